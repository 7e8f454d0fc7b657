"""What could be said in this tick, the weightiest first."""

from collections.abc import Iterator

import msgspec

from domain.units import legal_limit, limit_text
from proto.decision import Event
from proto.messages import ROWS, WEIGHT, Kind
from proto.rules import LegalLimit
from proto.speech import News
from proto.vehicle import Degradation, VehicleHealth
from services.orchestrator.events import foreign_plate
from services.orchestrator.law.limits_ahead import binding_ahead, limits_ahead
from services.orchestrator.speech.candidate import Candidate, Maker, told_within
from services.orchestrator.speech.candidates.limits_ahead import ahead, approach, lowest
from services.orchestrator.speech.candidates.road_users_and_stops import give_way, go, lead, person, stop
from services.orchestrator.speech.wording import drive, evidence_in_words, say, speed, word
from services.orchestrator.state import Believed, Limiter, State
from services.orchestrator.target.target import KMH, Target, factors
from services.orchestrator.text import sentences
from services.orchestrator.world.car_faults import covered, said_of


def candidates(state: State, target: Target, events: tuple[Event, ...]) -> tuple[Candidate, ...]:
    """All of them, the weightiest kind first (`proto.messages.KINDS`)."""
    by_kind = {event.kind: event for event in events}
    found = (candidate for make in MAKERS for candidate in make(state, target, by_kind))
    return tuple(sorted(found, key=lambda candidate: WEIGHT[candidate.kind]))


# -- the car -----------------------------------------------------------------------------------------------------------


