"""The worst moments of a run: what was struck, run, missed or left unanswered; each with its tick and picture."""

from collections.abc import Iterable, Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Literal, TypeVar, get_args

import msgspec
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from evaluation.metrics import Record
from evaluation.metrics.conflicts import encroachments, nearest_ttc_s, rss_unanswered
from evaluation.metrics.hazards import answers
from evaluation.metrics.law import TYPES
from evaluation.metrics.spans import Span, spans
from proto.truth import Truth
from services.logger.format.reader import messages

Kind = Literal[
    "collision",
    "stop line run",
    "unanswered hazard",
    "unanswered RSS violation",
    "lowest time to collision",
    "smallest post-encroachment time",
    "longest overspeed",
]
KINDS: tuple[Kind, ...] = get_args(Kind)
"""The gravest first."""
MOST, OF_A_KIND = 9, 3
"""Moments that a report shows: in all, and of each kind."""
T = TypeVar("T")
CAMERA = "sensor/camera/front"
LOW_TTC_S = 4.0
"""A time to collision above it is no bad moment."""
LOW_PET_S = 2.0
"""Nor is a post-encroachment time above this one; both are about twice what makes a near-collision."""
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
    found = (
        _collision(record), _line_run(record), _unanswered_hazard(record), _unanswered_rss(record), _lowest_ttc(record),
        _smallest_pet(record), _overspeed(record),
    )  # fmt: skip
    return tuple(moment for moment in found if moment is not None)


def shown(by_kind: Iterable[list[T]]) -> list[list[T]]:
    """Of moments by kind, the worst first in each, those that a report has room for: of each kind the worst, then the second."""
    kinds = [kind[:OF_A_KIND] for kind in by_kind]
    turns = zip_longest(*([(at, each) for each in kind] for at, kind in enumerate(kinds)))
    room = [pair for turn in turns for pair in turn if pair is not None][:MOST]
    return [[each for number, each in room if number == at] for at in range(len(kinds))]


def _collision(record: Record) -> Moment | None:
    truth = next((truth for truth in record.truths if truth.collision), None)
    if truth is None:
        return None
    what = f"collision at {truth.speed_mps * 3.6:.0f} km/h"
    return _moment(record, "collision", truth, what, truth.speed_mps)


def _line_run(record: Record) -> Moment | None:
    """At the highest speed."""
    run = [truth for truth in record.truths if TYPES.get(truth.infraction) == "failure_to_stop"]
    truth = max(run, key=lambda each: each.speed_mps, default=None)
    if truth is None:
        return None
    line = "a red light" if truth.infraction == "red_light" else "a stop line"
    what = f"{line} run at {truth.speed_mps * 3.6:.0f} km/h"
    return _moment(record, "stop line run", truth, what, truth.speed_mps)


def _unanswered_hazard(record: Record) -> Moment | None:
    """The one that began at the highest speed, then."""
    missed = [each.episode for each in answers(record) if each.at_s is None]
    begun = [(truth, each) for each in missed if (truth := record.truth_at(each.onset_s)) is not None]
    truth, episode = max(begun, key=lambda pair: pair[0].speed_mps, default=(None, None))
    if truth is None or episode is None:
        return None
    seconds = episode.over_s - episode.onset_s
    what = f"{episode.kind.replace('_', ' ')} for {seconds:.1f} s, from {truth.speed_mps * 3.6:.0f} km/h, and no word in time"
    return _moment(record, "unanswered hazard", truth, what, truth.speed_mps)


def _unanswered_rss(record: Record) -> Moment | None:
    longest = _longest(rss_unanswered(record))
    truth = record.truth_at(longest.from_s) if longest is not None else None
    if longest is None or truth is None:
        return None
    seconds = longest.to_s - longest.from_s
    what = f"{seconds:.1f} s below the RSS distance, from {truth.speed_mps * 3.6:.0f} km/h, and nothing braked"
    return _moment(record, "unanswered RSS violation", truth, what, seconds)


def _smallest_pet(record: Record) -> Moment | None:
    at_s, pet = min(encroachments(record), key=lambda pair: pair[1], default=(0.0, LOW_PET_S))
    truth = record.truth_at(at_s) if pet < LOW_PET_S else None
    if truth is None:
        return None
    what = f"{pet:.1f} s between two in one place, at {truth.speed_mps * 3.6:.0f} km/h"
    return _moment(record, "smallest post-encroachment time", truth, what, -pet)


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
    longest = _longest(over)
    if longest is None:
        return None
    truth = max(record.truths_between(longest.from_s, longest.to_s), key=_over_mps)
    seconds, limit = longest.to_s - longest.from_s, truth.law_limit_mps or 0.0
    what = f"{truth.speed_mps * 3.6:.0f} km/h where {limit * 3.6:.0f} are allowed, {seconds:.1f} s above the limit"
    return _moment(record, "longest overspeed", truth, what, seconds)


def _longest(found: tuple[Span, ...]) -> Span | None:
    return max(found, key=lambda span: span.to_s - span.from_s, default=None)


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
