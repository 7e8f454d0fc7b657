"""One piece of advice out of everything: target, the candidate worth saying, its reasons, and how sure all of it is.

The confidence of the advice is the minimum over what it rests on: the candidate itself, the law behind the limit, and,
where they lower the target, weather and the car; times `DEGRADED` where a routed tool did not answer.
"""

from collections.abc import Iterator
from typing import Any

import msgspec

from domain.units import in_unit, limit_text
from proto.decision import Event, Fused, Preferences, Reason
from proto.messages import Kind
from proto.rules import Citation, LegalLimit, SignMeaning
from proto.speed_assistance import Picture
from proto.weather import Conditions
from services.orchestrator.experts.answers import degraded
from services.orchestrator.experts.routing import right_of_way
from services.orchestrator.speech.candidate import Candidate
from services.orchestrator.speech.candidates.candidates import candidates
from services.orchestrator.speech.choice import choose, is_new, owes_first_notice
from services.orchestrator.speech.wording import decimal, drive, face, grip_word, say, toned, word
from services.orchestrator.state import State
from services.orchestrator.target.target import Law, Target, target
from services.orchestrator.text import plain
from services.orchestrator.world.road_kind import is_no_town

DEGRADED = 0.9
MOST_CITATIONS = 4
PLACE = "jurisdiction"
"""What the Rules miss where country or part of it are unknown: their note says whose law it is, and where it is lower."""
WIDENED = 1.15
"""A following distance that is widened by less is not worth a word."""
WATCHED_TICKS = 30
"""Before so many no limit is assumed to be shown: what speaks against it takes some seconds to be seen."""
SHOWN: dict[str, int] = {"short": 1, "normal": 3, "full": 12}
"""How many reasons a justification holds, by verbosity."""


def advise(state: State, events: tuple[Event, ...], failed: tuple[str, ...]) -> tuple[Fused, Candidate | None, Target]:
    """The advice, the candidate that it speaks of, and the target with its bounds; without the tools that failed."""
    goal = target(state)
    chosen = choose(candidates(state, goal, events), state.memory, state.now_ns)
    reasons = _reasons(state, goal, chosen)
    conditions, preferences = state.held.conditions, state.preferences
    fused = Fused(
        target_mps=goal.mps,
        legal_limit=_shown(state, goal.law),
        headway_factor=goal.headway_factor,
        justification=" ".join(reason.text for reason in reasons[: SHOWN[preferences.verbosity]]),
        confidence=_confidence(state, goal, chosen, failed),
        reasons=reasons,
        citations=_citations(reasons),
        mu_low=conditions.mu_low if conditions is not None else None,
        mu_high=conditions.mu_high if conditions is not None else None,
        language=preferences.language,
        unit=preferences.unit,
        degraded=degraded(state, failed),
        muted=preferences.muted,
        target_why=goal.bounds[0].why,
        **said_of(chosen, state),
    )
    return fused, chosen, goal


def _shown(state: State, law: Law) -> LegalLimit | None:
    """The limit; none where it is assumed, and the road was hardly watched yet or what is seen speaks against a town."""
    hidden = law.assumed and (state.tick < WATCHED_TICKS or is_no_town(state.world))
    return None if hidden else law.limit


def said_of(chosen: Candidate | None, state: State) -> dict[str, Any]:
    """The fields of `Fused` that the chosen candidate fills; None: nothing is to be said."""
    if chosen is None:
        return {"directive": "", "urgency": "info", "topic": ""}
    directive = in_unit(say(state.preferences, "directive", chosen.phrase, **chosen.values), state.preferences.unit)
    return {
        "directive": toned(state.preferences, directive, chosen.urgency),
        "urgency": chosen.urgency,
        "topic": chosen.topic,
        "hazard": chosen.hazard,
        "new_information": is_new(chosen, state.memory, state.now_ns),
        "first_notice": owes_first_notice(chosen, state.memory, state.now_ns),
        "ahead_mps": chosen.ahead_mps,
        "told_limit_mps": chosen.limit_mps,
        "asked_mps": chosen.asked_mps,
        "picture": picture_of(chosen, state),
    }


def picture_of(chosen: Candidate, state: State) -> Picture:
    """The sign that is shown with a message: the country's number and unit, whatever is spoken."""
    value, unit = chosen.number or (None, None)
    return Picture(
        face=face(chosen.phrase), value=value, unit=unit, country=state.signs.country or "", plate=chosen.plate
    )


# -- reasons -----------------------------------------------------------------------------------------------------------


def _reasons(state: State, goal: Target, chosen: Candidate | None) -> tuple[Reason, ...]:
    """Why this is said, the law, what the Rules say beside it, what asks for less than the law."""
    found = (
        *(_of_candidate(state, chosen) if chosen is not None else ()),
        _law_reason(state, goal.law),
        *(_of_rules(state, goal, chosen) if chosen is not None else ()),
        *_of_safety(state, goal),
    )
    unit = state.preferences.unit
    return tuple(msgspec.structs.replace(each, text=in_unit(each.text, unit)) for each in found if each.text)


