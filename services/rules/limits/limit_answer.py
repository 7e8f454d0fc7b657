"""The answer of `applicable_limit`: the verdict of every pack that may count, said with its citations."""

import msgspec

from domain.law import assuming
from domain.units import legal_limit, spoken, spoken_converted
from proto.rules import Citation, LegalAction, RulesAnswer, Situation
from services.rules.book import (
    FOREIGN_LAW,
    STALE,
    UNKNOWN_COUNTRY,
    UNKNOWN_PART,
    RuleBook,
    is_fallback,
    normal_jurisdiction,
)
from services.rules.citing import cite, cite_ids, cite_sign, cited_in_doubt, unique, without_packs
from services.rules.limits.limit_candidates import LimitCandidate
from services.rules.limits.minimum_speed import minimum_speed
from services.rules.limits.precedence import Verdict, decide
from services.rules.packs.format import Provision
from services.rules.packs.loading import Pack
from services.rules.words import country, named_packs, part, place, say


class Lower(msgspec.Struct, frozen=True, kw_only=True):
    """A part of the country, and what speaks for the lower limit there."""

    place: str
    candidate: LimitCandidate


def lower_in_parts(pack: Pack, situation: Situation, here: Verdict) -> tuple[Lower, ...]:
    """Where the same situation has a lower limit; none where the part is known, or the country is not."""
    if situation.jurisdiction != pack.manifest.jurisdiction:
        return ()
    most = here.candidate.mps if here.candidate is not None else float("inf")
    found = []
    for name in _parts(pack):
        there = decide(pack, msgspec.structs.replace(situation, jurisdiction=name)).candidate
        if there is not None and there.mps < most:
            found.append(Lower(place=name, candidate=there))
    return tuple(found)


def said_of_parts(book: RuleBook, lower: tuple[Lower, ...], language: str) -> list[str]:
    """One sentence for each limit, with the parts that have it."""
    by_limit: dict[str, list[str]] = {}
    for each in lower:
        by_limit.setdefault(spoken(each.candidate.value, each.candidate.unit), []).append(
            part(book, each.place, language)
        )
    joined = say("and", language)
    return [say("part_lower", language, parts=joined.join(parts), limit=limit) for limit, parts in by_limit.items()]


def _parts(pack: Pack) -> tuple[str, ...]:
    """Parts for which the pack states limits of their own."""
    return tuple(
        dict.fromkeys(effect.when.subdivision for _, effect in pack.limits if effect.when.subdivision is not None)
    )


PARTS_DIFFER = 0.9
"""Factor where the limit is lower in some part of the country, and the part is not known."""
_BASIS = {"temporary": "posted", "uncertain": "posted", "cap": "default"}


def applicable_limit(book: RuleBook, situation: Situation) -> RulesAnswer:
    """The limit in force; under an unknown jurisdiction the most conservative one of all packs, at low confidence."""
    known = msgspec.structs.replace(situation, jurisdiction=normal_jurisdiction(situation.jurisdiction))
    packs = book.for_jurisdiction(known.jurisdiction)
    foreign = not packs
    if not packs:
        packs = book.for_jurisdiction(None)
    if not packs:
        return without_packs("unknown", "no_limit_known", known.language)
    answers = [(pack, _answer(book, pack, known)) for pack in packs]
    chosen = min(answers, key=_strictness)[1]
    if known.jurisdiction is not None:
        chosen = msgspec.structs.replace(chosen, place=book.name_of(known.jurisdiction[:3], known.language))
    part_without = "-" in (known.jurisdiction or "") and not book.covers(known.jurisdiction)
    if known.road_type is None or known.jurisdiction is None or foreign or part_without:
        chosen = assuming(chosen, posted=bool(known.posted))
    if known.jurisdiction is None or foreign:
        return _doubted(book, chosen, answers, known, foreign)
    return chosen if book.covers(known.jurisdiction) else _part_unknown(book, chosen, answers, known)


def _answer(book: RuleBook, pack: Pack, situation: Situation) -> RulesAnswer:
    verdict = decide(pack, situation)
    lower = lower_in_parts(pack, situation, verdict)
    weak = book.weaknesses(pack)
    said = say("no_limit_known", situation.language)
    limit = None
    if verdict.candidate is not None:
        candidate = verdict.candidate
        limit = legal_limit(candidate.value, candidate.unit, advisory=candidate.basis == "advisory")
        said = " ".join(_sentences(situation, verdict, candidate))
    notes = [
        said,
        *said_of_parts(book, lower, situation.language),
        *(_weakness(name, book, pack, situation.language) for name in weak),
    ]
    least = minimum_speed(pack, situation, limit.mps if limit is not None else None)
    return RulesAnswer(
        legal_action=_action(verdict),
        limit=limit,
        minimum=legal_limit(least[1].value, least[1].unit) if least is not None else None,
        citations=_citations(pack, verdict, lower, least[0] if least is not None else None, situation.language),
        confidence=verdict.confidence * (STALE if weak else 1.0) * (PARTS_DIFFER if lower else 1.0),
        rulepack_version=pack.version,
        note=" ".join(notes),
        basis=_basis(verdict.candidate),
        degraded=(("stale_rulepack",) if weak else ()) + (("jurisdiction",) if lower else ()),
    )


