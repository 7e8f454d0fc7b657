"""Which events of the orchestrator's table should be on, and when: from the simulator's truth, in the table's own units.

Thresholds and tools are written down here, as the table first shipped them: no setting of a service moves what it is judged by.

A measured value wavers about a threshold, so each is two: from 3/4 of it an event may be detected, from 5/4 of it it must
be. A change is an instant, with a time before and after it in which it may be told. Not scored, for truth has no say in
them: `uncertain_sign` and `place_ahead` (matters of the reading), `stale_fact` (of the system's own memory),
`driver_query` (of the driver).
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

from evaluation.metrics.conflicts import EGO_LENGTH_M, gap_m, person_ahead, ttc_s
from evaluation.metrics.hazards import on_now
from evaluation.metrics.record import Record
from evaluation.metrics.spans import Span, spans
from proto.truth import Truth

ETA: Mapping[str, float] = MappingProxyType(
    {"closing_lead": 0.25, "low_friction": 0.3, "overspeed": 0.05, "stop_required": 0.4}
)
"""1 / time to collision (1/s); 1 - mu / dry mu; share above the limit; deceleration needed (m/s^2)."""
DRY_MU = 0.8
TOOLS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "foreign_sign": ("interpret_sign",),
        "jurisdiction_change": ("applicable_limit", "lookup_rule"),
        "dynamic_limit_update": ("applicable_limit", "assess_weather"),
        "speed_limit_change": ("applicable_limit",),
        "uncertain_sign": ("interpret_sign",),
        "place_ahead": ("interpret_sign",),
        "stop_required": ("right_of_way",),
        "low_friction": ("assess_weather",),
        "vehicle_fault": ("vehicle_health", "read_dtcs"),
        "closing_lead": (),
        "vulnerable_road_user": ("right_of_way",),
        "overspeed": ("applicable_limit",),
        "stale_fact": ("applicable_limit", "assess_weather", "vehicle_health"),
        "driver_query": (),
    }
)
"""What each event calls for."""
MAY, MUST = 0.75, 1.25
"""Shares of a threshold: from the one an event may be on, from the other it must be."""
LASTS_S = 0.3
"""What must be detected lasts at least three pictures."""
PAUSE_S = 1.0
"""An event that pauses for less is the same one, as in the orchestrator."""
PERSON_SEEN_M, PERSON_MAY_M, BESIDE_M = 60.0, 120.0, 4.0
PERSON_ROOM_M, LINE_ROOM_M = 3.0, 1.0
PLATE_READ_M = 30.0
"""A plate of 0.3 m is some 20 px wide in the tele camera at this distance: by then it must have been read."""
DRY_FILM_MM = 0.02
"""Ours: less water than this lies on a road that looks dry."""


class Tolerance(NamedTuple):
    """Seconds by which a detection may come before an event and after it."""

    before_s: float
    after_s: float


class Expected(NamedTuple):
    """A stretch in which an event may be detected; and from when to when it must be on, if it must at all."""

    span: Span
    due: Span | None = None


Level = Callable[[Truth], tuple[bool, bool] | None]
"""(may be on, must be on) at an instant; None: truth does not tell."""

TOLERANCES: Mapping[str, Tolerance] = {
    "foreign_sign": Tolerance(1.0, 2.0),
    "jurisdiction_change": Tolerance(5.0, 5.0),
    "dynamic_limit_update": Tolerance(2.0, 4.0),
    "speed_limit_change": Tolerance(3.0, 4.0),
    "stop_required": Tolerance(0.5, 1.0),
    "low_friction": Tolerance(2.0, 5.0),
    "vehicle_fault": Tolerance(0.5, 10.0),
    "closing_lead": Tolerance(0.5, 1.0),
    "vulnerable_road_user": Tolerance(1.0, 1.0),
    "overspeed": Tolerance(1.0, 2.0),
}
"""Ours. A border or a limit is told when its sign is read, up to 150 m before it; weather and faults are watched for
seconds before they are believed."""
KINDS = tuple(TOLERANCES)


def expected(record: Record) -> dict[str, tuple[Expected, ...]]:
    """What should be detected in a run, by kind; a kind that truth does not tell is left out."""
    found = {kind: _held(record, level) for kind, level in _LEVELS.items()}
    found["foreign_sign"] = _foreign(record)
    at = {
        "jurisdiction_change": changes([(t.time_s, t.jurisdiction) for t in record.truths]),
        "speed_limit_change": changes([(t.time_s, t.law_limit_mps) for t in record.truths]),
        "dynamic_limit_update": _gantries(record),
    }
    passed = tuple(Expected(Span(each.time_s, each.time_s)) for each in _passed(record))
    start = (Expected(Span(0.0, 0.0)),)  # then all is new
    for kind, instants in at.items():
        found[kind] = (*(Expected(Span(at_s, at_s), Span(at_s, at_s)) for at_s in instants), *passed, *start)
    return {kind: rows for kind in KINDS if (rows := found[kind]) is not None}


def tools_of(kind: str, truth: Truth) -> tuple[str, ...]:
    """The tools that an event calls for: the table's, but right of way only where a line or a light gives it a question."""
    tools = TOOLS[kind]
    if truth.light is None and not truth.stop_kind:
        return tuple(tool for tool in tools if tool != "right_of_way")
    return tools


