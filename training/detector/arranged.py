"""The eight-bit detector with the same sums in another order, which ONNX Runtime takes faster: its outputs are equal to the bit.

What is slow is copying in small pieces: three bytes of a pixel at each tap of the first convolution, and single bytes where a picture is
doubled. So the first convolution reads four columns and tells two at once, and doubling copies all channels of a cell together.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import helper, numpy_helper

GROUP = 4
"""Columns that the first convolution reads as one; of its stride 2, two columns come out of them."""
TO_CELLS, TO_PLANES = (0, 2, 3, 1), (0, 3, 1, 2)

_Step = tuple[str, Mapping[str, Any]]
"""A node's operator, and its attributes."""


class _Graph:
    """A network's nodes and weights by name."""

    def __init__(self, model: onnx.ModelProto) -> None:
        self._graph = model.graph

    def node(self, op: str, *, output: str = "", data: str = "") -> onnx.NodeProto:
        """The only node of a kind that writes `output` or whose first input is `data`."""
        found = [
            each for each in self._graph.node if each.op_type == op and (output in each.output or data == each.input[0])
        ]
        if len(found) != 1:
            raise ValueError(f"{len(found)} nodes {op} of {output or data}, where one was expected")
        only: onnx.NodeProto = found[0]
        return only

    def all(self, op: str) -> list[onnx.NodeProto]:
        """Every node of a kind."""
        return [each for each in self._graph.node if each.op_type == op]

    def weight(self, name: str) -> NDArray[np.generic]:
        """The array of this name."""
        return numpy_helper.to_array(next(each for each in self._graph.initializer if each.name == name))

    def channels(self, name: str) -> int:
        """Those of a tensor (N, C, H, W), as the network's own notes of shapes tell."""
        noted = next(each for each in self._graph.value_info if each.name == name)
        return int(noted.type.tensor_type.shape.dim[1].dim_value)

    def set_weight(self, name: str, array: NDArray[np.generic]) -> None:
        """Put an array in place of the one of this name, or add it."""
        for each in [each for each in self._graph.initializer if each.name == name]:
            self._graph.initializer.remove(each)
        self._graph.initializer.append(numpy_helper.from_array(array, name))

    def remove(self, *nodes: onnx.NodeProto) -> None:
        """Take nodes out."""
        for each in nodes:
            self._graph.node.remove(each)

    def without_unused(self) -> None:
        """Drop weights that no node reads."""
        read = {name for each in self._graph.node for name in each.input}
        for each in [each for each in self._graph.initializer if each.name not in read]:
            self._graph.initializer.remove(each)

    def before(self, place: onnx.NodeProto, data: str, steps: Sequence[_Step], output: str) -> None:
        """Nodes from `data` to `output`, one after the other, in front of `place`. A step's `shape` or `axes` become an input."""
        at = list(self._graph.node).index(place)
        for number, (op, settings) in enumerate(steps):
            told = output if number == len(steps) - 1 else f"{output}/{number}"
            inputs = [data, data] if op == "Concat" else [data]
            attributes = dict(settings)
            for key in ("shape", "axes"):
                if key in attributes:
                    inputs.append(f"{told}/{key}")
                    self.set_weight(inputs[-1], np.array(attributes.pop(key), np.int64))
            self._graph.node.insert(
                at + number, helper.make_node(op, inputs, [told], name=f"{told}/{op}", **attributes)
            )
            data = told


def arranged(model: onnx.ModelProto) -> onnx.ModelProto:
    """The network of `int8.quantise`, arranged; raises ValueError for another one."""
    out = onnx.ModelProto()
    out.CopyFrom(model)
    graph = _Graph(out)
    _bytes_as_they_are(graph)
    _columns_together(graph)
    for each in graph.all("Resize"):
        _cells_copied(graph, each)
    graph.without_unused()
    del out.graph.value_info[:]
    onnx.checker.check_model(out)
    return out


def _bytes_as_they_are(graph: _Graph) -> None:
    """The picture's bytes are the numbers that its cast to floating point and back would give: scale 1, nothing at 0."""
    cast = graph.node("Cast", output="/Cast_output_0")
    back = graph.node("QuantizeLinear", data=cast.output[0])
    if graph.weight(back.input[1]) != 1.0 or graph.weight(back.input[2]) != 0:
        raise ValueError("the picture's bytes are scaled: some channel never reached 255 in the calibration's pictures")
    graph.node("DequantizeLinear", data=back.output[0]).input[0] = cast.input[0]
    graph.remove(cast, back)


def _columns_together(graph: _Graph) -> None:
    """The first convolution of (3, H, W), kernel 3 and stride 2, as one of (12, H, W / 4) that tells two columns' channels."""
    turned = graph.node("Transpose", data="picture")
    taken = graph.node("DequantizeLinear", data=turned.output[0])
    first = graph.node("Conv", data=taken.output[0])
    kernel, offset = (graph.node("DequantizeLinear", output=each) for each in first.input[1:])
    graph.set_weight(kernel.input[0], _in_groups(graph.weight(kernel.input[0])))
    for name in {*kernel.input[1:], *offset.input}:
        graph.set_weight(name, np.tile(graph.weight(name), 2))
    for each in first.attribute:
        new = {"kernel_shape": [3, 2], "strides": [2, 1], "pads": [1, 1, 1, 0]}.get(each.name)
        if new:
            each.ints[:] = new
    turned.input[0] = "picture/groups"
    graph.before(turned, "picture", [("Reshape", {"shape": [0, 0, -1, 3 * GROUP]})], "picture/groups")
    told = graph.node("QuantizeLinear", data=first.output[0])
    apart = graph.node("DequantizeLinear", data=told.output[0])
    channels = len(graph.weight(kernel.input[1])) // 2
    steps: list[_Step] = [
        ("Transpose", {"perm": TO_CELLS}),
        ("Reshape", {"shape": [0, 0, -1, channels]}),
        ("Transpose", {"perm": TO_PLANES}),
    ]
    graph.before(apart, told.output[0], steps, f"{told.output[0]}/apart")
    apart.input[0] = f"{told.output[0]}/apart"


def _in_groups(kernel: NDArray[np.generic]) -> NDArray[np.generic]:
    """(K, 3, 3, 3) of single columns as (2 K, 12, 3, 2): taps are the group to the left and its own, outputs its first and third column."""
    count = len(kernel)
    out = np.zeros((2 * count, 3 * GROUP, 3, 2), kernel.dtype)
    for half in range(2):
        for tap in range(3):
            column = 2 * half + tap - 1
            group, place = (1, column) if column >= 0 else (0, column + GROUP)
            out[half * count : (half + 1) * count, 3 * place : 3 * place + 3, :, group] = kernel[:, :, :, tap]
    return out


def _cells_copied(graph: _Graph, resize: onnx.NodeProto) -> None:
    """Each cell four times, as doubling to the nearest one does; of one picture."""
    taken = graph.node("DequantizeLinear", output=resize.input[0])
    told = graph.node("QuantizeLinear", data=resize.output[0])
    channels = graph.channels(resize.output[0])
    steps: list[_Step] = [
        ("Transpose", {"perm": TO_CELLS}),
        ("Unsqueeze", {"axes": [2, 4]}),
        ("Concat", {"axis": 4}),
        ("Concat", {"axis": 2}),
        ("Squeeze", {"axes": [0]}),
        ("Reshape", {"shape": [0, 0, -1, channels]}),
        ("Reshape", {"shape": [1, -1, 0, 0]}),
        ("Transpose", {"perm": TO_PLANES}),
    ]
    graph.before(told, taken.input[0], steps, told.output[0])
    graph.remove(resize, told)
