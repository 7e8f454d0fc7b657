"""Answers to a driver's question from retrieved passages, or, without retrieval, from words shared with the provisions."""

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Literal

import msgspec

from proto.rules import Citation, LegalAction, Passage, Retrieved, RulesAnswer
from services.rules.book import STALE, UNKNOWN_COUNTRY, UNKNOWN_PART, RuleBook, normal_jurisdiction
from services.rules.citing import cite, cite_sign
from services.rules.lookup.asked_facts import asked_light
from services.rules.lookup.told_limit import governing, told_limit
from services.rules.packs.format import Duty, Effect, Limit, Prohibition, RightOfWay
from services.rules.packs.loading import Pack
from services.rules.signs.meaning import careful_rank
from services.rules.words import say

WITHOUT_RETRIEVAL = 0.8
"""Factor on the confidence of every answer that was made without retrieval."""
UNJUDGED = 0.5
"""Confidence where retrieval does not say how sure it is: its encoder was never tuned, or a reranker chose the first passage."""
WORDS_IN_COMMON = 0.4
"""Confidence when a text shares all words of the question, without retrieval: words alone often point elsewhere."""
NEAR = 0.85
"""Passages that score at least this share of the best one speak to the question too."""
_WORD = re.compile(r"\w{3,}")
_ABOUT_SIGNS = re.compile(
    r"\b(signs?|plates?|disc|triangle|symbol|schild\w*|zeichen\w*|tafel|dreieck|panneaux?|panonceau|symbole)\b|schild\b",
    re.I,
)
_PROHIBITED: dict[str, LegalAction] = {"overtaking": "no_overtaking", "entry": "no_entry", "lane": "no_entry"}


class Hit(msgspec.Struct, frozen=True, kw_only=True):
    """One text that speaks to the question."""

    score: float
    citation: Citation
    effects: tuple[Effect, ...]
    action: LegalAction | None
    pack: Pack


def lookup_rule(
    book: RuleBook,
    query: str,
    jurisdiction: str | None,
    language: str,
    retrieved: Retrieved | None,
    limit: int,
) -> RulesAnswer:
    """The best passages, and what they demand; contradictions by kind of text, then the most careful.

    `retrieved` is `None` where retrieval did not answer; where it knows none of the packs' texts it is as good as silent.
    """
    passages = None if retrieved is None else retrieved.passages
    here = normal_jurisdiction(jurisdiction)
    packs = book.for_jurisdiction(here) or book.for_jurisdiction(None)
    hits = _from_passages(packs, passages or (), language)
    if passages is None or (not hits and (passages or _of_another_nation(packs))):  # it does not know their texts
        passages, hits = None, _from_words(packs, query, language)
    degraded = (() if passages is not None else ("retrieval",)) + (() if book.covers(here) else ("jurisdiction",))
    if not hits:
        return _nothing(packs, language, degraded)
    found, hits = hits[0], _governed(hits, query, here, language)
    near = [hit for hit in hits if hit.score >= NEAR * hits[0].score]
    stale = any(book.weaknesses(hit.pack) for hit in near)
    action = _demand(near, asked_light(query))
    speed, depends = told_limit(hits[0].pack, hits[0].effects, query, here, language)
    sure = sureness(retrieved, found) if passages is not None else WORDS_IN_COMMON * found.score
    confidence = sure * _place_known(book, here) * (STALE if stale else 1.0)
    shown = tuple(hit.citation for hit in hits[:limit])
    notes = [shown[0].excerpt, depends, say("no_retrieval", language) if passages is None else ""]
    return RulesAnswer(
        legal_action=action,
        limit=speed,
        citations=shown,
        confidence=confidence,
        rulepack_version=hits[0].pack.version,
        note=" ".join(note for note in notes if note),
        basis="lookup",
        degraded=degraded + (("stale_rulepack",) if stale else ()),
    )


def _governed(hits: list[Hit], query: str, here: str | None, language: str) -> list[Hit]:
    """The texts, before them the one that sets the limit for the road or the part that is asked about, where the best is of another."""
    first = hits[0]
    name = governing(first.pack, first.effects, query, here)
    if not name or name == first.citation.provision:
        return hits
    others = [hit for hit in hits if hit.citation.provision != name]
    return [_known(first.pack, name, first.score, language), *others]


def _place_known(book: RuleBook, here: str | None) -> float:
    """The factor on confidence for a country, or a part of one, that no pack covers."""
    if here is None or not book.for_jurisdiction(here):
        return UNKNOWN_COUNTRY
    return 1.0 if book.covers(here) else UNKNOWN_PART


def sureness(retrieved: Retrieved | None, first: Hit) -> float:
    """How far the first answer is to be trusted: as retrieval says of its first passage; of another one, less."""
    if retrieved is None or retrieved.confidence is None:
        return UNJUDGED
    same = provision_of(retrieved.passages[0]) == first.citation.provision
    return retrieved.confidence if same else min(retrieved.confidence, UNJUDGED)


