"""The stop line ahead, and whether the ego has stood at the one that its stop sign means."""

import msgspec

from services.orchestrator.observations.inputs import Observations, RoadAhead, along_lane
from services.orchestrator.observations.validity import STANDING_MPS, VALID_NS, Motion, fresh
from services.orchestrator.signs.duplicate_tracks import is_earlier_track
from services.orchestrator.state import Light, SignAhead, Signs, State
from services.orchestrator.world.actors import EGO_HALF_M

LINE_PASSED_M = -1.0
"""From the ego's centre, by a map."""
RECKONED_PASSED_M = -3.0
"""The same after a map fell silent, with room for the error of the way travelled since."""
AT_LINE_M = 3.0
"""From the front bumper; an ego that stands farther off has not stopped at the line."""
AT_SIGN_M = 6.0
"""The same of the sign itself, whose range is a few metres off, where no map knows the line."""
CREEP_M = 2.0
SAME_LINE_M = 10.0
"""Stop signs so close to each other mean one line: one on either side, or one that two cameras place differently."""
SIGN_TO_LINE_M = 20.0
"""How far a sign may stand from its line, with the error of its range."""
BEHIND_LIGHT_M = 15.0
"""A line so far behind a light, at most, is that light's: the error of its range."""
STOP_LINES = ("light", "stop_line", "crossing")
"""Lines of a map at which a red light is waited for."""
RULING = ("stop_line", "light", "yield_line")
"""Lines that settle the right of way."""
KINDS = (*RULING, "crossing")


def on_map(seen: Observations) -> RoadAhead | None:
    """The road ahead by a map, its lines not yet passed, the nearest first; None: no map tells of it."""
    road, lanes = (fresh(each, VALID_NS["lanes"], seen.now_ns) for each in (seen.road, seen.lanes))
    if road is not None:
        return _ahead(road.message)
    return _ahead(along_lane(lanes.message)) if lanes is not None and lanes.message.source == "map" else None


def _ahead(road: RoadAhead) -> RoadAhead:
    lines = (line for line in road.stop_lines if line.distance_m > LINE_PASSED_M and line.kind in KINDS)
    nearest_first = tuple(sorted(lines, key=lambda line: line.distance_m))
    return RoadAhead(stop_lines=nearest_first, junction_m=road.junction_m, nearest_only=road.nearest_only)


def reckoned(at_m: float | None, motion: Motion) -> float | None:
    """Where a place of a map that fell silent is by now; None once it is passed."""
    if at_m is None or at_m - motion.travelled_m < RECKONED_PASSED_M:
        return None
    return at_m - motion.travelled_m


def stop_line(state: State, mapped: RoadAhead | None, motion: Motion) -> tuple[float | None, str]:
    """Distance and kind of the nearest line; where the map is silent, of the last known one."""
    if mapped is not None:
        return next(((line.distance_m, line.kind) for line in mapped.stop_lines), (None, ""))
    at_m = reckoned(state.stop_m, motion)
    return at_m, state.stop_kind if at_m is not None else ""


def with_line(light: Light | None, line: tuple[float | None, str]) -> Light | None:
    """The light, with whether the map tells its own line."""
    if light is None or light.lined or line[1] != "light" or is_beyond(line[0], light):
        return light
    return msgspec.structs.replace(light, lined=True)


def is_beyond(line_m: float | None, light: Light) -> bool:
    """Whether no line is known, or surely that of another light."""
    return line_m is None or (light.distance_m is not None and line_m > light.distance_m + BEHIND_LIGHT_M)


def stop_signs(signs: Signs) -> tuple[SignAhead, ...]:
    """Stop signs ahead, the nearest first; one at an unknown distance may be the nearest."""
    found = (sign for sign in signs.ahead if sign.reading == "stop")
    return tuple(sorted(found, key=lambda sign: (sign.distance_m or 0.0, sign.first_ns)))


def beyond(signs: tuple[SignAhead, ...]) -> tuple[SignAhead, ...]:
    """Those, of stop signs by their distance, that do not mean the line of the nearest."""
    first_m = (signs[0].distance_m or 0.0) if signs else 0.0
    others = (sign for sign in signs[1:] if not is_earlier_track(sign, signs[0]))
    return tuple(sign for sign in others if sign.at_m > first_m + SAME_LINE_M)


def line_of(sign: SignAhead, stop_m: float | None, stop_kind: str) -> float | None:
    """Where to stand for a stop sign: at the line that a map knows beside it, else at the sign; None: unknown."""
    if stop_m is None or stop_kind == "light":
        return sign.distance_m
    far = sign.distance_m is not None and abs(stop_m - sign.distance_m) > SIGN_TO_LINE_M
    return sign.distance_m if far else stop_m


def unexplained_line(state: State) -> float | None:
    """Where a map knows a stop line that no sign and no light explains (yet); None: nowhere."""
    if state.stop_kind != "stop_line" or state.light is not None:
        return None
    explained = (line_of(sign, state.stop_m, state.stop_kind) for sign in stop_signs(state.signs))
    return None if state.stop_m in explained else state.stop_m


def halted_at_line(state: State, line: tuple[float | None, str], motion: Motion, now_ns: int) -> int | None:
    """When the ego last stood at the stop line of the map; None once it is past it, or was never there."""
    at_m, kind = line
    return _stood(at_m if kind == "stop_line" else None, AT_LINE_M, state.line_halted_ns, motion, now_ns)


def halted(state: State, signs: Signs, line: tuple[float | None, str], motion: Motion, now_ns: int) -> int | None:
    """When the ego last stood at the line of the nearest stop sign; None once it is past it, or was never there."""
    at_m = next((line_of(sign, *line) for sign in stop_signs(signs)), None)
    return _stood(at_m, AT_LINE_M if at_m == line[0] else AT_SIGN_M, state.halted_ns, motion, now_ns)


def _stood(at_m: float | None, within_m: float, before_ns: int | None, motion: Motion, now_ns: int) -> int | None:
    """When the ego last stood within a distance of a place, as long as it has not left that."""
    if at_m is None or at_m - EGO_HALF_M > within_m + CREEP_M:
        return None
    near, speed = at_m - EGO_HALF_M <= within_m, motion.speed_mps
    return now_ns if near and speed is not None and abs(speed) < STANDING_MPS else before_ns
