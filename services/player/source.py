"""Tells what a source is, and opens it."""

import heapq
from pathlib import Path

from drivemcp.errors import UserError
from drivemcp.files.can_logs.log import CanLog
from proto import topics
from services.player.can_log import can_messages
from services.player.drive_log import log_files, open_log
from services.player.pictures import open_folder, open_video, open_webcam, webcam_number
from services.player.position_track import read_track, track_messages
from services.player.recording import Options, Recording
from services.player.street import frame_files, open_street

CAN_FRAMES = "CAN frames"
SAID_BY_CAN = (topics.EGO, topics.DEGRADATION)
"""Where a CAN log is given, the CAN service says these, and a recording's own are left out."""


def open_recording(
    source: str, options: Options, *, can_log: CanLog | None = None, can_offset_s: float = 0.0
) -> Recording:
    """A webcam, frames with LiDAR, logs of ours, a folder of pictures or a video, in this order; a CAN log goes along.

    Raises UserError saying what it is not.
    """
    recording = _open(source, options)
    if can_log is None:
        return recording
    seen = (each for each in recording.messages if each.topic not in SAID_BY_CAN)
    merged = heapq.merge(seen, can_messages(can_log, can_offset_s), key=lambda each: each.at_s)
    return recording._replace(messages=merged, ego=False, brings=f"{recording.brings}, {CAN_FRAMES}")


def with_track(recording: Recording, track: str, offset_s: float) -> Recording:
    """The recording with a position track's positions, and its speeds where nothing else says the ego speed. Raises UserError."""
    if not track:
        return recording
    found = track_messages(read_track(Path(track)), offset_s)
    told = CAN_FRAMES in recording.brings
    wanted = (each for each in found if each.topic is not topics.EGO or not (recording.ego or told))
    merged = heapq.merge(wanted, recording.messages, key=lambda each: each.at_s)
    return recording._replace(messages=merged, ego=not told, brings=f"{recording.brings}, positions")


def _open(source: str, options: Options) -> Recording:
    number = webcam_number(source)
    if number is not None:
        return open_webcam(number, options)
    path = Path(source)
    if not path.exists():
        raise UserError(f"no such recording: {source}")
    if frames := frame_files(path):
        return open_street(frames, path.parent.name if path.is_file() else path.name, options)
    if logs := log_files(path):
        return open_log(logs, path.name)
    return open_folder(path, options) if path.is_dir() else open_video(path, options)
