"""The answer to a driver's question, out of the running drive and what was asked just now. Pure."""

import re
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import msgspec

from domain.units import limit_text, spoken
from proto.decision import Advisory
from proto.rules import Citation, RulesAnswer, SignMeaning
from proto.tools import Outcome
from proto.vehicle import VehicleHealth
from proto.weather import Conditions
from services.orchestrator.driver.question import Subject, sign_asked_about
from services.orchestrator.experts.answers import degraded, failed, results
from services.orchestrator.signs.limits import in_force
from services.orchestrator.speech.wording import (
    decimal,
    distance,
    drive,
    evidence_in_words,
    grip_word,
    phrases,
    place_name,
    reading_words,
    say,
    speed,
    word,
)
from services.orchestrator.state import State
from services.orchestrator.target.target import marked, target
from services.orchestrator.text import plain, sentences

S = TypeVar("S")
MOST_CITATIONS = 6
CONTRADICTED = 0.5
"""The most confidence where the car and the driver contradict each other."""
SOUND_BRAKES = 0.98
"""Share of braking from which it is not mentioned."""
MOST_CODES = 3
GRAVITY = {"note": 0, "service": 1, "careful": 2, "stop_soon": 3, "stop_now": 4}
"""Severities of trouble codes; an unknown one counts as the gravest."""
_ASKED_UNIT = {"mph": re.compile(r"mph|mile|meile", re.I), "km/h": re.compile(r"km|kph|kilomet", re.I)}


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


class _Asked(NamedTuple):
    """A question, the drive in which it is asked, and what the tools answered to it."""

    question: str
    state: State
    outcomes: tuple[Outcome, ...]

    def say(self, phrase: str, **values: object) -> str:
        """One phrase of an answer."""
        return say(self.state.preferences, "ask", phrase, **values)

    def result(self, tool: str, kind: type[S]) -> S | None:
        """The first answer of a tool."""
        return next(iter(results(self.outcomes, tool, kind)), None)

    @property
    def limit(self) -> RulesAnswer | None:
        """The limit that applies, as answered just now."""
        answered = self.result("applicable_limit", RulesAnswer)
        return marked(self.state, answered) if answered is not None else None

    @property
    def law(self) -> RulesAnswer | None:
        """The first passage of law that cites something; without one the first."""
        found = results(self.outcomes, "lookup_rule", RulesAnswer)
        return next((each for each in found if each.citations), next(iter(found), None))

    def say_target(self, phrase: str, **values: object) -> str:
        """A phrase with the target speed in the driver's unit; its open form where only an assumed law bounds it."""
        mps = target(self.state).told_mps
        if mps is None:
            return self.say(f"{phrase}_open", **values)
        return self.say(phrase, target=drive(self.state.preferences, mps), **values)


def answer(question: str, subject: Subject, state: State, outcomes: tuple[Outcome, ...]) -> Answer:
    """Text with citations, from the drive's state and what was answered just now."""
    asked = _Asked(question, state, outcomes)
    told = _TELL[subject](asked)
    citations: dict[tuple[str, int, int], Citation] = {}
    for each in told.citations:
        citations.setdefault((each.document, each.start, each.end), each)
    return Answer(
        text=" ".join(told.lines) or asked.say("nothing"),
        subject=subject,
        citations=tuple(citations.values())[:MOST_CITATIONS],
        confidence=max(0.0, min(1.0, told.confidence)),
        target_mps=target(state).told_mps,
        tools=used(outcomes),
        language=state.preferences.language,
        degraded=degraded(state, failed(outcomes)),
    )


def used(outcomes: tuple[Outcome, ...]) -> tuple[ToolUse, ...]:
    """The tools that were asked, as an answer names them."""
    return tuple(ToolUse(tool=o.tool, status=o.status, elapsed_ms=round(o.elapsed_ms, 2)) for o in outcomes)


def _cited(*answers: RulesAnswer | None) -> tuple[Citation, ...]:
    return tuple(citation for each in answers if each is not None for citation in each.citations)


def _confidence(answered: RulesAnswer | None, unanswered: float) -> float:
    assumed = answered is None or (answered.limit is not None and answered.limit.assumed)
    return unanswered if answered is None or assumed else answered.confidence


# -- lines that several answers have -----------------------------------------------------------------------------------


def _weather_line(asked: _Asked) -> str:
    preferences = asked.state.preferences
    conditions = asked.result("assess_weather", Conditions) or asked.state.held.conditions
    if conditions is None:
        return asked.say("weather_unknown")
    told = asked.say_target(
        "weather",
        mu=grip_word(preferences, conditions),
        low=decimal(preferences, conditions.mu_low, 2),
        high=decimal(preferences, conditions.mu_high, 2),
        sight=_sight(asked, conditions),
    )
    return " ".join([told, *_stopping(asked, conditions)])


