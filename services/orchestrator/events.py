"""The event table: what is noticed, by which detector g, above which threshold eta, and which tools it routes to."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from proto.decision import Event
from services.orchestrator.law import rules_question
from services.orchestrator.law.limits_ahead import places_ahead
from services.orchestrator.observations.validity import EXPERT_VALID_NS, UNSET_AFTER, VALID_NS
from services.orchestrator.state import Onset, SignAhead, State
from services.orchestrator.world.actors import (
    clear,
    confirmed,
    met,
    pedestrian,
    people,
    stands,
    surely_nears,
    well_seen,
)
from services.orchestrator.world.car_faults import named, shown
from services.orchestrator.world.stops import needed_mps2, stops

FRESH_NS = 1_500_000_000
"""For how long a change counts as news; longer than a lost tick, shorter than a message."""
DRY_MU = 0.8
WEATHER_KNOWN = 0.3
"""Confidence from which the weather is known well enough to be spoken of."""
HELD_OVER_NS = 1_000_000_000
"""An event that pauses for less than this is the same one."""
MOST_DETAIL = 160
BY_TOOL = "tool:"
"""Before the name of the third-party tool whose restriction is stale: it is asked again before that runs out."""
NO_OTHERS: Mapping[str, float] = MappingProxyType({})
MOVED = (0.5, 1.5)
"""Shares of the table's threshold between which a setting may move it; farther off it would be another event."""


class Signal(NamedTuple):
    """What a detector found."""

    g: float
    detail: str = ""
    confidence: float = 1.0


NOTHING = Signal(0.0)


class EventRow(NamedTuple):
    """One kind of event. It holds while the g that `detect` returns exceeds `eta`."""

    kind: str
    detect: Callable[[State], Signal]
    eta: float
    tools: tuple[str, ...]
    g: str
    """What g measures, for people."""


def detect_events(
    state: State, before: State, query: str = "", thresholds: Mapping[str, float] = NO_OTHERS
) -> tuple[Event, ...]:
    """All events above their thresholds now, the table's but for those given; `since_ns` is when they began."""
    asked = Signal(1.0, query) if query else NOTHING
    signals = ((row, asked if row.kind == "driver_query" else row.detect(state)) for row in TABLE)
    above = ((row.kind, signal, thresholds.get(row.kind, row.eta)) for row, signal in signals)
    return tuple(_event(kind, signal, eta, before, state.now_ns) for kind, signal, eta in above if signal.g > eta)


def _event(kind: str, signal: Signal, eta: float, before: State, now_ns: int) -> Event:
    detail = signal.detail[:MOST_DETAIL]
    known = next((each for each in before.onsets if each.kind == kind), None)
    same = known is not None and now_ns - known.last_ns <= HELD_OVER_NS
    if known is None or not same or (kind in _BY_DETAIL and known.detail != detail):
        known = Onset(kind=kind, since_ns=now_ns, last_ns=now_ns)
    return Event(kind=kind, g=signal.g, eta=eta, detail=detail, confidence=signal.confidence, since_ns=known.since_ns)


def onsets(before: State, events: tuple[Event, ...], now_ns: int) -> tuple[Onset, ...]:
    """Since when each event holds, those that just paused included."""
    now = {e.kind: Onset(kind=e.kind, since_ns=e.since_ns, last_ns=now_ns, detail=e.detail) for e in events}
    paused = (o for o in before.onsets if o.kind not in now and now_ns - o.last_ns < HELD_OVER_NS)
    return tuple(sorted((*now.values(), *paused), key=lambda o: o.kind))


def new(events: tuple[Event, ...], now_ns: int) -> tuple[Event, ...]:
    """Those that began in this tick."""
    return tuple(event for event in events if event.since_ns == now_ns)


_BY_DETAIL = frozenset(
    {"foreign_sign", "uncertain_sign", "place_ahead", "stop_required", "vehicle_fault", "driver_query"}
)
"""Kinds of which another detail is another event."""


# -- detectors ---------------------------------------------------------------------------------------------------------


def _news(changed_ns: int | None, now_ns: int) -> bool:
    return changed_ns is not None and now_ns - changed_ns < FRESH_NS


EXPLAINED_M = 50.0
"""From here on a plate under a sign without a number is explained."""


def foreign_plate(sign: SignAhead, language: str) -> str:
    """The language of a plate that the driver does not read; empty: no such plate."""
    for plate in sign.plates:
        tail = plate.rpartition(":")[2]
        if plate.startswith("plate:when_wet:") and tail not in ("drawn", "", language):
            return tail
    return ""


