"""The answer to a driver's question, out of the running drive and what was asked just now. Pure."""

import re
from typing import NamedTuple, TypeVar

import msgspec

from domain.units import limit_text
from proto.decision import Preferences
from proto.rules import Citation, RulesAnswer, SignMeaning
from proto.tools import Outcome
from proto.vehicle import VehicleHealth
from proto.weather import Conditions
from services.orchestrator.driver.question import Subject, sign_asked_about
from services.orchestrator.experts.answers import degraded, failed, results
from services.orchestrator.signs.limits import in_force
from services.orchestrator.speech.wording import distance, drive, evidence_in_words, phrases, say, speed, word
from services.orchestrator.state import State
from services.orchestrator.target.target import target
from services.orchestrator.text import plain, sentences

S = TypeVar("S")
MOST_CITATIONS = 6

CONTRADICTED = 0.5
"""At most as sure as this where the car and the driver contradict each other."""
SOUND_BRAKES = 0.98
"""Share of braking from which nothing is said of it."""
MOST_CODES = 3
GRAVITY = {"note": 0, "service": 1, "careful": 2, "stop_soon": 3, "stop_now": 4}
"""Severities of trouble codes; one that is not known here counts as the gravest."""


class ToolUse(msgspec.Struct, frozen=True, kw_only=True):
    """A tool that was asked for an answer."""

    tool: str
    status: str
    elapsed_ms: float


class Answer(msgspec.Struct, frozen=True, kw_only=True):
    """What the driver is told, and what it rests on."""

    text: str
    subject: Subject
    citations: tuple[Citation, ...]
    confidence: float
    target_mps: float | None
    tools: tuple[ToolUse, ...]
    language: str
    degraded: tuple[str, ...] = ()


class Told(NamedTuple):
    """Sentences with how sure they are and where they stand."""

    lines: tuple[str, ...]
    confidence: float
    citations: tuple[Citation, ...] = ()


def answer(question: str, subject: Subject, state: State, outcomes: tuple[Outcome, ...]) -> Answer:
    """Text with citations, from the drive's state and what was answered just now."""
    told = _units(question, state, outcomes) if subject == "units" else _TELL[subject](state, outcomes)
    citations: dict[tuple[str, int, int], Citation] = {}
    for each in told.citations:
        citations.setdefault((each.document, each.start, each.end), each)
    goal = target(state)
    return Answer(
        text=" ".join(told.lines) or say(state.preferences, "ask", "nothing"),
        subject=subject,
        citations=tuple(citations.values())[:MOST_CITATIONS],
        confidence=max(0.0, min(1.0, told.confidence)),
        target_mps=goal.mps,
        tools=used(outcomes),
        language=state.preferences.language,
        degraded=degraded(state, failed(outcomes)),
    )


def used(outcomes: tuple[Outcome, ...]) -> tuple[ToolUse, ...]:
    """The tools that were asked, as an answer names them."""
    return tuple(ToolUse(tool=o.tool, status=o.status, elapsed_ms=round(o.elapsed_ms, 2)) for o in outcomes)


def _result(outcomes: tuple[Outcome, ...], tool: str, kind: type[S]) -> S | None:
    return next(iter(results(outcomes, tool, kind)), None)


def _law_found(outcomes: tuple[Outcome, ...]) -> RulesAnswer | None:
    """The first answer that cites something; without one the first."""
    found = results(outcomes, "lookup_rule", RulesAnswer)
    return next((each for each in found if each.citations), found[0] if found else None)


def _weather_line(state: State, outcomes: tuple[Outcome, ...]) -> str:
    preferences = state.preferences
    conditions = _result(outcomes, "assess_weather", Conditions) or state.held.conditions
    if conditions is None:
        return say(preferences, "ask", "weather_unknown")
    grip = word(preferences, "little" if conditions.mu_low < 0.35 else "reduced" if conditions.mu_low < 0.7 else "full")
    sight = conditions.visibility_m
    told = say(
        preferences,
        "ask",
        "weather",
        mu=grip,
        low=f"{conditions.mu_low:.2f}",
        high=f"{conditions.mu_high:.2f}",
        sight=_sight(preferences, sight),
        target=drive(preferences, target(state).mps),
    )
    return " ".join([told, *_stopping(preferences, conditions)])


def _sight(preferences: Preferences, metres: float | None) -> str:
    return say(preferences, "ask", "sight_unknown") if metres is None else distance(preferences, metres)


