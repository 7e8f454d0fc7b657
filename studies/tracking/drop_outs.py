"""Withholds one vehicle's boxes for half a second at a time, from both cameras, and asks whether it comes back as itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from services.perception.detect.detection import Detection, overlaps
from studies.tracking.pairing import Scene, scene
from studies.tracking.recording import Look, Step
from studies.tracking.seeing import Found, see

LASTS_S, EVERY_S = 0.5, 1.5
FOLLOWED_S = 1.0
"""Only a vehicle that was followed under one id for so long, and can be seen for as long after, is withheld."""
BACK_WITHIN_S = 0.5
SAME_IOU = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class DropOut:
    """A vehicle withheld from a stamp on."""

    actor_id: int
    start_ns: int

    @property
    def end_ns(self) -> int:
        """When it may be seen again."""
        return self.start_ns + round(LASTS_S * 1e9)


@dataclass(frozen=True, slots=True, kw_only=True)
class Kept:
    """How many drop-outs there were, and after how many the vehicle had its old id."""

    tried: int
    kept: int


def drop_outs(steps: Sequence[Step], found: Found, scenes: Sequence[Scene], seed: int, runs: int = 3) -> Kept:
    """Try drop-outs on a drive, in several runs with different vehicles and times."""
    tried = kept = 0
    for run in range(runs):
        chosen = list(_choose(scenes, np.random.default_rng([seed, run]), EVERY_S * run / runs))
        after = [scene(view) for view in see(steps, list(withhold(steps, found, chosen)))]
        tried += len(chosen)
        kept += sum(_keeps(after, each) for each in chosen)
    return Kept(tried=tried, kept=kept)


def _choose(scenes: Sequence[Scene], chance: np.random.Generator, phase_s: float) -> Iterator[DropOut]:
    start_ns = scenes[0].stamp_ns + round((FOLLOWED_S + phase_s) * 1e9)
    while start_ns + round((LASTS_S + BACK_WITHIN_S) * 1e9) <= scenes[-1].stamp_ns:
        able = sorted(_able(scenes, start_ns))
        if able:
            yield DropOut(actor_id=able[int(chance.integers(len(able)))], start_ns=start_ns)
        start_ns += round(EVERY_S * 1e9)


def _able(scenes: Sequence[Scene], start_ns: int) -> set[int]:
    """Actors that were followed under one id before and can be seen until after."""
    follow_ns = round(FOLLOWED_S * 1e9)
    before = [each for each in scenes if start_ns - follow_ns <= each.stamp_ns < start_ns]
    after = [each for each in scenes if start_ns <= each.stamp_ns < start_ns + follow_ns]
    seen = set.intersection(*({v.actor_id for v in each.vehicles} for each in (*before, *after)))
    owned = {actor: {each.pairs.get(actor) for each in before} for actor in seen}
    return {actor for actor, ids in owned.items() if len(ids) == 1 and None not in ids}


def withhold(steps: Sequence[Step], found: Found, chosen: Sequence[DropOut]) -> Iterator[list[Detection]]:
    """The boxes of each picture but those of the vehicles withheld then."""
    pictures = ((step.stamp_ns, look) for step in steps for look in step.looks)
    for (stamp_ns, look), boxes in zip(pictures, found, strict=True):
        gone = {each.actor_id for each in chosen if each.start_ns <= stamp_ns < each.end_ns}
        yield [box for box in boxes if not _shows(box, look, gone)]


def _shows(box: Detection, look: Look, actors: set[int]) -> bool:
    places = [label.box_px for label in look.labels if label.kind == "vehicle" and label.id in actors]
    if box.kind != "vehicle" or not places:
        return False
    ours = np.array([(box.x0_px, box.y0_px, box.x1_px, box.y1_px)], np.float32)
    return bool(overlaps(ours, np.array(places, np.float32)).max() >= SAME_IOU)


def _keeps(scenes: Sequence[Scene], drop: DropOut) -> bool:
    """Whether the first track that is the vehicle's again is the last one it had before."""
    until_ns = drop.end_ns + round(BACK_WITHIN_S * 1e9)
    before = [each.pairs.get(drop.actor_id) for each in scenes if each.stamp_ns < drop.start_ns]
    back = (each.pairs.get(drop.actor_id) for each in scenes if drop.end_ns <= each.stamp_ns < until_ns)
    old = next((track for track in reversed(before) if track is not None), None)
    return old is not None and next((track for track in back if track is not None), None) == old
