"""From events to calls: which tool, with which arguments, and whether the answer at hand still serves."""

from collections.abc import Callable
from typing import Any, NamedTuple

import msgspec

from proto.decision import Event
from proto.rules import RightOfWayQuestion, RulesAnswer
from services.orchestrator.events import BY_TOOL, TOOLS, foreign_sign
from services.orchestrator.law import rules_question
from services.orchestrator.law.limits_ahead import PLACES, places_ahead, sign_question
from services.orchestrator.observations.inputs import Expert
from services.orchestrator.state import State
from services.orchestrator.world.actors import pedestrian
from services.orchestrator.world.car_faults import covered

REFRESHES = {"legal_limit": "applicable_limit", "conditions": "assess_weather", "degradation": "vehicle_health"}
RETRY_NS = 500_000_000
"""After a failure a tool is not asked for so long: a dead service must not cost every tick its time."""
PATIENT = frozenset({"vehicle_health", "right_of_way"})
"""So are these after an answer that does not serve: it lacks what the car tells, or its question comes and goes with a person."""


class Call(msgspec.Struct, frozen=True, kw_only=True):
    """One call of a tick."""

    tool: str
    arguments: dict[str, Any]
    deadline_ms: float
    events: tuple[str, ...] = ()
    """Because of which events."""


class ToolRow(NamedTuple):
    """How a tool is asked: the arguments it needs (None: nothing to ask now), its deadline, how long its answer serves."""

    arguments: Callable[[State], dict[str, Any] | None]
    deadline_ms: float
    serves_s: float


def route(events: tuple[Event, ...], state: State, experts: tuple[Expert, ...]) -> tuple[Call, ...]:
    """The calls of this tick: each tool once, none whose question is answered, none that just failed."""
    rows = TOOL_TABLE | {x.tool: ToolRow(_nothing, x.deadline_ms, EXPERT_SERVES_S) for x in experts}
    because, calls = _because(events, experts), []
    for tool in sorted(because.keys() & rows.keys()):
        row, arguments = rows[tool], rows[tool].arguments(state)
        if arguments is not None and not _answered(state, tool, arguments, row.serves_s):
            kinds = tuple(because[tool])
            calls.append(Call(tool=tool, arguments=arguments, deadline_ms=row.deadline_ms, events=kinds))
    return tuple(calls)


def failing(events: tuple[Event, ...], state: State, experts: tuple[Expert, ...]) -> tuple[str, ...]:
    """Tools that these events route to and that failed, in this tick or so lately that they are not asked in it."""
    late = {each.tool for each in state.asked if not each.ok and 0 <= state.now_ns - each.stamp_ns < RETRY_NS}
    return tuple(sorted(late & _because(events, experts).keys()))


def _because(events: tuple[Event, ...], experts: tuple[Expert, ...]) -> dict[str, list[str]]:
    """Each tool that events route to, with their kinds."""
    because: dict[str, list[str]] = {}
    for event in events:
        own = _stale_tools(event) if event.kind == "stale_fact" else TOOLS[event.kind]
        for tool in (*own, *(x.tool for x in experts if event.kind in x.answers)):
            because.setdefault(tool, []).append(event.kind)
    return because


def _stale_tools(event: Event) -> tuple[str, ...]:
    """Only those facts are asked for again that are stale."""
    names = event.detail.split()
    experts = (name.removeprefix(BY_TOOL) for name in names if name.startswith(BY_TOOL))
    return (*(REFRESHES[name] for name in names if name in REFRESHES), *experts)


def _answered(state: State, tool: str, arguments: dict[str, Any], serves_s: float) -> bool:
    """Whether the same question was answered recently, or the tool failed within `RETRY_NS`."""
    sha = rules_question.key(arguments)
    for asked in (each for each in state.asked if each.tool == tool):
        age_ns = state.now_ns - asked.stamp_ns
        if not asked.ok and age_ns < RETRY_NS:
            return True
        if asked.ok and asked.arguments_sha256 == sha and age_ns < serves_s * 1e9:
            return _at_hand(state, tool, arguments, sha) or (tool in PATIENT and age_ns < RETRY_NS)
    return False


def _at_hand(state: State, tool: str, arguments: dict[str, Any], sha: str) -> bool:
    """Whether it is this question's answer that is held, and not a later one's nor one about other faults."""
    held = state.held
    if tool == "vehicle_health":
        return covered(held)
    if tool == "interpret_sign" and arguments["reading"] not in PLACES:
        return held.meaning is not None and held.meaning.reading == arguments["reading"]
    keys = {"right_of_way": held.right_of_way_key, "applicable_limit": held.legal_key, "interpret_sign": held.place_key}
    return keys.get(tool, sha) == sha


# -- arguments ---------------------------------------------------------------------------------------------------------


def _nothing(state: State) -> dict[str, Any]:
    return {}


def _language(state: State) -> dict[str, Any]:
    return {"language": state.preferences.language}


def _sign(state: State) -> dict[str, Any] | None:
    """The sign to be explained: a doubted one, else a place whose limit is unknown, else one with a plate in a foreign language."""
    doubted = [s for s in state.signs.ahead if s.doubted_limit]
    places = [s for s in places_ahead(state) if state.held.place_key != rules_question.key(sign_question(state, s))][:1]
    sign = max(doubted or places, key=lambda each: (each.seen_ns, each.track_id), default=foreign_sign(state))
    return sign_question(state, sign) if sign is not None else None


def right_of_way(state: State) -> RulesAnswer | None:
    """The answer on the junction ahead; None where it is on another one, or on another moment of it."""
    arguments, held = _junction(state), state.held
    asked = arguments is not None and held.right_of_way_key == rules_question.key(arguments)
    return held.right_of_way if asked else None


def _junction(state: State) -> dict[str, Any] | None:
    """Only where a sign, a light or a crossing gives the law something to go by."""
    light = state.light.state if state.light is not None and not state.light.lost_at_line else None
    signs = tuple(s.reading for s in state.signs.ahead if s.believed and s.reading in JUNCTION_SIGNS)
    if state.stop_kind == "crossing" and "crossing" not in signs:
        signs = (*signs, "crossing")
    if not signs and light is None:
        return None
    # An unseen person is not an absent one: only a tick with tracks can say so.
    person = pedestrian(state.world) is not None or (None if state.world.actors is None else False)
    question = RightOfWayQuestion(
        jurisdiction=state.place,
        signs=signs,
        light=light,  # type: ignore[arg-type]
        pedestrians_on_crossing=person,
        language=state.preferences.language,
    )
    return {"question": msgspec.to_builtins(question)}


def _new_law(state: State) -> dict[str, Any] | None:
    if state.signs.country is None:
        return None
    query = "speed limits, units and side of the road in this country"
    return {"query": query, "jurisdiction": state.place, "language": state.preferences.language}


JUNCTION_SIGNS = frozenset({"stop", "yield", "priority_road", "priority_here", "crossing"})
EXPERT_SERVES_S = 2.0
TOOL_TABLE: dict[str, ToolRow] = {
    "applicable_limit": ToolRow(rules_question.situation_arguments, 40.0, 30.0),
    "interpret_sign": ToolRow(_sign, 40.0, 30.0),
    "right_of_way": ToolRow(_junction, 40.0, 5.0),
    "lookup_rule": ToolRow(_new_law, 60.0, 60.0),
    "assess_weather": ToolRow(_nothing, 40.0, 5.0),
    "vehicle_health": ToolRow(_language, 40.0, 5.0),
    "read_dtcs": ToolRow(_language, 40.0, 10.0),
}
