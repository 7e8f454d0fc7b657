"""One sign under two tracks: what hangs below it holds for both, and a stop sign asks for one stop."""

from collections.abc import Iterable

import msgspec

from services.orchestrator.signs.limits import SURE
from services.orchestrator.state import InForce, SignAhead

SAME_M = 8.0
"""Ranges of one sign by two cameras differ by a few metres; two signs of one limit do not follow each other so closely."""
UNSEEN_NS = 1_000_000_000
"""A track without a word for so long, while pictures were read, is lost: the front end repeats what it sees twice a second."""
RANGE_SHARE = 0.5
"""From afar only its size tells how far away a sign is: stop signs 90 m away were thought to be 129 m away."""


def without_earlier_tracks(stop: SignAhead, others: tuple[SignAhead, ...]) -> tuple[SignAhead, ...]:
    """The other signs without the earlier tracks of a stop sign; other signs have none."""
    return tuple(each for each in others if not is_earlier_track(each, stop))


def is_earlier_track(other: SignAhead, stop: SignAhead) -> bool:
    """Whether another track of the same stop sign was lost before this one began; a second sign would have been seen since."""
    return stop.reading == "stop" and _was_lost_before(other, stop)


def _was_lost_before(other: SignAhead, sign: SignAhead) -> bool:
    """Whether a track was lost before another of the same sign began, as far apart as its size from afar may tell."""
    lost = _same(sign, other) and other.seen_ns < sign.first_ns
    return lost and other.seen_m is not None and _apart_m(other, sign) <= RANGE_SHARE * other.seen_m


def with_its_plates(sign: SignAhead, known: SignAhead | None, others: Iterable[SignAhead]) -> SignAhead:
    """The sign with the plates that another track surely shows of it: from afar plates cannot be read.

    A track that was lost from afar is often thought to be nearer than the post, or farther.
    `known`: what was known of this track before. Its shared plates stay once the other track was passed, and go if that one
    no longer shows any.
    """
    if sign.plates or sign.scope != "permanent":
        return sign
    same = [each for each in others if _same(sign, each) and not each.shared]
    lost = sign.missed_ns >= UNSEEN_NS
    there = [each for each in same if _apart_m(sign, each) <= SAME_M or (lost and _was_lost_before(sign, each))]
    twins = [each for each in there if each.plates and each.believed and each.confidence >= SURE]
    if known is not None and known.shared and _same(known, sign) and sign.distance_m is not None and not same:
        twins = [known]
    return msgspec.structs.replace(sign, plates=twins[0].plates, scope=twins[0].scope, shared=True) if twins else sign


def as_passed(sign: SignAhead, restricted: Iterable[InForce], now_ns: int) -> SignAhead:
    """The sign with the plates of a post that was passed since it was last seen, if that one shows its number.

    A track that was lost from afar is counted past late, for only its size told how far away it was. A second sign well
    behind the post would have been seen since.
    """
    if sign.plates or sign.scope != "permanent":
        return sign
    for each in restricted:
        same = (each.posted.reading, each.posted.unit) == (sign.reading, sign.unit)
        late = now_ns - each.since_ns <= RANGE_SHARE * (now_ns - sign.seen_ns)
        if same and late and each.posted.confidence >= SURE and each.since_ns > sign.seen_ns:
            return msgspec.structs.replace(sign, plates=each.posted.plates, scope=each.posted.scope, shared=True)
    return sign


def _apart_m(one: SignAhead, other: SignAhead) -> float:
    """How far apart two signs stand; not finite where a distance is unknown."""
    return abs(one.at_m - other.at_m)


def _same(one: SignAhead, other: SignAhead) -> bool:
    return (one.kind, one.reading, one.unit) == (other.kind, other.reading, other.unit)
