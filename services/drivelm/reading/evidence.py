"""Fusing what was read of one track in frame after frame, as log-likelihoods over its possible readings.

Frames of one approach are not independent (same dirt, same angle), so each counts for less than its probability
says, no single frame may decide alone, and belief needs frames that were clear in themselves. Frames that err do so alike
(a lettering's 3 that looks like a 5), so that their product grows sure of what their mean leaves open. A lower number that
they showed now and then therefore stays as probable as it was in the mean.
"""

import math
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import NamedTuple

from services.drivelm.vocabulary.classes import OTHER

FLOOR, CEILING = 0.004, 0.985
"""No frame rules a reading out, or in, beyond these probabilities."""
CLEAR = 0.75
"""A frame whose best reading reaches this probability is a clear one."""
FRAME_WEIGHT = 0.6
"""Share of a frame's log-likelihood that counts, at full size; the rest is taken as correlation with other frames."""
SMALL_PX, FULL_PX = 8.0, 26.0
"""Heights at which a crop starts to count, and counts fully."""
LEGIBLE_PX = 24.0
"""From this height on a frame that shows nothing where a number could be is a clear one: below, the number may be blurred away."""
EMPTY = frozenset({"no_vehicles", "led:blank"})
CONTESTED = 0.08
"""Share of what was seen from which on a lower number of the same kind is no less probable than that share."""
SIZE_COUNTS = 4.0
"""How much more of what was seen a larger frame is: by this power of its size."""


class Evidence(NamedTuple):
    """What is known of a track. ``unlisted`` is the log-likelihood of any reading never offered so far; ``shown`` what each
    reading was given by the frames, by their size, and ``looked`` how much they were together."""

    scores: Mapping[str, float] = {}
    unlisted: float = 0.0
    clear: Mapping[str, float] = {}
    frames: int = 0
    shown: Mapping[str, float] = {}
    looked: float = 0.0


class Belief(NamedTuple):
    """The best reading, its posterior, the clear frames behind it, and the runners-up."""

    reading: str
    probability: float
    clear_frames: float
    ranked: tuple[tuple[str, float], ...]


def weight(height_px: float) -> float:
    """How much a crop of this height counts."""
    return FRAME_WEIGHT * _size(height_px)


def _size(height_px: float) -> float:
    return min(1.0, max(0.1, (height_px - SMALL_PX) / (FULL_PX - SMALL_PX)))


def fused(before: Evidence, ranked: Iterable[tuple[str, float]], height_px: float, keep: float = 1.0) -> Evidence:
    """Add one frame's readings (with probabilities). ``keep`` below 1 forgets: for lights and panels, which change."""
    offered = dict(ranked)
    share = weight(height_px)
    left_over = max(1.0 - sum(offered.values()), 0.0) / 10.0
    rest = share * math.log(_bounded(left_over))
    scores = {label: keep * score + rest for label, score in before.scores.items() if label not in offered}
    for label, probability in offered.items():
        scores[label] = keep * before.scores.get(label, before.unlisted) + share * math.log(_bounded(probability))
    clear = {label: keep * count for label, count in before.clear.items()}
    best = max(offered, key=lambda label: offered[label], default=OTHER)
    if offered.get(best, 0.0) >= CLEAR and (best not in EMPTY or height_px >= LEGIBLE_PX):
        clear[best] = clear.get(best, 0.0) + 1.0
    seen = _size(height_px) ** SIZE_COUNTS
    shown = {label: keep * before.shown.get(label, 0.0) + seen * offered.get(label, 0.0) for label in scores}
    looked = keep * before.looked + seen * max(1.0, sum(offered.values()))
    return Evidence(scores, keep * before.unlisted + rest, clear, before.frames + 1, shown, looked)


def belief(evidence: Evidence, keep: int = 4) -> Belief:
    """The posterior over everything offered, with one more share for all that never was."""
    if not evidence.scores:
        return Belief(OTHER, 0.0, 0.0, ())
    top = max(max(evidence.scores.values()), evidence.unlisted)
    masses = {label: math.exp(score - top) for label, score in evidence.scores.items()}
    total = sum(masses.values()) + math.exp(evidence.unlisted - top)
    posterior = _with_lower({label: mass / total for label, mass in masses.items()}, evidence)
    ranked = sorted(posterior.items(), key=lambda row: (-row[1], row[0]))
    reading, probability = ranked[0]
    return Belief(reading, probability, evidence.clear.get(reading, 0.0), tuple(ranked[:keep]))


def _with_lower(posterior: dict[str, float], evidence: Evidence) -> dict[str, float]:
    """The posterior with lower numbers no less probable than the frames showed them in the mean, at the cost of all others."""
    kind, number = _number(max(posterior, key=lambda label: posterior[label]))
    if number is None:
        return posterior
    held = {}
    for label, shown in evidence.shown.items():
        alike, lower = _number(label)
        share = shown / evidence.looked
        if alike == kind and lower is not None and lower < number and share >= max(CONTESTED, posterior[label]):
            held[label] = share
    others = 1.0 - sum(posterior[label] for label in held)
    rest = (1.0 - sum(held.values())) / others if held else 1.0
    return {label: held.get(label, share * rest) for label, share in posterior.items()}


@lru_cache(maxsize=1024)
def _number(label: str) -> tuple[str, int | None]:
    kind, _, value = label.rpartition(":")
    return kind, int(value) if value.isdigit() else None


def _bounded(probability: float) -> float:
    return min(CEILING, max(FLOOR, probability))
