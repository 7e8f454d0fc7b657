"""The worst moments of a run: a collision, the lowest time to collision, the longest overspeed; each with its tick and picture."""

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import msgspec
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from evaluation.metrics import Record
from evaluation.metrics.conflicts import nearest_ttc_s
from evaluation.metrics.spans import spans
from proto.truth import Truth
from services.logger.reader import messages

Kind = Literal["collision", "lowest time to collision", "longest overspeed"]
CAMERA = "sensor/camera/front"
LOW_TTC_S = 4.0
"""A time to collision above it is no bad moment."""
OVER_MPS = 1.0


class Moment(msgspec.Struct, frozen=True, kw_only=True):
    """A bad moment of a run."""

    kind: Kind
    time_s: float
    tick: int | None
    what: str
    badness: float
    """Larger is worse, within one kind."""
    picture: str = ""
    """The file beside the log; empty: no camera."""


def worst_moments(record: Record) -> tuple[Moment, ...]:
    """At most one of each kind."""
    found = (_collision(record), _lowest_ttc(record), _overspeed(record))
    return tuple(moment for moment in found if moment is not None)


def _collision(record: Record) -> Moment | None:
    truth = next((truth for truth in record.truths if truth.collision), None)
    if truth is None:
        return None
    what = f"collision at {truth.speed_mps * 3.6:.0f} km/h"
    return _moment(record, "collision", truth, what, truth.speed_mps)


def _lowest_ttc(record: Record) -> Moment | None:
    times = ((nearest_ttc_s(truth), truth) for truth in record.truths)
    ttc, truth = min(
        ((ttc, truth) for ttc, truth in times if ttc is not None), key=lambda pair: pair[0], default=(None, None)
    )
    if ttc is None or truth is None or ttc > LOW_TTC_S:
        return None
    return _moment(
        record, "lowest time to collision", truth, f"{ttc:.1f} s to collision at {truth.speed_mps * 3.6:.0f} km/h", -ttc
    )


def _overspeed(record: Record) -> Moment | None:
    over = spans(((truth.time_s, _over_mps(truth) > OVER_MPS) for truth in record.truths), 0.1)
    longest = max(over, key=lambda span: span.to_s - span.from_s, default=None)
    if longest is None:
        return None
    truth = max(record.truths_between(longest.from_s, longest.to_s), key=_over_mps)
    seconds, limit = longest.to_s - longest.from_s, truth.law_limit_mps or 0.0
    what = f"{truth.speed_mps * 3.6:.0f} km/h where {limit * 3.6:.0f} are allowed, {seconds:.1f} s above the limit"
    return _moment(record, "longest overspeed", truth, what, seconds)


def _over_mps(truth: Truth) -> float:
    return truth.speed_mps - truth.law_limit_mps if truth.law_limit_mps else 0.0


def _moment(record: Record, kind: Kind, truth: Truth, what: str, badness: float) -> Moment:
    before = [each for each in record.advisories if each.time_s <= truth.time_s + 1e-6]
    tick = before[-1].message.tick if before else None
    return Moment(kind=kind, time_s=truth.time_s, tick=tick, what=what, badness=badness)


def with_pictures(moments: tuple[Moment, ...], log: Path) -> tuple[Moment, ...]:
    """The moments with the newest picture of the log before each, written beside it as NAME.jpg."""
    pictures = dict(_pictures(log, tuple(moment.time_s for moment in moments)))
    told = []
    for moment in moments:
        jpeg, name = pictures.get(moment.time_s), f"{moment.kind.replace(' ', '-')}.jpg"
        if jpeg:
            (log.parent / name).write_bytes(jpeg)
        told.append(msgspec.structs.replace(moment, picture=name if jpeg else ""))
    return tuple(told)


def _pictures(log: Path, times_s: tuple[float, ...]) -> Iterator[tuple[float, bytes]]:
    """(time, JPEG) for each time; the log's first picture is a tenth of a second into the drive at most."""
    start_ns, newest = None, b""
    waiting = sorted(times_s)
    for logged in messages(log):
        if logged.name != CAMERA:
            continue
        start_ns = logged.stamp_ns if start_ns is None else start_ns
        while waiting and (logged.stamp_ns - start_ns) / 1e9 > waiting[0]:
            yield waiting.pop(0), _jpeg(newest)
        newest = logged.data
    for time_s in waiting:
        yield time_s, _jpeg(newest)


def _jpeg(data: bytes) -> bytes:
    return bytes(CompressedImage.FromString(data).data) if data else b""
