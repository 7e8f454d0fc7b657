"""What the experts' answers change in the state: typed, checked, and only where they may."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import msgspec

from domain.languages import spoken_language
from proto.rules import PlaceName, RulesAnswer, SignMeaning
from proto.tools import Effect, Outcome
from proto.vehicle import VehicleHealth
from proto.weather import Conditions
from services.orchestrator.law import rules_question
from services.orchestrator.law.limits_ahead import PLACES
from services.orchestrator.observations.validity import EXPERT_VALID_NS, VALID_NS, fresh_ns, newer, sane_health
from services.orchestrator.signs.limits import SURE
from services.orchestrator.state import Cached, Held, Limiter, State, ToldPlace
from services.orchestrator.text import plain
from services.orchestrator.world.car_faults import worse
from services.orchestrator.world.conditions import no_better, sane_conditions, settle

S = TypeVar("S")
KEPT = 24
LATE_SERVES_MS = 2000.0
DOUBTED_NS = 10_000_000_000
"""For how long pictures are read until a doubted sign's lowest reading lowers the target no more."""


def take(state: State, outcomes: tuple[Outcome, ...]) -> State:
    """The state with all usable answers taken in, and every question noted as asked."""
    held, asked = state.held, state.asked
    for outcome in outcomes:
        if outcome.ok and outcome.age_ms <= LATE_SERVES_MS:
            held = _take_one(held, state, outcome)
        elif not outcome.ok:
            held = _prolonged(held, outcome.tool, state.now_ns + EXPERT_VALID_NS)
        asked = _note(asked, outcome, state.now_ns)
    return msgspec.structs.replace(state, held=held, asked=asked)


def failed(outcomes: tuple[Outcome, ...]) -> tuple[str, ...]:
    """Tools that did not answer in time, or at all."""
    return tuple(sorted({outcome.tool for outcome in outcomes if not outcome.ok}))


def degraded(state: State, tools: tuple[str, ...]) -> tuple[str, ...]:
    """What the answer lacks: what the world lacks, and the tools that failed."""
    return tuple(sorted({*state.world.degraded, *(f"tool:{tool}" for tool in tools)}))


def typed(outcome: Outcome, kind: type[S]) -> S | None:
    """The result as its type; one that breaks its schema is no answer."""
    try:
        return msgspec.convert(outcome.result, kind)
    except msgspec.ValidationError:
        return None


def results(outcomes: tuple[Outcome, ...], tool: str, kind: type[S]) -> list[S]:
    """What a tool answered, in the order in which it was asked; what is no such answer is left out."""
    found = (typed(each, kind) for each in outcomes if each.tool == tool and each.ok)
    return [each for each in found if each is not None]


def _note(asked: tuple[Cached, ...], outcome: Outcome, now_ns: int) -> tuple[Cached, ...]:
    """The questions with this one; an answer drops what failed of its tool before."""
    sha, ok = rules_question.key(outcome.arguments), outcome.ok
    entry = Cached(tool=outcome.tool, arguments_sha256=sha, stamp_ns=_answered_ns(outcome, now_ns), ok=ok)
    others = (
        each
        for each in asked
        if each.tool != entry.tool or (each.arguments_sha256 != sha and (each.ok or not entry.ok))
    )
    return (*others, entry)[-KEPT:]


def _answered_ns(outcome: Outcome, now_ns: int) -> int:
    return now_ns - int(outcome.age_ms * 1e6)


def _take_one(held: Held, state: State, outcome: Outcome) -> Held:
    taker, effect = _TAKERS.get(outcome.tool), dict(state.effects).get(outcome.tool)
    if taker is not None:
        answer = typed(outcome, taker.kind)
        return taker.take(held, state, outcome, answer) if answer is not None else held
    if effect is None:
        return held
    limiter = expert_limiter(outcome.tool, outcome.result or {}, effect, state.now_ns + EXPERT_VALID_NS)
    others = tuple(each for each in held.limiters if each.tool != outcome.tool)
    return msgspec.structs.replace(held, limiters=(*others, limiter)) if limiter is not None else held


def _legal(held: Held, state: State, outcome: Outcome, answer: RulesAnswer) -> Held:
    key, held = rules_question.key(outcome.arguments), _named(held, outcome, answer.place)
    doubtful = answer.confidence < SURE / 2.0 and held.legal is not None and _raises(held.legal, answer)
    if doubtful or not rules_question.sane_limit(answer) or key != rules_question.todays_key(state):
        return held  # the last: a late answer to another question than today's
    asked_h = outcome.arguments["situation"]["time_of_day_h"]  # today's arguments, by their key
    return msgspec.structs.replace(held, legal=answer, legal_key=key, legal_h=asked_h, legal_ns=state.now_ns)


