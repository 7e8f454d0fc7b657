"""One sign under two tracks: what hangs below it holds for both, and a stop sign asks for one stop."""

from collections.abc import Iterable

import msgspec

from services.orchestrator.signs.limits import SURE
from services.orchestrator.state import SignAhead

SAME_M = 8.0
"""Ranges of one sign by two cameras differ by a few metres; two signs of one limit do not follow each other so closely."""

RANGE_SHARE = 0.5
"""From afar only its size tells how far away a sign is: stop signs 90 m away were thought to be 129 m away."""


def without_earlier_tracks(stop: SignAhead, others: tuple[SignAhead, ...]) -> tuple[SignAhead, ...]:
    """The other signs without those that a stop sign was known as before, which is to be forgotten. Other signs have none."""
    return tuple(each for each in others if not is_earlier_track(each, stop))


def is_earlier_track(other: SignAhead, stop: SignAhead) -> bool:
    """Whether another track was of the same stop sign, lost from sight before this one was first seen.

    A second sign behind the first would have been seen since then.
    """
    if stop.reading != "stop" or not _same(stop, other) or other.seen_ns >= stop.first_ns:
        return False
    if stop.distance_m is None or other.distance_m is None or other.seen_m is None:
        return False
    return abs(other.distance_m - stop.distance_m) <= RANGE_SHARE * other.seen_m


def with_its_plates(sign: SignAhead, known: SignAhead | None, others: Iterable[SignAhead]) -> SignAhead:
    """The sign with the plates that another track surely shows of it: who cannot read them from afar sees a sign without any.

    `known`: what was known of this track before. Its shared plates stay once the other track was passed, and go if that one
    no longer shows any.
    """
    if sign.plates or sign.scope != "permanent" or sign.distance_m is None:
        return sign
    there = [each for each in others if _same(sign, each) and _beside(sign, each) and not each.shared]
    twin = next((each for each in there if each.plates and each.believed and each.confidence >= SURE), None)
    if twin is None and not there and known is not None and known.shared and _same(known, sign):
        twin = known
    if twin is None:
        return sign
    return msgspec.structs.replace(sign, plates=twin.plates, scope=twin.scope, shared=True)


def _beside(one: SignAhead, other: SignAhead) -> bool:
    if one.distance_m is None or other.distance_m is None:
        return False
    return abs(one.distance_m - other.distance_m) <= SAME_M


def _same(one: SignAhead, other: SignAhead) -> bool:
    return (one.kind, one.reading, one.unit) == (other.kind, other.reading, other.unit)
