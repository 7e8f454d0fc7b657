"""`drivemcp play`: what is wrong with a recording is told before anything starts."""

import argparse
from pathlib import Path

import cv2
import numpy as np
import pytest

from app.play.command import register
from app.play.recording import DECIDING, can_log_of
from drivemcp.cli import run
from drivemcp.errors import UserError
from proto.services import BY_NAME
from services.player.recording import Options
from services.player.source import open_recording


def flags(*arguments: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    register(parser.add_subparsers())
    return parser.parse_args(["play", *arguments])


@pytest.fixture
def pictures(tmp_path: Path) -> str:
    """A folder with one picture."""
    folder = tmp_path / "pictures"
    folder.mkdir()
    cv2.imwrite(str(folder / "0.png"), np.zeros((90, 160, 3), np.uint8))
    return str(folder)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["webcam:987"], "no webcam 987"),
        (["absent.mp4"], "no such recording"),
        (["PICTURES", "--render", "seen.gif"], ".mp4 file, not seen.gif"),
        (["PICTURES", "--detector", "no-such-model"], "no such model or file: no-such-model; the names are yolox-nano"),
        (["PICTURES", "--detector", "yolox-nano"], "fetch it with: drivemcp models pull yolox-nano"),
        (["PICTURES", "--can", "absent.asc"], "no such CAN log: absent.asc"),
        (["PICTURES", "--speed-signal", "Speed"], "name it with --can FILE"),
    ],
)
def test_a_mistake_is_one_line_and_starts_nothing(
    arguments: list[str], complaint: str, pictures: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.setenv("DRIVEMCP_MODELS", str(tmp_path / "models"))
    monkeypatch.chdir(tmp_path)
    assert run(["play", *(pictures if each == "PICTURES" else each for each in arguments)]) == 2
    assert complaint in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "out").exists()


def test_a_log_beside_the_recording_is_looked_for_only_where_none_is_named(pictures: str) -> None:
    (Path(pictures) / "drive.asc").write_text("date Mon Jan 1 00:00:00.000 2024\nbase hex timestamps absolute\n")
    recording = open_recording(pictures, Options())
    with pytest.raises(UserError, match=r"drive\.asc holds no frame: it has nothing but a header"):
        can_log_of(flags(pictures), pictures, recording)
    assert can_log_of(flags(pictures, "--can", "none"), pictures, recording) == (None, None)


def test_recording_only_leaves_out_who_decides_and_keeps_who_sees_and_logs() -> None:
    assert set(DECIDING) <= set(BY_NAME)
    assert {"orchestrator", "arbiter"} <= set(DECIDING)
    assert not {"player", "can", "perception", "drivelm", "logger"} & set(DECIDING)


def test_a_scenario_takes_another_detector_by_name_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("DRIVEMCP_MODELS", str(tmp_path))
    assert run(["up", "--detector", "yolox-nano"]) == 2
    assert "drivemcp models pull yolox-nano" in capsys.readouterr().err
