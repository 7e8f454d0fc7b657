"""Tells what a source is, and opens it."""

import heapq
from pathlib import Path

from drivemcp.errors import UserError
from proto import topics
from services.player.can_log import can_messages
from services.player.drive_log import log_files, open_log
from services.player.pictures import open_folder, open_video, open_webcam, webcam_number
from services.player.recording import Options, Recording
from services.player.street import frame_files, open_street

SAID_BY_CAN = (topics.EGO, topics.DEGRADATION)
"""Where a CAN log is given, the CAN service says these, and a recording's own are left out."""


def open_recording(source: str, options: Options, *, can_log: str = "", can_offset_s: float = 0.0) -> Recording:
    """A webcam, frames with LiDAR, logs of ours, a folder of pictures or a video, in this order; a CAN log goes along.

    Raises UserError saying what it is not.
    """
    recording = _open(source, options)
    if not can_log:
        return recording
    seen = (each for each in recording.messages if each.topic not in SAID_BY_CAN)
    merged = heapq.merge(seen, can_messages(Path(can_log), can_offset_s), key=lambda each: each.at_s)
    return recording._replace(messages=merged, ego=False, brings=f"{recording.brings}, CAN frames")


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
