"""The Direct methods: no experts, no fusion. For each new event the front end answers one prompt, and its parsed answer is
what the driver is told. It advises only: the arbiter is not asked, and nothing brakes.

An answer that cannot be parsed advises nothing. A limit that was told stands until another one is.
"""

from typing import Any, NamedTuple

import msgspec

from proto.decision import Event, Fused, Reason, Urgency
from proto.rules import LegalLimit, Retrieved
from proto.scene import PromptAnswer
from proto.tools import Outcome
from services.orchestrator.answers import results, typed
from services.orchestrator.ask import Ask
from services.orchestrator.direct_context import context
from services.orchestrator.events import new
from services.orchestrator.fusion import is_new
from services.orchestrator.inputs import Method, Observations
from services.orchestrator.matter import Advised, Matter
from services.orchestrator.messages import say, toned
from services.orchestrator.routing import Call
from services.orchestrator.state import Direct, State, Told
from services.orchestrator.targets import Law, Target, cautious_mps
from services.orchestrator.text import plain
from services.orchestrator.units import limit_text, to_mps

PROMPT, RETRIEVE = "answer_prompt", "retrieve"
DEADLINE_MS = 60.0
LIMIT, HAZARD = "Which speed limit is in force here?", "Who is ahead in the path and comes nearer?"
QUERIES: dict[str, str] = {
    "closing_lead": HAZARD,
    "vulnerable_road_user": HAZARD,
    "stop_required": "Is there a stop sign, a give way sign or a red traffic light?",
    "jurisdiction_change": LIMIT,
    "dynamic_limit_update": LIMIT,
    "speed_limit_change": LIMIT,
    "uncertain_sign": LIMIT,
    "foreign_sign": "What does the sign with the foreign plate mean for the speed limit?",
}
"""Event to the query of its prompt, the gravest first. Events that only experts tell of (grip, the car) ask nothing."""
_CONTEXT = {"urban": "built-up area", "motorway": "motorway", "rural": "outside built-up areas"}


class Saying(NamedTuple):
    """How an action is said: phrase, urgency, topic."""

    phrase: str
    urgency: Urgency
    topic: str


SAYINGS: dict[str, Saying] = {
    "stop": Saying("stop_sign", "warning", "stop"),
    "give_way": Saying("caution", "advice", "stop"),
    "slow": Saying("caution", "advice", "slow"),
    "limit": Saying("limit", "advice", "limit"),
}
_HAZARDS = {"closing_lead": Saying("lead", "warning", "lead"), "pedestrian": Saying("person", "warning", "person")}


def advise(state: State, events: tuple[Event, ...], seen: Observations, ask: Ask) -> Advised:
    """Ask for the gravest new event, hear what has come, and put it into words."""
    kind = asked_for(new(events, state.now_ns))
    calls, outcomes = consult(QUERIES[kind], state, seen.method, ask) if kind else ((), ())
    state = msgspec.structs.replace(state, direct=_heard(state, (*seen.late, *outcomes), outcomes))
    goal = _goal(state)
    matter = _matter(state)
    return Advised(state, events, calls, outcomes, _fused(state, goal, matter), matter, goal)


def asked_for(events: tuple[Event, ...]) -> str:
    """The kind of event that is asked about; empty: none that a prompt could help with."""
    kinds = {event.kind for event in events}
    return next((kind for kind in QUERIES if kind in kinds), "")


# -- asking --------------------------------------------------------------------------------------------------------------


def consult(query: str, state: State, method: Method, ask: Ask) -> tuple[tuple[Call, ...], tuple[Outcome, ...]]:
    """Retrieve, where the method does, then ask; two waits, one after the other."""
    found, outcomes = retrieval(query, state, method), tuple[Outcome, ...]()
    if found:
        outcomes = ask.experts(found)
    prompt = prompt_call(query, state, method, outcomes)
    return (*found, prompt), (*outcomes, *ask.experts((prompt,)))


def retrieval(query: str, state: State, method: Method) -> tuple[Call, ...]:
    """The call that fetches passages; none where the method has none."""
    if not method.passages:
        return ()
    here, road = state.signs.jurisdiction, state.world.environment.road_type
    arguments: dict[str, Any] = {
        "query": query,
        "jurisdiction": here.value if here is not None else None,
        "language": "en",
        "k": method.passages,
        "road_context": _CONTEXT.get(road.value, road.value) if road is not None else "",
    }
    return (Call(tool=RETRIEVE, arguments=arguments, deadline_ms=DEADLINE_MS),)


