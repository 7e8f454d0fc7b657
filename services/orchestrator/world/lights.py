"""The traffic light ahead: a red that was believed stands until its lamp turns green or it is passed.

Which way the ego goes is not known, so an arrow's red or amber counts as red or amber, and its green permits nothing:
it only ends the red of its own lamp. Where a round red stands beside arrows, no arrow ends it.

A red that was doubted, and is more probably none in later pictures of the same track, is taken back.

A lamp seen from behind, across the junction, is read as one that is off: it ends no lit one but itself, and hides no red.

Who stands at the line has the lamp above the pictures: what it shows then is unknown, neither red nor green.
"""

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

import msgspec

from proto.scene import Fact
from proto.vehicle import Ego
from services.orchestrator.observations.inputs import Stamped
from services.orchestrator.observations.motion import STANDING_MPS, Motion
from services.orchestrator.observations.validity import MOST_SKEW_NS, SECOND, UNSET_AFTER, VALID_NS, number
from services.orchestrator.signs.limits import SURE
from services.orchestrator.state import Light

_STATES = ("red", "red_amber", "amber", "green", "off")
_WAYS = ("left", "straight", "right")
_PERMISSION = ("green", "off")
GREEN_LASTS_NS = 2 * SECOND
"""Permission wears off at once; a red that was believed stands until green is read or the light is passed."""
RED_LASTS_NS = 60 * SECOND
"""Of a red light whose distance nobody knows, while the ego moves; and the age at which a reading is none."""
LAMPS_APART_M = 15.0
"""Lamps of one junction, and the error of their ranges."""
NEXT_JUNCTION_M = 80.0
"""A red light so far behind a green one is of another junction: 17 m/s still come to a stand there at 2 m/s²."""
LIGHT_PASSED_M = -3.0
LOST_NS, AT_LINE_M = SECOND, 7.0
"""A light that the ego stands before, so near and unseen for so long, is out of the pictures."""


def light_ahead(
    light: Light | None, facts: tuple[Fact, ...], motion: Motion, ego: Stamped[Ego] | None, now_ns: int
) -> Light | None:
    """The light after a tick, from what was held and the lamps read since."""
    if light is not None:
        light = _still_ahead(light, motion, ego, now_ns)
    read = [fact for fact in facts if fact.kind == "light" and fact.reading.startswith("light:")]
    for fact in sorted(read, key=lambda each: _lamp(each) not in _PERMISSION):  # red has the last word
        light = _read_light(light, fact, now_ns)
    return light


def _lamp(fact: Fact) -> str:
    return _colour_and_arrow(fact)[0]


def _colour_and_arrow(fact: Fact) -> tuple[str, str]:
    """`light:red_left` is red with an arrow to the left; a round lamp has no arrow."""
    tail = fact.reading.partition(":")[2]
    colour, _, way = tail.rpartition("_")
    return (colour, way) if way in _WAYS else (tail, "")


def _still_ahead(light: Light, motion: Motion, ego: Stamped[Ego] | None, now_ns: int) -> Light | None:
    """The light, nearer by the way travelled; None once it is passed."""
    age_ns = now_ns - light.seen_ns
    if light.state in _PERMISSION and age_ns > GREEN_LASTS_NS:
        return None
    speed = number(ego.message.speed_mps) if ego is not None else None
    stands = speed is not None and speed < STANDING_MPS
    if light.distance_m is None:
        # Nothing tells when it is passed; while the ego stands it is not.
        return None if age_ns > RED_LASTS_NS and speed is not None and not stands else light
    moved = light.distance_m - motion.travelled_m
    if moved < LIGHT_PASSED_M:
        return None
    out_of_view = stands and age_ns > LOST_NS and moved <= AT_LINE_M and light.state not in _PERMISSION
    lost = light.lost_at_line or out_of_view
    return msgspec.structs.replace(light, distance_m=moved, lost_at_line=lost)


class _Reading(NamedTuple):
    """A fact about a light, beside the light held so far."""

    light: Light | None
    fact: Fact
    state: str
    arrow: str
    now_ns: int

    @property
    def same(self) -> bool:
        """Whether it is of the lamp that is held."""
        return self.light is not None and self.light.track_id == self.fact.track_id

    @property
    def age_ns(self) -> int:
        """Since its picture."""
        return self.now_ns - self.fact.frame_stamp_ns

    @property
    def permits(self) -> bool:
        """Whether it says that one may go."""
        return self.state in _PERMISSION

    @property
    def granted(self) -> bool:
        """Green is permission: only a sure and fresh reading grants it. Red and amber are believed at once."""
        sure = self.fact.believed and self.fact.confidence >= SURE
        return sure and -MOST_SKEW_NS <= self.age_ns <= GREEN_LASTS_NS

    @property
    def is_none(self) -> bool:
        """Whether it is no reading of a light, or of one long past."""
        known = self.state in _STATES and math.isfinite(self.fact.confidence)
        return not known or self.age_ns > RED_LASTS_NS


