"""Evidence for the kind of road from what is seen, where neither a sign that was passed nor a map tells it.

What follows from it is an assumption: no limit, no speed and no word rests on it. It only takes a limit that was assumed for a
town out of sight, where pictures and speed speak against a town. A barrier is not among it: nothing in perception sees one.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from proto.observed import Observed, Source
from proto.perception import Track
from proto.scene import Fact
from proto.world import WorldState
from services.orchestrator.observations.validity import SECOND
from services.orchestrator.world.actors import CERTAIN, LOST_S

KINDS = ("motorway", "rural", "urban")
BELIEVED = 0.8
"""Posterior from which a kind is assumed; below it the kind is unknown."""
NO_TOWN = 0.2
"""Posterior of a town below which its limit is not shown any more."""
FAST_MPS, OTHERS_MPS, FAST_NS = 90 / 3.6, 70 / 3.6, 20 * SECOND
"""Speed of the ego and of all vehicles that go its way (lorries are slower), and for how long, so that it is a fast flow."""
KNOWN_S, FAR_M, LANE_M, WAY_MPS = 2.0, 40.0, 3.5, 1.5
"""A vehicle tells of a lane if its track is old enough, near enough that a bend does not place it a lane further, and surely goes our way.

It goes our way above that speed over ground, or, with an unknown ego speed, if it pulls away by as much.
"""
MANY_LANES = 3
NEAR_M = 6.0
"""Nearer aside than this, oncoming traffic is on our carriageway."""


class Cue(NamedTuple):
    """The source that tells it, for how long it counts, its log-odds by kind of road at full confidence, and whether it counts in doubt."""

    source: Source
    lasts_s: int
    odds: Mapping[str, float]
    doubted: bool = False


_CROSSED: Mapping[str, float] = {"motorway": -3.0, "urban": 1.5}
CUES: Mapping[str, Cue] = {
    "motorway": Cue("drivelm", 120, {"motorway": 3.0, "urban": -1.0}, doubted=True),
    "info:interstate": Cue("drivelm", 120, {"motorway": 2.0}, doubted=True),
    "expressway": Cue("drivelm", 120, {"motorway": 1.0, "urban": -2.0}, doubted=True),
    "motorway_end": Cue("drivelm", 120, {"motorway": -3.0}, doubted=True),
    "expressway_end": Cue("drivelm", 120, {"motorway": -3.0}, doubted=True),
    "town_entry": Cue("drivelm", 120, {"urban": 3.0}, doubted=True),
    "town_exit": Cue("drivelm", 120, {"urban": -3.0}, doubted=True),
    "calm_street": Cue("drivelm", 120, {"urban": 3.0}, doubted=True),
    **dict.fromkeys(("stop", "yield", "crossing", "roundabout", "light"), Cue("drivelm", 30, _CROSSED)),
    "person": Cue("perception", 30, _CROSSED),
    "oncoming": Cue("perception", 30, {"motorway": -2.0}),
    "lanes": Cue("perception", 30, {"motorway": 1.5}),
    "flow": Cue("can", 60, {"motorway": 0.5, "urban": -3.0}),
}
"""What tells of the kind of road; boards count while they are ahead or doubted: one that was believed and passed is no evidence but
tells the road (`limits.ENDS`)."""


def fast_since(before_ns: int | None, speed_mps: float | None, tracks: tuple[Track, ...], now_ns: int) -> int | None:
    """Since when the ego and all vehicles that go its way are fast; None: one surely is not, or the speed is unknown."""
    if speed_mps is None or speed_mps < FAST_MPS:
        return None
    others = (
        track for track in tracks if _well(track) and track.kind == "vehicle" and speed_mps + track.vx_mps > WAY_MPS
    )
    if any(speed_mps + track.vx_mps + 2.0 * track.sigma_vx_mps < OTHERS_MPS for track in others):
        return None
    return now_ns if before_ns is None or before_ns > now_ns else before_ns


def evidence(
    before: tuple[Observed[str], ...],
    facts: Iterable[Fact],
    tracks: tuple[Track, ...],
    speed_mps: float | None,
    fast_ns: int | None,
    now_ns: int,
) -> tuple[Observed[str], ...]:
    """What is known now, the last of each cue, with what is not too old of before."""
    held = {each.value: each for each in before if 0 <= now_ns - each.stamp_ns < each.valid_for_ns}
    fast = fast_ns is not None and now_ns - fast_ns >= FAST_NS
    told = (*_read(facts), *_seen(tracks, speed_mps), *([("flow", 1.0)] if fast else []))
    for code, sure in told:
        cue, sure = CUES[code], min(1.0, max(0.0, sure))
        held[code] = Observed(
            value=code, confidence=sure, source=cue.source, stamp_ns=now_ns, valid_for_ns=cue.lasts_s * SECOND
        )
    return tuple(held[code] for code in sorted(held))


def _read(facts: Iterable[Fact]) -> Iterator[tuple[str, float]]:
    for fact in facts:
        head = fact.reading.partition(":")[0]
        code = fact.reading if fact.reading in CUES else head
        known = fact.kind in ("sign", "light") and code in CUES and math.isfinite(fact.confidence)
        if known and (fact.believed or CUES[code].doubted):
            yield code, fact.confidence


def _seen(tracks: tuple[Track, ...], speed_mps: float | None) -> Iterator[tuple[str, float]]:
    well = [track for track in tracks if _well(track)]
    for track in well:
        if track.kind != "vehicle":
            yield "person", track.confidence
        elif track.oncoming and abs(track.y_m) < NEAR_M:
            yield "oncoming", track.confidence
    aside = [0.0, *(track.y_m for track in well if _goes_our_way(track, speed_mps))]
    if 1 + round((max(aside) - min(aside)) / LANE_M) >= MANY_LANES:
        yield "lanes", 1.0


def _well(track: Track) -> bool:
    return track.confidence >= CERTAIN and track.age_s >= KNOWN_S and track.unseen_s <= LOST_S


def _goes_our_way(track: Track, speed_mps: float | None) -> bool:
    """Whether a vehicle drives as the ego does; at an unknown speed only one that pulls away surely drives at all."""
    near = track.kind == "vehicle" and 0.0 < track.x_m <= FAR_M
    return near and abs(track.vy_mps) < WAY_MPS and track.vx_mps + (speed_mps or 0.0) >= WAY_MPS


def shares(found: tuple[Observed[str], ...]) -> dict[str, float]:
    """How probable each kind of road is by the evidence alone."""
    odds = {kind: sum(each.confidence * CUES[each.value].odds.get(kind, 0.0) for each in found) for kind in KINDS}
    mass = {kind: math.exp(each) for kind, each in odds.items()}
    return {kind: each / sum(mass.values()) for kind, each in mass.items()}


def assumed(found: tuple[Observed[str], ...]) -> Observed[str] | None:
    """The kind that the evidence speaks for; `unknown` where it is weak or contradicts itself, None without any."""
    if not found:
        return None
    by_kind = shares(found)
    best = max(KINDS, key=by_kind.__getitem__)
    return Observed(
        value=best if by_kind[best] >= BELIEVED else "unknown",
        confidence=round(by_kind[best], 4),
        source="derived",
        stamp_ns=max(each.stamp_ns for each in found),
        valid_for_ns=min(each.valid_for_ns for each in found),
        evidence=", ".join(each.value for each in found),
    )


def is_no_town(world: WorldState) -> bool:
    """Whether the evidence speaks against a town, so that a limit assumed for one is not to be shown."""
    return shares(world.environment.road_evidence)["urban"] < NO_TOWN