def prompt_call(query: str, state: State, method: Method, outcomes: tuple[Outcome, ...]) -> Call:
    """The prompt, with the passages that came."""
    arguments = {"query": query, "context": context(state, method.context), "passages": _passages(outcomes)}
    return Call(tool=PROMPT, arguments=arguments, deadline_ms=DEADLINE_MS)


def _passages(outcomes: tuple[Outcome, ...]) -> list[str]:
    return [passage.excerpt for found in results(outcomes, RETRIEVE, Retrieved) for passage in found.passages]


# -- hearing -------------------------------------------------------------------------------------------------------------


def _heard(state: State, outcomes: tuple[Outcome, ...], now: tuple[Outcome, ...]) -> Direct:
    before_ms = sum(outcome.elapsed_ms for outcome in now if outcome.tool != PROMPT)
    told = [*state.direct.waiting]
    for outcome in outcomes:
        answer = typed(outcome, PromptAnswer) if outcome.tool == PROMPT and outcome.ok else None
        if answer is not None:
            told.append(_told(state, outcome, answer, before_ms))
    due = [each for each in told if each.due_ns <= state.now_ns and each.action != "none"]
    heard = due[-1] if due else None
    limit = next((each for each in reversed(due) if each.limit is not None), state.direct.limit)
    return Direct(waiting=tuple(each for each in told if each.due_ns > state.now_ns), heard=heard, limit=limit)


def _told(state: State, outcome: Outcome, answer: PromptAnswer, before_ms: float) -> Told:
    waited_ms = max(outcome.elapsed_ms, outcome.age_ms)
    query = str(outcome.arguments.get("query", ""))
    return Told(
        kind=next((kind for kind, each in QUERIES.items() if each == query), ""),
        action=answer.action,
        text=plain(answer.text),
        confidence=max(0.0, min(1.0, answer.score)),
        due_ns=state.now_ns + int(max(0.0, answer.took_ms - waited_ms) * 1e6),
        latency_ms=before_ms + max(waited_ms, answer.took_ms),
        limit=_limit(state, answer),
        hazard=answer.hazard if answer.hazard in _HAZARDS else "",
    )


def _limit(state: State, answer: PromptAnswer) -> LegalLimit | None:
    if answer.action != "limit" or answer.value is None or not 1.0 <= answer.value <= 150.0:
        return None
    units = state.world.environment.units
    unit = answer.unit or (units.value if units is not None else state.preferences.unit)
    return LegalLimit(value=answer.value, unit=unit, mps=to_mps(answer.value, unit))


# -- saying --------------------------------------------------------------------------------------------------------------


def _goal(state: State) -> Target:
    """The limit last told is all that bounds the target; before that, caution is what is not advised, but held."""
    told = state.direct.limit
    if told is None or told.limit is None:
        return Target(cautious_mps(state), Law(None, None, 0.0, "unknown"), 1.0, 1.0, ())
    return Target(told.limit.mps, Law(told.limit, told.limit.mps, told.confidence, "sign"), 1.0, 1.0, ())


def _matter(state: State) -> Matter | None:
    heard = state.direct.heard
    saying = _HAZARDS.get(heard.hazard) or SAYINGS.get(heard.action) if heard is not None else None
    if heard is None or saying is None:
        return None
    limit = limit_text(heard.limit, state.preferences.unit) if heard.limit is not None else ""
    return Matter(
        topic=saying.topic,
        key=f"{heard.action} {limit}{heard.hazard}",
        phrase=saying.phrase,
        urgency=saying.urgency,
        values={"limit": limit},
        hazard=heard.hazard,
        confidence=heard.confidence,
        repeat_s=20.0,
    )


def _fused(state: State, goal: Target, matter: Matter | None) -> Fused:
    preferences, heard = state.preferences, state.direct.heard
    directive = say(preferences, "directive", matter.phrase, **matter.values) if matter is not None else ""
    urgency: Urgency = matter.urgency if matter is not None else "info"
    text = heard.text if matter is not None and heard is not None else ""
    return Fused(
        target_mps=goal.mps if state.direct.limit is not None else None,
        legal_limit=goal.law.limit,
        headway_factor=1.0,
        directive=toned(preferences, directive, urgency),
        justification=text,
        confidence=heard.confidence if heard is not None else 0.0,
        urgency=urgency,
        topic=matter.topic if matter is not None else "",
        hazard=matter.hazard if matter is not None else "",
        reasons=(Reason(source="drivelm", text=text, confidence=matter.confidence),) if matter is not None else (),
        language=preferences.language,
        unit=preferences.unit,
        degraded=state.world.degraded,
        new_information=matter is not None and is_new(matter, state),
        muted=preferences.muted,
    )
