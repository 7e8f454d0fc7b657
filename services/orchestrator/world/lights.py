"""The traffic light ahead: a red that was believed stands until its lamp turns green or it is passed.

The ego's way is not known: an arrow's red or amber counts as red or amber, and its green only ends the red of its own
lamp. No arrow ends a round red beside it. A red that was doubted and is withdrawn by later pictures of its track ends.
A red of a single doubted picture, or one that the pictures of 3 s do not show, lowers the target; words on it wait for
another picture or a mapped line.
A lamp seen from behind, across the junction, is read as off: it ends no lit lamp but itself, and hides no red.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import msgspec

from proto.scene import Fact
from services.orchestrator.observations.validity import (
    MOST_SKEW_NS,
    SECOND,
    UNSET_AFTER,
    VALID_NS,
    Motion,
    distance_ahead,
)
from services.orchestrator.signs.limits import SURE
from services.orchestrator.state import PERMISSION, Light

_STATES = ("red", "red_amber", "amber", *PERMISSION)
_WAYS = ("left", "straight", "right")
GREEN_LASTS_NS = 2 * SECOND
OUT_OF_SIGHT_NS = UNSET_AFTER * VALID_NS["light"]
RED_LASTS_NS = 60 * SECOND
"""Of a red light at an unknown distance while the ego moves; older readings count for nothing."""
LAMPS_APART_M = 15.0
"""Lamps of one junction, and the error of their ranges."""
NEXT_JUNCTION_M = 80.0
"""A red light so far behind a green one is of another junction: 17 m/s still come to a stand there at 2 m/s²."""
LIGHT_PASSED_M = -3.0
LOST_NS, AT_LINE_M = SECOND, 7.0
"""Within 7 m the lamp is above the cameras' view: unseen for 1 s while the ego stands there, its state is unknown."""
_NO_LIGHT = Light(state="off", confidence=1.0, seen_ns=-(1 << 62), distance_m=None, track_id=-1)
"""Stands for no light; any reading supersedes it."""


def light_ahead(light: Light | None, facts: tuple[Fact, ...], motion: Motion, now_ns: int) -> Light | None:
    """The light after a tick, from the one held and the lamps read since."""
    light = _still_ahead(light, motion, now_ns) if light is not None else None
    read = [fact for fact in facts if fact.kind == "light" and fact.reading.startswith("light:")]
    for fact in sorted(read, key=lambda each: _colour_and_arrow(each)[0] not in PERMISSION):  # red has the last word
        light = _read_light(light, fact, now_ns)
    return light


def _colour_and_arrow(fact: Fact) -> tuple[str, str]:
    """`light:red_left` is red with an arrow to the left; a round lamp has no arrow."""
    tail = fact.reading.partition(":")[2]
    colour, _, way = tail.rpartition("_")
    return (colour, way) if way in _WAYS else (tail, "")


def _still_ahead(light: Light, motion: Motion, now_ns: int) -> Light | None:
    """The light, nearer by the way travelled; None once it is passed, or a permission is worn off."""
    if light.permits and now_ns - light.seen_ns > GREEN_LASTS_NS:
        return None
    missed_ns = light.missed_ns + motion.read_ns
    light = msgspec.structs.replace(light, missed_ns=missed_ns)
    if light.distance_m is None:  # nothing tells when it is passed; while the ego stands it is not
        moves = motion.known and not motion.stands
        return None if moves and missed_ns > RED_LASTS_NS else light
    moved = light.distance_m - motion.travelled_m
    if moved < LIGHT_PASSED_M:
        return None
    out_of_view = motion.stands and missed_ns > LOST_NS and moved <= AT_LINE_M and not light.permits
    return msgspec.structs.replace(light, distance_m=moved, lost_at_line=light.lost_at_line or out_of_view)