def _of_candidate(state: State, chosen: Candidate) -> Iterator[Reason]:
    """The candidate's own phrases, then what the Rules say of the sign that is spoken of."""
    for phrase in chosen.why:
        text = say(state.preferences, "justification", phrase, **chosen.values)
        yield Reason(source=chosen.topic, text=text, confidence=chosen.confidence)
    meaning, law = _meaning(state, chosen), chosen.law
    if meaning is not None:
        yield Reason(
            source="rules", text=plain(meaning.note), confidence=meaning.confidence, citations=meaning.citations
        )
    if law is not None:
        yield Reason(source="rules", text=plain(law.meaning), confidence=law.confidence, citations=law.citations)


def _of_rules(state: State, goal: Target, chosen: Candidate) -> Iterator[Reason]:
    """The country whose law counts where the place is in doubt, and the right of way at a junction."""
    doubted, way = goal.law.answer, right_of_way(state)
    explained = chosen.row.explained_by == "place" and not goal.law.assumed
    if explained and doubted is not None and PLACE in doubted.degraded:
        yield Reason(source="rules", text=plain(doubted.note), confidence=doubted.confidence)
    if chosen.row.explained_by == "right_of_way" and way is not None:
        yield Reason(source="rules", text=plain(way.note), confidence=way.confidence, citations=way.citations)


def _of_safety(state: State, goal: Target) -> Iterator[Reason]:
    """What recommends less than the law allows, and a wider distance."""
    yield from _safety_reason(state, goal)
    if goal.headway_factor >= WIDENED:
        text = say(
            state.preferences, "justification", "distance", headway=decimal(state.preferences, goal.headway_factor)
        )
        yield Reason(source="weather", text=text)


def _meaning(state: State, chosen: Candidate) -> SignMeaning | None:
    """What the Rules say of the sign that is spoken of; not what they said of another one."""
    meaning = state.held.meaning
    if meaning is None or chosen.row.explained_by != "meaning":
        return None
    doubted = {s.reading for s in state.signs.ahead if s.track_id == chosen.news.track_id}
    return meaning if chosen.kind is Kind.FOREIGN or meaning.reading in doubted else None


def _law_reason(state: State, law: Law) -> Reason:
    preferences = state.preferences
    if law.limit is None or law.limit.assumed:
        text = say(preferences, "justification", "law_none")
        return Reason(source="rules", text=text, confidence=law.confidence)
    section = next((citation.section for citation in law.citations[:1] if citation.section), "")
    limit = limit_text(law.limit, preferences.unit) + (f" ({section})" if section else "")
    phrase = {"held": "law_held", "sign": "law_sign"}.get(law.basis, "law_advisory" if law.limit.advisory else "law")
    text = say(preferences, "justification", phrase, limit=limit)
    return Reason(source="rules", text=text, confidence=law.confidence, citations=law.citations)


def _safety_reason(state: State, goal: Target) -> Iterator[Reason]:
    """What recommends less than the law allows; both are said."""
    law_mps, bound = goal.law.mps, goal.bounds[0]
    if law_mps is not None and not _law_is_all(goal) and goal.mps < law_mps - 0.5:
        why = (
            _why_the_road(state) if bound.why == "law" else say(state.preferences, "why", bound.why, tool=bound.source)
        )
        text = say(state.preferences, "justification", "safety", target=drive(state.preferences, goal.mps), why=why)
        yield Reason(source=bound.source, text=text, confidence=bound.confidence)


def _law_is_all(goal: Target) -> bool:
    """Whether an assumed law is all that the target rests on: then no speed is recommended."""
    return goal.law.assumed and goal.bounds[0].why == "law"


def _why_the_road(state: State) -> str:
    """Weather, car and experts, as far as each asks for less than the law does."""
    preferences, conditions, car = state.preferences, state.held.conditions, state.held.degradation
    parts = []
    if conditions is None or conditions.speed_factor < 0.98:
        parts.append(say(preferences, "why", "weather", **_road_words(preferences, conditions)))
    if car is None or (car.h or 0.0) > 0.1:
        parts.append(say(preferences, "why", "vehicle"))
    parts += [limiter.tool for limiter in state.held.limiters if limiter.speed_factor < 1.0]
    return word(preferences, "and").join(parts) or say(preferences, "why", "unknown")


def _road_words(preferences: Preferences, conditions: Conditions | None) -> dict[str, str]:
    grip = grip_word(preferences, conditions)
    return {"mu": grip, "surface": word(preferences, SURFACE[conditions.wet if conditions is not None else None])}


SURFACE = {None: "unknown", True: "wet", False: "dry"}


def _citations(reasons: tuple[Reason, ...]) -> tuple[Citation, ...]:
    seen: dict[tuple[str, int, int], Citation] = {}
    for reason in reasons:
        for citation in reason.citations:
            seen.setdefault((citation.document, citation.start, citation.end), citation)
    return tuple(seen.values())[:MOST_CITATIONS]


# -- confidence ----------------------------------------------------------------------------------------------------------


def _confidence(state: State, goal: Target, chosen: Candidate | None, failed: tuple[str, ...]) -> float:
    rests_on = [chosen.confidence] if chosen is not None else []
    if chosen is None or not chosen.hazard:
        # A hazard rests on the actor alone; everything else on the law, and on what scales it.
        rests_on.append(goal.law.confidence)
        if goal.factor < 0.98:
            conditions = state.world.environment.conditions
            rests_on.append(conditions.confidence if conditions is not None else 0.3)
    least = min(rests_on, default=0.0)
    return max(0.0, min(1.0, least * (DEGRADED if failed else 1.0)))
