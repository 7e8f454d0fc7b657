"""Signs, actors and messages for the corruption's tests."""

from typing import Any

import msgspec
from hypothesis import settings

from evaluation.corruption.corruptor import Corruptor, Left
from evaluation.corruption.spec import CorruptionSpec
from proto import topics
from proto.perception import Box, Boxes, Track, Tracks
from proto.scene import Fact, Facts
from proto.sensors import CameraFrame, LidarSweep
from proto.truth import TrueActor, Truth

SECOND = 1_000_000_000
TICK = SECOND // 10
ORIGIN = 1000 * SECOND
SOME = settings(max_examples=40, deadline=None)
replace = msgspec.structs.replace


def limit(value: int = 80, *, camera: str = "tele", track_id: int = 7, at_ns: int = ORIGIN, **fields: Any) -> Fact:
    """A limit read by a camera."""
    given = {
        "kind": "limit", "reading": f"limit:{value}", "value": float(value), "unit": "km/h", "confidence": 0.97,
        "frame_stamp_ns": at_ns, "track_id": track_id, "camera": camera, "distance_m": 60.0, "lateral_m": -3.0, **fields,
    }  # fmt: skip
    return Fact(**given)


def said(kind: str, reading: str, **fields: Any) -> Fact:
    """A fact without a number."""
    return replace(limit(), kind=kind, reading=reading, value=None, unit=None, **fields)


def truth(time_s: float = 0.0, **fields: Any) -> Truth:
    """What is so at a time."""
    given = {
        "time_s": time_s, "distance_m": 0.0, "speed_mps": 20.0, "acceleration_mps2": 0.0, "law_limit_mps": None,
        "jurisdiction": "DEU", "mu": 0.9, "gap_m": None, "closing_mps": None, **fields,
    }  # fmt: skip
    return Truth(**given)


def post(id: int, x_m: float, code: str = "limit:80", y_m: float = -3.0) -> dict[str, str | float]:
    """A sign as truth tells it."""
    return {"id": float(id), "code": code, "country": "DEU", "x_m": x_m, "y_m": y_m}


def track(track_id: int, x_m: float, y_m: float = 0.0, **fields: Any) -> Track:
    """A vehicle ahead."""
    given = {
        "track_id": track_id, "kind": "vehicle", "x_m": x_m, "y_m": y_m, "vx_mps": -2.0, "vy_mps": 0.0,
        "in_ego_path": y_m == 0.0, "confidence": 0.9, **fields,
    }  # fmt: skip
    return Track(**given)


def true_actor(actor_id: int, x_m: float, y_m: float = 0.0) -> TrueActor:
    """The vehicle itself."""
    return TrueActor(
        actor_id=actor_id, kind="vehicle", x_m=x_m, y_m=y_m, vx_mps=-2.0, vy_mps=0.0, length_m=4.5, width_m=1.8
    )


def facts_after(corruptor: Corruptor, *facts: Fact) -> tuple[Fact, ...]:
    """What is left of facts."""
    left = corruptor.leave(topics.FACTS, Facts(facts=facts), "drivelm", facts[0].frame_stamp_ns)
    return () if left.message is None else left.message.facts


def tracks_after(corruptor: Corruptor, at_ns: int, *tracks: Track, lead: int | None = None) -> Tracks:
    """What is left of tracks."""
    message = Tracks(camera="front", frame=1, tracks=tracks, lead_track_id=lead)
    after: Tracks = corruptor.leave(topics.TRACKS, message, "perception", at_ns).message
    return after


def boxes_of(*boxes: Box) -> Boxes:
    """Boxes of the front camera."""
    return Boxes(camera="front", frame=1, boxes=boxes)


def frame(number: int) -> CameraFrame:
    """A picture that can be told from others."""
    return CameraFrame(jpeg=b"picture %d" % number, width_px=64, height_px=36, frame=number)


SWEEP = LidarSweep(points=b"\0" * 16, count=1)


def drive(spec: CorruptionSpec, ticks: int, offset_ns: int = ORIGIN) -> list[list[Left]]:
    """What leaves of all topics at each tick of a drive past four signs with two cars around."""
    corruptor, out = Corruptor(spec), []
    for number in range(ticks):
        at_ns, gone_m = offset_ns + number * TICK, 2.0 * number
        signs = [(index, 60.0 + 90.0 * index - gone_m) for index in range(4)]
        shown = truth(number / 10, signs=tuple(post(i, x) for i, x in signs),
                      actors=(true_actor(1, 30.0), true_actor(2, 50.0, 3.5)))  # fmt: skip
        corruptor.truth(shown, at_ns)
        seen = tuple(
            limit(camera=camera, track_id=10 + i, at_ns=at_ns, distance_m=x) for i, x in signs if 5.0 < x < 60.0
            for camera in ("tele", "front")
        )  # fmt: skip
        tracks = Tracks(camera="front", frame=number, tracks=(track(1, 30.0), track(2, 50.0, 3.5)), lead_track_id=1)
        messages: list[tuple[Any, Any, str]] = [
            (topics.CAMERA, frame(number), "front"), (topics.CAMERA, frame(number), "tele"),
            (topics.LIDAR, SWEEP, "top"), (topics.TRACKS, tracks, "perception"), (topics.TRUTH, shown, "simulator"),
            *([(topics.FACTS, Facts(facts=seen), "drivelm")] if seen else []),
        ]  # fmt: skip
        out.append([corruptor.leave(topic, message, id, at_ns) for topic, message, id in messages])
    return out


def encoded(lefts: list[list[Left]], offset_ns: int = ORIGIN) -> list[list[tuple[bytes, int]]]:
    """Bytes and stamps since the drive began."""
    return [
        [(msgspec.msgpack.encode(_since(left.message, offset_ns)), left.stamp_ns - offset_ns) for left in row]
        for row in lefts
    ]


def _since(message: Any, offset_ns: int) -> Any:
    if not isinstance(message, Facts):
        return message
    return Facts(facts=tuple(replace(f, frame_stamp_ns=f.frame_stamp_ns - offset_ns) for f in message.facts))
