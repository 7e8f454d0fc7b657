"""Where the ego has to stop: red lights, stop signs, people on a crossing."""

from typing import NamedTuple

from domain import kinematics
from proto.perception import Track
from services.orchestrator.signs.limits import SURE
from services.orchestrator.state import Light, SignAhead, State
from services.orchestrator.world.actors import EGO_HALF_M, people
from services.orchestrator.world.lights import OUT_OF_SIGHT_NS
from services.orchestrator.world.stop_lines import STOP_LINES, beyond, is_beyond, line_of, stop_signs, unexplained_line

REACTION_S = 1.9
"""Until 85 % of drivers act on a word (Lerner 1993)."""
STANDSTILL_M = 1.0
"""Kept before a line."""
PERSON_M = 3.0
"""Kept before a person."""
COMFORT_MPS2 = 2.0
"""Comfortable braking; the approach speed to a stop is sqrt(2 a d)."""
UNKNOWN_STOP_M = 60.0
LINE_CONFIDENCE = 0.7
"""Of a stop line that a map knows and nothing was seen of."""


def to_be_told_m(speed_mps: float, slower_mps: float, slowing_mps2: float = COMFORT_MPS2) -> float:
    """The distance at which a driver has to be told to reach a lower speed by then: reaction and slowing down."""
    return REACTION_S * speed_mps + max(0.0, speed_mps**2 - slower_mps**2) / (2.0 * slowing_mps2)


class Stop(NamedTuple):
    """One reason to stop. `room_m` from the front bumper to where the ego shall stand."""

    why: str
    """`red_light`, `stop_sign`, `stop_line`, `person`"""
    room_m: float
    confidence: float
    track: Track | None = None
    """The person; None: the stop is a line."""
    unmapped: bool = False
    """The line is a guess beside the map's."""
    doubted: bool = False
    """One picture alone shows it, or none for 3 s, or it is read unsurely, and no map has its line: it bounds the target, and is not
    spoken of."""

    def approach_mps(self) -> float:
        """The speed from which comfortable braking ends at the line."""
        return float((2.0 * COMFORT_MPS2 * max(0.0, self.room_m)) ** 0.5)


def stops(state: State) -> tuple[Stop, ...]:
    """All of them, the nearest first."""
    found = (*lines(state), *people_ahead(state)[:1])
    return tuple(sorted(found, key=lambda stop: (stop.room_m, stop.why)))


def lines(state: State) -> tuple[Stop, ...]:
    """Lights, signs and lines."""
    return tuple(stop for stop in (_red(state), _sign(state), _line(state)) if stop is not None)


def people_ahead(state: State) -> tuple[Stop, ...]:
    """All people in the way, the nearest first: a person behind the nearest still bounds once that one is gone."""
    return tuple(
        Stop("person", person.least_m - PERSON_M, person.track.confidence, person.track)
        for person in people(state.world)
    )


def needed_mps2(stop: Stop, speed_mps: float) -> float:
    """The deceleration that ends at the line."""
    return kinematics.needed_mps2(speed_mps, stop.room_m)


def _at(why: str, at_m: float | None, confidence: float) -> Stop | None:
    """A stop before a place, until the front has passed it."""
    room_m = (at_m if at_m is not None else UNKNOWN_STOP_M) - EGO_HALF_M - STANDSTILL_M
    return Stop(why, room_m, confidence) if room_m >= -EGO_HALF_M - 2.0 else None


def _red(state: State) -> Stop | None:
    light = state.light
    if light is None or light.lost_at_line or light.permits:
        return None
    line_m = state.stop_m if state.stop_kind in STOP_LINES else None
    unmapped = line_m is not None and not light.lined and is_beyond(line_m, light)
    stop = _at("red_light", _by_now_m(state, light) if line_m is None or unmapped else line_m, light.confidence)
    seen = light.seen_twice and light.missed_ns <= OUT_OF_SIGHT_NS
    doubted = not seen and (line_m is None or unmapped)
    return stop._replace(unmapped=unmapped, doubted=doubted) if stop is not None else None


def _by_now_m(state: State, light: Light) -> float | None:
    """Where the light may be by now; at an unknown speed as near as the last one brings it, and never passed."""
    at_m, last = light.distance_m, state.held.speed
    if at_m is None or state.speed_mps is not None or last is None:
        return at_m
    since_ns = max(0, state.now_ns - last.stamp_ns)
    return max(min(at_m, EGO_HALF_M), at_m - max(0.0, last.mps) * since_ns / 1e9)


def _sign(state: State) -> Stop | None:
    signs = stop_signs(state.signs)
    ahead = signs if state.halted_ns is None else beyond(signs)
    return next((_at_sign(state, sign) for sign in ahead), None)


def _at_sign(state: State, sign: SignAhead) -> Stop | None:
    line_m = line_of(sign, state.stop_m, state.stop_kind)
    stop = _at("stop_sign", line_m, sign.confidence)
    unmapped = state.stop_m is None or line_m != state.stop_m
    doubted = unmapped and not sign.believed and sign.confidence < SURE
    return stop._replace(doubted=doubted) if stop is not None else None


def _line(state: State) -> Stop | None:
    """A line that a map knows, before what asks for it can be read. A light that is found there explains it."""
    at_m = unexplained_line(state)
    return None if at_m is None or state.line_halted_ns is not None else _at("stop_line", at_m, LINE_CONFIDENCE)