def _vehicle(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    event = events.get("vehicle_fault")
    if event is None:
        return
    health, slow = said_of(state.held), _slow_for_a_motorway(state, target)
    drive_on = health.safe_to_drive if health is not None else "with_care"
    phrase, told = _vehicle_phrase(state, drive_on, slow=slow), _told_of_the_car(state, health, event)
    yield Candidate(
        kind=Kind.VEHICLE,
        news=News(what=phrase, detail=told),
        phrase=phrase,
        urgency="warning" if drive_on in GRAVE_FAULTS else "advice",
        values={"fault": told, "target": drive(state.preferences, target.mps)},
        why=("fault", "slow") if slow else ("fault",),
        hazard="vehicle_fault" if drive_on == "stop_now" else "",
        first_since_ns=event.since_ns,
        again_s=REPEAT_MILD_S if phrase in ("vehicle_trend", "vehicle_sensor") else None,
        confidence=health.confidence if health is not None else 0.7,
        names=tuple(event.detail.split()),
    )


def _vehicle_phrase(state: State, drive_on: str, *, slow: bool) -> str:
    """By what the car's health allows; ahead of the lamp where only a trend or a sensor is in doubt."""
    mild = _ahead_of_the_lamp(state.held.degradation) if drive_on not in GRAVE_FAULTS else ""
    phrase = mild or _VEHICLE.get(drive_on, "vehicle_with_care")
    return "vehicle_leave" if slow and phrase == "vehicle_with_care" else phrase


def _told_of_the_car(state: State, health: VehicleHealth | None, event: Event) -> str:
    """The advice of the tool where it knows of every fault; else the names of the faults."""
    known = health is not None and covered(state.held) and health.advice
    return sentences(known or event.detail or f"h {event.g:.2f}")


GRAVE_FAULTS = ("stop_now", "stop_soon")
_VEHICLE = {"stop_now": "vehicle_stop_now", "stop_soon": "vehicle_stop_soon", "yes": "vehicle_ok"}
REPEAT_MILD_S = 1800.0
MOTORWAY_LEAST_MPS = 60 * KMH
"""Vehicles that cannot go faster have no place on a motorway (StVO § 18 Abs. 1; the Austrian StVO § 46 Abs. 1 alike)."""


def _slow_for_a_motorway(state: State, target: Target) -> bool:
    """Whether the car's state asks for less than whoever comes from behind reckons with: nobody here looks back.

    Told so, it stays so for a while: a target that wavers around the bound is no news each time.
    """
    road, limit, (_, vehicle, _) = state.world.environment.road_type, target.law.limit, factors(state)
    if road is None or road.value != "motorway" or vehicle >= 1.0:
        return False
    if limit is not None and limit.mps <= MOTORWAY_LEAST_MPS:
        return False
    told = state.memory.last(Kind.VEHICLE)
    lately = told_within(state, Kind.VEHICLE, ROWS[Kind.VEHICLE].repeat_s)
    if told is not None and told.news.what == "vehicle_leave" and lately:
        return True
    return _road_mps(target) < MOTORWAY_LEAST_MPS


def _ahead_of_the_lamp(car: Degradation | None) -> str:
    """The phrase where nothing but a trend or a doubted sensor is to be told."""
    if car is None or car.dtcs or car.warning_lamps or any(each.name != "sensors_faulty" for each in car.indicators):
        return ""
    return "vehicle_trend" if car.trends else "vehicle_sensor" if car.sensor_faults else ""


# -- the law -----------------------------------------------------------------------------------------------------------


def _overspeed(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    event, limit, ego = events.get("overspeed"), target.law.limit, state.world.ego.speed_mps
    if event is None or limit is None or ego is None or not target.law.told or _starting(state):
        return  # where the limit is a guess the target is low, and no driver is told to break a law
    if ego.value <= limit.mps:
        return  # another limit than the one that the event was about
    far = ego.value > 1.2 * limit.mps
    yield Candidate(
        kind=Kind.OVERSPEED,
        news=_overspeed_news(state, limit, far=far),
        phrase="overspeed_safe" if _safe_below(target, limit) else "overspeed",
        urgency="warning" if far else "advice",
        values={
            "limit": limit_text(limit, state.preferences.unit),
            "speed": speed(state.preferences, ego.value),
            "target": drive(state.preferences, _road_mps(target)),
        },
        why=("overspeed",),
        first_since_ns=event.since_ns,
        confidence=target.law.confidence,
        tells=(Kind.LIMIT, _limit_news(limit)),
        limit_mps=_binding_mps(limit),
    )


def _overspeed_news(state: State, limit: LegalLimit, *, far: bool) -> News:
    """A driver who was told of an overspeed by far hears no calmer word on it."""
    grave = News(value=limit.value, unit=limit.unit, grave=True)
    told = any(each.kind is Kind.OVERSPEED and each.news == grave for each in state.memory.spoken)
    return msgspec.structs.replace(grave, grave=far or told)


def _limit_news(limit: LegalLimit) -> News:
    return News(value=limit.value, unit=limit.unit, advisory=limit.advisory)


def _binding_mps(limit: LegalLimit | None) -> float | None:
    return limit.mps if limit is not None and not limit.advisory else None


def _safe_below(target: Target, limit: LegalLimit) -> bool:
    """Whether road, weather or car ask for less than the law does, and are to be told with the limit."""
    return _road_mps(target) < 0.9 * limit.mps


def _road_mps(target: Target) -> float:
    """What road, weather and car ask for; a lead or a stop that asks for less is soon passed."""
    return min(bound.mps for bound in target.bounds if bound.why in OF_THE_ROAD)


def _starting(state: State) -> bool:
    """The first moments of a drive, while nobody has said yet what the weather is; later, its silence is a reason for care."""
    conditions = state.held.conditions
    return state.tick < STARTING_TICKS and (conditions is None or conditions.confidence <= 0.0)


def _border(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """The country that begins, until it is told: where limits follow closely the budget may keep it for some seconds."""
    here = state.signs.jurisdiction
    if here is None or not ("jurisdiction_change" in events or _border_untold(state, here)):
        return
    limit, told = target.law.limit, evidence_in_words(state.preferences, here.evidence)
    lower = lowest(limits_ahead(state), limit)  # the words allow no more than a sign in sight does
    ahead_here = legal_limit(lower.value, lower.unit) if lower is not None else None
    yield Candidate(
        kind=Kind.BORDER,
        news=News(what=here.value),
        phrase="border_ahead" if ahead_here else "border",
        urgency="advice",
        values={"country": here.value, "evidence": told, **_border_words(state, limit, ahead_here or limit)},
        why=("border_told" if told else "border",),
        confidence=here.confidence,
        tells=_told_limit(target),
        ahead_mps=ahead_here.mps if ahead_here else None,
        limit_mps=None if ahead_here or not target.law.told else _binding_mps(limit),
    )


def _told_limit(target: Target) -> tuple[Kind, News] | None:
    """That the limit is told with the border, where it is known, and no safe speed below it."""
    limit = target.law.limit
    known = limit is not None and target.law.told and not _safe_below(target, limit)
    return (Kind.LIMIT, _limit_news(limit)) if known and limit is not None else None


def _border_words(state: State, limit: LegalLimit | None, shown: LegalLimit | None) -> dict[str, str]:
    """Limit, unit and side of traffic, as far as they are known."""
    preferences, side = state.preferences, state.signs.traffic_side
    believed = state.signs.units
    unit = believed.value if believed is not None else limit.unit if limit is not None else "?"
    keeps = word(preferences, side.value) if side is not None and side.value in ("left", "right") else ""
    return {
        "limit": limit_text(shown, preferences.unit) if shown is not None and not shown.assumed else "?",
        "unit": unit,
        "side": say(preferences, "justification", "border_side", side=keeps) if keeps else "",
    }


BORDER_NEWS_S = 20.0
"""For so long a border is worth a word: until the budget has long filled up again."""


def _border_untold(state: State, here: Believed) -> bool:
    crossed = state.signs.crossed and state.now_ns - here.since_ns < BORDER_NEWS_S * 1e9
    told = state.memory.last(Kind.BORDER)
    return crossed and (told is None or told.stamp_ns < here.since_ns)


def _limit(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """The limit in force, once for each that is in force; as a gantry's where a gantry changed it.

    Not while a sign ahead shows less: nobody is to speed up for the last metres before it.
    """
    limit = target.law.limit
    if limit is None or not target.law.told or _starting(state):
        return
    if lowest(binding_ahead(state), limit) is not None:
        return
    safe = _safe_below(target, limit)
    gantry = "gantry" if "dynamic_limit_update" in events else "limit"
    gantry = "limit_advisory" if limit.advisory else gantry
    ended = bool(state.signs.ended) and "speed_limit_change" in events
    yield Candidate(
        kind=Kind.LIMIT,
        news=_limit_news(limit),
        phrase=f"{gantry}_safe" if safe else gantry,
        urgency="advice" if gantry == "gantry" else "info",
        values={
            "limit": limit_text(limit, state.preferences.unit),
            "target": drive(state.preferences, _road_mps(target)),
        },
        why=("gantry",) if gantry == "gantry" else ("ended",) if ended else (),
        confidence=target.law.confidence,
        limit_mps=_binding_mps(limit),
    )


def _foreign(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    meaning = state.held.meaning
    if "foreign_sign" not in events or meaning is None:
        return
    sign = next((s for s in state.signs.ahead if s.believed and foreign_plate(s, state.preferences.language)), None)
    if sign is None or meaning.reading != sign.reading:
        return
    yield Candidate(
        kind=Kind.FOREIGN,
        news=News(what=sign.reading, detail=" ".join(sign.plates)),
        phrase="foreign",
        urgency="advice",
        values={"meaning": meaning.meaning, "reading": sign.reading},
        why=("foreign",),
        confidence=min(meaning.confidence, sign.confidence),
    )


def _doubt(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    event = events.get("uncertain_sign")
    if event is None or not any(bound.why == "doubt" for bound in target.bounds):
        return
    sign = next((s for s in state.signs.ahead if not s.believed and f"track {s.track_id}" == event.detail), None)
    if sign is None or sign.distance_m is None or sign.distance_m > 25.0:
        return  # it may still become readable; the target comes down meanwhile
    names = word(state.preferences, "or").join(c.reading.partition(":")[2] or c.reading for c in sign.candidates[:3])
    yield Candidate(
        kind=Kind.DOUBT,
        news=News(track_id=sign.track_id),
        phrase="doubt" if target.told_mps is not None else "doubt_open",
        urgency="advice",
        values={"target": drive(state.preferences, target.told_mps or 0.0), "candidates": names or sign.reading},
        why=("doubt",),
        confidence=1.0 - sign.confidence,
    )


# -- the road and ourselves --------------------------------------------------------------------------------------------


def _friction(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    event = events.get("low_friction")
    if event is None:
        return
    if event.detail != "severe" and told_within(state, Kind.LIMIT, FRICTION_TOLD_S):
        return  # the limit was told with the safe target and its reason
    if event.detail not in GRAVE and target.bounds[0].why in PASSED_SOON:
        return  # till then whoever keeps to the target is slower than the road asks for
    # What a lead or a stop asks for now is not what the road does.
    told = OF_THE_ROAD[1:] if target.law.assumed else OF_THE_ROAD
    road_mps = min((bound.mps for bound in target.bounds if bound.why in told), default=None)
    yield Candidate(
        kind=Kind.FRICTION,
        news=News(what=_gravest(state, event.detail)),
        phrase="friction" if road_mps is not None else "friction_open",
        urgency="warning" if event.detail == "severe" else "advice",
        values={"target": drive(state.preferences, road_mps or 0.0)},
        confidence=event.confidence,
    )


OF_THE_ROAD = ("law", "sight")
PASSED_SOON = ("give_way", "junction", "red_light", "stop_sign", "stop_line")
GRAVE = ("high", "severe")
SLIPPERY = ("low", "moderate", *GRAVE)
"""Levels of risk, the gravest last; an unknown one is none of them."""


def _gravest(state: State, level: str) -> str:
    """The level, or a graver one that was told of late: where grip wavers between two, neither is news again."""
    told, repeat_s = state.memory.last(Kind.FRICTION), ROWS[Kind.FRICTION].repeat_s
    if told is None or not told_within(state, Kind.FRICTION, repeat_s) or not {told.news.what, level} <= set(SLIPPERY):
        return level
    return max(told.news.what, level, key=SLIPPERY.index)


def _expert(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    for tool, limiter in ((each.tool, each) for each in state.held.limiters if _lowers(each)):
        yield Candidate(
            kind=Kind.EXPERT,
            about=tool,
            news=News(what=tool),
            phrase="expert" if target.told_mps is not None else "expert_open",
            urgency="advice",
            values={"target": drive(state.preferences, target.told_mps or 0.0), "tool": tool, "text": limiter.text},
            why=("expert",) if limiter.text else (),
            confidence=limiter.confidence,
        )


def _lowers(limiter: Limiter) -> bool:
    return limiter.target_mps is not None or limiter.speed_factor < 1.0 or limiter.headway_factor > 1.0


def _degraded(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """Each service or topic that goes missing is told once; what comes and goes is not told again for a while."""
    long = {o.kind.split("/")[0] for o in state.missing if state.now_ns - o.since_ns >= MISSING_NS}
    names = tuple(sorted(long - QUIET))
    if not names or state.tick < SETTLED_TICKS:
        return
    yield Candidate(
        kind=Kind.DEGRADED,
        news=News(what=" ".join(names)),
        phrase="degraded",
        urgency="info",
        values={"names": ", ".join(names)},
        why=("degraded",),
        first_since_ns=0,
    )


def _old_rules(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """That a country's rulepack is too old, or not in force: told once in a drive, and never again."""
    answers = [answer for answer in (state.held.legal, state.held.right_of_way) if answer is not None]
    stale = next((answer for answer in answers if STALE in answer.degraded), None)
    if stale is None or state.tick < SETTLED_TICKS:
        return
    pack = stale.rulepack_version.partition("@")[0]
    yield Candidate(
        kind=Kind.OLD_RULES,
        about=pack,
        news=News(what=pack),
        phrase="old_rules",
        urgency="info",
        values={"pack": stale.rulepack_version.partition("#")[0].replace("@", " ")},
        why=("old_rules",),
        first_since_ns=0,
        confidence=stale.confidence,
    )


STALE = "stale_rulepack"
"""What the Rules call an answer from a pack that is older than the configuration expects, or not in force."""
STARTING_TICKS = 20
SETTLED_TICKS = 50
"""While a drive begins, services are still coming up."""
MISSING_NS = 2_000_000_000
"""A gap shorter than this is not worth a word."""
FRICTION_TOLD_S = 45.0
QUIET = frozenset({"logger", "gateway", "sensor", "snapshot"})
"""Their absence costs the driver nothing."""
MAKERS: tuple[Maker, ...] = (
    person, lead, stop, give_way, _vehicle, _overspeed, _border, _limit, go, _doubt, _friction, _foreign, approach, ahead, _expert,
    _degraded, _old_rules,
)  # fmt: skip