def _named(held: Held, outcome: Outcome, place: PlaceName | None) -> Held:
    """A country's name, kept for as long as it may be spoken of: the one behind the last border too, in two languages."""
    asked = outcome.arguments.get("situation")
    code = asked.get("jurisdiction") if isinstance(asked, dict) else None
    if place is None or not isinstance(asked, dict) or not isinstance(code, str):
        return held
    told = ToldPlace(code=code, language=spoken_language(str(asked.get("language", ""))), name=place)
    if told in held.places:
        return held
    others = tuple(each for each in held.places if (each.code, each.language) != (told.code, told.language))
    return msgspec.structs.replace(held, places=(*others, told)[-MOST_PLACES:])


MOST_PLACES = 4


def _raises(before: RulesAnswer, after: RulesAnswer) -> bool:
    """Whether an answer allows more than the one before."""
    return before.limit is not None and (after.limit is None or after.limit.mps > before.limit.mps)


def _meaning(held: Held, state: State, outcome: Outcome, meaning: SignMeaning) -> Held:
    if meaning.reading in PLACES:
        return msgspec.structs.replace(held, place=meaning, place_key=rules_question.key(outcome.arguments))
    held, limit = msgspec.structs.replace(held, meaning=meaning), meaning.limit
    if limit is None or not 1.0 <= limit.mps < math.inf or not outcome.arguments.get("candidates"):
        return held
    return msgspec.structs.replace(held, doubted_mps=limit.mps, doubted_for_ns=DOUBTED_NS)


def _right_of_way(held: Held, state: State, outcome: Outcome, answer: RulesAnswer) -> Held:
    return msgspec.structs.replace(held, right_of_way=answer, right_of_way_key=rules_question.key(outcome.arguments))


def _weather(held: Held, state: State, outcome: Outcome, conditions: Conditions) -> Held:
    stamp_ns = _answered_ns(outcome, state.now_ns)
    if not sane_conditions(conditions):
        return held
    if newer(stamp_ns, held.conditions_ns, state.now_ns):
        return msgspec.structs.replace(held, conditions=settle(held.conditions, conditions), conditions_ns=stamp_ns)
    if stamp_ns != held.conditions_ns or held.conditions is None:
        return held  # a late answer: the topic has told more since
    return msgspec.structs.replace(held, conditions=no_better(held.conditions, conditions))


def _health(held: Held, state: State, outcome: Outcome, health: VehicleHealth) -> Held:
    if not (math.isfinite(health.speed_factor) and math.isfinite(health.headway_factor)):
        return held
    held = msgspec.structs.replace(held, health=health)
    if fresh_ns(held.degradation_ns, VALID_NS["degradation"], state.now_ns):
        return held
    car = worse(held.degradation, health)  # the topic is silent: what the tool knows beyond it counts
    return msgspec.structs.replace(held, degradation=car) if car is not None and sane_health(car) else held


class _Taker(NamedTuple):
    """The type of a tool's answer, and what it changes."""

    kind: Any
    take: Callable[[Held, State, Outcome, Any], Held]


_TAKERS = {
    "applicable_limit": _Taker(RulesAnswer, _legal),
    "interpret_sign": _Taker(SignMeaning, _meaning),
    "right_of_way": _Taker(RulesAnswer, _right_of_way),
    "assess_weather": _Taker(Conditions, _weather),
    "vehicle_health": _Taker(VehicleHealth, _health),
}


# -- third parties -----------------------------------------------------------------------------------------------------


def _prolonged(held: Held, tool: str, until_ns: int) -> Held:
    """An expert that is asked and does not answer lifts nothing: its restriction stands for another while."""
    limiters = tuple(
        msgspec.structs.replace(each, until_ns=until_ns) if each.tool == tool else each for each in held.limiters
    )
    return msgspec.structs.replace(held, limiters=limiters)


def expert_limiter(tool: str, result: dict[str, Any], effect: Effect, until_ns: int) -> Limiter | None:
    """What a third party's result may do: lower the target, shrink the factor below 1, widen the headway above 1."""
    bounds = {
        "target_mps": _number(result, effect.target_mps_field, 0.0, math.inf),
        "speed_factor": _number(result, effect.speed_factor_field, 0.3, 1.0),
        "headway_factor": _number(result, effect.headway_factor_field, 1.0, 3.0),
    }
    given = {name: value for name, value in bounds.items() if value is not None}
    confidence, text = _number(result, effect.confidence_field, 0.0, 1.0), result.get(effect.text_field)
    if not given:
        return None
    return Limiter(
        tool=tool,
        until_ns=until_ns,
        confidence=0.5 if confidence is None else confidence,
        text=plain(text) if isinstance(text, str) else "",
        **given,
    )


def _number(result: dict[str, Any], field: str, low: float, high: float) -> float | None:
    """A field of a result between two bounds; None where it is no finite number, or the field has no name."""
    value = result.get(field) if field else None
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return min(high, max(low, number)) if math.isfinite(number) else None
