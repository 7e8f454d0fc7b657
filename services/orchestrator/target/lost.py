"""How long an actor bounds the target once it is no longer seen to: no doubt raises the target, and no single picture does.

An actor that vanishes, fades below the floor of confidence, leaves the lane for a moment or comes back under another number did not
dissolve. It bounds as it did, until its time is over or until it was seen elsewhere without a break.
"""

from typing import NamedTuple

from msgspec.structs import replace

from services.orchestrator.state import Lost

VANISHED_NS = 3_000_000_000
"""For how long an actor that was seen well bounds the target once it is not seen to."""
HARDLY_NS = 500_000_000
"""The same of any other actor, which may be a ghost."""
SURELY_NS = 500_000_000
"""Seen for so long, without a break, an actor is believed to be elsewhere, or to ask for less: five pictures."""
RISES_MPS2 = 3.0
"""A bound rises by no more until then: no lead speeds up faster for long."""
MOST_LOST = 24


class Asks(NamedTuple):
    """The bound that an actor sets in this tick."""

    track_id: int
    why: str
    mps: float
    known: bool
    """The actor is seen well, and was for long enough."""


def settled(
    lost: tuple[Lost, ...], asked: dict[int, Asks], elsewhere: dict[int, bool] | None, now_ns: int
) -> tuple[Lost, ...]:
    """How actors bound from this tick on, the lowest bounds first.

    `elsewhere`: of the actors that are seen, whether surely; None in a tick that sees nothing.
    """
    before = {each.track_id: each for each in lost}
    seen = {} if elsewhere is None else elsewhere
    asking = (_asking(before.get(number), asks, seen.get(number, False), now_ns) for number, asks in asked.items())
    silent = (_silent(each, seen.get(each.track_id), now_ns) for each in lost if each.track_id not in asked)
    found = [*asking, *(each for each in silent if each is not None)]
    return tuple(sorted(found, key=lambda each: (each.mps, each.track_id))[:MOST_LOST])


def unseen(lost: tuple[Lost, ...], blind_ns: int) -> tuple[Lost, ...]:
    """The same actors, where time that no picture tells of does not count: blindness is no evidence."""
    return tuple(_later(each, blind_ns) for each in lost) if blind_ns else lost


def _later(lost: Lost, by_ns: int) -> Lost:
    higher_ns = None if lost.higher_ns is None else lost.higher_ns + by_ns
    return replace(lost, stamp_ns=lost.stamp_ns + by_ns, higher_ns=higher_ns)


def holds_back(lost: Lost, asked: dict[int, Asks]) -> bool:
    """Whether an actor bounds by more than what it asks for now."""
    asks = asked.get(lost.track_id)
    return asks is None or lost.mps < asks.mps


def _asking(before: Lost | None, asks: Asks, surely: bool, now_ns: int) -> Lost:
    """An actor in the way: at once where it asks for more, at a bounded rate or after a while where it asks for less."""
    known = asks.known or (before is not None and before.known)
    now = Lost(track_id=asks.track_id, why=asks.why, mps=asks.mps, stamp_ns=now_ns, known=known)
    if before is None or asks.mps <= (most_mps := before.mps + RISES_MPS2 * (now_ns - before.stamp_ns) / 1e9):
        return now
    if before.known and not surely:
        return replace(now, why=before.why, mps=most_mps)
    least_mps = min(asks.mps, before.higher_mps if before.higher_mps is not None else asks.mps)
    since_ns = before.higher_ns if before.higher_ns is not None else now_ns
    if now_ns - since_ns >= SURELY_NS:
        return replace(now, mps=max(most_mps, least_mps))
    return replace(now, why=before.why, mps=most_mps, higher_ns=since_ns, higher_mps=least_mps)


def _silent(before: Lost, surely: bool | None, now_ns: int) -> Lost | None:
    """An actor that is not in the way, or not seen (None); None: it bounds no more."""
    if now_ns - before.stamp_ns > (VANISHED_NS if before.known else HARDLY_NS):
        return None
    if surely is None or (before.known and not surely):
        return replace(before, higher_ns=None, higher_mps=None)
    since_ns = before.higher_ns if before.higher_ns is not None else now_ns
    return None if now_ns - since_ns >= SURELY_NS else replace(before, higher_ns=since_ns)
