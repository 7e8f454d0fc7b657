"""What the experts' answers change in the state: typed, checked, and only where they may."""

import math
from collections.abc import Callable
from typing import Any, TypeVar

import msgspec

from proto.rules import RulesAnswer, SignMeaning
from proto.tools import Effect, Outcome
from proto.vehicle import VehicleHealth
from proto.weather import Conditions
from services.orchestrator.law import rules_question
from services.orchestrator.law.limits_ahead import PLACES
from services.orchestrator.observations.validity import EXPERT_VALID_NS, VALID_NS, fresh_ns, newer, sane_health
from services.orchestrator.signs.limits import SURE
from services.orchestrator.state import Cached, Held, Limiter, State
from services.orchestrator.text import plain
from services.orchestrator.world.car_faults import worse
from services.orchestrator.world.conditions import no_better, sane_conditions, settle

S = TypeVar("S")
KEPT = 24
LATE_SERVES_MS = 2000.0


def take(state: State, outcomes: tuple[Outcome, ...]) -> State:
    """The state with all usable answers taken in, and every question noted as asked."""
    held, asked = state.held, state.asked
    for outcome in outcomes:
        if outcome.ok and outcome.age_ms <= LATE_SERVES_MS:
            held = _take_one(held, state, outcome)
        elif not outcome.ok:
            held = _prolonged(held, outcome.tool, state.now_ns)
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
    stamp_ns = now_ns - int(outcome.age_ms * 1e6)
    entry = Cached(
        tool=outcome.tool, arguments_sha256=rules_question.key(outcome.arguments), stamp_ns=stamp_ns, ok=outcome.ok
    )
    others = tuple(
        each
        for each in asked
        if (each.tool, each.arguments_sha256) != (entry.tool, entry.arguments_sha256)
        and not (outcome.ok and each.tool == entry.tool and not each.ok)
    )
    return (*others, entry)[-KEPT:]


def _take_one(held: Held, state: State, outcome: Outcome) -> Held:
    taker = _TAKERS.get(outcome.tool)
    if taker is not None:
        return taker(held, state, outcome)
    effect = dict(state.effects).get(outcome.tool)
    return held if effect is None else _take_expert(held, state, outcome, effect)


def _legal(held: Held, state: State, outcome: Outcome) -> Held:
    answer = typed(outcome, RulesAnswer)
    if answer is None or not rules_question.sane_limit(answer):
        return held
    key = rules_question.key(outcome.arguments)
    if key != rules_question.key(rules_question.situation_arguments(state)):
        return held  # a late answer to another question than today's
    if held.legal is not None and raises(held.legal, answer) and answer.confidence < SURE / 2.0:
        return held
    return msgspec.structs.replace(held, legal=answer, legal_key=key, legal_ns=state.now_ns)


def raises(before: RulesAnswer, after: RulesAnswer) -> bool:
    """Whether an answer allows more than the one before."""
    if before.limit is None:
        return False
    return after.limit is None or after.limit.mps > before.limit.mps


def _meaning(held: Held, state: State, outcome: Outcome) -> Held:
    meaning = typed(outcome, SignMeaning)
    if meaning is None:
        return held
    if meaning.reading in PLACES:
        return msgspec.structs.replace(held, place=meaning, place_key=rules_question.key(outcome.arguments))
    held = msgspec.structs.replace(held, meaning=meaning)
    doubted = bool(outcome.arguments.get("candidates"))
    if not doubted or meaning.limit is None or not math.isfinite(meaning.limit.mps) or meaning.limit.mps < 1.0:
        return held
    return msgspec.structs.replace(held, doubted_mps=meaning.limit.mps, doubted_until_ns=state.now_ns + 10_000_000_000)


def _right_of_way(held: Held, state: State, outcome: Outcome) -> Held:
    answer = typed(outcome, RulesAnswer)
    if answer is None:
        return held
    return msgspec.structs.replace(held, right_of_way=answer, right_of_way_key=rules_question.key(outcome.arguments))


def _weather(held: Held, state: State, outcome: Outcome) -> Held:
    conditions = typed(outcome, Conditions)
    if conditions is None or not sane_conditions(conditions):
        return held
    stamp_ns = state.now_ns - int(outcome.age_ms * 1e6)
    if newer(stamp_ns, held.conditions_ns, state.now_ns):
        return msgspec.structs.replace(held, conditions=settle(held.conditions, conditions), conditions_ns=stamp_ns)
    if stamp_ns != held.conditions_ns or held.conditions is None:
        return held  # a late answer: the topic has told more since
    return msgspec.structs.replace(held, conditions=no_better(held.conditions, conditions))


def _health(held: Held, state: State, outcome: Outcome) -> Held:
    health = typed(outcome, VehicleHealth)
    if health is None or not (math.isfinite(health.speed_factor) and math.isfinite(health.headway_factor)):
        return held
    held = msgspec.structs.replace(held, health=health)
    if fresh_ns(held.degradation_ns, VALID_NS["degradation"], state.now_ns):
        return held
    car = worse(held.degradation, health)  # the topic is silent: what the tool knows beyond it counts
    return msgspec.structs.replace(held, degradation=car) if car is not None and sane_health(car) else held


def _prolonged(held: Held, tool: str, now_ns: int) -> Held:
    """An expert that is asked and does not answer lifts nothing: its restriction stands for another while."""
    until_ns = now_ns + EXPERT_VALID_NS
    limiters = (
        msgspec.structs.replace(each, until_ns=until_ns) if each.tool == tool else each for each in held.limiters
    )
    return msgspec.structs.replace(held, limiters=tuple(limiters))


def _take_expert(held: Held, state: State, outcome: Outcome, effect: Effect) -> Held:
    limiter = expert_limiter(outcome.tool, outcome.result or {}, effect, state.now_ns + EXPERT_VALID_NS)
    others = tuple(each for each in held.limiters if each.tool != outcome.tool)
    return msgspec.structs.replace(held, limiters=(*others, limiter)) if limiter is not None else held


def expert_limiter(tool: str, result: dict[str, Any], effect: Effect, until_ns: int) -> Limiter | None:
    """What a third party's result may do: lower the target, shrink the factor below 1, widen the headway above 1."""
    target = _number(result.get(effect.target_mps_field)) if effect.target_mps_field else None
    speed = _number(result.get(effect.speed_factor_field)) if effect.speed_factor_field else None
    headway = _number(result.get(effect.headway_factor_field)) if effect.headway_factor_field else None
    if target is None and speed is None and headway is None:
        return None
    confidence = _number(result.get(effect.confidence_field)) if effect.confidence_field else None
    return Limiter(
        tool=tool,
        until_ns=until_ns,
        confidence=min(1.0, max(0.0, confidence if confidence is not None else 0.5)),
        target_mps=max(0.0, target) if target is not None else None,
        speed_factor=min(1.0, max(0.3, speed)) if speed is not None else 1.0,
        headway_factor=min(3.0, max(1.0, headway)) if headway is not None else 1.0,
        text=_words(result.get(effect.text_field)) if effect.text_field else "",
    )


def _words(value: object) -> str:
    return plain(value) if isinstance(value, str) else ""


def _number(value: object) -> float | None:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


_TAKERS: dict[str, Callable[[Held, State, Outcome], Held]] = {
    "applicable_limit": _legal,
    "interpret_sign": _meaning,
    "right_of_way": _right_of_way,
    "assess_weather": _weather,
    "vehicle_health": _health,
}
