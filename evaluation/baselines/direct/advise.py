"""The Direct methods: no experts, no fusion. For each new event, and each new sign ahead that sets a limit or says to stop or
give way, the front end answers one prompt, and its parsed answer is what the driver is told. It advises only: the arbiter is
not asked, and nothing brakes.

An answer that cannot be parsed advises nothing. A limit that was told stands until another one is; one that begins ahead is
announced if it is lower, and holds only once its sign is passed and asked about.
"""

from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from typing import Annotated, Any, Literal, NamedTuple

import msgspec

from domain.units import legal_limit, limit_text
from evaluation.baselines.direct.context import context, shows_limit, signs_ahead
from evaluation.baselines.direct.memory import Direct, Told, kept, recalled
from evaluation.baselines.direct.prompt_answer import PromptAnswer
from proto.decision import Event, Fused, Reason, Urgency
from proto.messages import Kind
from proto.rules import LegalLimit, Retrieved
from proto.speech import News
from proto.tools import Outcome
from services.orchestrator.advisor import Advised
from services.orchestrator.events import new
from services.orchestrator.experts.answers import results, typed
from services.orchestrator.experts.ask import Ask
from services.orchestrator.experts.routing import Call
from services.orchestrator.observations.inputs import Observations
from services.orchestrator.speech.candidate import Candidate
from services.orchestrator.speech.candidates.limits_ahead import OVER_MPS
from services.orchestrator.speech.choice import is_new
from services.orchestrator.speech.local import PAUSE_S
from services.orchestrator.speech.wording import say, toned
from services.orchestrator.state import SignAhead, State
from services.orchestrator.target.target import Law, Target, cautious_mps
from services.orchestrator.text import plain

PROMPT, RETRIEVE = "answer_prompt", "retrieve"
DEADLINE_MS = 60.0
LIMIT, LIMIT_AHEAD = "Which speed limit is in force here?", "Which speed limit begins ahead?"
STOP = "Is there a stop sign, a give way sign or a red traffic light?"
QUERIES: dict[str, str] = {
    "vulnerable_road_user": "Is a pedestrian or cyclist ahead in the path?",
    "closing_lead": "Which vehicle is ahead in the path and comes nearer?",
    "stop_required": STOP,
    "jurisdiction_change": LIMIT,
    "dynamic_limit_update": LIMIT,
    "speed_limit_change": LIMIT,
    "uncertain_sign": LIMIT,
    "foreign_sign": "What does the sign with the foreign plate mean for the speed limit?",
    "stop_ahead": STOP,
    "limit_ahead": LIMIT_AHEAD,
}
"""Event, or kind of a sign ahead, to the query of its prompt, the gravest first; signs last, as they can wait for the next tick.
Events that only experts tell of (grip, the car) ask nothing."""
MOST_ASKED = 24
WAITS_NS = int(PAUSE_S * 1e9)
"""For so long a word waits for its turn: no longer than the pause after any other."""
_CONTEXT = {"urban": "built-up area", "motorway": "motorway", "rural": "outside built-up areas"}


class DirectSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """`orchestrator.method_settings` of a Direct method."""

    context: Literal["text", "json"] = "text"
    """In which form the prompt tells `world_state`."""
    passages: Annotated[int, msgspec.Meta(ge=0, le=10)] = 0
    """How many retrieved passages stand in the prompt; 0: retrieval is not asked."""

    @property
    def queries(self) -> Mapping[str, str]:
        """What is asked about which event or sign ahead, the gravest first."""
        return QUERIES


class Experts(NamedTuple):
    """What tools have told before the prompt, in sentences, and what the last of them took."""

    told: tuple[str, ...] = ()
    took_ms: float = 0.0


NO_EXPERTS = Experts()


class Saying(NamedTuple):
    """How an action is said."""

    phrase: str
    urgency: Urgency
    kind: Kind


SAYINGS: dict[str, Saying] = {
    "stop": Saying("stop_sign", "warning", Kind.STOP),
    "give_way": Saying("caution", "advice", Kind.GIVE_WAY),
    "slow": Saying("caution", "advice", Kind.SLOW),
    "limit": Saying("limit", "advice", Kind.LIMIT),
    "limit_ahead": Saying("limit_ahead", "info", Kind.AHEAD),
}
_HAZARDS = {
    "closing_lead": Saying("lead", "warning", Kind.LEAD),
    "pedestrian": Saying("person", "warning", Kind.PERSON),
}


def advise(
    state: State,
    events: tuple[Event, ...],
    seen: Observations,
    settings: DirectSettings,
    ask: Ask,
    experts: Experts = NO_EXPERTS,
) -> Advised:
    """Ask for the gravest that is new, hear what has come, and put it into words."""
    news = _news(state, events)
    query = asked_for(news | _unasked(state), settings.queries)
    calls, outcomes = consult(query, state, settings, ask, experts.told) if query else ((), ())
    before_ms = experts.took_ms + sum(outcome.elapsed_ms for outcome in outcomes if outcome.tool != PROMPT)
    heard = _heard(state, (*seen.late, *outcomes), before_ms, settings.queries)
    waits = tuple(kind for kind, each in settings.queries.items() if kind in news and each != query)
    noted = msgspec.structs.replace(heard, asked=_asked(state, query, settings.queries), passed_over=waits)
    state = kept(state, noted)
    goal = _goal(state)
    chosen = _candidate(state)
    took_ms = heard.heard.latency_ms if heard.heard is not None and not heard.heard.waited else None
    return Advised(state, events, calls, outcomes, _fused(state, goal, chosen), chosen, goal, latency_ms=took_ms)


