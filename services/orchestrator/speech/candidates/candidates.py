"""What could be said in this tick, the weightiest first."""

from collections.abc import Iterator

from domain.units import legal_limit, limit_text, to_mps
from proto.decision import Event
from proto.messages import ROWS, WEIGHT, Kind
from proto.rules import LegalLimit, RulesAnswer
from proto.speech import News
from proto.vehicle import Degradation, VehicleHealth
from proto.weather import Conditions
from services.orchestrator.events import foreign_sign
from services.orchestrator.law.limits_ahead import LimitAhead, binding_ahead, limits_ahead
from services.orchestrator.signs.limits import in_force, unit_and_side
from services.orchestrator.speech.candidate import Candidate, Maker, told_within
from services.orchestrator.speech.candidates.limits_ahead import (
    ahead,
    approach,
    is_due_soon,
    is_near,
    lowest,
    told_of_less,
    told_twice,
    was_announced,
)
from services.orchestrator.speech.candidates.road_users_and_stops import (
    give_way,
    go,
    lead,
    person,
    stop,
    stop_is_due_soon,
)
from services.orchestrator.speech.wording import (
    advised_number,
    drive,
    evidence_in_words,
    few,
    limit_number,
    place_name,
    plate_words,
    reading_words,
    say,
    speed,
    unit_name,
    units_name,
    word,
)
from services.orchestrator.speed_assistance import FELL_MPS, allowed_mps, plate_of, warning_of
from services.orchestrator.state import Believed, Limiter, SignAhead, State
from services.orchestrator.target.target import KMH, OF_THE_ROAD, Target, factors
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
        again_s=REPEAT_MILD_S if phrase in ("vehicle_trend", "vehicle_sensor", "vehicle_unread") else None,
        confidence=health.confidence if health is not None else 0.7,
        names=tuple(event.detail.split()),
        asked_mps=target.mps,
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
    """Whether the car's state asks for a speed below what traffic from behind expects: no sensor here looks back.

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
    return target.road_mps < MOTORWAY_LEAST_MPS


def _ahead_of_the_lamp(car: Degradation | None) -> str:
    """The phrase where nothing but a trend, a doubted sensor or what cannot be read is to be told."""
    if car is None or car.dtcs or car.warning_lamps or any(each.name != "sensors_faulty" for each in car.indicators):
        return ""
    told = (("vehicle_trend", car.trends), ("vehicle_sensor", car.sensor_faults), ("vehicle_unread", car.unknown))
    return next((phrase for phrase, found in told if found), "")


# -- the law -----------------------------------------------------------------------------------------------------------


def _overspeed(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """The word on an overspeed, while the speed assistance sounds it; not a third word on one limit, nor one that another would cut."""
    limit, ego, sounded_ns = target.law.limit, state.world.ego.speed_mps, state.overspeed.sounded_ns
    if limit is None or ego is None or sounded_ns is None or warning_of(state.overspeed, state.now_ns) != "sounded":
        return
    if ego.value <= limit.mps:
        return  # a limit of this tick is higher than the one that was exceeded
    if told_of_less(state, limit) or told_twice(state, limit, sounded_ns):
        return
    if is_due_soon(state, limit) or stop_is_due_soon(state):
        return
    yield Candidate(
        kind=Kind.OVERSPEED,
        news=News(value=limit.value, unit=limit.unit, grave=ego.value > FAR_OVER * limit.mps),
        phrase="overspeed",
        urgency="warning" if ego.value > FAR_OVER * limit.mps else "advice",
        values={
            "limit": limit_number(state.preferences, limit.value, limit.unit),
            "posted": limit_text(limit, state.preferences.unit),
            "speed": speed(state.preferences, ego.value),
        },
        why=("overspeed",),
        first_since_ns=sounded_ns,
        confidence=target.law.confidence,
        tells=(Kind.LIMIT, _limit_news(limit)),
        limit_mps=limit.mps,
        asked_mps=limit.mps,
        number=(limit.value, limit.unit),
    )


FAR_OVER = 1.2


def _limit_news(limit: LegalLimit) -> News:
    return News(value=limit.value, unit=limit.unit, advisory=limit.advisory)


def _binding_mps(limit: LegalLimit | None) -> float | None:
    return limit.mps if limit is not None and not limit.advisory else None


def _border(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """The country that begins, until it is told: where limits follow closely the budget may keep it for some seconds."""
    here = state.signs.jurisdiction
    if here is None or not ("jurisdiction_change" in events or _border_untold(state, here)) or _unit_comes(state, here):
        return
    preferences, limit = state.preferences, target.law.limit
    lower = lowest(limits_ahead(state), limit)  # the words allow no more than a sign in sight does
    shown = legal_limit(lower.value, lower.unit) if lower is not None else limit if target.law.told else None
    rules, told = _border_rules(state, shown), evidence_in_words(preferences, here.evidence)
    named = place_name(state, here.value)
    side = state.signs.traffic_side
    keeps = word(preferences, side.value) if side is not None and side.value in ("left", "right") else ""
    yield Candidate(
        kind=Kind.BORDER,
        news=News(what=here.value),
        phrase="border" if rules else "border_open",
        urgency="advice",
        values={
            "country": named.name,
            "from_country": named.out_of,
            "rules": rules,
            "evidence": told,
            "unit": say(preferences, "justification", "border_unit", unit=unit) if (unit := _unit_here(state)) else "",
            "side": say(preferences, "justification", "border_side", side=keeps) if keeps else "",
        },
        why=("border_told" if told else "border",),
        confidence=here.confidence,
        tells=_told_at_border(lower, shown),
        ahead_mps=lower.mps if lower is not None else None,
        limit_mps=_binding_mps(shown) if lower is None else None,
        number=(shown.value, shown.unit) if shown is not None else None,
    )


def _told_at_border(lower: LimitAhead | None, shown: LegalLimit | None) -> tuple[Kind, News] | None:
    """The limit that is told with the border."""
    if lower is not None:
        return Kind.AHEAD, News(value=lower.value, unit=lower.unit)
    return (Kind.LIMIT, _limit_news(shown)) if shown is not None else None


def _border_rules(state: State, shown: LegalLimit | None) -> str:
    """What is otherwise than before, and the limit: `keep left, 20 miles an hour`."""
    preferences, side = state.preferences, state.signs.traffic_side
    unit = shown.unit if shown is not None else _unit_here(state)
    unit_before, side_before = unit_and_side(state.signs.former_jurisdiction)
    parts = []
    if side is not None and side.value != side_before:
        parts.append(say(preferences, "word", "keeps", side=word(preferences, side.value)))
    other = unit if unit and unit != unit_before else ""
    if shown is not None and not shown.advisory:
        number = limit_number(preferences, shown.value, shown.unit)
        named = other and number == f"{shown.value:g}"
        parts.append(f"{number} {unit_name(preferences, other)}" if named else number)
    elif other:
        parts.append(units_name(preferences, other))
    return ", ".join(parts)


def _unit_here(state: State) -> str:
    believed, posted = state.signs.units, [each.posted.unit for each in in_force(state.signs)]
    return believed.value if believed is not None else next(iter(posted), "")


BORDER_NEWS_S = 20.0
"""For so long a border is worth a word: until the budget has long filled up again."""


def _unit_comes(state: State, here: Believed) -> bool:
    """Whether signs speak in miles here, and the front end is about to say so: a number is read as the lower until then."""
    miles = unit_and_side(here.value)[0] == "mph"
    return miles and state.signs.units is None and state.now_ns - here.since_ns < UNIT_COMES_NS


UNIT_COMES_NS = 1_000_000_000


def _border_untold(state: State, here: Believed) -> bool:
    crossed = state.signs.crossed and state.now_ns - here.since_ns < BORDER_NEWS_S * 1e9
    told = state.memory.last(Kind.BORDER)
    return crossed and (told is None or told.stamp_ns < here.since_ns)


def _limit(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """A limit that is lower than the one before it, once: a higher one is shown, and so is the first of a drive.

    Not while a sign ahead shows less; not where the ego keeps it already, or nearly; not where it was announced before its sign; and not
    later, when the driver goes beyond it: that is an overspeed.
    """
    limit = target.law.limit
    if (
        limit is None
        or not target.law.told
        or not _fell(state, limit)
        or lowest(binding_ahead(state), limit) is not None
    ):
        return
    if is_near(state, limit.mps) or _was_announced(state, limit) or not _is_new(state, limit):
        return
    plate = plate_of(state, limit)
    ended = bool(state.signs.ended) and "speed_limit_change" in events
    gantry = "dynamic_limit_update" in events
    yield Candidate(
        kind=Kind.LIMIT,
        news=_limit_news(limit),
        phrase="limit_advisory" if limit.advisory else "limit_plate" if plate else "limit",
        urgency="advice" if gantry and not limit.advisory else "info",
        values={"limit": limit_number(state.preferences, limit.value, limit.unit), "plate": plate},
        why=("gantry",) if gantry else ("ended",) if ended else (),
        confidence=target.law.confidence,
        limit_mps=_binding_mps(limit),
        number=(limit.value, limit.unit),
        plate=plate,
    )


def _fell(state: State, limit: LegalLimit) -> bool:
    """Whether it is lower than the limit before, which an answer of this tick may have ended."""
    mps = allowed_mps(limit)
    same = state.limit_mps is not None and abs(state.limit_mps - mps) < FELL_MPS
    before = state.former_mps if same else state.limit_mps
    return before is not None and mps < before


def _is_new(state: State, limit: LegalLimit) -> bool:
    """Whether it began recently."""
    same = state.limit_mps is not None and abs(state.limit_mps - allowed_mps(limit)) < FELL_MPS
    return not same or state.limit_ns is None or state.now_ns - state.limit_ns < LIMIT_NEWS_S * 1e9


LIMIT_NEWS_S = 5.0
"""For so long a limit is news: until what was being said is over."""


def _was_announced(state: State, limit: LegalLimit) -> bool:
    return state.announced is not None and state.announced.same_limit(_limit_news(limit))


def _foreign(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    meaning = state.held.meaning
    if "foreign_sign" not in events or meaning is None:
        return
    sign = foreign_sign(state)
    if sign is None or meaning.reading != sign.reading or sign.head == "border" or sign.scope == "end":
        return  # a border is told by its country, and the end of a limit is shown
    if sign.value is not None and is_near(state, to_mps(sign.value, sign.unit or "km/h")):
        return  # whatever the plate means, that limit is kept
    if any(each.sign.track_id == sign.track_id and was_announced(state, each) for each in binding_ahead(state)):
        return  # it holds here, and was told
    ahead_here = next((each for each in limits_ahead(state) if each.sign.track_id == sign.track_id), None)
    yield Candidate(
        kind=Kind.FOREIGN,
        about=sign.reading,
        news=News(what=sign.reading, detail=" ".join(sign.plates)),
        phrase="limit_plate" if sign.value is not None and plate_words(state.preferences, sign.plates) else "foreign",
        urgency="advice",
        values={
            "meaning": few(state.preferences, meaning.meaning),
            **_number_and_plate(state, sign),
        },
        why=("foreign",),
        confidence=min(meaning.confidence, sign.confidence),
        tells=(Kind.AHEAD, News(value=ahead_here.value, unit=ahead_here.unit)) if ahead_here is not None else None,
        ahead_mps=ahead_here.mps if ahead_here is not None else None,
        number=(sign.value, sign.unit or "km/h") if sign.value is not None else None,
        plate=plate_words(state.preferences, sign.plates),
    )


def _number_and_plate(state: State, sign: SignAhead) -> dict[str, str]:
    number = limit_number(state.preferences, sign.value, sign.unit or "km/h") if sign.value is not None else ""
    return {"limit": number, "plate": plate_words(state.preferences, sign.plates)}


def _shown(state: State, reading: str) -> str:
    """What stands on a sign that may read so: the number, of a border the country."""
    words = reading_words(state, reading)
    return words if words != reading else reading.partition(":")[2] or reading


def _doubt(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    event = events.get("uncertain_sign")
    if event is None or not any(bound.why == "doubt" for bound in target.bounds):
        return
    sign = next((s for s in state.signs.ahead if not s.believed and f"track {s.track_id}" == event.detail), None)
    if sign is None or sign.distance_m is None or sign.distance_m > 25.0:
        return  # it may still become readable; the target comes down meanwhile
    names = word(state.preferences, "or").join(_shown(state, c.reading) for c in sign.candidates[:3])
    yield Candidate(
        kind=Kind.DOUBT,
        news=News(track_id=sign.track_id),
        phrase="doubt",
        urgency="advice",
        values={"candidates": names or _shown(state, sign.reading)},
        asked_mps=target.told_mps,
        why=("doubt",),
        confidence=1.0 - sign.confidence,
    )


# -- the road and ourselves --------------------------------------------------------------------------------------------


def _friction(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """Water, ice, a slippery road: what to do on it, or a speed, to a driver who is faster."""
    event, conditions, ego = events.get("low_friction"), state.held.conditions, state.world.ego.speed_mps
    if event is None or conditions is None:
        return
    if event.detail not in GRAVE and target.bounds[0].why in PASSED_SOON:
        return  # until then a driver at the target is slower than the road allows
    # What a lead or a stop asks for now is not what the road does.
    told = OF_THE_ROAD[1:] if target.law.assumed else OF_THE_ROAD
    road_mps = min((bound.mps for bound in target.bounds if bound.why in told), default=None)
    slow = ego is not None and (ego.value < LEAST_MPS or (road_mps is not None and ego.value <= NEAR * road_mps))
    if slow and event.detail != "severe":
        return
    surface = _of_the_surface(conditions)
    if surface == "water" and _is_ordinary_rain(conditions, event.detail):
        return  # the driver sees it, and its speed is shown beside the limit
    if surface in _OPEN and state.now_ns - event.since_ns < SETTLES_S * 1e9:
        return
    number = advised_number(state.preferences, road_mps, target.law.limit) if road_mps is not None else ""
    yield Candidate(
        kind=Kind.FRICTION,
        news=News(what=_gravest(state, surface, event.detail)),
        phrase=surface if road_mps is not None and _worth_saying(target, road_mps) else _OPEN.get(surface, surface),
        urgency="warning" if event.detail == "severe" else "advice",
        values={"target": number},
        confidence=event.confidence,
        asked_mps=road_mps,
    )


def _of_the_surface(conditions: Conditions) -> str:
    """Deep water and ice by what to do; else by what lies on the road."""
    if conditions.mu_low < DEEP_MU and conditions.mu_high < SURELY_LITTLE_MU:
        return "deep_water" if conditions.wet and conditions.precipitation != "snow" else "ice"
    return "water" if conditions.wet and conditions.precipitation != "snow" else "slippery"


def _is_ordinary_rain(conditions: Conditions, level: str) -> bool:
    """Whether a wet road's risk is moderate, or hardly more: at best its grip is that of a damp road, and at worst not much below."""
    hardly = conditions.mu_high > WETTED_MU and conditions.mu_low > HARDLY_MU and not conditions.disagree
    return level not in GRAVE or (level != "severe" and hardly)


