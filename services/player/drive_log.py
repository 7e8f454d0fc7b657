"""One of our own logs (MCAP): what its sensors said, played again. LiDAR, map and raw CAN frames are not in a log."""

import itertools
import struct
from collections import deque
from collections.abc import Iterable, Iterator
from pathlib import Path
from statistics import median_low
from typing import Any, NamedTuple

import cv2
import msgspec
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from google.protobuf.message import DecodeError
from mcap.exceptions import McapError
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader

from domain.pictures import may_be_unpacked
from drivemcp.errors import UserError
from proto import topics
from proto.sensors import CameraFrame
from proto.topics import Topic
from proto.vehicle import Ego
from services.player.recording import Recording, TimedMessage

PLAYED: tuple[Topic[Any], ...] = (
    topics.CALIBRATION, topics.GNSS, topics.WEATHER_SENSING, topics.EGO, topics.DEGRADATION, topics.CAMERA,
)  # fmt: skip
_CAMERAS = topics.CAMERA.name.replace("<id>", "")
_PICTURES = "foxglove.CompressedImage"
_OURS = "drivemcp."
_NS = 1e9
BESIDE, STRAY_NS = 3, 30_000_000_000
"""A message whose stamp is so far from the middle one of so many before and after it is left out."""


class Logged(NamedTuple):
    """One message of a log, by the name of its topic."""

    name: str
    stamp_ns: int
    data: bytes


class Contents(NamedTuple):
    """What a log holds: pictures, whether a known ego speed, the stamps of the first and the last picture, and how many messages
    have a stamp that is not to be believed."""

    pictures: int
    ego: bool
    first_ns: int
    last_ns: int
    stray: int


def log_files(path: Path) -> list[Path]:
    """A log, or the logs of a drive's folder; none where this is something else."""
    if path.is_file():
        return [path] if path.suffix == ".mcap" else []
    return sorted((path / "logs").glob("*.mcap")) or sorted(path.glob("*.mcap"))


def open_log(files: list[Path], name: str) -> Recording:
    """A drive's logs, one after the other. Raises UserError where they are no MCAP, or no drive of ours."""
    held = _contents(files)
    duration_s = (held.last_ns - held.first_ns) / _NS
    brings = f"a log (messages left out for impossible times: {held.stray})" if held.stray else "a log"
    return Recording(name, held.pictures, duration_s, _messages(files, held), ego=held.ego, brings=brings)


def _contents(files: list[Path]) -> Contents:
    ego, stray, stamps = False, 0, []
    for file in files:
        for record, strays in _timed(_records(file)):
            if strays:
                stray += 1
                continue
            if record.name.startswith(_CAMERAS):
                stamps.append(record.stamp_ns)
            ego = ego or (record.name == topics.EGO.name and _tells_speed(file, record))
    if not stamps:
        raise UserError(f"{files[0]} is no drive of ours: no pictures on {_CAMERAS}*, as drivemcp up and play log them")
    return Contents(len(stamps), ego, min(stamps), max(stamps), stray)


def _messages(files: list[Path], held: Contents) -> Iterator[TimedMessage]:
    """From the first picture on. Where the ego's speed is unknown throughout, the CAN service may say so as well as the log."""
    left_out = () if held.ego else (topics.EGO, topics.DEGRADATION)
    for file in files:
        for number, (record, strays) in enumerate(_timed(_records(file))):
            found = _topic_of(record.name)
            if strays or found is None or found[0] in left_out:
                continue
            topic, id = found
            at_s = (record.stamp_ns - held.first_ns) / _NS
            if at_s >= 0 or topic is topics.CALIBRATION:
                yield TimedMessage(max(at_s, 0.0), topic, _message(file, topic, record, number), id)


def _timed(records: Iterable[Logged]) -> Iterator[tuple[Logged, bool]]:
    """Each record, and whether its stamp strays from those of the records around it: one bit wrong, and a replay would wait
    for years. A jump that lasts does not stray: half of the records around are on its side."""
    around: deque[Logged] = deque(maxlen=2 * BESIDE + 1)
    ahead = itertools.chain(records, itertools.repeat(None, BESIDE))
    waiting: deque[Logged] = deque()
    for record in ahead:
        if record is not None:
            around.append(record)
            waiting.append(record)
        elif len(around) > BESIDE + 1:
            around.popleft()
        if len(waiting) > BESIDE or (record is None and waiting):
            it = waiting.popleft()
            yield it, abs(it.stamp_ns - median_low(each.stamp_ns for each in around)) > STRAY_NS


def _tells_speed(file: Path, record: Logged) -> bool:
    message = _message(file, topics.EGO, record, 0)
    return isinstance(message, Ego) and message.speed_mps is not None


def _records(file: Path) -> Iterator[Logged]:
    """What can be played, in the order of the file; a cut file ends at the cut. Raises UserError where it is no MCAP."""
    schemas: dict[int, str] = {}
    names: dict[int, str] = {}
    read = False
    try:
        with file.open("rb") as stream:
            for record in StreamReader(stream).records:
                read = True
                if isinstance(record, Schema):
                    schemas[record.id] = record.name
                elif isinstance(record, Channel) and _is_ours(record.topic, schemas.get(record.schema_id, "")):
                    names[record.id] = record.topic
                elif isinstance(record, Message) and record.channel_id in names:
                    yield Logged(names[record.channel_id], record.publish_time, record.data)
    except OSError as error:
        raise UserError(f"cannot read {file}: {error.strerror}") from None
    except (McapError, EOFError, struct.error, ValueError):
        if not read:
            raise UserError(f"{file} is no MCAP file") from None


def _is_ours(name: str, schema: str) -> bool:
    found = _topic_of(name)
    return found is not None and schema == (
        _PICTURES if found[0] is topics.CAMERA else f"{_OURS}{found[0].message.__name__}"
    )


def _topic_of(name: str) -> tuple[Topic[Any], str | None] | None:
    for topic in PLAYED:
        before, has_id, _ = topic.name.partition("<id>")
        if name == topic.name and not has_id:
            return topic, None
        id = name.removeprefix(before)
        if has_id and id and id != name and "/" not in id:
            return topic, id
    return None


def _message(file: Path, topic: Topic[Any], record: Logged, number: int) -> msgspec.Struct:
    try:
        if topic is topics.CAMERA:
            return _picture(record.data, number)
        decoded: msgspec.Struct = msgspec.json.decode(record.data, type=topic.message)
    except (msgspec.MsgspecError, DecodeError, cv2.error, ValueError) as error:
        raise UserError(f"{file}: a message on {record.name} does not decode: {error}") from None
    return decoded


def _picture(data: bytes, number: int) -> CameraFrame:
    """The size comes from the picture itself: a log's form for pictures does not say it."""
    jpeg = CompressedImage.FromString(data).data
    bgr = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR) if may_be_unpacked(jpeg) else None
    if bgr is None:
        raise ValueError("no picture")
    return CameraFrame(jpeg=jpeg, width_px=bgr.shape[1], height_px=bgr.shape[0], frame=number)