def asked_for(kinds: AbstractSet[str], queries: Mapping[str, str]) -> str:
    """The query about the gravest of them; empty: none that a prompt could help with."""
    return next((query for kind, query in queries.items() if kind in kinds), "")


def _news(state: State, events: tuple[Event, ...]) -> set[str]:
    """Kinds of the new events, and of those that hold still and had to wait. To stop for a person is asked as `vulnerable_road_user`."""
    others = tuple(event for event in events if (event.kind, event.detail) != ("stop_required", "person"))
    waited = {event.kind for event in others if event.kind in recalled(state).passed_over}
    return waited | {event.kind for event in new(others, state.now_ns)}


def _unasked(state: State) -> set[str]:
    return {_kind(sign) for sign in signs_ahead(state) if (sign.track_id, sign.reading) not in recalled(state).asked}


def _asked(state: State, query: str, queries: Mapping[str, str]) -> tuple[tuple[int, str], ...]:
    """The signs ahead that were asked about, those of this query with them, as long as their track is there."""
    tracks = {sign.track_id for sign in state.signs.ahead}
    now = [(sign.track_id, sign.reading) for sign in signs_ahead(state) if query and queries.get(_kind(sign)) == query]
    return tuple(each for each in dict.fromkeys((*recalled(state).asked, *now)) if each[0] in tracks)[-MOST_ASKED:]


def _kind(sign: SignAhead) -> str:
    """As what a sign ahead is asked about; empty: as nothing."""
    if not sign.believed:
        return ""
    return "limit_ahead" if shows_limit(sign) else "stop_ahead" if sign.reading in ("stop", "yield") else ""


# -- asking --------------------------------------------------------------------------------------------------------------


def consult(
    query: str, state: State, settings: DirectSettings, ask: Ask, tools: tuple[str, ...] = ()
) -> tuple[tuple[Call, ...], tuple[Outcome, ...]]:
    """Retrieve, where the method does, then ask; two waits, one after the other."""
    found, outcomes = retrieval(query, state, settings), tuple[Outcome, ...]()
    if found:
        outcomes = ask.experts(found)
    prompt = prompt_call(query, state, settings, outcomes, tools)
    return (*found, prompt), (*outcomes, *ask.experts((prompt,)))


def retrieval(query: str, state: State, settings: DirectSettings) -> tuple[Call, ...]:
    """The call that fetches passages; none where the method has none."""
    if not settings.passages:
        return ()
    here, road = state.signs.jurisdiction, state.world.environment.road_type
    arguments: dict[str, Any] = {
        "query": query,
        "jurisdiction": here.value if here is not None else None,
        "language": "en",
        "k": settings.passages,
        "road_context": _CONTEXT.get(road.value, road.value) if road is not None else "",
    }
    return (Call(tool=RETRIEVE, arguments=arguments, deadline_ms=DEADLINE_MS),)


def prompt_call(
    query: str, state: State, settings: DirectSettings, outcomes: tuple[Outcome, ...], tools: tuple[str, ...] = ()
) -> Call:
    """The prompt, with the passages that came and what tools have told."""
    arguments = {"query": query, "context": context(state, settings.context), "passages": _passages(outcomes)}
    if tools:
        arguments["tools"] = list(tools)
    return Call(tool=PROMPT, arguments=arguments, deadline_ms=DEADLINE_MS)


def _passages(outcomes: tuple[Outcome, ...]) -> list[str]:
    return [passage.excerpt for found in results(outcomes, RETRIEVE, Retrieved) for passage in found.passages]


# -- hearing -------------------------------------------------------------------------------------------------------------


def _heard(state: State, outcomes: tuple[Outcome, ...], before_ms: float, queries: Mapping[str, str]) -> Direct:
    told = [*recalled(state).waiting]
    for outcome in outcomes:
        answer = typed(outcome, PromptAnswer) if outcome.tool == PROMPT and outcome.ok else None
        if answer is not None:
            told.append(_told(state, outcome, answer, before_ms, queries))
    due = [each for each in told if each.due_ns <= state.now_ns and each.action != "none"]
    heard = due[-1] if due else _unsaid(state)
    limit = next((each for each in reversed(due) if each.action == "limit" and each.limit), recalled(state).limit)
    return Direct(waiting=tuple(each for each in told if each.due_ns > state.now_ns), heard=heard, limit=limit)


