"""Citations: a provision or sign of a pack as document, offsets and excerpt, in the driver's language where it is written in it."""

from collections.abc import Iterable, Iterator, Mapping

from domain.languages import spoken_language
from proto.rules import Citation, CitedParagraph, LegalAction, RulesAnswer
from services.rules.book import is_fallback
from services.rules.packs.format import Provision, Sign, Source
from services.rules.packs.loading import Pack
from services.rules.words import say

Cites = tuple[Citation, ...]


def cite(pack: Pack, provision: Provision, language: str) -> Citation:
    """A provision as a citation; its document is named with its pack's id."""
    source = _source(provision.sources, language)
    return _citation(pack, provision.id, provision.section, provision.kind, source)


def cite_sign(pack: Pack, sign: Sign, language: str) -> Citation:
    """A sign's entry in the sign table as a citation."""
    return _citation(pack, f"sign:{sign.code}", sign.section, "sign_table", _source(sign.sources, language))


def cite_ids(pack: Pack, ids: Iterable[str], language: str) -> tuple[Citation, ...]:
    """Provisions by id, and signs as `sign:CODE`, each once, those the pack has."""
    found = (_cited(pack, name, language) for name in dict.fromkeys(ids))
    return tuple(citation for citation in found if citation is not None)


def _cited(pack: Pack, name: str, language: str) -> Citation | None:
    if name in pack.provisions:
        return cite(pack, pack.provisions[name], language)
    kind, _, code = name.partition(":")
    return cite_sign(pack, pack.signs[code], language) if kind == "sign" and code in pack.signs else None


def paragraph_at(packs: Mapping[str, Pack], document: str, offset: int) -> CitedParagraph | None:
    """The text that a citation of `document` at `offset` points at, or the one that holds this character; None: no text is cited there.

    The pack's id is compared without regard to case: clients write the first part of an address small.
    """
    wanted, _, below = document.partition("/")
    for pack in packs.values():
        for name, entry, source in _sources(pack):
            here = source.document == below and source.start <= offset < source.end
            if here and _origin(pack, name).casefold() == wanted.casefold():
                kind = entry.kind if isinstance(entry, Provision) else "sign_table"
                citation = _citation(pack, name, entry.section, kind, source)
                return CitedParagraph(citation=citation, language=source.language, rulepack_version=pack.origin[name])
    return None


def places(packs: Mapping[str, Pack], document: str) -> tuple[str, ...]:
    """What can be cited: ids of packs; below a pack its documents; in a document the offsets of its texts."""
    wanted, _, below = document.partition("/")
    ids, documents, offsets = set[str](), set[str](), set[int]()
    for pack in packs.values():
        for name, _, source in _sources(pack):
            origin = _origin(pack, name)
            ids.add(origin)
            if origin.casefold() == wanted.casefold():
                documents.add(source.document)
                offsets |= {source.start} if source.document == below else set()
    if not wanted:
        return tuple(sorted(ids))
    return tuple(map(str, sorted(offsets))) if below else tuple(sorted(documents))


def _sources(pack: Pack) -> Iterator[tuple[str, Provision | Sign, Source]]:
    for name, provision in pack.provisions.items():
        yield from ((name, provision, source) for source in provision.sources)
    for code, sign in pack.signs.items():
        yield from ((f"sign:{code}", sign, source) for source in sign.sources)


def cited_in_doubt(chosen: Cites, answers: Iterable[tuple[Pack, Cites]]) -> tuple[Citation, ...]:
    """Where it is not known whose law it is: the answer's own citations, then the fallback's, then the other packs'."""
    ordered = sorted(answers, key=lambda answer: not is_fallback(answer[0]))
    return unique((*chosen, *(citation for _, citations in ordered for citation in citations[:2])))


def unique(citations: Iterable[Citation]) -> tuple[Citation, ...]:
    """Each place once, in order."""
    return tuple({(c.document, c.start): c for c in citations}.values())


def without_packs(action: LegalAction, phrase: str, language: str) -> RulesAnswer:
    """The answer where no pack is loaded: nothing is cited, and nothing is sure."""
    return RulesAnswer(
        legal_action=action, limit=None, citations=(), confidence=0.0, rulepack_version="", note=say(phrase, language),
        basis="unknown", degraded=("jurisdiction",),
    )  # fmt: skip


def _source(sources: tuple[Source, ...], language: str) -> Source:
    """In the driver's language, else in English; the text as it is written where the pack has neither."""
    by_language = {source.language: source for source in reversed(sources)}
    return by_language.get(spoken_language(language)) or by_language.get("en") or sources[0]


def _citation(pack: Pack, name: str, section: str, kind: str, source: Source) -> Citation:
    return Citation(
        document=f"{_origin(pack, name)}/{source.document}",
        start=source.start,
        end=source.end,
        excerpt=source.excerpt,
        section=section,
        kind=kind,  # type: ignore[arg-type]
        provision=name,
    )


def _origin(pack: Pack, name: str) -> str:
    return pack.origin[name].partition("@")[0]