Fate = Literal["held", "ends"]
_FATES: tuple[tuple[Callable[[_Reading], bool], Fate], ...] = (
    (lambda r: r.light is not None and _outdated(r.light, r.fact), "held"),
    (lambda r: r.fact.withdrawn and r.light is not None and _takes_back(r.light, r.fact), "ends"),
    (lambda r: r.fact.withdrawn, "held"),
    (lambda r: r.fact.passed and r.same, "ends"),
    (lambda r: r.fact.passed or r.is_none, "held"),
    (lambda r: r.permits and not r.granted, "held"),
    # Green one way only, and which way the ego goes is not known: the lamp's own red ends, no permission begins.
    (lambda r: r.permits and bool(r.arrow) and r.same, "ends"),
    (lambda r: r.permits and bool(r.arrow), "held"),
    (lambda r: r.light is not None and not _supersedes(r.light, r.fact, r.state, r.now_ns), "held"),
)
"""What a reading does to the light held; the first row that applies decides, and where none does the reading replaces it."""


def _read_light(light: Light | None, fact: Fact, now_ns: int) -> Light | None:
    read = _Reading(light, fact, *_colour_and_arrow(fact), now_ns)
    fate = next((fate for applies, fate in _FATES if applies(read)), None)
    if fate is not None:
        return light if fate == "held" else None
    known_m = light.distance_m if light is not None else None
    round_before = light is not None and read.same and not light.arrow
    return Light(
        state=read.state,
        confidence=min(1.0, max(0.0, fact.confidence)),
        seen_ns=min(fact.frame_stamp_ns, now_ns),
        distance_m=fact.distance_m if fact.distance_m is not None else known_m,
        track_id=fact.track_id,
        arrow="" if round_before else read.arrow,
    )


def _takes_back(light: Light, fact: Fact) -> bool:
    """Whether that there is none ends the light: the same one, read with doubt. A red of which one was sure stands."""
    return light.track_id == fact.track_id and light.confidence < SURE


def _outdated(light: Light, fact: Fact) -> bool:
    """Whether a later frame was read already; a red lamp beside a green one counts whichever frame showed it."""
    beside = light.track_id != fact.track_id and light.state in _PERMISSION and _lamp(fact) not in _PERMISSION
    return fact.frame_stamp_ns < light.seen_ns and not beside


def _supersedes(light: Light, fact: Fact, state: str, now_ns: int) -> bool:
    """Whether a reading replaces the light held: of the same lamp, or of another one that rather counts."""
    if light.track_id == fact.track_id:
        return state not in _PERMISSION or light.state in _PERMISSION or fact.frame_stamp_ns > light.seen_ns
    beyond_m = _beyond_m(light, fact)
    if _is_hidden_by(light, fact, beyond_m):
        return False
    if state == "off" and light.state != "off":
        return False
    if state not in _PERMISSION and light.state in _PERMISSION:
        return beyond_m <= NEXT_JUNCTION_M or light.state == "off"
    if state in _PERMISSION and light.state not in _PERMISSION and beyond_m < -NEXT_JUNCTION_M:
        return True
    # A lamp may be known under another number once it was out of sight.
    lost = now_ns - light.seen_ns > UNSET_AFTER * VALID_NS["light"]
    agree = (state in _PERMISSION) == (light.state in _PERMISSION)
    return (agree or lost) and beyond_m <= LAMPS_APART_M


def _is_hidden_by(light: Light, fact: Fact, beyond_m: float) -> bool:
    """Whether a red arrow stands beside a round red: the round one is for every way, and no arrow may end it."""
    arrow, round_red = _colour_and_arrow(fact)[1], light.state not in _PERMISSION and not light.arrow
    return bool(arrow) and round_red and beyond_m >= -LAMPS_APART_M


def _beyond_m(light: Light, fact: Fact) -> float:
    """How far behind the light held another one stands; 0 where a distance is unknown."""
    return fact.distance_m - light.distance_m if fact.distance_m is not None and light.distance_m is not None else 0.0
