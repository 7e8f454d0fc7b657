"""The mean of what two second looks say, in one file: each learnt from another world, and neither forgets.

`python -m training second_look.mean ONE OTHER` writes `models/people.onnx`, which holds both networks; their cards stand beside them.
`python -m training second_look.train --only-weigh ...` then weighs its word. Their weights cannot be averaged: they began apart.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import onnx
from onnx import compose, helper

from drivemcp.paths import data

INPUTS, OUTPUTS = ("pictures", "sizes"), ("odds", "sides")


def mean(one: onnx.ModelProto, other: onnx.ModelProto) -> onnx.ModelProto:
    """A network with the inputs of both, that tells the mean of both."""
    first, second = (compose.add_prefix(model, f"{name}/") for name, model in (("one", one), ("other", other)))
    nodes, weights = [], [*first.graph.initializer, *second.graph.initializer]
    for model, name in ((first, "one"), (second, "other")):
        for node in model.graph.node:
            node.input[:] = [each.removeprefix(f"{name}/") if _is_input(each, name) else each for each in node.input]
            nodes.append(node)
    nodes += [helper.make_node("Mean", [f"one/{each}", f"other/{each}"], [each]) for each in OUTPUTS]
    graph = helper.make_graph(nodes, "people", list(one.graph.input), list(one.graph.output), weights)
    made = helper.make_model(graph, opset_imports=list(one.opset_import), ir_version=one.ir_version)
    onnx.checker.check_model(made)
    return made


def _is_input(edge: str, name: str) -> bool:
    return edge.removeprefix(f"{name}/") in INPUTS


def card_of(one: Path, other: Path, out: Path) -> dict[str, Any]:
    """The later one's card without what is told of a single network, and what each was made of."""
    both = [json.loads(path.with_suffix(".json").read_text(encoding="utf-8")) for path in (one, other)]
    own = ("crops", "asked_by", "steps", "minutes", "seed", "command", "sha256", "size_bytes")
    shared = {key: value for key, value in both[1].items() if key not in own}
    parts = [{key: card[key] for key in own if key in card} for card in both]
    return shared | {
        "mean_of": parts,
        "sha256": hashlib.sha256(out.read_bytes()).hexdigest(),
        "size_bytes": out.stat().st_size,
    }


def main() -> None:
    """Join two networks."""
    parser = argparse.ArgumentParser(prog="python -m training second_look.mean")
    parser.add_argument("one", type=Path)
    parser.add_argument("other", type=Path)
    parser.add_argument("--out", type=Path, default=data("models/people.onnx"))
    flags = parser.parse_args()
    onnx.save(mean(onnx.load(flags.one), onnx.load(flags.other)), flags.out)
    card = card_of(flags.one, flags.other, flags.out)
    flags.out.with_suffix(".json").write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")
    sys.stdout.write(f"{flags.out}: {flags.out.stat().st_size / 1e3:.0f} kB\n")


if __name__ == "__main__":
    main()
