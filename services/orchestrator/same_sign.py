"""One sign that two cameras follow: what hangs below it holds for both of its tracks."""

from collections.abc import Iterable

import msgspec

from services.orchestrator.limits import SURE
from services.orchestrator.state import SignAhead

SAME_M = 8.0
"""Ranges of one sign by two cameras differ by a few metres; two signs of one limit do not follow each other so closely."""


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
