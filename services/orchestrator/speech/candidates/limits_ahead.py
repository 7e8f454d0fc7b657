"""Lower limits ahead: announced while there is time, and told to slow down for while they can still be kept."""

from collections.abc import Iterable, Iterator

import msgspec

from domain.kinematics import needed_mps2
from domain.units import posted_text, to_mps
from proto.decision import Event
from proto.messages import ROWS, Kind
from proto.rules import LegalLimit, PostedLimit
from proto.speech import News
from services.orchestrator.law.limits_ahead import LimitAhead, binding_ahead, limits_ahead, surely
from services.orchestrator.signs.limits import in_force, may_be_ours
from services.orchestrator.speech.candidate import SPOKEN_S, Candidate, told_within
from services.orchestrator.speech.wording import distance, limit_number
from services.orchestrator.speed_assistance import kept_up_to_mps
from services.orchestrator.state import State
from services.orchestrator.target.target import Target
from services.orchestrator.world.stops import COMFORT_MPS2, REACTION_S, to_be_told_m

OVER_MPS = 0.5
"""By so much a limit ahead is lower than the one in force."""
LIFTED_MPS2 = 0.9
"""How fast a car slows down once the foot is lifted."""
HEEDS_S = 3.0
"""From a word to slow down until one sees whether the driver heeds it."""
EXPLAINED_S = 5.0
"""For so long after a foreign sign was explained its limit is not announced as well."""
FIRM_MPS2, FAR_OVER = 3.0, 1.15
"""A driver who was told of a limit ahead and does not slow down hears it once more when no less than this keeps the limit, so far above
it."""
HEARD_S = 1.0
"""Till the words are over; a sign that is passed by then is told of by the overspeed behind it."""
CALMER = (Kind.AHEAD, Kind.FOREIGN, Kind.BORDER)
ANNOUNCES = (Kind.AHEAD, Kind.APPROACH)
NEAR = 1.1
"""A driver who is so near to a limit sees it; behind its sign the overspeed is told of by the table of times."""
FLICKERS_S = 5.0
"""A gantry or a sign that was announced may be read otherwise for so long without being another one."""