def _sight(asked: _Asked, conditions: Conditions) -> str:
    sight_m = conditions.visibility_m
    return asked.say("sight_unknown") if sight_m is None else distance(asked.state.preferences, sight_m)


def _stopping(asked: _Asked, conditions: Conditions) -> list[str]:
    """What the speed follows from: the way to a stop, beside what can be seen or beside a dry road's."""
    reference, stop, usual = conditions.reference_speed_mps, conditions.stopping_m, conditions.usual_stopping_m
    if reference is None or stop is None or usual is None or conditions.bounded_by == "none":
        return []
    preferences = asked.state.preferences
    found = asked.say(
        f"stop_{conditions.bounded_by}",
        speed=speed(preferences, reference),
        stop=distance(preferences, stop),
        usual=distance(preferences, usual),
        sight=_sight(asked, conditions),
        gust=speed(preferences, conditions.gust_mps or 0.0),
    )
    return [found, asked.say("sources_disagree")] if conditions.disagree else [found]


def _limit_line(asked: _Asked) -> str:
    answered = asked.limit
    limit = answered.limit if answered is not None else target(asked.state).law.limit
    if limit is None or limit.assumed:
        return asked.say("limit_unknown")
    other = "km/h" if limit.unit == "mph" else "mph"
    converted = speed(msgspec.structs.replace(asked.state.preferences, unit=other), limit.mps)
    return asked.say("limit_here", limit=spoken(limit.value, limit.unit), converted=converted)


# -- one answer a subject ----------------------------------------------------------------------------------------------


def _sign(asked: _Asked) -> Told:
    sign = sign_asked_about(asked.state)
    if sign is None:
        return Told((asked.say("no_sign"), _weather_line(asked)), 0.5)
    meaning = asked.result("interpret_sign", SignMeaning)
    if meaning is None:
        return Told((asked.say("no_rules"), _weather_line(asked)), 0.2)
    preferences = asked.state.preferences
    lines = [asked.say("sign", meaning=meaning.meaning.rstrip("."))]
    if not sign.believed and sign.candidates:
        names = word(preferences, "or").join(reading_words(asked.state, c.reading) for c in sign.candidates[:3])
        lines.append(asked.say("unsure", candidates=names))
    if meaning.limit is not None:
        lines.append(asked.say("sign_limit", limit=limit_text(meaning.limit, preferences.unit)))
    if meaning.legal_action == "stop":
        lines.append(asked.say("sign_stop"))
    if meaning.note:
        lines.append(plain(meaning.note))
    return Told((*lines, _weather_line(asked)), min(meaning.confidence, sign.confidence), meaning.citations)


def _units(asked: _Asked) -> Told:
    signs, answered = asked.state.signs, asked.limit
    here, unit = signs.jurisdiction, signs.units.value if signs.units is not None else None
    if unit is None and answered is not None and answered.limit is not None:
        unit = answered.limit.unit
    if here is None or unit is None:
        return Told((asked.say("units_unknown"), _limit_line(asked)), 0.3)
    named = [name for name, pattern in _ASKED_UNIT.items() if pattern.search(asked.question)]
    phrase = "units" if len(named) != 1 else "units_yes" if named[0] == unit else "units_no"
    lines = [asked.say(phrase, in_country=place_name(asked.state, here.value).inside, unit=unit)]
    if here.assumed:
        lines.append(asked.say("assumed"))
    if signs.former_jurisdiction:
        told = evidence_in_words(asked.state.preferences, here.evidence)
        phrase = "switched_told" if told else "switched"
        lines.append(asked.say(phrase, former=place_name(asked.state, signs.former_jurisdiction).out_of, evidence=told))
    sure = min(here.confidence, _confidence(answered, 0.4))
    return Told((*lines, _limit_line(asked)), sure, _cited(answered, asked.law))


def _change(asked: _Asked) -> Told:
    recommended = asked.say_target("recommend")
    lines = (_why_changed(asked), _limit_line(asked), _weather_line(asked), recommended)
    return Told(lines, _confidence(asked.limit, 0.3), _cited(asked.limit, asked.law))


def _why_changed(asked: _Asked) -> str:
    signs = asked.state.signs
    gantry = signs.gantry
    newest = max(in_force(signs), key=lambda each: each.since_ns, default=None)
    if gantry is not None and newest is not None and newest.since_ns <= gantry.since_ns:
        return asked.say("changed_gantry", limit=spoken(gantry.posted.value, gantry.posted.unit))
    if newest is not None and newest.since_ns == signs.changed_ns:
        ago = f"{(asked.state.now_ns - newest.since_ns) / 1e9:.0f}"
        return asked.say("changed_sign", ago=ago, limit=spoken(newest.posted.value, newest.posted.unit))
    if not signs.ended:
        return asked.say("changed_none")
    return asked.say("changed_ended", reading=reading_words(asked.state, signs.ended[-1]))