WETTED_MU, HARDLY_MU = 0.85, 0.33
"""Grip at best under 0.13 mm of water (Weather's curve); and a little below where the level "high" begins."""
_OPEN = {"water": "water_open", "slippery": "slippery_open"}
"""Phrases with a speed, and their like without one."""
SETTLES_S = 2.0
"""A level of risk that has just risen may rise further: it is told once, at its highest."""


def _worth_saying(target: Target, road_mps: float) -> bool:
    """Whether the speed is one that a driver would take for advice: not less than half of the limit."""
    return road_mps >= LEAST_SHARE * target.law.allowed_mps


DEEP_MU, SURELY_LITTLE_MU = 0.25, 0.5
LEAST_SHARE, LEAST_MPS = 0.5, 40 * KMH
NEAR = 1.1
"""A speed that the ego is so near to is not worth a word."""
PASSED_SOON = ("give_way", "junction", "red_light", "stop_sign", "stop_line")
GRAVE = ("high", "severe")
SURFACES = ("slippery", "water", "severe", "ice", "deep_water")
"""What is told of the road, the gravest last; `severe`: its risk, whatever lies there."""


def _gravest(state: State, surface: str, level: str) -> str:
    """What is told of the road, or what was told recently and is graver: where grip wavers between two, neither is news again."""
    now = max(surface, "severe", key=SURFACES.index) if level == "severe" else surface
    told = state.memory.last(Kind.FRICTION)
    if told is None or not told_within(state, Kind.FRICTION, ROWS[Kind.FRICTION].repeat_s):
        return now
    return max(told.news.what, now, key=SURFACES.index) if told.news.what in SURFACES else now