def foreign_sign(state: State) -> SignAhead | None:
    """The sign whose plate is explained next. One without a number waits till it is near: what hangs with a number says the same, and the
    number comes first."""
    foreign = [each for each in state.signs.ahead if each.believed and foreign_plate(each, state.preferences.language)]
    numbers = [each for each in foreign if each.value is not None]
    near = [each for each in foreign if each.distance_m is None or each.distance_m <= EXPLAINED_M]
    return next(iter(numbers or near), None)


def _foreign_sign(state: State) -> Signal:
    sign = foreign_sign(state)
    if sign is None:
        return NOTHING
    return Signal(sign.confidence, f"{sign.reading} {' '.join(sign.plates)}", sign.confidence)


def _jurisdiction_change(state: State) -> Signal:
    here, signs = state.signs.jurisdiction, state.signs
    if here is None or not signs.crossed or not _news(here.since_ns, state.now_ns):
        return NOTHING
    on = f" on {here.evidence}" if here.evidence else ""
    return Signal(here.confidence, f"{signs.former_jurisdiction or '?'} to {here.value}{on}", here.confidence)


def _dynamic_limit(state: State) -> Signal:
    if not _news(state.signs.gantry_changed_ns, state.now_ns):
        return NOTHING
    gantry = state.signs.gantry
    return Signal(gantry.posted.confidence, gantry.posted.reading) if gantry is not None else Signal(1.0, "gantry ends")


def _limit_change(state: State) -> Signal:
    return Signal(1.0, " ".join(state.signs.ended)) if _news(state.signs.changed_ns, state.now_ns) else NOTHING


def _uncertain_sign(state: State) -> Signal:
    doubted = (sign for sign in state.signs.ahead if sign.doubted_limit)
    sign = max(doubted, key=lambda each: (each.seen_ns, each.track_id), default=None)
    return Signal(1.0 - sign.confidence, f"track {sign.track_id}", sign.confidence) if sign is not None else NOTHING


def _place_ahead(state: State) -> Signal:
    places = (Signal(sign.confidence, sign.reading, sign.confidence) for sign in places_ahead(state))
    return next(places, NOTHING)


def _stop_required(state: State) -> Signal:
    """A person that is neither certain nor confirmed lowers the target, and is no event yet."""
    speed_mps, person = state.speed_mps, pedestrian(state.world)
    sure = person is not None and confirmed(state.gaps, person)
    # Without a speed there is no deceleration to need: a stop within sight counts.
    needs = (
        Signal(needed_mps2(stop, speed_mps) if speed_mps is not None else 1.0, stop.why, stop.confidence)
        for stop in stops(state)
        if sure or stop.why != "person"
    )
    return max(needs, key=lambda each: each.g, default=NOTHING)


def _low_friction(state: State) -> Signal:
    conditions = state.held.conditions
    if conditions is None or conditions.confidence < WEATHER_KNOWN:
        return NOTHING  # unknown grip lowers the target; it is no news that the road is slippery
    return Signal(1.0 - conditions.mu_low / DRY_MU, conditions.risk_level, conditions.confidence)


def _vehicle_fault(state: State) -> Signal:
    car = state.held.degradation
    if car is None:
        return NOTHING
    names = named(car)
    return Signal(max(car.h or 0.0, 0.2 if names else 0.0), " ".join([*names, *shown(car)]))


def _closing_lead(state: State) -> Signal:
    """The vehicle that is met soonest, as far as that is sure; a car that stands meets none."""
    surely = (way for way in met(state.world) if surely_nears(way) and clear(state.gaps, way))
    way = next(surely, None)
    if way is None or way.ttc_s is None or stands(state.world):
        return NOTHING
    return Signal(1.0 / max(0.05, way.ttc_s), f"track {way.track.track_id}", way.track.confidence)


def _vulnerable(state: State) -> Signal:
    seen = (way for way in people(state.world) if well_seen(way.track) and confirmed(state.gaps, way))
    person = next((way.track for way in seen), None)
    if person is None:
        return NOTHING
    return Signal(person.confidence, f"{person.kind} {person.track_id}", person.confidence)