def _strictness(found: tuple[Pack, RulesAnswer]) -> tuple[float, bool, bool, float]:
    """The lowest limit first; of equals the fallback's, then that of a base, which are meant for doubt."""
    pack, answer = found
    base = pack.manifest.base
    return (answer.limit.mps if answer.limit else float("inf"), not is_fallback(pack), not base, answer.confidence)


def _doubted(
    book: RuleBook, chosen: RulesAnswer, answers: list[tuple[Pack, RulesAnswer]], situation: Situation, foreign: bool
) -> RulesAnswer:
    language = situation.language
    packs = named_packs(book, [pack for pack, _ in answers], language)
    if foreign:
        why = say("no_law_here", language, country=country(book, situation.jurisdiction or "", language), packs=packs)
    else:
        why = say("country_unknown", language, packs=packs)
    return msgspec.structs.replace(
        chosen,
        confidence=chosen.confidence * (FOREIGN_LAW if foreign else UNKNOWN_COUNTRY),
        minimum=None,
        citations=cited_in_doubt(chosen.citations, ((pack, answer.citations) for pack, answer in answers)),
        note=f"{chosen.note} {why}",
        degraded=(*chosen.degraded, "jurisdiction"),
    )


def _part_unknown(
    book: RuleBook, chosen: RulesAnswer, answers: list[tuple[Pack, RulesAnswer]], situation: Situation
) -> RulesAnswer:
    language = situation.language
    named = "-" in (situation.jurisdiction or "")
    packs = named_packs(book, [pack for pack, _ in answers], language)
    why = say("part_without" if named else "part_unknown", language, packs=packs)
    higher = [pack for pack, answer in answers if not named and _above(answer, chosen)]
    raised = [part(book, pack.manifest.jurisdiction, language) for pack in higher]
    raises = say("part_raises", language, parts=", ".join(raised)) if raised else ""
    return msgspec.structs.replace(
        chosen,
        confidence=chosen.confidence * UNKNOWN_PART,
        minimum=None,
        note=f"{chosen.note} {why} {raises}".strip(),
        degraded=(*chosen.degraded, "jurisdiction"),
    )


def _above(answer: RulesAnswer, chosen: RulesAnswer) -> bool:
    """Whether the part's law allows more, if the car is there."""
    return chosen.limit is not None and (answer.limit is None or answer.limit.mps > chosen.limit.mps)


def _action(verdict: Verdict) -> LegalAction:
    if verdict.candidate is None:
        return "unknown"
    if verdict.uncertain or verdict.against:
        return "reduce_speed"
    return "proceed_with_care" if verdict.candidate.basis == "advisory" else "comply_with_limit"


def _basis(candidate: LimitCandidate | None) -> str:
    if candidate is None:
        return "unknown"
    if candidate.why == "visibility":
        return "conditional"
    return _BASIS.get(candidate.basis, candidate.basis)


def _citations(
    pack: Pack, verdict: Verdict, lower: tuple[Lower, ...], minimum: Provision | None, language: str
) -> tuple[Citation, ...]:
    said = (verdict.candidate, *verdict.against, *verdict.replaced, *(each.candidate for each in lower))
    candidates = [candidate for candidate in said if candidate is not None]
    found: list[Citation] = []
    for candidate in candidates:
        found.extend(cite_ids(pack, candidate.provisions, language))
        if candidate.sign in pack.signs:
            found.append(cite_sign(pack, pack.signs[candidate.sign], language))
    if minimum is not None:
        found.append(cite(pack, minimum, language))
    return unique(found)


def _sentences(situation: Situation, verdict: Verdict, candidate: LimitCandidate) -> list[str]:
    language, shown = situation.language, spoken(candidate.value, candidate.unit)
    parts = [say(candidate.basis, language, limit=shown, why=say(candidate.why or "why_road", language))]
    if verdict.against and not verdict.uncertain:
        parts.append(say("conflict", language))
    if candidate.presumed:
        facts = ", ".join(say(name, language) for name in candidate.presumed)
        parts.append(say("presumed", language, facts=facts))
    if candidate.unit != situation.home_unit:
        converted = spoken_converted(candidate.value, candidate.unit, situation.home_unit)
        parts.append(say("unit", language, limit=shown, converted=converted))
    return parts


def _weakness(name: str, book: RuleBook, pack: Pack, language: str) -> str:
    named = place(book, pack.manifest, language)
    return say(name, language, country=named, have=pack.manifest.version, want=book.expected_of(pack))