def _lamp(asked: _Asked) -> Told:
    """The lamp, the codes, what they mean for driving now, what to do next, and the rule that applies."""
    health = asked.result("vehicle_health", VehicleHealth)
    car = health or asked.state.held.degradation
    lamps = car.warning_lamps if car is not None else ()
    lit = asked.say("lamp", lamps=_lamp_names(asked, lamps)) if lamps else asked.say("lamp_none")
    if health is None:
        lines = (lit, asked.say("no_health"), asked.say("safe_unknown"), *_rule(asked))
        return Told(lines, 0.2, _cited(asked.law))
    # the driver sees a lamp and the car knows of none: they contradict each other, and the careful one counts
    contradicted = not lamps and not health.dtcs and health.safe_to_drive == "yes"
    lines = (lit, *_meaning(asked, health, contradicted), *_next_steps(asked, health), *_rule(asked))
    return Told(lines, min(health.confidence, CONTRADICTED if contradicted else 1.0), _cited(asked.law))


def _lamp_names(asked: _Asked, lamps: tuple[str, ...]) -> str:
    """Lamps by the words of the dashboard; one that has none by its own name."""
    words = phrases(asked.state.preferences.language)["lamp"]
    return ", ".join(words.get(lamp, lamp) for lamp in lamps)


def _meaning(asked: _Asked, health: VehicleHealth, contradicted: bool) -> list[str]:
    safe = "safe_contradicted" if contradicted else f"safe_{health.safe_to_drive}"
    known = safe in phrases(asked.state.preferences.language)["ask"]
    safe = safe if known else "safe_unknown"
    lines = [asked.say_target(safe) if safe == "safe_with_care" else asked.say(safe)]
    if health.brake_envelope is not None and health.brake_envelope < SOUND_BRAKES:
        share, gap = f"{100 * health.brake_envelope:.0f}", decimal(asked.state.preferences, health.headway_factor)
        lines.append(asked.say("brakes_weak", share=share, gap=gap))
    return lines


def _next_steps(asked: _Asked, health: VehicleHealth) -> list[str]:
    """The gravest codes with what to do about each; without any, the car's own advice."""
    gravest = sorted(health.dtcs, key=lambda dtc: -GRAVITY.get(dtc.severity, len(GRAVITY)))[:MOST_CODES]
    told = [asked.say("code", code=dtc.code, summary=dtc.summary.rstrip("."), step=dtc.next_step) for dtc in gravest]
    if more := len(health.dtcs) - len(gravest):
        told.append(asked.say("codes_more", more=more))
    if not told and health.advice and health.safe_to_drive != "yes":
        told.append(f"{sentences(health.advice, 400)}.")
    return told


def _rule(asked: _Asked) -> tuple[str, ...]:
    """What the law says of it, with its section; that the Rules did not answer, where they did not."""
    law = asked.law
    if law is None:
        return (asked.say("no_rules"),)
    if not law.note or not law.citations:
        return ()
    return (f"{asked.say('rule', section=law.citations[0].section)} {plain(law.note, 400)}",)


def _limit(asked: _Asked) -> Told:
    lines = (_limit_line(asked), _weather_line(asked))
    return Told(lines, _confidence(asked.limit, 0.3), _cited(asked.limit))


def _law(asked: _Asked) -> Told:
    law = asked.law
    if law is None:
        return Told((asked.say("no_rules"),), 0.0)
    return Told((plain(law.note, 600) or asked.say("nothing"),), law.confidence, law.citations)


def answer_of_told(told: Advisory | None, state: State) -> Answer:
    """What the driver was told last, with its reasons and where they stand."""
    preferences = state.preferences
    if told is None:
        text = say(preferences, "ask", "told_none")
    else:
        text = say(preferences, "ask", "told", directive=told.directive.rstrip(".!"), reasons=told.justification)
    return Answer(
        text=text.strip(),
        subject="told",
        citations=told.citations[:MOST_CITATIONS] if told is not None else (),
        confidence=told.confidence if told is not None else 1.0,
        target_mps=target(state).told_mps,
        tools=(),
        language=preferences.language,
        degraded=degraded(state, ()),
    )


_TELL: dict[Subject, Callable[[_Asked], Told]] = {
    "sign": _sign, "units": _units, "change": _change, "lamp": _lamp, "limit": _limit, "law": _law, "told": _law,
}  # fmt: skip
