"""What logs tell of speed assistance: of drives in the simulator, on the road, and of played recordings.

With the truth of a run beside its log all of it is told. Without truth the limit that was shown, the car's own speed and the front end's
signs are all there is: whether a limit was right, a hazard answered or a warning founded cannot be told.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import msgspec

from drivemcp.errors import MALFORMED, UserError
from evaluation.isa.accuracy import SHOWN_WITHIN_S, Accuracy, accuracy
from evaluation.isa.warnings import Moment, Warned, judged, of_overspeed, overspeeds
from evaluation.metrics.metrics import Metrics, measure
from evaluation.metrics.record import DAMAGED, from_log
from evaluation.run.recorded import fault_of
from proto import topics
from proto.scene import Fact, Facts
from proto.speed_assistance import SpeedAssistance
from proto.topics import Topic
from proto.vehicle import Ego
from services.logger.format.reader import messages

SAME_SIGN_S = 3.0
"""Ours: a sign of the same number within this time is the same sign, or its twin beside the road."""
WAITS_S = 10.0
"""Ours: what is not shown by then was not shown because of that sign."""
RELEASED, BRAKED = 0.02, 0.05
"""Of the pedals' ways: the driver has answered."""


class Over(msgspec.Struct, frozen=True, kw_only=True):
    """One overspeed of the limit that was shown."""

    at_s: float
    limit_kmh: float
    most_kmh: float
    warned: Warned
    excused: str = ""
    """Why no sound was due: the driver had answered, or had switched sounds off."""

    @property
    def verdict(self) -> str:
        """`passed`, what the table asks for, or why nothing was due."""
        return self.excused or judged(self.warned)


class Told(msgspec.Struct, frozen=True, kw_only=True):
    """What a log tells."""

    metrics: Metrics
    accuracy: Accuracy | None
    """None: no truth lies beside it."""
    sign_delays_s: tuple[float | None, ...] = ()
    """From each limit sign that was passed to its number; None: not within 10 s, as for a plate that does not hold now."""
    overs: tuple[Over, ...] = ()


class _Found(msgspec.Struct):
    """Messages of a log, by seconds since its first."""

    shown: list[tuple[float, SpeedAssistance]] = []
    facts: list[tuple[float, Fact]] = []
    ego: list[tuple[float, Ego]] = []


def told_by(log: Path) -> Told:
    """What a log tells. Raises UserError naming a log that is missing, damaged, altered, or of another version."""
    try:
        if fault := fault_of(log):
            raise UserError(f"{log}: it is not as it was written: {fault}")
        record, found = from_log(log), _read(log)
    except DAMAGED as error:
        raise UserError(f"{log}: {getattr(error, 'strerror', None) or error}") from None
    return Told(
        metrics=measure(record),
        accuracy=accuracy(record) if record.truths else None,
        sign_delays_s=tuple(sign_delays_s(found.facts, found.shown)),
        overs=tuple(overs(found.shown, found.ego)),
    )


def _read(log: Path) -> _Found:
    found, start_ns = _Found(), None
    for each in messages(log):
        start_ns = each.stamp_ns if start_ns is None else start_ns
        at_s = (each.stamp_ns - start_ns) / 1e9
        if each.name == topics.SPEED_ASSISTANCE.name:
            found.shown.append((at_s, _decoded(topics.SPEED_ASSISTANCE, each.data, log)))
        elif each.name == topics.EGO.name:
            found.ego.append((at_s, _decoded(topics.EGO, each.data, log)))
        elif each.name == topics.FACTS.name:
            facts: Facts = _decoded(topics.FACTS, each.data, log)
            found.facts += [(at_s, fact) for fact in facts.facts]
    return found


def _decoded(topic: Topic[Any], data: bytes, log: Path) -> Any:
    try:
        return msgspec.json.decode(data, type=topic.message)
    except MALFORMED as error:
        raise UserError(f"{log}: {topic.name} does not fit this version: {error}") from None