def approach(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """A limit that the ego will not keep unless it slows down now: no message came in time, or the driver did not slow down."""
    ego = state.world.ego.speed_mps
    lower = lowest(_exceeded(state, binding_ahead(state)), target.law.limit)
    if lower is None or ego is None:
        return
    if told_within(state, Kind.APPROACH, HEEDS_S) or any(told_within(state, kind, REACTION_S) for kind in CALMER):
        return  # the driver acts on it
    if _heeds(state, lower):
        return
    announced = _announced(state, lower)
    slow = announced._replace(
        phrase="slow_ahead", urgency="advice", kind=Kind.APPROACH, tells=(Kind.AHEAD, announced.news)
    )
    if not was_announced(state, lower):
        if _spare_s(lower, ego.value) <= 0.0:
            yield slow
    elif (
        ego.value > FAR_OVER * lower.mps
        and needed_mps2(ego.value, _room_m(lower), lower.mps) > FIRM_MPS2
        and _room_m(lower) > HEARD_S * ego.value
        and not _just_told(state)
    ):
        yield slow._replace(news=msgspec.structs.replace(slow.news, grave=True), urgency="warning")


def was_announced(state: State, lower: LimitAhead) -> bool:
    """Whether the driver was told recently that such a limit is ahead."""
    told = state.memory.last(Kind.AHEAD)
    same = told is not None and told.news == News(value=lower.value, unit=lower.unit)
    return same and told_within(state, Kind.AHEAD, ROWS[Kind.AHEAD].repeat_s)


def _heeds(state: State, lower: LimitAhead) -> bool:
    """Whether the ego slows down enough: to the limit, or as with the foot lifted and to nearly the limit."""
    ego, change = state.world.ego.speed_mps, state.world.ego.acceleration_mps2
    if ego is None or change is None:
        return False
    slowing_mps2 = -change.value
    left_mps2 = ego.value**2 - 2.0 * slowing_mps2 * _room_m(lower)
    return left_mps2 <= ((NEARLY if slowing_mps2 >= LIFTED_MPS2 else 1.0) * lower.mps) ** 2


NEARLY = 1.15
"""A driver who has lifted the foot and will be so near to a limit at its sign heeds it."""


def past(state: State) -> tuple[Kind, ...]:
    """Kinds, in memory, whose last word is over: the same again is news.

    Announcements of limits that no sign shows any more, ahead or passed (a gantry shows something else, or it ended); one that
    flickers is not announced anew each time. And the word on a limit, once a higher one holds.
    """
    shown = {(each.value, each.unit) for each in limits_ahead(state)}
    shown |= {(each.value, each.unit) for each in _posted_for_us(state)}
    told = (state.memory.last(kind) for kind in ANNOUNCES)
    over = tuple(
        each.kind
        for each in told
        if each is not None
        and (each.news.value, each.news.unit) not in shown
        and state.now_ns - each.stamp_ns >= FLICKERS_S * 1e9
    )
    rose = state.limit_mps is not None and state.former_mps is not None and state.limit_mps > state.former_mps
    return (*over, Kind.LIMIT) if rose and state.memory.last(Kind.LIMIT) is not None else over


def _posted_for_us(state: State) -> Iterator[PostedLimit]:
    """Limits in force that may hold for a car now, not those of lorries."""
    dry = surely(state, wet=False)
    posted = (each.posted for each in in_force(state.signs))
    return (each for each in posted if may_be_ours(each.scope, each.plates, dry=dry))


def ahead(state: State, target: Target, events: dict[str, Event]) -> Iterator[Candidate]:
    """The lowest limit ahead that the ego drives faster than, when it is time to lift the foot; not for a driver who slows down enough."""
    ego = state.world.ego.speed_mps
    lower = lowest(_exceeded(state, limits_ahead(state)), target.law.limit)
    if lower is None or told_within(state, Kind.FOREIGN, EXPLAINED_S) or _heeds(state, lower):
        return
    if ego is None or _spare_s(lower, ego.value, LIFTED_MPS2) <= 0.0:
        yield _announced(state, lower)


def _exceeded(state: State, found: Iterable[LimitAhead]) -> Iterator[LimitAhead]:
    """Those of limits ahead that the ego is not near to yet. A number that may be miles is told with its border."""
    return (each for each in found if not each.open_unit and not is_near(state, each.mps))


def is_near(state: State, limit_mps: float) -> bool:
    """Whether the ego keeps a limit or nearly keeps it."""
    speed_mps = state.speed_mps
    return speed_mps is not None and speed_mps <= max(NEAR * limit_mps, kept_up_to_mps(limit_mps, state.preferences))


def _just_told(state: State) -> bool:
    return any(told_within(state, kind, HEEDS_S) for kind in CALMER)


def lowest(found: Iterable[LimitAhead], limit: LegalLimit | None) -> LimitAhead | None:
    """The lowest of limits ahead, if it is below the one in force."""
    lower = (
        each
        for each in found
        if each.sign.distance_m is not None and limit is not None and each.mps < limit.mps - OVER_MPS
    )
    return min(lower, key=lambda each: (each.mps, each.sign.track_id), default=None)


def told_of_less(state: State, limit: LegalLimit) -> bool:
    """Whether the driver was told of a lower limit ahead, just now or where it begins in a moment: it is enough to keep that one."""
    lower = lowest(limits_ahead(state), limit)
    if lower is not None and was_announced(state, lower) and _room_m(lower) <= HEEDS_S * (state.speed_mps or 0.0):
        return True
    told = [state.memory.last(kind) for kind in ANNOUNCES if told_within(state, kind, HEEDS_S)]
    news = [each.news for each in told if each is not None]
    return any(to_mps(each.value or 0.0, "mph" if each.unit == "mph" else "km/h") < limit.mps for each in news)


def told_twice(state: State, limit: LegalLimit, before_ns: int) -> bool:
    """Whether the driver was told in vain to slow down for this limit, shortly before: a third word tells nothing that a tone does not."""
    told = state.memory.last(Kind.APPROACH)
    if told is None or not told.news.grave or (told.news.value, told.news.unit) != (limit.value, limit.unit):
        return False
    return 0 <= before_ns - told.stamp_ns < TWICE_S * 1e9


TWICE_S = 10.0
"""So long before the tone the second word on a limit still counts."""


def is_due_soon(state: State, limit: LegalLimit) -> bool:
    """Whether a lower limit ahead is about to be announced: a word of now would keep that one waiting."""
    ego, lower = state.world.ego.speed_mps, lowest(_exceeded(state, limits_ahead(state)), limit)
    if ego is None or lower is None or was_announced(state, lower) or _heeds(state, lower):
        return False
    return _spare_s(lower, ego.value, LIFTED_MPS2) <= SPOKEN_S


def _announced(state: State, lower: LimitAhead) -> Candidate:
    return Candidate(
        kind=Kind.AHEAD,
        news=News(value=lower.value, unit=lower.unit),
        phrase="zone_ahead" if lower.sign.scope == "zone" else "limit_ahead",
        urgency="info",
        values={
            "limit": limit_number(state.preferences, lower.value, lower.unit),
            "posted": posted_text(lower.value, lower.unit, state.preferences.unit),
            "gap": distance(state.preferences, _room_m(lower)),
        },
        why=("ahead",) if lower.law is None else ("place_ahead",),
        confidence=lower.confidence,
        ahead_mps=lower.mps,
        number=(lower.value, lower.unit),
        law=lower.law,
    )


def _spare_s(lower: LimitAhead, speed_mps: float, slowing_mps2: float = COMFORT_MPS2) -> float:
    """Seconds until a driver, reaction included, must be told so that the car comes down to the limit at its sign."""
    return (_room_m(lower) - to_be_told_m(speed_mps, lower.mps, slowing_mps2)) / max(speed_mps, 1.0)


def _room_m(lower: LimitAhead) -> float:
    return max(0.0, lower.sign.distance_m or 0.0)
