"""Where the ego gives way, or the right of way is unknown: there it has to be slow enough before road users come into view.

A line of a map or a sign asks for it. So does a junction in town that no known line, light or sign rules: in most
countries those from one side go first.
"""

from collections.abc import Iterator
from typing import NamedTuple

from services.orchestrator.observations.inputs import RoadAhead
from services.orchestrator.observations.validity import Motion
from services.orchestrator.state import GiveWay, State
from services.orchestrator.world.actors import EGO_HALF_M
from services.orchestrator.world.stop_lines import LINE_PASSED_M, RULING, SIGN_TO_LINE_M, reckoned
from services.orchestrator.world.stops import LINE_CONFIDENCE, UNKNOWN_STOP_M, to_be_told_m

READY_MPS = 25.0 / 3.6
"""Ours: from it a driver stops for a road user 14 m away on a wet road (0.5) after 1.25 s of reaction. Law asks for a moderate
speed there, and names none (StVO § 8 Abs. 2)."""
BEFORE_MIDDLE_M = 8.0
"""From where one gives way to the middle of a junction without a line, by which maps tell it."""
LINE_TO_MIDDLE_M = 25.0
"""A line so far before a junction, at most, is that junction's."""
SAME_JUNCTION_M = 10.0
OVERHEAD_M = 30.0
"""A light hangs beyond its junction."""
SEEN_NS = 10_000_000_000
"""A passed sign that was seen so lately was the next junction's."""
RULED_BY = frozenset({"stop", "yield", "priority_road", "priority_here"})
IN_TOWN = frozenset({"urban", "living_street", ""})
"""Types of road with junctions that no sign rules; empty: unknown."""
MAIN_ROADS_UNSIGNED = frozenset({"GBR", "IRL", "USA"})
"""Countries where a main road shows no sign at its junctions: there a junction without one is no reason to slow down."""


class Place(NamedTuple):
    """One of them; `room_m` from the front bumper to where one would stand."""

    why: str
    """`give_way`, or `junction` where the right of way is unknown."""
    room_m: float
    confidence: float

    def begins_m(self, allowed_mps: float) -> float:
        """The distance at which a driver at the allowed speed has to be told."""
        return to_be_told_m(allowed_mps, READY_MPS)


def by_map(before: GiveWay, mapped: RoadAhead | None, motion: Motion) -> GiveWay:
    """What the map tells of it; where that is silent, what it told last, nearer by the way travelled."""
    junction_m = reckoned(before.junction_m, motion)
    if mapped is None:
        return GiveWay(line_m=reckoned(before.line_m, motion), junction_m=junction_m, ruled=before.ruled)
    line_m = next((line.distance_m for line in mapped.stop_lines if line.kind == "yield_line"), None)
    if line_m is None and mapped.nearest_only:
        line_m = reckoned(before.line_m, motion)
    at_m = mapped.junction_m
    if at_m is None:
        return GiveWay(line_m=line_m)
    own = any(0.0 <= at_m - line.distance_m <= LINE_TO_MIDDLE_M for line in mapped.stop_lines if line.kind in RULING)
    same = before.ruled and junction_m is not None and abs(junction_m - at_m) <= SAME_JUNCTION_M
    return GiveWay(line_m=line_m, junction_m=at_m, ruled=own or same)


def place(state: State) -> Place | None:
    """The nearest one ahead."""
    return min((*_line(state), *_signs(state), *_junction(state)), key=lambda each: each.room_m, default=None)


def _line(state: State) -> Iterator[Place]:
    if state.give_way.line_m is not None:
        yield Place("give_way", state.give_way.line_m - EGO_HALF_M, LINE_CONFIDENCE)


def _signs(state: State) -> Iterator[Place]:
    """Signs whose line no map tells."""
    line_m = state.give_way.line_m
    for sign in state.signs.ahead:
        at_m = sign.distance_m if sign.distance_m is not None else UNKNOWN_STOP_M
        if sign.reading == "yield" and sign.ours and (line_m is None or abs(at_m - line_m) > SIGN_TO_LINE_M):
            yield Place("give_way", at_m - EGO_HALF_M, sign.confidence)


def _junction(state: State) -> Iterator[Place]:
    """A junction in town, or on a road of unknown type, if nothing is known to rule it."""
    at_m = state.give_way.junction_m
    if at_m is None or at_m - BEFORE_MIDDLE_M <= LINE_PASSED_M or state.give_way.ruled:
        return
    unsigned = state.road in IN_TOWN and state.signs.country not in MAIN_ROADS_UNSIGNED
    if unsigned and not _by_light(state, at_m) and not _by_sign(state, at_m):
        yield Place("junction", at_m - BEFORE_MIDDLE_M - EGO_HALF_M, LINE_CONFIDENCE)


def _by_light(state: State, junction_m: float) -> bool:
    light = state.light
    if light is None or light.state == "off":
        return False
    return light.distance_m is None or light.distance_m <= junction_m + OVERHEAD_M


def _by_sign(state: State, junction_m: float) -> bool:
    ruling = [sign for sign in state.signs.ahead if sign.distance_m is None or sign.distance_m <= junction_m]
    ruling += [sign for sign in state.signs.recent if state.now_ns - sign.seen_ns <= SEEN_NS]
    return any(sign.believed and sign.reading in RULED_BY for sign in ruling)