def _stopping(preferences: Preferences, conditions: Conditions) -> list[str]:
    """What the speed follows from: the way to a stop, beside what can be seen or beside a dry road's."""
    reference, stop, usual = conditions.reference_speed_mps, conditions.stopping_m, conditions.usual_stopping_m
    if reference is None or stop is None or usual is None or conditions.bounded_by == "none":
        return []
    values = {
        "speed": speed(preferences, reference),
        "stop": distance(preferences, stop),
        "usual": distance(preferences, usual),
        "sight": _sight(preferences, conditions.visibility_m),
        "gust": speed(preferences, conditions.gust_mps or 0.0),
    }
    found = [say(preferences, "ask", f"stop_{conditions.bounded_by}", **values)]
    return [*found, say(preferences, "ask", "sources_disagree")] if conditions.disagree else found


def _sign(state: State, outcomes: tuple[Outcome, ...]) -> Told:
    preferences, sign = state.preferences, sign_asked_about(state)
    if sign is None:
        return Told((say(preferences, "ask", "no_sign"), _weather_line(state, outcomes)), 0.5)
    meaning = _result(outcomes, "interpret_sign", SignMeaning)
    if meaning is None:
        return Told((say(preferences, "ask", "no_rules"), _weather_line(state, outcomes)), 0.2)
    lines = [say(preferences, "ask", "sign", meaning=meaning.meaning.rstrip("."))]
    if not sign.believed and sign.candidates:
        names = word(preferences, "or").join(c.reading for c in sign.candidates[:3])
        lines.append(say(preferences, "ask", "unsure", candidates=names))
    if meaning.limit is not None:
        lines.append(say(preferences, "ask", "sign_limit", limit=limit_text(meaning.limit, preferences.unit)))
    if meaning.legal_action == "stop":
        lines.append(say(preferences, "ask", "sign_stop"))
    lines += [plain(meaning.note)] if meaning.note else []
    lines.append(_weather_line(state, outcomes))
    return Told(tuple(lines), min(meaning.confidence, sign.confidence), meaning.citations)


def _limit_line(state: State, answered: RulesAnswer | None) -> str:
    preferences = state.preferences
    limit = answered.limit if answered is not None else target(state).law.limit
    if limit is None:
        return say(preferences, "ask", "limit_unknown")
    other = "km/h" if limit.unit == "mph" else "mph"
    converted = speed(msgspec.structs.replace(preferences, unit=other), limit.mps)
    return say(preferences, "ask", "limit_here", limit=f"{limit.value:g} {limit.unit}", converted=converted)


_ASKED_UNIT = {"mph": re.compile(r"mph|mile|meile", re.I), "km/h": re.compile(r"km|kph|kilomet", re.I)}


def _units(question: str, state: State, outcomes: tuple[Outcome, ...]) -> Told:
    preferences, signs = state.preferences, state.signs
    answered = _result(outcomes, "applicable_limit", RulesAnswer)
    law = _law_found(outcomes)
    here = signs.jurisdiction
    unit = signs.units.value if signs.units is not None else None
    if unit is None and answered is not None and answered.limit is not None:
        unit = answered.limit.unit
    if here is None or unit is None:
        return Told((say(preferences, "ask", "units_unknown"), _limit_line(state, answered)), 0.3)
    asked = [name for name, pattern in _ASKED_UNIT.items() if pattern.search(question)]
    phrase = "units" if len(asked) != 1 else "units_yes" if asked[0] == unit else "units_no"
    lines = [say(preferences, "ask", phrase, country=here.value, unit=unit)]
    if here.assumed:
        lines.append(say(preferences, "ask", "assumed"))
    if signs.former_jurisdiction:
        told = evidence_in_words(preferences, here.evidence)
        phrase = "switched_told" if told else "switched"
        lines.append(say(preferences, "ask", phrase, former=signs.former_jurisdiction, evidence=told))
    lines.append(_limit_line(state, answered))
    citations = (*(answered.citations if answered else ()), *(law.citations if law else ()))
    sure = min(here.confidence, answered.confidence if answered is not None else 0.4)
    return Told(tuple(lines), sure, citations)


def _change(state: State, outcomes: tuple[Outcome, ...]) -> Told:
    preferences = state.preferences
    answered = _result(outcomes, "applicable_limit", RulesAnswer)
    law = _law_found(outcomes)
    lines = [_why_changed(state), _limit_line(state, answered), _weather_line(state, outcomes)]
    lines.append(say(preferences, "ask", "recommend", target=drive(preferences, target(state).mps)))
    citations = (*(answered.citations if answered else ()), *(law.citations if law else ()))
    return Told(tuple(lines), answered.confidence if answered is not None else 0.3, citations)


