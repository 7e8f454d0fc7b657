"""Which limit applies: claims weighed by the pack's precedence, and the most careful one where doubt remains.

Unknown facts never raise the limit: a condition that may hold is taken to hold. A further restriction never raises it:
every sign in force and every cap counts, and only a sign that is trusted and surely in force replaces the road's default.
"""

from collections.abc import Iterable

import msgspec

from proto.rules import Situation
from services.rules.limits.limit_candidates import (
    RANK,
    Claim,
    advisory_claims,
    candidate_claims,
    law_claims,
    posted_claims,
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

    claim: Claim | None
    against: tuple[Claim, ...] = ()
    """Claims that contradict it; the lower value was taken."""
    replaced: tuple[Claim, ...] = ()
    """Permanent signs that show more, beside a temporary sign or gantry of which the law does not say that it goes first."""
    uncertain: bool = False
    confidence: float = 0.0


def decide(pack: Pack, situation: Situation) -> Verdict:
    """Weigh everything that speaks for a limit here."""
    posted = posted_claims(pack, situation)
    governing = tuple(claim for claim in posted if claim.replaces_default)
    defaults = () if governing else preferred(pack, law_claims(pack, situation, caps=False))
    pool = (*posted, *defaults, *law_claims(pack, situation, caps=True))
    claim = lowest(pool) or lowest(advisory_claims(pack, situation))
    doubted = lowest(candidate_claims(pack, situation))
    if doubted is not None and (claim is None or doubted.mps < claim.mps):
        return _verdict(pack, doubted, () if claim is None else (claim,), uncertain=True)
    if claim is None:
        return Verdict(claim=None)
    verdict = _verdict(pack, claim, contradictions(claim, governing), uncertain=False)
    return _unsettled(pack, verdict, claim, governing)


def preferred(pack: Pack, claims: tuple[Claim, ...]) -> tuple[Claim, ...]:
    """Of contradicting provisions those of the highest kind: statute, then sign table, then guidance."""
    for kind in pack.manifest.precedence:
        if found := tuple(claim for claim in claims if claim.kind == kind):
            return found
    return ()


def lowest(claims: Iterable[Claim]) -> Claim | None:
    """The most conservative claim; of equals the one that governs, then the one best known."""
    ordered = sorted(claims, key=lambda c: (c.mps, -RANK.get(c.basis, 0), len(c.presumed), -c.confidence))
    return ordered[0] if ordered else None


def contradictions(claim: Claim, governing: tuple[Claim, ...]) -> tuple[Claim, ...]:
    """Signs of the same or a higher rank that show more than the one taken: one of the two must be wrong or past."""
    if claim.basis not in RANK:
        return ()
    return tuple(c for c in governing if RANK[c.basis] >= RANK[claim.basis] and c.mps > claim.mps)


def _unsettled(pack: Pack, verdict: Verdict, claim: Claim, governing: tuple[Claim, ...]) -> Verdict:
    """The lower sign counts in any case; a little less surely where the law does not say which of the two goes first."""
    if claim.basis not in ("temporary", "gantry") or reads(pack, f"{claim.basis}_over_permanent"):
        return verdict
    replaced = tuple(c for c in governing if RANK[c.basis] < RANK[claim.basis] and c.mps > claim.mps)
    doubt = UNSETTLED if replaced else 1.0
    return msgspec.structs.replace(verdict, replaced=replaced, confidence=verdict.confidence * doubt)


def _verdict(pack: Pack, claim: Claim, against: tuple[Claim, ...], *, uncertain: bool) -> Verdict:
    confidence = claim.confidence
    if claim.presumed:
        confidence *= PRESUMED
    if uncertain:
        confidence *= UNCERTAIN
    elif against:
        confidence *= CONFLICT
    if claim.basis == "gantry" and not reads(pack, "gantry"):
        confidence *= UNSUPPORTED_SCOPE
    return Verdict(claim=claim, against=against, uncertain=uncertain, confidence=confidence)