def corpus_for(query: str) -> Literal["statutes", "all"]:
    """The sign table is searched only for questions about signs: its short texts match too much else."""
    return "all" if _ABOUT_SIGNS.search(query) else "statutes"


def _of_another_nation(packs: tuple[Pack, ...]) -> bool:
    """Whether all of them inherit from another nation's: retrieval, which has each nation's texts apart, refuses in ignorance."""
    return all(
        any(manifest.jurisdiction[:3] != pack.manifest.jurisdiction[:3] for manifest in pack.extended) for pack in packs
    )


def _nothing(packs: tuple[Pack, ...], language: str, degraded: tuple[str, ...]) -> RulesAnswer:
    return RulesAnswer(
        legal_action="unknown",
        limit=None,
        citations=(),
        confidence=0.0,
        rulepack_version=packs[0].version if packs else "",
        note=say("nothing_found", language),
        basis="unknown",
        degraded=degraded,
    )


def _demand(near: list[Hit], light: str | None) -> LegalAction:
    """Of the nearest texts those of the highest kind that demand anything; among them the most careful.

    `light`: which is asked about. What the law says of that one counts, whichever light the nearest texts are about.
    """
    lit = [
        effect.action
        for provision in near[0].pack.provisions.values()
        for effect in provision.effects
        if isinstance(effect, RightOfWay) and effect.trigger == f"light:{light}"
    ]
    if lit and (light == "red" or any(_is_of_light(effect) for hit in near for effect in hit.effects)):
        return min(lit, key=careful_rank)
    for kind in near[0].pack.manifest.precedence:
        demanding = [action for hit in near if hit.citation.kind == kind for action in _actions(hit)]
        if demanding:
            return min(demanding, key=careful_rank)
    return "none"


def _is_of_light(effect: Effect) -> bool:
    return isinstance(effect, RightOfWay) and effect.trigger.startswith("light:")


def _actions(hit: Hit) -> tuple[LegalAction, ...]:
    found: list[LegalAction] = [hit.action] if hit.action is not None else []
    for effect in hit.effects:
        if isinstance(effect, Duty | RightOfWay):
            found.append(effect.action)
        elif isinstance(effect, Limit):
            found.append("comply_with_limit")
        elif isinstance(effect, Prohibition):
            found.append(_PROHIBITED.get(effect.what, "proceed_with_care"))
    return tuple(found)


def _from_passages(packs: tuple[Pack, ...], passages: tuple[Passage, ...], language: str) -> list[Hit]:
    found = [hit for passage in passages if (hit := _hit(packs, passage, language)) is not None]
    return sorted(found, key=lambda hit: -hit.score)


def _hit(packs: tuple[Pack, ...], passage: Passage, language: str) -> Hit | None:
    """A passage counts only if its text stands, under its own pack, in what was loaded and checked here.

    Packs share names, signs above all, and do not demand the same by them.
    """
    name, standing = provision_of(passage), passage.passage_id.partition("/")[0]
    for pack in packs:
        if name in pack.origin and pack.origin[name].partition("@")[0] == standing:
            return _known(pack, name, passage.score, language)
    return None


def provision_of(passage: Passage) -> str:
    """`deu-speed-urban` of the passage id `DEU-v1/deu-speed-urban/de`."""
    parts = passage.passage_id.split("/")
    return parts[1] if len(parts) == 3 else ""


def _known(pack: Pack, name: str, score: float, language: str) -> Hit:
    if name in pack.provisions:
        provision = pack.provisions[name]
        return Hit(
            score=score, citation=cite(pack, provision, language), effects=provision.effects, action=None, pack=pack
        )
    sign = pack.signs[name.removeprefix("sign:")]
    return Hit(score=score, citation=cite_sign(pack, sign, language), effects=(), action=sign.action, pack=pack)


def _from_words(packs: tuple[Pack, ...], query: str, language: str) -> list[Hit]:
    """The share of the question's words that a text contains: a poor man's retrieval, said to be that."""
    wanted = _words(query)
    if not wanted:
        return []
    found = []
    with_signs = corpus_for(query) == "all"
    for pack in packs:
        for name, text in _texts(pack, with_signs=with_signs):
            score = len(wanted & _words(text)) / len(wanted)
            if score > 0:
                found.append(_known(pack, name, score, language))
    return sorted(found, key=lambda hit: (-hit.score, hit.citation.document, hit.citation.start))


def _texts(pack: Pack, *, with_signs: bool) -> Iterable[tuple[str, str]]:
    for provision in pack.provisions.values():
        yield (
            provision.id,
            " ".join(
                (provision.section, *provision.topics.values(), *(source.excerpt for source in provision.sources))
            ),
        )
    for sign in pack.signs.values() if with_signs else ():
        yield f"sign:{sign.code}", " ".join((sign.section, *(source.excerpt for source in sign.sources)))


@lru_cache(maxsize=8192)
def _words(text: str) -> frozenset[str]:
    return frozenset(word.lower() for word in _WORD.findall(text))
