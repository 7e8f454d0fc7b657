"""Videos, folders of pictures, and cameras of this machine."""

import os
import re
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import cv2

from drivemcp.errors import UserError
from drivemcp.files.folders import files_of
from drivemcp.files.foreign import foreign
from services.player.picture_names import cameras_in, ordered, times_in, times_unused
from services.player.recording import Options, Picture, Recording, bits_in, camera_messages, read_picture, shrink

PERIOD_S = 0.5
"""Between pictures without times."""
JPEG = (".jpg", ".jpeg")
_BEHIND = 1 << 16
"""Bytes at the end of a picture in which its end is looked for; cameras write more behind it."""
PICTURES = (*JPEG, ".png", ".bmp", ".webp", ".avif", ".tif", ".tiff", ".jp2", ".ppm")
UNREAD_PICTURES = (".heic", ".heif", ".jxl", ".gif", ".dng", ".cr2", ".nef", ".arw", ".raw")
"""OpenCV reads none of them, or the first picture alone."""
VIDEOS = (
    ".mp4",
    ".mov",
    ".avi",
    ".mkv",
    ".ts",
    ".m4v",
    ".webm",
    ".mpg",
    ".mts",
    ".3gp",
    ".insv",
    ".360",
    ".h264",
    ".wmv",
)


def open_folder(path: Path, options: Options) -> Recording:
    """Pictures in the order of the numbers in their names. Raises UserError where the folder holds no pictures."""
    files = ordered(files_of(path, PICTURES))
    if not files:
        videos = files_of(path, VIDEOS)
        told = passed_over(path) or (f"it holds {len(videos)} videos; name one, as {videos[0].name}" if videos else "")
        raise UserError(
            f"{path} holds no pictures ({', '.join(PICTURES)}), no frame.json and no log{'; ' if told else ''}{told}"
        )
    files = [file for file in files if not is_cut(file)] or files
    if len(cameras := cameras_in(files)) > 1:
        raise UserError(
            f"{path} holds pictures of several cameras: {', '.join(cameras)}; give each a folder of its own"
        )
    times = [] if options.picture_period_s else times_in(files)
    if times:
        shown = set(thinned(times, options.max_rate_hz))
        timed = [(file, at_s) for file, at_s in zip(files, times, strict=True) if at_s in shown]
    else:
        period_s = options.picture_period_s or PERIOD_S
        timed = [(file, number * period_s) for number, file in enumerate(files)]
    return Recording(path.name, len(timed), timed[-1][1], camera_messages(_decoded(timed, bits_in(files)), options))


def _decoded(timed: Iterable[tuple[Path, float]], bits: int) -> Iterator[Picture]:
    """The pictures that decode. Raises UserError behind them where some do not."""
    bad: list[Path] = []
    for file, at_s in timed:
        try:
            yield Picture(shrink(read_picture(file, bits)), at_s)
        except UserError:
            bad.append(file)
    if bad:
        told = f"{bad[0]} does not decode as a picture"
        raise UserError(
            f"{told} and is left out" if len(bad) == 1 else f"{told}, nor do {len(bad) - 1} others; they are left out"
        )


def passed_over(path: Path) -> str:
    """Which pictures of a folder are not read, and what to do; empty where all are, or where it is no folder."""
    others = files_of(path, UNREAD_PICTURES) if path.is_dir() else []
    cut = [file for file in files_of(path, JPEG) if is_cut(file)] if path.is_dir() else []
    told = [f"{len(cut)} pictures are cut and left out, first {cut[0].name}"] if cut else []
    if others:
        endings = ", ".join(sorted({each.suffix.lower() for each in others}))
        told.append(
            f"{len(others)} pictures ({endings}) are not read, first {others[0].name}: convert them to .jpg or .png"
        )
    if path.is_dir() and (why := times_unused([each for each in ordered(files_of(path, PICTURES)) if each not in cut])):
        told.append(why)
    return "; ".join(told)


def is_cut(file: Path) -> bool:
    """Whether a JPEG lacks its end, as where the power of a recorder went."""
    if file.suffix.lower() not in JPEG:
        return False
    with file.open("rb") as opened:
        if opened.read(2) != b"\xff\xd8":
            return False
        size = opened.seek(0, os.SEEK_END)
        opened.seek(size - 2)
        if opened.read() == b"\xff\xd9":  # as most pictures end: the rest need not be read
            return False
        opened.seek(max(0, size - _BEHIND))
        return b"\xff\xd9" not in opened.read()


