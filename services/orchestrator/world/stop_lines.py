"""The stop line ahead, and whether the ego has stood at the one that its stop sign means."""

from typing import NamedTuple

from proto.sensors import StopLine
from proto.vehicle import Ego
from services.orchestrator.observations.inputs import Observations, Stamped
from services.orchestrator.observations.motion import STANDING_MPS, Motion
from services.orchestrator.observations.validity import VALID_NS, fresh, number
from services.orchestrator.signs.duplicate_tracks import is_earlier_track
from services.orchestrator.state import SignAhead, Signs, State
from services.orchestrator.world.actors import EGO_HALF_M

LINE_PASSED_M = -1.0
"""From the ego's centre, by a map; what is reckoned on from a map that fell silent is given the room for its error."""
RECKONED_PASSED_M = -3.0
AT_LINE_M = 3.0
"""From the front bumper: who stands farther off has not stopped at the line."""
AT_SIGN_M = 6.0
"""The same of the sign itself, whose range is a few metres off, where no map knows the line."""
CREEP_M = 2.0


class OnMap(NamedTuple):
    """What a map knows ahead; from the ego's centre."""

    lines: tuple[StopLine, ...]
    junction_m: float | None


def on_map(seen: Observations) -> OnMap | None:
    """Lines that are not passed yet, and the next junction. None: no map tells anything."""
    road = fresh(seen.road, VALID_NS["lanes"], seen.now_ns)
    if road is not None:
        ahead = (line for line in road.message.stop_lines if line.distance_m > LINE_PASSED_M)
        return OnMap(tuple(sorted(ahead, key=lambda line: line.distance_m)), road.message.junction_m)
    lanes = fresh(seen.lanes, VALID_NS["lanes"], seen.now_ns)
    if lanes is None or lanes.message.source != "map":
        return None
    at_m, kind = lanes.message.stop_line_distance_m, lanes.message.stop_line_kind
    known = at_m is not None and at_m > LINE_PASSED_M and kind in KINDS
    return OnMap((StopLine(distance_m=at_m, kind=kind),) if known else (), lanes.message.junction_distance_m)


RULING = ("stop_line", "light", "yield_line")
"""Lines that tell who goes first."""
KINDS = (*RULING, "crossing")


def reckoned(at_m: float | None, motion: Motion) -> float | None:
    """Where a place of a map that fell silent is by now: nearer by the way travelled, until it is passed."""
    if at_m is None or at_m - motion.travelled_m < RECKONED_PASSED_M:
        return None
    return at_m - motion.travelled_m


def stop_line(state: State, told: OnMap | None, motion: Motion) -> tuple[float | None, str]:
    """The nearest line and its kind, from what the map tells; where that falls silent, the last known one."""
    if told is not None:
        return (told.lines[0].distance_m, told.lines[0].kind) if told.lines else (None, "")
    at_m = reckoned(state.stop_m, motion)
    return at_m, state.stop_kind if at_m is not None else ""


def stop_signs(signs: Signs) -> tuple[SignAhead, ...]:
    """Stop signs ahead, the nearest first; one whose distance nobody knows may be the nearest."""
    found = [sign for sign in signs.ahead if sign.reading == "stop"]
    return tuple(sorted(found, key=lambda sign: (sign.distance_m or 0.0, sign.first_ns)))


SAME_LINE_M = 10.0
"""Stop signs so close to each other mean one line: one on either side, or one that two cameras place differently."""


def beyond(signs: tuple[SignAhead, ...]) -> tuple[SignAhead, ...]:
    """Those, of stop signs by their distance, that do not mean the line of the nearest."""
    first_m = (signs[0].distance_m or 0.0) if signs else 0.0
    others = (sign for sign in signs[1:] if not is_earlier_track(sign, signs[0]))
    return tuple(sign for sign in others if sign.distance_m is None or sign.distance_m > first_m + SAME_LINE_M)


def line_of(sign: SignAhead, stop_m: float | None, stop_kind: str) -> float | None:
    """Where to stand for a stop sign: at the line that a map knows beside it, else at the sign; None: nobody knows."""
    if stop_m is None or stop_kind == "light":
        return sign.distance_m
    beside = sign.distance_m is None or abs(stop_m - sign.distance_m) <= SIGN_TO_LINE_M
    return stop_m if beside else sign.distance_m


SIGN_TO_LINE_M = 20.0
"""How far a sign may stand from its line, with the error of its range."""


def unexplained_line(state: State) -> float | None:
    """Where a map knows a stop line that no sign and no light explains (yet); None: there is none."""
    if state.stop_kind != "stop_line" or state.stop_m is None or state.light is not None:
        return None
    explained = any(line_of(sign, state.stop_m, state.stop_kind) == state.stop_m for sign in stop_signs(state.signs))
    return None if explained else state.stop_m


def halted_at_line(state: State, line: tuple[float | None, str], ego: Stamped[Ego] | None, now_ns: int) -> int | None:
    """When the ego last stood at the stop line that a map knows; None once it is past it, or was never there."""
    at_m, kind = line
    if at_m is None or kind != "stop_line":
        return None
    return _stood(at_m, AT_LINE_M, state.line_halted_ns, ego, now_ns)


def halted(
    state: State, signs: Signs, line: tuple[float | None, str], ego: Stamped[Ego] | None, now_ns: int
) -> int | None:
    """When the ego last stood at the line of the nearest stop sign; None once it is past it, or was never there."""
    sign = next(iter(stop_signs(signs)), None)
    at_m = line_of(sign, *line) if sign is not None else None
    if at_m is None:
        return None
    within = AT_LINE_M if at_m == line[0] else AT_SIGN_M
    return _stood(at_m, within, state.halted_ns, ego, now_ns)


def _stood(at_m: float, within_m: float, before_ns: int | None, ego: Stamped[Ego] | None, now_ns: int) -> int | None:
    """When the ego last stood within a distance of a place, as long as it has not left that."""
    room, speed = at_m - EGO_HALF_M, number(ego.message.speed_mps) if ego is not None else None
    if room <= within_m and speed is not None and abs(speed) < STANDING_MPS:
        return now_ns
    return before_ns if room <= within_m + CREEP_M else None
