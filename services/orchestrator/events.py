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
    """One kind of event. `g` in the unit that the comment beside the row names."""

    kind: str
    detect: Callable[[State, str], Signal]
    eta: float
    tools: tuple[str, ...]


def detect_events(
    state: State, before: State, query: str = "", thresholds: Mapping[str, float] = NO_OTHERS
) -> tuple[Event, ...]:
    """All events above their thresholds now, the table's but for those given; `since_ns` is when they began."""
    found = []
    for row in TABLE:
        signal, eta = row.detect(state, query), thresholds.get(row.kind, row.eta)
        if signal.g > eta:
            found.append(
                Event(
                    kind=row.kind,
                    g=signal.g,
                    eta=eta,
                    detail=signal.detail[:160],
                    confidence=signal.confidence,
                    since_ns=_since(before, row.kind, signal.detail, state.now_ns),
                )
            )
    return tuple(found)


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


def _since(before: State, kind: str, detail: str, now_ns: int) -> int:
    known = next((o for o in before.onsets if o.kind == kind), None)
    if known is None or now_ns - known.last_ns > HELD_OVER_NS or (kind in _BY_DETAIL and known.detail != detail[:160]):
        return now_ns
    return known.since_ns


# -- detectors ---------------------------------------------------------------------------------------------------------


def _news(changed_ns: int | None, now_ns: int) -> bool:
    return changed_ns is not None and now_ns - changed_ns < FRESH_NS


def foreign_plate(sign: SignAhead, language: str) -> str:
    """The language of a plate that the driver does not read; empty: there is none."""
    for plate in sign.plates:
        tail = plate.rpartition(":")[2]
        if plate.startswith("plate:when_wet:") and tail not in ("drawn", "", language):
            return tail
    return ""


def _foreign_sign(state: State, query: str) -> Signal:
    language = state.preferences.language
    found = [sign for sign in state.signs.ahead if foreign_plate(sign, language)]
    if not found:
        return NOTHING
    sign = max(found, key=lambda each: (each.confidence, each.track_id))
    return Signal(sign.confidence, f"{sign.reading} {' '.join(sign.plates)}", sign.confidence)


def _jurisdiction_change(state: State, query: str) -> Signal:
    here, signs = state.signs.jurisdiction, state.signs
    if here is None or not signs.crossed or not _news(here.since_ns, state.now_ns):
        return NOTHING
    on = f" on {here.evidence}" if here.evidence else ""
    return Signal(here.confidence, f"{signs.former_jurisdiction or '?'} to {here.value}{on}", here.confidence)


def _dynamic_limit(state: State, query: str) -> Signal:
    if not _news(state.signs.gantry_changed_ns, state.now_ns):
        return NOTHING
    gantry = state.signs.gantry
    return Signal(gantry.posted.confidence, gantry.posted.reading) if gantry is not None else Signal(1.0, "gantry ends")


def _limit_change(state: State, query: str) -> Signal:
    if not _news(state.signs.changed_ns, state.now_ns):
        return NOTHING
    return Signal(1.0, " ".join(state.signs.ended))


def _uncertain_sign(state: State, query: str) -> Signal:
    doubted = [sign for sign in state.signs.ahead if not sign.believed and sign.kind == "limit"]
    if not doubted:
        return NOTHING
    sign = max(doubted, key=lambda each: (each.seen_ns, each.track_id))
    return Signal(1.0 - sign.confidence, f"track {sign.track_id}", sign.confidence)


def _place_ahead(state: State, query: str) -> Signal:
    sign = next(iter(places_ahead(state)), None)
    return Signal(sign.confidence, sign.reading, sign.confidence) if sign is not None else NOTHING


def _stop_required(state: State, query: str) -> Signal:
    """A person that is neither certain nor confirmed lowers the target, and is no event yet."""
    speed, person = state.world.ego.speed_mps, pedestrian(state.world)
    sure = person is not None and confirmed(state.gaps, person)
    found = [stop for stop in stops(state) if stop.why != "person" or sure]
    if not found:
        return NOTHING
    # Without a speed there is no deceleration to need: a stop within sight counts.
    worst = max(found, key=lambda stop: needed_mps2(stop, speed.value) if speed is not None else 1.0)
    need = needed_mps2(worst, speed.value) if speed is not None else 1.0
    return Signal(need, worst.why, worst.confidence)


def _low_friction(state: State, query: str) -> Signal:
    conditions = state.held.conditions
    if conditions is None or conditions.confidence < WEATHER_KNOWN:
        return NOTHING  # unknown grip lowers the target; it is no news that the road is slippery
    return Signal(1.0 - conditions.mu_low / DRY_MU, conditions.risk_level, conditions.confidence)


def _vehicle_fault(state: State, query: str) -> Signal:
    car = state.held.degradation
    if car is None:
        return NOTHING
    names = named(car)
    return Signal(max(car.h or 0.0, 0.2 if names else 0.0), " ".join([*names, *shown(car)]))


