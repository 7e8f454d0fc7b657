"""Which limit applies: candidates weighed by the pack's precedence, and the most careful one where doubt remains.

Unknown facts never raise the limit: a condition that may hold is taken to hold. A further restriction never raises it:
every sign in force and every cap counts, and only a sign that is trusted and surely in force replaces the road's default.
"""

from collections.abc import Iterable

import msgspec

from proto.rules import Situation
from services.rules.limits.limit_candidates import (
    RANK,
    LimitCandidate,
    advisory_candidates,
    law_candidates,
    misread_candidates,
    posted_candidates,
    reads,
)
from services.rules.packs.loading import Pack

PRESUMED = 0.8
"""Factor on the confidence when a condition is taken to hold because a fact is unknown."""
CONFLICT = 0.7
UNCERTAIN = 0.6
UNSETTLED = 0.9
"""Factor for a temporary sign or gantry beside a permanent one where the law does not say that it goes first."""
UNSUPPORTED_SCOPE = 0.9
"""Factor for a gantry where the loaded pack has no provisions on variable signs."""


class Verdict(msgspec.Struct, frozen=True, kw_only=True):
    """The limit that applies in one pack's law, or none, and what speaks against it."""

    candidate: LimitCandidate | None
    against: tuple[LimitCandidate, ...] = ()
    """Candidates that contradict it; the lower value was taken."""
    replaced: tuple[LimitCandidate, ...] = ()
    """Permanent signs that show more, beside a temporary sign or gantry of which the law does not say that it goes first."""
    uncertain: bool = False
    confidence: float = 0.0


def decide(pack: Pack, situation: Situation) -> Verdict:
    """Weigh everything that speaks for a limit here."""
    posted = posted_candidates(pack, situation)
    governing = tuple(candidate for candidate in posted if candidate.replaces_default)
    defaults = () if governing else preferred(pack, law_candidates(pack, situation, caps=False))
    pool = (*posted, *defaults, *law_candidates(pack, situation, caps=True))
    candidate = lowest(pool) or lowest(advisory_candidates(pack, situation))
    doubted = lowest(misread_candidates(pack, situation))
    if doubted is not None and (candidate is None or doubted.mps < candidate.mps):
        return _verdict(pack, doubted, () if candidate is None else (candidate,), uncertain=True)
    if candidate is None:
        return Verdict(candidate=None)
    verdict = _verdict(pack, candidate, contradictions(candidate, governing), uncertain=False)
    return _unsettled(pack, verdict, candidate, governing)


def preferred(pack: Pack, candidates: tuple[LimitCandidate, ...]) -> tuple[LimitCandidate, ...]:
    """Of contradicting provisions those of the highest kind that surely holds here, and those above it that may hold.

    The kinds are statute, then sign table, then guidance.
    """
    found: list[LimitCandidate] = []
    for kind in pack.manifest.precedence:
        found += (candidate for candidate in candidates if candidate.kind == kind)
        if any(not candidate.presumed for candidate in found):
            break
    return tuple(found)


def lowest(candidates: Iterable[LimitCandidate]) -> LimitCandidate | None:
    """The most conservative candidate; of equals the one that governs, then the one best known."""
    ordered = sorted(candidates, key=lambda c: (c.mps, -RANK.get(c.basis, 0), len(c.presumed), -c.confidence))
    return ordered[0] if ordered else None


def contradictions(candidate: LimitCandidate, governing: tuple[LimitCandidate, ...]) -> tuple[LimitCandidate, ...]:
    """Signs of the same or a higher rank that show more than the one taken: one of the two must be wrong or past."""
    if candidate.basis not in RANK:
        return ()
    return tuple(c for c in governing if RANK[c.basis] >= RANK[candidate.basis] and c.mps > candidate.mps)


def _unsettled(
    pack: Pack, verdict: Verdict, candidate: LimitCandidate, governing: tuple[LimitCandidate, ...]
) -> Verdict:
    """The lower sign counts in any case; a little less surely where the law does not say which of the two goes first."""
    if candidate.basis not in ("temporary", "gantry") or reads(pack, f"{candidate.basis}_over_permanent"):
        return verdict
    replaced = tuple(c for c in governing if RANK[c.basis] < RANK[candidate.basis] and c.mps > candidate.mps)
    doubt = UNSETTLED if replaced else 1.0
    return msgspec.structs.replace(verdict, replaced=replaced, confidence=verdict.confidence * doubt)


def _verdict(pack: Pack, candidate: LimitCandidate, against: tuple[LimitCandidate, ...], *, uncertain: bool) -> Verdict:
    confidence = candidate.confidence
    if candidate.presumed:
        confidence *= PRESUMED
    if uncertain:
        confidence *= UNCERTAIN
    elif against:
        confidence *= CONFLICT
    if candidate.basis == "gantry" and not reads(pack, "gantry"):
        confidence *= UNSUPPORTED_SCOPE
    return Verdict(candidate=candidate, against=against, uncertain=uncertain, confidence=confidence)