def _unsaid(state: State) -> Told | None:
    """A limit whose words had to wait for another message's end; a hazard's do not, and soon it is too late for any other."""
    heard = recalled(state).heard
    if heard is None or heard.hazard or heard.limit is None or state.now_ns - heard.due_ns > WAITS_NS:
        return None
    if heard.action == "limit_ahead" and not any(_begins(sign, heard.limit) for sign in signs_ahead(state)):
        return None
    said = state.memory.last(SAYINGS[heard.action].kind)
    return None if said is not None and said.stamp_ns >= heard.due_ns else msgspec.structs.replace(heard, waited=True)


def _begins(sign: SignAhead, limit: LegalLimit) -> bool:
    return shows_limit(sign) and sign.value == limit.value


def _told(state: State, outcome: Outcome, answer: PromptAnswer, before_ms: float, queries: Mapping[str, str]) -> Told:
    waited_ms = max(outcome.elapsed_ms, outcome.age_ms)
    query = str(outcome.arguments.get("query", ""))
    begins_ahead = query == LIMIT_AHEAD and answer.action == "limit"
    return Told(
        kind=next((kind for kind, each in queries.items() if each == query), ""),
        action="limit_ahead" if begins_ahead else answer.action,
        text=plain(answer.text),
        confidence=max(0.0, min(1.0, answer.score)),
        due_ns=state.now_ns + int(max(0.0, answer.took_ms - waited_ms) * 1e6),
        latency_ms=before_ms + max(waited_ms, answer.took_ms),
        limit=_limit(state, answer),
        hazard=answer.hazard if answer.hazard in _HAZARDS else "",
    )


def _limit(state: State, answer: PromptAnswer) -> LegalLimit | None:
    if answer.action not in ("limit", "limit_ahead") or answer.value is None or not 1.0 <= answer.value <= 150.0:
        return None
    units = state.world.environment.units
    unit = answer.unit or (units.value if units is not None else state.preferences.unit)
    return legal_limit(answer.value, unit)


# -- saying --------------------------------------------------------------------------------------------------------------


def _goal(state: State) -> Target:
    """The limit last told is all that bounds the target; before that, caution is what is not advised, but held."""
    told = recalled(state).limit
    if told is None or told.limit is None:
        return Target(cautious_mps(state), Law(None, None, 0.0, "unknown"), 1.0, 1.0, ())
    return Target(told.limit.mps, Law(told.limit, told.limit.mps, told.confidence, "sign"), 1.0, 1.0, ())


def _candidate(state: State) -> Candidate | None:
    heard = recalled(state).heard
    saying = _HAZARDS.get(heard.hazard) or SAYINGS.get(heard.action) if heard is not None else None
    if heard is None or saying is None:
        return None
    limit = limit_text(heard.limit, state.preferences.unit) if heard.limit is not None else ""
    begins = heard.limit if heard.action == "limit_ahead" else None
    if heard.action == "limit_ahead" and (begins is None or not _lower(begins, state)):
        return None
    told = begins or heard.limit
    news = News(what=f"{heard.action} {heard.hazard}") if begins is None else News()
    return Candidate(
        kind=saying.kind,
        news=msgspec.structs.replace(news, value=told.value, unit=told.unit) if told is not None else news,
        phrase=saying.phrase,
        urgency=saying.urgency,
        values={"limit": limit},
        hazard=heard.hazard,
        confidence=heard.confidence,
        again_s=20.0,
        ahead_mps=begins.mps if begins is not None else None,
        limit_mps=heard.limit.mps if saying.kind is Kind.LIMIT and heard.limit is not None else None,
    )


def _lower(ahead: LegalLimit, state: State) -> bool:
    """Whether a limit ahead is below the one that stands or below the speed; where neither is known, too."""
    standing, ego = recalled(state).limit, state.world.ego.speed_mps
    now_mps = [standing.limit.mps] if standing is not None and standing.limit is not None else []
    now_mps += [ego.value] if ego is not None else []
    return not now_mps or ahead.mps < max(now_mps) - OVER_MPS


def _fused(state: State, goal: Target, chosen: Candidate | None) -> Fused:
    preferences, heard = state.preferences, recalled(state).heard
    directive = say(preferences, "directive", chosen.phrase, **chosen.values) if chosen is not None else ""
    urgency: Urgency = chosen.urgency if chosen is not None else "info"
    text = heard.text if chosen is not None and heard is not None else ""
    return Fused(
        target_mps=goal.mps if recalled(state).limit is not None else None,
        legal_limit=goal.law.limit,
        headway_factor=1.0,
        directive=toned(preferences, directive, urgency),
        justification=text,
        confidence=heard.confidence if heard is not None else 0.0,
        urgency=urgency,
        topic=chosen.topic if chosen is not None else "",
        hazard=chosen.hazard if chosen is not None else "",
        reasons=(Reason(source="drivelm", text=text, confidence=chosen.confidence),) if chosen is not None else (),
        language=preferences.language,
        unit=preferences.unit,
        degraded=state.world.degraded,
        new_information=chosen is not None and is_new(chosen, state.memory, state.now_ns),
        muted=preferences.muted,
        ahead_mps=chosen.ahead_mps if chosen is not None else None,
        told_limit_mps=chosen.limit_mps if chosen is not None else None,
        asked_mps=goal.mps if chosen is not None and recalled(state).limit is not None else None,
    )
