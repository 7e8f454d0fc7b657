"""The mean of two networks, weight by weight."""

import json
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from drivemcp.errors import UserError
from training.detector.mean import OF_A_RUN, card_of, mean


def tensor(name: str, *values: float) -> onnx.TensorProto:
    return numpy_helper.from_array(np.array(values, np.float32), name)


def network(*weights: float, bias: tuple[float, ...] | None = None) -> onnx.ModelProto:
    """A convolution of one pixel."""
    kernel = numpy_helper.from_array(np.array(weights, np.float32).reshape(-1, 1, 1, 1), "w")
    flat = tensor("b", *(bias or (0.0,) * len(weights)))
    nodes = [helper.make_node("Conv", ["x", "w", "b"], ["y"], name="conv")]
    ends = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, size, 4, 4])
        for name, size in (("x", 1), ("y", len(weights)))
    ]
    graph = helper.make_graph(nodes, "g", ends[:1], ends[1:], [kernel, flat])
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])


def shared(model: onnx.ModelProto) -> onnx.ModelProto:
    """The same network whose bias is another tensor's copy."""
    graph = model.graph
    graph.initializer.append(tensor("first", *numpy_helper.to_array(graph.initializer[1])))
    del graph.initializer[1]
    graph.node.insert(0, helper.make_node("Identity", ["first"], ["b"]))
    return model


def weights_of(model: onnx.ModelProto) -> list[list[float]]:
    return [numpy_helper.to_array(each).ravel().tolist() for each in model.graph.initializer]


def test_each_weight_is_the_mean_of_both() -> None:
    both = mean(network(1.0, 4.0, bias=(1.0, 2.0)), network(3.0, -4.0, bias=(3.0, 3.0)))
    assert weights_of(both) == [[2.0, 0.0], [2.0, 2.5]]
    onnx.checker.check_model(both)


def test_a_share_draws_the_mean_to_the_later_one() -> None:
    assert weights_of(mean(network(1.0, 4.0), network(3.0, -4.0), 0.75))[0] == [2.5, -2.0]


def test_a_tensor_that_is_stored_once_for_two_counts_for_each() -> None:
    both = mean(shared(network(1.0, 4.0, bias=(1.0, 2.0))), network(3.0, -4.0, bias=(3.0, 3.0)))
    assert weights_of(both) == [[2.0, 0.0], [2.0, 2.5]]


def test_of_a_network_with_itself_it_is_the_network() -> None:
    one = network(0.5, 0.75, bias=(1.0, 2.0))
    assert weights_of(mean(one, one)) == weights_of(one)


def test_networks_of_different_shapes_have_none() -> None:
    with pytest.raises(UserError, match="AFTER must have begun as BEFORE"):
        mean(network(1.0, 4.0), network(1.0, 4.0, 2.0))


def test_the_card_of_a_mean_tells_of_every_run(tmp_path: Path) -> None:
    def made(name: str, **card: object) -> Path:
        folder = tmp_path / name
        folder.mkdir()
        (folder / "detector.json").write_text(json.dumps({"classes": ["vehicle"], "parameters": 7} | card))
        (folder / "detector-float.onnx").write_bytes(name.encode())
        return folder / "detector-float.onnx"

    def run(steps: int) -> dict[str, object]:
        return dict.fromkeys(OF_A_RUN, "") | {"steps": steps}

    first, second, third = (made(name, **run(steps)) for name, steps in (("first", 1), ("second", 2), ("third", 3)))
    once = card_of(first, second, second)
    mean_of_both = made("both", **once)
    twice = card_of(mean_of_both, third, third)
    assert [each["steps"] for each in once["mean_of"]] == [1, 2]
    assert [each["steps"] for each in twice["mean_of"][0]["mean_of"]] == [1, 2]
    assert twice["mean_of"][1]["steps"] == 3
    assert not set(OF_A_RUN) & set(twice)