def _expert(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    for tool, limiter in ((each.tool, each) for each in state.held.limiters if _lowers(each)):
        yield Candidate(
            kind=Kind.EXPERT,
            about=tool,
            news=News(what=tool),
            phrase="expert" if target.told_mps is not None else "expert_open",
            urgency="advice",
            values={
                "target": advised_number(state.preferences, target.told_mps or 0.0, target.law.limit),
                "tool": tool,
                "text": limiter.text,
            },
            why=("expert",) if limiter.text else (),
            confidence=limiter.confidence,
            asked_mps=target.told_mps,
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
        values={"pack": f"{place_name(state, state.signs.country or '').in_a_sentence}, {_version(stale)}"},
        why=("old_rules",),
        first_since_ns=0,
        confidence=stale.confidence,
    )


def _version(answer: RulesAnswer) -> str:
    return answer.rulepack_version.partition("#")[0].partition("@")[2]


STALE = "stale_rulepack"
"""What the Rules call an answer from a pack that is older than the configuration expects, or not in force."""
SETTLED_TICKS = 50
"""While a drive begins, services are still coming up."""
MISSING_NS = 2_000_000_000
"""A gap shorter than this is not worth a word."""
QUIET = frozenset({"logger", "gateway", "sensor", "snapshot"})
"""Their absence costs the driver nothing."""
MAKERS: tuple[Maker, ...] = (
    person, lead, stop, give_way, _vehicle, _overspeed, _border, _limit, go, _doubt, _friction, _foreign, approach, ahead, _expert,
    _degraded, _old_rules,
)  # fmt: skip