# -- levels ------------------------------------------------------------------------------------------------------------


def _above(g: float, kind: str) -> tuple[bool, bool]:
    return g > MAY * ETA[kind], g > MUST * ETA[kind]


def _closing_lead(truth: Truth) -> tuple[bool, bool]:
    """A road user from the side with right of way may count as well, though it does not lead before it is in the path."""
    time = ttc_s(truth.gap_m, truth.closing_mps)
    may, must = _above(1.0 / max(0.05, time) if time is not None else 0.0, "closing_lead")
    return may or any(each.kind == "priority" for each in on_now(truth)), must


def _low_friction(truth: Truth) -> tuple[bool, bool]:
    """On a road that is wet at all it may be on: the detector takes the lower bound of what the friction may be."""
    may, must = _above(1.0 - truth.mu / DRY_MU, "low_friction")
    return may or (truth.film_mm or 0.0) > DRY_FILM_MM, must


def _overspeed(truth: Truth) -> tuple[bool, bool]:
    return _above(truth.speed_mps / truth.law_limit_mps - 1.0 if truth.law_limit_mps else 0.0, "overspeed")


def _stop_required(truth: Truth) -> tuple[bool, bool]:
    """Deceleration needed to a line or to a person in the path; a person beside the path may be taken to be in it."""
    rooms = [room for room in (_line_m(truth), _person_m(truth)) if room is not None]
    worst = max((truth.speed_mps**2 / (2.0 * max(0.5, room)) for room in rooms), default=0.0)
    may, must = _above(worst, "stop_required")
    return may or _person_near(truth), must


def _line_m(truth: Truth) -> float | None:
    if truth.stop_kind in ("red_light", "stop_sign") and truth.stop_distance_m is not None:
        return truth.stop_distance_m - LINE_ROOM_M
    if truth.light in ("red", "red_amber", "amber") and truth.light_distance_m is not None:
        return truth.light_distance_m - LINE_ROOM_M
    return None


def _person_m(truth: Truth) -> float | None:
    person = person_ahead(truth)
    return gap_m(person) - PERSON_ROOM_M if person is not None else None


def _vulnerable(truth: Truth) -> tuple[bool, bool]:
    """A person in the path within 60 m must be seen; a person near the path, or farther off, may be."""
    person = person_ahead(truth)
    return _person_near(truth), person is not None and gap_m(person) < PERSON_SEEN_M


def _person_near(truth: Truth) -> bool:
    return any(
        a.kind == "pedestrian" and 0.0 < a.x_m < PERSON_MAY_M and (a.in_ego_path or abs(a.y_m) < BESIDE_M)
        for a in truth.actors
    )


def _vehicle_fault(truth: Truth) -> tuple[bool, bool] | None:
    return None if truth.faults is None else (bool(truth.faults), bool(truth.faults))


_LEVELS: Mapping[str, Level] = {
    "closing_lead": _closing_lead,
    "low_friction": _low_friction,
    "overspeed": _overspeed,
    "stop_required": _stop_required,
    "vulnerable_road_user": _vulnerable,
    "vehicle_fault": _vehicle_fault,
}