def sign_delays_s(
    facts: Sequence[tuple[float, Fact]], shown: Sequence[tuple[float, SpeedAssistance]]
) -> Iterator[float | None]:
    """From each believed limit sign that was passed to its number on the display; 0 where it stood there."""
    seen_s: dict[float, float] = {}
    for at_s, fact in facts:
        if not (fact.passed and fact.believed and fact.kind == "limit") or fact.value is None:
            continue
        known = at_s - seen_s.get(fact.value, -SAME_SIGN_S) < SAME_SIGN_S
        seen_s[fact.value] = at_s
        if not known:
            yield _delay_s(at_s, fact, shown)


def _delay_s(at_s: float, fact: Fact, shown: Sequence[tuple[float, SpeedAssistance]]) -> float | None:
    stood: SpeedAssistance | None = None
    for time_s, each in shown:
        if time_s <= at_s:
            stood = each
        elif stood is not None and _shows(stood, fact):
            return 0.0
        elif time_s > at_s + WAITS_S:
            return None
        elif _shows(each, fact):
            return time_s - at_s
    return 0.0 if stood is not None and _shows(stood, fact) else None


def _shows(shown: SpeedAssistance, fact: Fact) -> bool:
    limit = shown.limit
    return limit is not None and limit.value == fact.value and fact.unit in (None, limit.unit)


def overs(shown: Sequence[tuple[float, SpeedAssistance]], ego: Sequence[tuple[float, Ego]]) -> Iterator[Over]:
    """Overspeeds of the limit that was shown, by the speed that the display knew; of assumed and advised limits none."""
    course = [Moment(at_s, each.speed_mps or 0.0, _known_mps(each)) for at_s, each in shown]
    for over in overspeeds(course):
        found = of_overspeed(over, shown)
        yield Over(
            at_s=over[0].time_s,
            limit_kmh=(over[0].limit_mps or 0.0) * 3.6,
            most_kmh=max(each.speed_mps for each in over) * 3.6,
            warned=found,
            excused=_excuse(over, found, shown, ego),
        )


def _known_mps(shown: SpeedAssistance) -> float | None:
    limit = shown.limit
    return None if limit is None or limit.assumed or limit.advisory else limit.mps


def _excuse(
    over: Sequence[Moment],
    found: Warned,
    shown: Sequence[tuple[float, SpeedAssistance]],
    ego: Sequence[tuple[float, Ego]],
) -> str:
    if found.due_s is None or found.sounded_s is not None:
        return ""
    from_s, due_s = over[0].time_s, over[0].time_s + found.due_s
    if any(each.muted for at_s, each in shown if from_s <= at_s <= due_s):
        return "muted"
    return "the driver had answered" if any(_answers(each) for at_s, each in ego if from_s <= at_s <= due_s) else ""


def _answers(ego: Ego) -> bool:
    lifted = ego.accelerator_pedal is not None and ego.accelerator_pedal <= RELEASED
    return lifted or (ego.brake_pedal is not None and ego.brake_pedal >= BRAKED)


UNTOLD = (
    "Without truth a log cannot tell: whether the limit shown was the right one, by distance or by change; signs that were not read; "
    "false warnings, hazards, precision."
)


def rows(logs: Sequence[Told]) -> Iterator[tuple[str, str, str]]:
    """What logs tell without truth: delays, overspeeds; what, the value, the goal."""
    delays = [delay for each in logs for delay in each.sign_delays_s]
    known = [delay for delay in delays if delay is not None]
    in_time = sum(delay <= SHOWN_WITHIN_S for delay in known)
    yield f"limit signs passed, {len(delays)}: shown within 10 s", f"{len(known)} of {len(delays)}", ""
    yield "of those shown, within 2 s", f"{in_time} of {len(known)}", "all"
    yield "delay after a sign, median, s", f"{median(known):.1f}" if known else "-", "2.0"
    found = [over for each in logs for over in each.overs]
    due = [over for over in found if over.warned.due_s is not None and not over.excused]
    passed = sum(over.verdict == "passed" for over in due)
    yield (
        f"overspeeds of the limit shown, {len(found)}: sounded by the table",
        f"{passed} of {len(due)} that were due",
        "all",
    )