def _closing_lead(state: State, query: str) -> Signal:
    """Who is met soonest, as far as that is sure; a car that stands meets nobody."""
    if stands(state.world):
        return NOTHING
    way = next((way for way in met(state.world) if surely_nears(way) and clear(state.gaps, way)), None)
    if way is None or way.ttc_s is None:
        return NOTHING
    return Signal(1.0 / max(0.05, way.ttc_s), f"track {way.track.track_id}", way.track.confidence)


def _vulnerable(state: State, query: str) -> Signal:
    seen = (way for way in people(state.world) if well_seen(way.track))
    person = next((way for way in seen if confirmed(state.gaps, way)), None)
    if person is None:
        return NOTHING
    return Signal(person.track.confidence, f"{person.track.kind} {person.track.track_id}", person.track.confidence)


def _overspeed(state: State, query: str) -> Signal:
    speed, answer = state.world.ego.speed_mps, state.held.legal
    if speed is None or answer is None or answer.limit is None or answer.limit.advisory:
        return NOTHING
    if answer.confidence < rules_question.LAW_KNOWN:
        return NOTHING  # nobody drives too fast by a law that is a guess; the target is careful all the same
    confidence = min(speed.confidence, answer.confidence)
    return Signal(speed.value / max(0.5, answer.limit.mps) - 1.0, f"{answer.limit.value:g}", confidence)


def _stale(state: State, query: str) -> Signal:
    ages = {
        "conditions": (state.held.conditions_ns, VALID_NS["conditions"]),
        "degradation": (state.held.degradation_ns, VALID_NS["degradation"]),
        **{
            f"{BY_TOOL}{each.tool}": (each.until_ns - EXPERT_VALID_NS, EXPERT_VALID_NS // 2)
            for each in state.held.limiters
        },
    }
    shares = {name: _share(stamp, valid, state.now_ns) for name, (stamp, valid) in ages.items()}
    if state.held.legal is None or state.held.legal_key != rules_question.key(
        rules_question.situation_arguments(state)
    ):
        shares["legal_limit"] = UNSET_AFTER
    name = max(shares, key=lambda each: shares[each])
    stale = sorted(each for each, share in shares.items() if share > 1.0)
    return Signal(shares[name], " ".join(stale))


BY_TOOL = "tool:"
"""Before the name of the third-party tool whose restriction is stale: it is asked again before that runs out."""


def _share(stamp_ns: int | None, valid_ns: int, now_ns: int) -> float:
    return UNSET_AFTER if stamp_ns is None else (now_ns - stamp_ns) / valid_ns


def _driver_query(state: State, query: str) -> Signal:
    return Signal(1.0, query) if query else NOTHING


TABLE: tuple[EventRow, ...] = (
    EventRow("foreign_sign", _foreign_sign, 0.5, ("interpret_sign",)),  # confidence of the reading
    EventRow("jurisdiction_change", _jurisdiction_change, 0.6, ("applicable_limit", "lookup_rule")),  # confidence
    EventRow("dynamic_limit_update", _dynamic_limit, 0.3, ("applicable_limit", "assess_weather")),  # confidence
    EventRow("speed_limit_change", _limit_change, 0.5, ("applicable_limit",)),  # 0 or 1
    EventRow("uncertain_sign", _uncertain_sign, 0.1, ("interpret_sign",)),  # 1 - confidence of the best reading
    EventRow("place_ahead", _place_ahead, 0.5, ("interpret_sign",)),  # confidence of the reading
    EventRow("stop_required", _stop_required, 0.4, ("right_of_way",)),  # deceleration needed, m/s^2
    EventRow("low_friction", _low_friction, 0.3, ("assess_weather",)),  # 1 - mu / 0.8: wet asphalt 0.25, flooded 0.5
    EventRow(
        "vehicle_fault", _vehicle_fault, 0.15, ("vehicle_health", "read_dtcs")
    ),  # h, or 0.2 for a code, lamp, trend
    EventRow("closing_lead", _closing_lead, 0.25, ()),  # 1 / time to collision: 4 s. No tool is worth the wait
    EventRow("vulnerable_road_user", _vulnerable, 0.4, ("right_of_way",)),  # confidence of the track
    EventRow("overspeed", _overspeed, 0.05, ("applicable_limit",)),  # share above the limit
    EventRow("stale_fact", _stale, 1.0, ("applicable_limit", "assess_weather", "vehicle_health")),  # age / validity
    EventRow("driver_query", _driver_query, 0.5, ()),  # 1 while one is open; answered by the tool `ask`
)
"""Thresholds are ours; the evaluation's corruption protocol measures what they cost (docs/corruption.md)."""
ETA = {row.kind: row.eta for row in TABLE}
TOOLS = {row.kind: row.tools for row in TABLE}


def out_of_bounds(thresholds: Mapping[str, float]) -> str:
    """What is wrong with thresholds that somebody has set; empty: nothing."""
    low, high = MOVED
    for kind, eta in thresholds.items():
        if kind not in ETA:
            return f"thresholds: no event {kind!r}; there are {', '.join(sorted(ETA))}"
        if not low * ETA[kind] <= eta <= high * ETA[kind]:
            return f"thresholds.{kind} must lie in [{low * ETA[kind]:g}, {high * ETA[kind]:g}], not {eta:g}"
    return ""