def _overspeed(state: State) -> Signal:
    """A law that is a guess is no reason to tell of too high a speed; it keeps the target careful all the same."""
    speed, answer = state.world.ego.speed_mps, state.held.legal
    known = answer is not None and answer.confidence >= rules_question.LAW_KNOWN
    if speed is None or answer is None or not known or answer.limit is None or answer.limit.advisory:
        return NOTHING
    confidence = min(speed.confidence, answer.confidence)
    return Signal(speed.value / max(0.5, answer.limit.mps) - 1.0, f"{answer.limit.value:g}", confidence)


def _stale(state: State) -> Signal:
    held, now_ns = state.held, state.now_ns
    shares = {
        "conditions": _share(held.conditions_ns, VALID_NS["conditions"], now_ns),
        "degradation": _share(held.degradation_ns, VALID_NS["degradation"], now_ns),
    }
    for each in held.limiters:
        shares[BY_TOOL + each.tool] = _share(each.until_ns - EXPERT_VALID_NS, EXPERT_VALID_NS // 2, now_ns)
    if held.legal is None or held.legal_key != rules_question.todays_key(state):
        shares["legal_limit"] = UNSET_AFTER
    return Signal(max(shares.values()), " ".join(sorted(name for name, share in shares.items() if share > 1.0)))


def _share(stamp_ns: int | None, valid_ns: int, now_ns: int) -> float:
    return UNSET_AFTER if stamp_ns is None else (now_ns - stamp_ns) / valid_ns


TABLE: tuple[EventRow, ...] = (
    EventRow("foreign_sign", _foreign_sign, 0.5, ("interpret_sign",), "confidence of the reading"),
    EventRow(
        "jurisdiction_change",
        _jurisdiction_change,
        0.6,
        ("applicable_limit", "lookup_rule"),
        "confidence of the country",
    ),
    EventRow(
        "dynamic_limit_update",
        _dynamic_limit,
        0.3,
        ("applicable_limit", "assess_weather"),
        "confidence of the gantry's reading",
    ),
    EventRow("speed_limit_change", _limit_change, 0.5, ("applicable_limit",), "1 while the change is news"),
    EventRow("uncertain_sign", _uncertain_sign, 0.1, ("interpret_sign",), "1 − confidence of the best reading"),
    EventRow(
        "place_ahead",
        _place_ahead,
        0.5,
        ("interpret_sign",),
        "confidence of a believed town or calm-street sign that is not passed yet",
    ),
    EventRow(
        "stop_required",
        _stop_required,
        0.4,
        ("right_of_way",),
        "m/s² needed to stop at a red light, a stop sign, a person, or a mapped stop line without a sign or light",
    ),
    EventRow("low_friction", _low_friction, 0.3, ("assess_weather",), "1 − μ_low / 0.8: wet asphalt 0.25, flooded 0.5"),
    EventRow(
        "vehicle_fault",
        _vehicle_fault,
        0.15,
        ("vehicle_health", "read_dtcs"),
        "h of the car, or 0.2 for a trouble code, lamp, trend or doubted sensor",
    ),
    EventRow(
        "closing_lead",
        _closing_lead,
        0.25,
        (),
        "1 / time to collision in 1/s, of a road user that surely comes nearer; 0 while the ego stands",
    ),
    EventRow(
        "vulnerable_road_user",
        _vulnerable,
        0.4,
        ("right_of_way",),
        "confidence of the track, once certain or confirmed in three ticks",
    ),
    EventRow("overspeed", _overspeed, 0.05, ("applicable_limit",), "share of the speed above the limit"),
    EventRow(
        "stale_fact",
        _stale,
        1.0,
        ("applicable_limit", "assess_weather", "vehicle_health"),
        "age / validity of the oldest fact; the tool that refreshes it is asked",
    ),
    EventRow("driver_query", lambda _: NOTHING, 0.5, (), "1 while a question is open; the tool `ask` answers it"),
)
"""Thresholds are ours; the evaluation's corruption protocol measures what they cost (docs/explanation/corruption.md)."""
ETA = {row.kind: row.eta for row in TABLE}
TOOLS = {row.kind: row.tools for row in TABLE}


def out_of_bounds(thresholds: Mapping[str, float]) -> str:
    """What is wrong with configured thresholds; empty: nothing."""
    low, high = MOVED
    for kind, eta in thresholds.items():
        if kind not in ETA:
            return f"thresholds: no event {kind!r}; there are {', '.join(sorted(ETA))}"
        if not low * ETA[kind] <= eta <= high * ETA[kind]:
            return f"thresholds.{kind} must lie in [{low * ETA[kind]:g}, {high * ETA[kind]:g}], not {eta:g}"
    return ""
