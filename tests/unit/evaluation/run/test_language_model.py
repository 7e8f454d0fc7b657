"""A drive by a language model, recorded: its cassette drives the same run again, to the bit, without the model."""

import sys
from pathlib import Path

import msgspec
import pytest

from drivemcp.node import Node
from evaluation.baselines.direct.cassette import Line, read, write
from evaluation.campaign.plan import with_settings
from evaluation.run.host import drive
from evaluation.run.methods import PROPOSERS, applied
from evaluation.run.spec import RunSpec
from proto import topics
from proto.decision import Advisory
from tests.unit.services.drivelm import llama_stand_in

FOLLOWS = {":": "S", "S": "t", "t": "o", "o": "p", "p": "."}
"""After `Answer:` the stand-in says `Stop.`"""
SPEC = RunSpec(scenario="dynamic-vsl", seed=3, seconds=8.0, sensors="model")


@pytest.mark.parametrize("label", ["LM-Direct, free", "LM-Tools-Arbiter, free"])
def test_the_cassette_of_a_drive_drives_it_again_to_the_bit(
    label: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "llama_cpp", llama_stand_in.module())
    llama_stand_in.write(model := tmp_path / "tiny.gguf", FOLLOWS)
    file = tmp_path / "answers.jsonl"
    spec = with_settings(applied(PROPOSERS[label], SPEC), "drivelm", {"gguf": {"file": str(model), "context": 32_768}})
    recorded = _advisories(with_settings(spec, "drivelm", {"answers": {"record": str(file)}}), tmp_path / "recorded")
    lines = read(file)
    assert {line.text for line in lines} == {"Stop."}
    assert all(line.took_ms > 0.0 for line in lines)
    assert any(each.justification == "Stop." and each.kind == "SPEAK" for each in recorded)
    monkeypatch.delitem(sys.modules, "llama_cpp")
    model.unlink()
    slow = [msgspec.structs.replace(line, took_ms=500.0) for line in lines]
    write(late := tmp_path / "late.jsonl.gz", slow)
    assert _advisories(_played(spec, file, lines), tmp_path / "played") == recorded
    assert _advisories(_played(spec, late, slow), tmp_path / "late") != recorded, "the recorded latency counts"


def _played(spec: RunSpec, file: Path, lines: list[Line]) -> RunSpec:
    return with_settings(spec, "drivelm", {"answers": {"play": str(file), "model": lines[0].backend}})


def _advisories(spec: RunSpec, folder: Path) -> list[Advisory]:
    found: list[Advisory] = []

    def follow(node: Node) -> None:
        node.subscribe(topics.ADVISORY, lambda message, _: found.append(message))

    assert drive(spec, folder, follow).finished
    return found
