"""The graphs of a log go out as a file of DriveLM's form that comes in again."""

from pathlib import Path

import msgspec
import pytest

from proto.scene import QA, SceneGraph
from services.logger.format import signing
from services.logger.writing.log_file import DiskFile, LogFile, Origin, Record
from services.logger.writing.topic_formats import json_form
from studies.gvqa.drivelm_json import from_drivelm, to_drivelm
from studies.gvqa.export import main
from studies.gvqa.files import load

GRAPH = SceneGraph(
    camera="front",
    frame=7,
    objects=(),
    qa=(QA(layer="behavior", question="Predict the behavior of the ego vehicle.", answer="It stands.", score=0.9),),
    description="Nothing relevant is seen ahead.",
)


def _log(path: Path, topic: str, data: bytes) -> None:
    signer = signing.load_or_make(path.parent / "secrets")
    file = LogFile(DiskFile(path), Origin(file=path.name, vehicle="ego", public_key=signer.public_hex), signer)
    form = json_form(SceneGraph)
    record = Record(topic=topic, form=form, sequence=1, log_time_ns=5_000, publish_time_ns=4_000, data=data)
    file.append([record], now_ns=0)
    file.append([], now_ns=0, closed=True)
    file.finish()
    file.release()


def test_a_logs_graphs_become_key_frames(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _log(tmp_path / "drive.mcap", "drivelm/graph", msgspec.json.encode(GRAPH))
    out = tmp_path / "out.json"
    assert main([str(tmp_path / "drive.mcap"), str(out)]) == 0
    assert "1 key frames of 1 logs" in capsys.readouterr().out
    scene = from_drivelm(load(out))["drive"]
    assert scene.description == GRAPH.description
    assert [qa.answer for qa in scene.frames["4000"].qa] == ["It stands."]
    assert to_drivelm({"drive": scene}) == msgspec.json.decode(out.read_bytes())


@pytest.mark.parametrize(
    ("topic", "data", "told"),
    [("drivelm/graph", b'{"camera": 4}', "does not fit"), ("trace", b"{}", "no scene graphs in this log")],
)
def test_a_log_without_a_graph_is_told(
    topic: str, data: bytes, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _log(tmp_path / "drive.mcap", topic, data)
    assert main([str(tmp_path / "drive.mcap"), str(tmp_path / "out.json")]) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / "out.json").exists()


def test_a_file_that_is_absent_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path / "absent.mcap"), str(tmp_path / "out.json")]) == 2
    assert "no such file" in capsys.readouterr().err
