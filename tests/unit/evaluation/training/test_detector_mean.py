"""The mean of two networks, weight by weight."""

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from drivemcp.errors import UserError
from evaluation.training.detector_mean import mean


def tensor(name: str, *values: float) -> onnx.TensorProto:
    return numpy_helper.from_array(np.array(values, np.float32), name)


def network(*weights: float) -> onnx.ModelProto:
    """y = x * weights + 3, the 3 as a node's attribute, as an exporter may write it."""
    three = helper.make_node("Constant", [], ["three"], value=tensor("three", 3.0, 3.0))
    nodes = [three, helper.make_node("Mul", ["x", "w"], ["m"]), helper.make_node("Add", ["m", "three"], ["y"])]
    ends = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [2]) for name in ("x", "y")]
    graph = helper.make_graph(nodes, "g", ends[:1], ends[1:], [tensor("w", *weights)])
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])


def test_each_weight_is_the_mean_of_both() -> None:
    both = mean(network(1.0, 4.0), network(3.0, -4.0))
    np.testing.assert_allclose(numpy_helper.to_array(both.graph.initializer[0]), [2.0, 0.0])
    np.testing.assert_allclose(numpy_helper.to_array(both.graph.node[0].attribute[0].t), [3.0, 3.0])
    onnx.checker.check_model(both)


def test_of_a_network_with_itself_it_is_the_network() -> None:
    one = network(0.1, 0.7)
    assert mean(one, one) == one


def test_networks_of_different_shapes_have_none() -> None:
    with pytest.raises(UserError, match="AFTER must have begun as BEFORE"):
        mean(network(1.0, 4.0), network(1.0, 4.0, 2.0))
