"""Where the ego has to stop: red lights, stop signs, people on a crossing."""

from typing import NamedTuple

from services.orchestrator.state import State
from services.orchestrator.world.actors import EGO_HALF_M, missed_as, pedestrian
from services.orchestrator.world.stop_lines import beyond, line_of, stop_signs, unexplained_line

REACTION_S = 1.9
"""Until 85 % of drivers act on a word (Lerner 1993)."""
STANDSTILL_M = 1.0
"""Kept before a line."""
PERSON_M = 3.0
"""Kept before a person."""
COMFORT_MPS2 = 2.0
"""Braking that nobody minds; the approach speed to a stop is sqrt(2 a d)."""
UNKNOWN_STOP_M = 60.0
LINE_CONFIDENCE = 0.7
"""Of a stop line that a map knows and nothing was seen of."""


def to_be_told_m(speed_mps: float, slower_mps: float, slowing_mps2: float = COMFORT_MPS2) -> float:
    """From how far away one has to be told to come down to a speed by then: he reacts, and slows down."""
    return REACTION_S * speed_mps + max(0.0, speed_mps**2 - slower_mps**2) / (2.0 * slowing_mps2)


class Stop(NamedTuple):
    """One reason to stop. `room_m` from the front bumper to where the ego shall stand."""

    why: str
    """`red_light`, `stop_sign`, `stop_line`, `person`"""
    room_m: float
    confidence: float
    track_id: int = 0
    """The person who was seen well enough to be missed; 0: none."""

    def approach_mps(self) -> float:
        """The speed from which comfortable braking ends at the line."""
        return float((2.0 * COMFORT_MPS2 * max(0.0, self.room_m)) ** 0.5)


def stops(state: State) -> tuple[Stop, ...]:
    """All of them, the nearest first."""
    found = [stop for stop in (_red(state), _sign(state), _line(state), _person(state)) if stop is not None]
    return tuple(sorted(found, key=lambda stop: (stop.room_m, stop.why)))


def needed_mps2(stop: Stop, speed_mps: float) -> float:
    """The deceleration that ends at the line."""
    return speed_mps * speed_mps / (2.0 * max(0.5, stop.room_m))


def _red(state: State) -> Stop | None:
    light = state.light
    if light is None or light.lost_at_line or light.state not in ("red", "red_amber", "amber"):
        return None
    line = state.stop_m if state.stop_kind in ("light", "stop_line", "crossing") else None
    distance = line if line is not None else light.distance_m
    room = (distance if distance is not None else UNKNOWN_STOP_M) - EGO_HALF_M - STANDSTILL_M
    if room < -EGO_HALF_M - 2.0:
        return None
    return Stop("red_light", room, light.confidence)


def _sign(state: State) -> Stop | None:
    signs = stop_signs(state.signs)
    if state.halted_ns is not None:
        signs = beyond(signs)
    if not signs:
        return None
    sign = signs[0]
    distance = line_of(sign, state.stop_m, state.stop_kind)
    room = (distance if distance is not None else UNKNOWN_STOP_M) - EGO_HALF_M - STANDSTILL_M
    return Stop("stop_sign", room, sign.confidence) if room > -EGO_HALF_M - 2.0 else None


def _line(state: State) -> Stop | None:
    """A line that a map knows, before what asks for it can be read. A light that is found there explains it."""
    distance = unexplained_line(state)
    if distance is None or state.line_halted_ns is not None:
        return None
    room = distance - EGO_HALF_M - STANDSTILL_M
    return Stop("stop_line", room, LINE_CONFIDENCE) if room > -EGO_HALF_M - 2.0 else None


def _person(state: State) -> Stop | None:
    person = pedestrian(state.world)
    if person is None:
        return None
    return Stop("person", person.gap_m - PERSON_M, person.track.confidence, missed_as(person))
