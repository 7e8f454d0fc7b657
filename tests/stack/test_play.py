"""Real recordings through the same stack; skipped where they are absent."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import pytest

pytestmark = pytest.mark.stack
ROOT = Path(__file__).parents[2]
SHARED = ROOT.parent / "shared"
MODEL = SHARED / "models" / "yolox_nano.onnx"
RECORDINGS = {
    "video": SHARED / "data" / "dashcam" / "highway.mp4",
    "pictures": SHARED / "data" / "street" / "sequence",
    "frame": SHARED / "data" / "street" / "fused-frame",
}
SECONDS = "6"


@pytest.mark.parametrize("kind", RECORDINGS)
def test_a_recording_is_tracked_decided_on_logged_and_rendered(kind: str, tmp_path: Path) -> None:
    recording = RECORDINGS[kind]
    if not recording.exists() or not MODEL.exists():
        pytest.skip(
            f"{recording} or {MODEL.name} is absent: recordings and weights of others are not in the repository"
        )
    video = tmp_path / "seen.mp4"
    summary = play(recording, tmp_path, "--render", str(video))
    assert summary["ticks"] > 3
    assert summary["distance_m"] is None, "a recording has no truth"
    assert tracked(Path(summary["log"])) > 0
    capture = cv2.VideoCapture(str(video))
    assert capture.get(cv2.CAP_PROP_FRAME_COUNT) >= 4
    capture.release()


def test_recording_only_logs_what_is_seen_and_the_log_can_be_played_again(tmp_path: Path) -> None:
    recording = RECORDINGS["video"]
    if not recording.exists() or not MODEL.exists():
        pytest.skip(f"{recording} or {MODEL.name} is absent")
    first = play(recording, tmp_path, "--record-only")
    assert topics_of(Path(first["log"])).isdisjoint({"advisory", "arbiter/decision", "trace"})
    assert tracked(Path(first["log"])) > 0
    again = play(Path(first["log"]), tmp_path, "--record-only")
    assert tracked(Path(again["log"])) > 0


def play(recording: Path, folder: Path, *more: str) -> Any:
    """The summary of a recording that was played."""
    command = [
        sys.executable, "-m", "drivemcp.cli", "play", str(recording), "--detector", str(MODEL), "--seconds", SECONDS,
        "--headless", "--json", "--out", str(folder), *more,
    ]  # fmt: skip
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
    ran = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=240, check=False)
    assert ran.returncode == 0, ran.stderr[-3000:]
    summary = json.loads(ran.stdout.strip().splitlines()[-1])
    assert summary["log_verified"] is True
    return summary


def topics_of(log: Path) -> set[str]:
    """The topics of a log."""
    from services.logger.format.reader import messages

    return {record.name for record in messages(log)}


def tracked(log: Path) -> int:
    """How many different vehicles were tracked; the ego speed must be unknown throughout."""
    from services.logger.format.reader import messages

    vehicles = set()
    for record in messages(log):
        if record.name == "perception/boxes":
            boxes = json.loads(record.data)["boxes"]
            vehicles |= {box["track_id"] for box in boxes if box["kind"] == "vehicle" and box["track_id"]}
        if record.name == "perception/tracks":
            assert json.loads(record.data)["ego_speed_used_mps"] is None
    return len(vehicles)
