"""What the experts have answered, in plain English sentences for a prompt: law, sign, right of way, weather, car, third parties."""

from collections.abc import Iterator

from domain.units import shown
from proto.rules import LegalLimit
from services.orchestrator.experts.routing import right_of_way
from services.orchestrator.state import State
from services.orchestrator.target.target import law_of

SCALED = 0.98
"""A factor above this is not worth a sentence."""


def told(state: State) -> tuple[str, ...]:
    """A sentence or two of each expert that has answered."""
    parts = (_law(state), _sign(state), _way(state), _weather(state), _car(state), _third(state))
    return tuple(sentence for part in parts for sentence in part)


def _law(state: State) -> Iterator[str]:
    law = law_of(state)
    if law.limit is None:
        yield "The law sets no limit that is known here."
    elif law.limit.advisory:
        yield f"The law recommends at most {_number(law.limit)}."
    else:
        section = next((citation.section for citation in law.citations[:1] if citation.section), "")
        yield f"The speed limit is {_number(law.limit)}."
        if section:
            yield f"It is set by {section}."


def _sign(state: State) -> Iterator[str]:
    place = state.held.place
    if (
        place is not None
        and place.limit is not None
        and any(sign.reading == place.reading for sign in state.signs.ahead)
    ):
        yield f"Behind the sign ahead the speed limit is {_number(place.limit)}."


def _way(state: State) -> Iterator[str]:
    answer = right_of_way(state)
    if answer is not None:
        yield f"Right of way: {answer.legal_action.replace('_', ' ')}."


def _weather(state: State) -> Iterator[str]:
    conditions = state.held.conditions
    if conditions is None:
        yield "The state of the road is unknown."
        return
    if conditions.wet is not None:
        yield f"The road is {'wet' if conditions.wet else 'dry'}."
    if conditions.speed_factor < SCALED:
        yield f"Grip and sight call for {conditions.speed_factor * 100:.0f} % of the usual speed."
    sight, law = conditions.safe_speed_mps, law_of(state)
    if sight is not None and sight < law.allowed_mps:
        unit = state.preferences.unit
        yield f"One can stop within sight from {shown(sight, unit)} {unit}."


def _car(state: State) -> Iterator[str]:
    car = state.held.degradation
    if car is not None and (car.h or 0.0) > 1.0 - SCALED:
        yield f"Something is wrong with the car, {car.h:.2f} on a scale from 0 to 1."


def _third(state: State) -> Iterator[str]:
    yield from (" ".join(each.text.split()) for each in state.held.limiters if each.text)


def _number(limit: LegalLimit) -> str:
    return f"{limit.value:g} {limit.unit}"
