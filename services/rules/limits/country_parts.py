"""Parts of a country whose limit is lower than the one that is answered because nobody knows the part."""

import msgspec

from proto.rules import Situation
from services.rules.limits.limit_candidates import Claim
from services.rules.limits.precedence import Verdict, decide
from services.rules.packs.loading import Pack
from services.rules.units import spoken
from services.rules.words import part, say


class Lower(msgspec.Struct, frozen=True, kw_only=True):
    """A part of the country, and what speaks for the lower limit there."""

    place: str
    claim: Claim


def lower_in_parts(pack: Pack, situation: Situation, here: Verdict) -> tuple[Lower, ...]:
    """Where the same situation has a lower limit; none where the part is known, or the country is not."""
    if situation.jurisdiction != pack.manifest.jurisdiction:
        return ()
    most = here.claim.mps if here.claim is not None else float("inf")
    found = []
    for place in _parts(pack):
        there = decide(pack, msgspec.structs.replace(situation, jurisdiction=place)).claim
        if there is not None and there.mps < most:
            found.append(Lower(place=place, claim=there))
    return tuple(found)


def said_of_parts(lower: tuple[Lower, ...], language: str) -> list[str]:
    """One sentence for each limit, with the parts that have it."""
    by_limit: dict[str, list[str]] = {}
    for each in lower:
        by_limit.setdefault(spoken(each.claim.value, each.claim.unit), []).append(part(each.place, language))
    joined = say("and", language)
    return [say("part_lower", language, parts=joined.join(parts), limit=limit) for limit, parts in by_limit.items()]


def _parts(pack: Pack) -> tuple[str, ...]:
    """Parts for which the pack states limits of their own."""
    return tuple(
        dict.fromkeys(effect.when.subdivision for _, effect in pack.limits if effect.when.subdivision is not None)
    )
