"""The weights in an exported network."""

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import numpy_helper


def convolutions(model: onnx.ModelProto, name: str) -> list[tuple[NDArray[np.floating], NDArray[np.floating]]]:
    """Weight and bias of each convolution, in the order in which they run. Raises ValueError naming the network where one has none."""
    graph = model.graph
    known = {each.name: each for each in graph.initializer}
    for node in graph.node:
        if node.op_type == "Identity" and node.input[0] in known:  # what is the same twice is stored once
            known[node.output[0]] = known[node.input[0]]
    found = []
    for node in graph.node:
        if node.op_type == "Conv":
            if len(node.input) != 3 or any(each not in known for each in node.input[1:]):
                raise ValueError(f"{name}: {node.name} has no weights of its own; give the network in floating point")
            weight, bias = (numpy_helper.to_array(known[each]) for each in node.input[1:])
            found.append((weight, bias))
    return found