def _why_changed(state: State) -> str:
    preferences, signs = state.preferences, state.signs
    gantry = signs.gantry
    newest = max(in_force(signs), key=lambda each: each.since_ns, default=None)
    if gantry is not None and (newest is None or newest.since_ns <= gantry.since_ns):
        shown = f"{gantry.posted.value:g} {gantry.posted.unit}"
        return say(preferences, "ask", "changed_gantry", limit=shown)
    if newest is not None and newest.since_ns == signs.changed_ns:
        ago = (state.now_ns - newest.since_ns) / 1e9
        limit = f"{newest.posted.value:g} {newest.posted.unit}"
        return say(preferences, "ask", "changed_sign", ago=f"{ago:.0f}", limit=limit)
    if signs.ended:
        return say(preferences, "ask", "changed_ended", reading=signs.ended[-1])
    return say(preferences, "ask", "changed_none")


def _lamp(state: State, outcomes: tuple[Outcome, ...]) -> Told:
    """The lamp, the codes, what they mean for driving now, what to do next, and the rule that applies."""
    preferences, car = state.preferences, state.held.degradation
    health = _result(outcomes, "vehicle_health", VehicleHealth)
    law = _law_found(outcomes)
    citations = law.citations if law is not None else ()
    lamps = health.warning_lamps if health is not None else car.warning_lamps if car is not None else ()
    lit = (
        say(preferences, "ask", "lamp", lamps=_lamp_names(state, lamps))
        if lamps
        else say(preferences, "ask", "lamp_none")
    )
    if health is None:
        silent = (say(preferences, "ask", "no_health"), say(preferences, "ask", "safe_unknown"))
        return Told((lit, *silent, *_rule(state, law)), 0.2, citations)
    # the driver sees a lamp and the car knows of none: they contradict each other, and the careful one counts
    contradicted = not lamps and not health.dtcs and health.safe_to_drive == "yes"
    lines = (lit, *_meaning(state, health, contradicted=contradicted), *_next_steps(state, health), *_rule(state, law))
    confidence = min(health.confidence, CONTRADICTED) if contradicted else health.confidence
    return Told(lines, confidence, citations)


def _lamp_names(state: State, lamps: tuple[str, ...]) -> str:
    """Lamps by the words of the dashboard; one that has none by its own name."""
    words = phrases(state.preferences.language)["lamp"]
    return ", ".join(words.get(lamp, lamp) for lamp in lamps)


def _meaning(state: State, health: VehicleHealth, *, contradicted: bool) -> tuple[str, ...]:
    preferences = state.preferences
    safe = "safe_contradicted" if contradicted else f"safe_{health.safe_to_drive}"
    known = safe in phrases(preferences.language)["ask"]
    line = say(preferences, "ask", safe if known else "safe_unknown", target=drive(preferences, target(state).mps))
    brakes = health.brake_envelope
    if brakes is None or brakes >= SOUND_BRAKES:
        return (line,)
    shown = {"share": f"{100 * brakes:.0f}", "gap": f"{health.headway_factor:.1f}"}
    return (line, say(preferences, "ask", "brakes_weak", **shown))


def _next_steps(state: State, health: VehicleHealth) -> list[str]:
    """The gravest codes with what to do about each; without any, the car's own advice."""
    preferences = state.preferences
    gravest = sorted(health.dtcs, key=lambda dtc: -GRAVITY.get(dtc.severity, len(GRAVITY)))[:MOST_CODES]
    told = [
        say(preferences, "ask", "code", code=dtc.code, summary=dtc.summary.rstrip("."), step=dtc.next_step)
        for dtc in gravest
    ]
    if more := len(health.dtcs) - len(gravest):
        told.append(say(preferences, "ask", "codes_more", more=more))
    return told or ([f"{sentences(health.advice, 400)}."] if health.advice and health.safe_to_drive != "yes" else [])


def _rule(state: State, law: RulesAnswer | None) -> tuple[str, ...]:
    """What the law says of it, with its section; that nobody answered, where nobody did."""
    if law is None:
        return (say(state.preferences, "ask", "no_rules"),)
    if not law.note or not law.citations:
        return ()
    section = law.citations[0].section
    return (f"{say(state.preferences, 'ask', 'rule', section=section)} {plain(law.note, 400)}",)


def _limit(state: State, outcomes: tuple[Outcome, ...]) -> Told:
    answered = _result(outcomes, "applicable_limit", RulesAnswer)
    lines = (_limit_line(state, answered), _weather_line(state, outcomes))
    citations = answered.citations if answered is not None else ()
    return Told(lines, answered.confidence if answered is not None else 0.3, citations)


def _law(state: State, outcomes: tuple[Outcome, ...]) -> Told:
    preferences = state.preferences
    law = _law_found(outcomes)
    if law is None:
        return Told((say(preferences, "ask", "no_rules"),), 0.0)
    text = plain(law.note, 600)
    lines = (text,) if text else (say(preferences, "ask", "nothing"),)
    return Told(lines, law.confidence, law.citations)


_TELL = {"sign": _sign, "change": _change, "lamp": _lamp, "limit": _limit, "law": _law}