def _held(record: Record, level: Level) -> tuple[Expected, ...] | None:
    judged = [(truth.time_s, level(truth)) for truth in record.truths]
    if any(found is None for _, found in judged):
        return None
    known = [(time_s, found) for time_s, found in judged if found is not None]
    must = [s for s in spans((time_s, must) for time_s, (_, must) in known) if s.to_s - s.from_s >= LASTS_S]
    may = spans(((time_s, may) for time_s, (may, _) in known), PAUSE_S)
    return tuple(Expected(span, _due(span, must)) for span in may)


def _due(span: Span, must: Sequence[Span]) -> Span | None:
    within = [each for each in must if span.overlaps(each)]
    return Span(within[0].from_s, within[-1].to_s) if within else None


# -- signs and changes ---------------------------------------------------------------------------------------------------


def changes(samples: Sequence[tuple[float, object]]) -> tuple[float, ...]:
    """Instants at which the value became another."""
    return tuple(time_s for (_, old), (time_s, new) in pairwise(samples) if old != new)


class Passed(NamedTuple):
    """A sign or panel that the ego's front drove past: when, what it shows, how far from the ego's middle it was."""

    time_s: float
    code: str
    aside_m: float


def _passed(record: Record) -> Iterator[Passed]:
    ahead: dict[float, tuple[str, float]] = {}
    for truth in record.truths:
        for sign in filter(_for_us, truth.signs):
            number, code, x_m = float(sign["id"]), str(sign["code"]), float(sign["x_m"])
            if x_m > EGO_LENGTH_M / 2.0:
                ahead[number] = code, abs(float(sign["y_m"]))
            elif number in ahead:
                yield Passed(truth.time_s, *ahead.pop(number))


def _gantries(record: Record) -> tuple[float, ...]:
    """Instants at which a gantry was passed that shows something else than the one before; the first one counts.

    It shows what its panel over the ego's lane does: a lane that is open beside a limit is no news of the limit.
    """
    gantries: list[list[Passed]] = []
    for each in _passed(record):
        if each.code.startswith("led"):
            if not (gantries and each.time_s - gantries[-1][0].time_s < PAUSE_S):
                gantries.append([])
            gantries[-1].append(each)
    ours = [min(panels, key=lambda each: each.aside_m).code for panels in gantries]
    news = zip(gantries, ours, ["", *ours], strict=False)
    return tuple(panels[0].time_s for panels, code, before in news if code != before)


def _foreign(record: Record) -> tuple[Expected, ...]:
    language = _language(record)
    nearest = [(truth.time_s, _nearest_foreign_m(truth, language)) for truth in record.truths]
    may = spans(((time_s, distance < math.inf) for time_s, distance in nearest), PAUSE_S)
    must = spans(((time_s, distance < PLATE_READ_M) for time_s, distance in nearest), PAUSE_S)
    return tuple(Expected(span, _due(span, must)) for span in may)


def foreign_ahead(record: Record, truth: Truth) -> bool:
    """Whether a plate that the driver does not read is ahead."""
    return _nearest_foreign_m(truth, _language(record)) < math.inf


def _language(record: Record) -> str:
    """The language that the driver reads. From a truth that does not tell it, the language of the first advisory, else `en`."""
    told = record.truths[0].driver_language if record.truths else ""
    return told or (record.advisories[0].message.language if record.advisories else "en")


def _nearest_foreign_m(truth: Truth, language: str) -> float:
    plates = (sign for sign in filter(_for_us, truth.signs) if foreign(str(sign["code"]), language))
    return min((x_m for sign in plates if (x_m := float(sign["x_m"])) > 0.0), default=math.inf)


def _for_us(sign: Mapping[str, str | float]) -> bool:
    """Whether a sign faces the ego; from a truth that does not tell, all do."""
    return float(sign.get("faces_ego", 1.0)) > 0.0


def foreign(code: str, language: str) -> bool:
    """Whether a post, its codes joined by `+`, has a plate in words that the driver does not read."""
    plates = (each.rpartition(":")[2] for each in code.split("+") if each.startswith("plate:when_wet:"))
    return any(tail not in ("drawn", "", language) for tail in plates)