def open_video(path: Path, options: Options) -> Recording:
    """A video at its own pace, turned as its camera was held, thinned to the highest rate. Raises UserError where it does not open."""
    capture = cv2.VideoCapture(str(path))
    if not capture.isOpened():
        raise UserError(f"{path} does not open as a video{_why(path)}")
    rate_hz = capture.get(cv2.CAP_PROP_FPS) or 25.0
    frames = max(0, int(capture.get(cv2.CAP_PROP_FRAME_COUNT)))
    shown = min(frames, round(frames / rate_hz * options.max_rate_hz))
    promised = frames if path.suffix.lower() in WITH_A_COUNT else 0
    pictures = _pictures(capture, options, f"{path.name} is damaged or cut", promised)
    return Recording(path.name, shown, frames / rate_hz, camera_messages(pictures, options))


def _why(path: Path) -> str:
    """What a file is that is no video, where its beginning tells."""
    with path.open("rb") as file:
        head = file.read(64)
    if told := foreign(head, "video"):
        return f": {told}"
    if head.startswith((b"#ROSBAG", b"SQLite format")):
        return ": a rosbag is not read; write a frame.json or a folder of pictures from it"
    cut_off = head[4:8] == b"ftyp"
    return ": its end is missing; was the recorder cut off? A repair tool may write its index" if cut_off else ""


def _pictures(capture: cv2.VideoCapture, options: Options, damaged: str, promised: int) -> Iterator[Picture]:
    """The pictures that can be read. Raises UserError behind them where a file promised many more frames."""
    frames = _Tally(_times(capture))
    for at_s in thinned(frames, options.max_rate_hz):
        read, bgr = capture.retrieve()
        if read:
            yield Picture(shrink(bgr), at_s)
    capture.release()
    if frames.count < WHOLE * promised:
        raise UserError(f"{damaged}: {frames.count} of its {promised} frames can be read; a repair tool may find more")


class _Tally(Iterator[float]):
    """Times, counted as they pass."""

    def __init__(self, times: Iterator[float]) -> None:
        self._times, self.count = times, 0

    def __next__(self) -> float:
        at_s = next(self._times)
        self.count += 1
        return at_s


def _times(capture: cv2.VideoCapture) -> Iterator[float]:
    """The time of each frame as the file has it, which need not be even; by the mean rate where the file has none."""
    rate_hz, number, last_s = capture.get(cv2.CAP_PROP_FPS) or 25.0, 0, -1.0
    while capture.grab():
        at_s = capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3
        last_s = at_s if at_s > last_s else max(last_s, number / rate_hz)
        yield last_s
        number += 1


def thinned(times_s: Iterable[float], max_rate_hz: float) -> Iterator[float]:
    """The times that are shown: each the first at or after its turn; after a gap the turns begin anew."""
    due_s, period_s = 0.0, 1.0 / max_rate_hz
    for at_s in times_s:
        if at_s >= due_s - 1e-6:
            due_s = max(due_s + period_s, at_s)
            yield at_s


WITH_A_COUNT = (".mp4", ".mov", ".m4v", ".avi")
"""Videos that say how many frames they hold; of others it is an estimate."""
WHOLE = 0.8
"""Of the frames that a video promises so many may be read at least, since some files count badly."""
_NAMES = re.compile(r"^(?:webcam:|/dev/video)(\d{1,3})$")


def webcam_number(source: str) -> int | None:
    """The number in `webcam:0` or `/dev/video0`; None for what is no webcam."""
    match = _NAMES.match(source)
    return int(match[1]) if match else None


def open_webcam(number: int, options: Options) -> Recording:
    """Pictures as they come. Raises UserError where there is no such camera."""
    capture = _capture(number)
    pictures = live_pictures(capture, options.max_rate_hz)
    return Recording(f"webcam:{number}", 0, 0.0, camera_messages(pictures, options))


def check_webcam(number: int) -> None:
    """That it opens now. Raises UserError."""
    _capture(number).release()


def live_pictures(capture: cv2.VideoCapture, max_rate_hz: float) -> Iterator[Picture]:
    """At most so many a second, stamped by the monotonic clock as they are taken. Raises UserError when no more come."""
    start_s, last_s = time.monotonic(), -1.0
    try:
        while capture.grab():
            at_s = time.monotonic() - start_s
            if at_s - last_s < 0.9 / max_rate_hz:
                continue
            read, bgr = capture.retrieve()
            if read:
                last_s = at_s
                yield Picture(shrink(bgr), at_s)
    finally:
        capture.release()
    raise UserError("the webcam gives no more pictures: was it unplugged, or is it in use elsewhere?")


def _capture(number: int) -> cv2.VideoCapture:
    device = Path(f"/dev/video{number}")
    if sys.platform == "linux" and not device.exists():
        there = ", ".join(sorted(str(path) for path in Path("/dev").glob("video[0-9]*"))) or "none"
        raise UserError(f"no webcam {number}: there is no {device} (cameras here: {there})")
    capture = cv2.VideoCapture(number)
    if not capture.isOpened():
        raise UserError(f"the webcam {number} does not open: is it in use, or not permitted to you?")
    return capture