class _Reading(NamedTuple):
    """A fact about a light, beside the light held so far."""

    held: Light
    fact: Fact
    state: str
    arrow: str
    now_ns: int

    @property
    def same(self) -> bool:
        """Whether it is of the lamp that is held."""
        return self.held.track_id == self.fact.track_id

    @property
    def permits(self) -> bool:
        """Whether it does not ask to stop."""
        return self.state in PERMISSION

    @property
    def at_m(self) -> float | None:
        """Its distance; None: unknown, or none that a lamp in the pictures can have."""
        return distance_ahead(self.fact.distance_m)

    @property
    def passed(self) -> bool:
        """Whether it was passed; one that is far ahead by its own distance was not."""
        return self.fact.passed and (self.at_m is None or self.at_m <= LAMPS_APART_M)

    @property
    def beyond_m(self) -> float:
        """How far behind the lamp held it stands; 0 where a distance is unknown."""
        to_m, held_m = self.at_m, self.held.distance_m
        return 0.0 if to_m is None or held_m is None else to_m - held_m

    @property
    def outdated(self) -> bool:
        """Whether a later frame was read already; a red lamp beside a green one counts whichever frame showed it."""
        beside = self.held.permits and not self.permits and not self.same
        return self.fact.frame_stamp_ns < self.held.seen_ns and not beside

    @property
    def is_none(self) -> bool:
        """Whether it is no reading of a light, or too old."""
        known = self.state in _STATES and math.isfinite(self.fact.confidence)
        return not known or self.now_ns - self.fact.frame_stamp_ns > RED_LASTS_NS

    @property
    def granted(self) -> bool:
        """Whether a permission is sure and fresh; red and amber are believed at once."""
        sure = self.fact.believed and self.fact.confidence >= SURE
        return sure and -MOST_SKEW_NS <= self.now_ns - self.fact.frame_stamp_ns <= GREEN_LASTS_NS

    @property
    def hidden(self) -> bool:
        """Whether it is an arrow beside a round red, which is for every way, or an unlit lamp beside a lit one."""
        round_red = not self.held.permits and not self.held.arrow and self.beyond_m >= -LAMPS_APART_M
        return round_red if self.arrow else self.state == "off" and self.held.state != "off"

    @property
    def supersedes(self) -> bool:
        """Whether it replaces the light held: of the same lamp, or of another one that rather counts."""
        if self.same:
            return not self.permits or self.held.permits or self.fact.frame_stamp_ns > self.held.seen_ns
        if self.hidden:
            return False
        if self.held.permits and not self.permits:
            return self.held.state == "off" or self.beyond_m <= NEXT_JUNCTION_M
        # A lamp may be known under another number once it was out of sight.
        lost = self.now_ns - self.held.seen_ns > OUT_OF_SIGHT_NS
        if lost or self.permits == self.held.permits:
            return self.beyond_m <= LAMPS_APART_M
        return self.beyond_m < -NEXT_JUNCTION_M

    @property
    def seen_twice(self) -> bool:
        """Whether a red or amber lamp is believed, or a picture before showed one at this junction."""
        before = not self.held.permits and abs(self.beyond_m) <= LAMPS_APART_M
        again = self.held.seen_twice or self.fact.frame_stamp_ns > self.held.seen_ns
        return self.fact.believed or (before and again)

    @property
    def one_way(self) -> bool:
        """Whether an arrow permits to go: the lamp's own red ends, no permission begins."""
        return self.permits and bool(self.arrow)

    @property
    def taken_back(self) -> bool:
        """Whether it withdraws the lamp held; a red of which one was sure stands."""
        return self.fact.withdrawn and self.same and self.held.confidence < SURE


HELD, ENDS, REPLACED = "held", "ends", "replaced"
_FATES: tuple[tuple[Callable[[_Reading], bool], str], ...] = (
    (lambda r: r.outdated, HELD),
    (lambda r: r.taken_back, ENDS),
    (lambda r: r.fact.withdrawn, HELD),
    (lambda r: r.passed and r.same, ENDS),
    (lambda r: r.fact.passed or r.is_none, HELD),
    (lambda r: r.permits and not r.granted, HELD),
    (lambda r: r.one_way and r.same, ENDS),
    (lambda r: r.one_way, HELD),
    (lambda r: r.supersedes, REPLACED),
    (lambda r: True, HELD),
)
"""What a reading does to the light held; the first row that applies decides."""


def _read_light(light: Light | None, fact: Fact, now_ns: int) -> Light | None:
    held = light or _NO_LIGHT
    read = _Reading(held, fact, *_colour_and_arrow(fact), now_ns)
    fate = next(fate for applies, fate in _FATES if applies(read))
    if fate != REPLACED:
        return light if fate == HELD else None
    return Light(
        state=read.state,
        confidence=min(1.0, max(0.0, fact.confidence)),
        seen_ns=min(fact.frame_stamp_ns, now_ns),
        distance_m=read.at_m if read.at_m is not None else held.distance_m,
        track_id=fact.track_id,
        arrow="" if read.same and not held.arrow else read.arrow,
        lined=held.lined and (read.same or abs(read.beyond_m) <= LAMPS_APART_M),
        seen_twice=read.seen_twice,
    )
