"""The texts of the rulepacks as passages. Checked is that they are what was sealed; the Rules service checks packs in full."""

import hashlib
import itertools
import logging
from codecs import BOM_UTF8
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Literal

import msgspec

from drivemcp.errors import MALFORMED, UserError
from drivemcp.files.packfiles import ASKED, FILES, Asked, content_sha256, read_content, read_regular

Kind = Literal["statute", "sign_table", "guidance"]
Corpus = Literal["statutes", "signs"]
LOOKS = Path(__file__).parent / "sign_looks.json"
"""How drivers ask for the signs that readers know, whatever the pack."""
MOST_PHRASES = 40
"""With one text: an encoder's time grows with them."""
logger = logging.getLogger(__name__)


class CorpusError(UserError):
    """A rulepack that cannot be indexed; the message names file and field."""


class Manifest(msgspec.Struct, frozen=True):
    """What of `manifest.json` matters here."""

    id: str
    version: str
    content_sha256: str
    jurisdiction: str
    effective_from: str = ""
    effective_until: str | None = None


class When(msgspec.Struct, frozen=True):
    """Of an effect's conditions, the roads on which it holds."""

    road_types: tuple[str, ...] = ()


class Effect(msgspec.Struct, frozen=True):
    """One effect of a provision."""

    when: When = When()


class Source(msgspec.Struct, frozen=True):
    """One text: characters `start` to `end` of a document."""

    language: str
    document: str
    start: int
    end: int
    excerpt: str


class Entry(msgspec.Struct, frozen=True):
    """A provision (`id`) or a sign (`code`)."""

    section: str
    sources: tuple[Source, ...]
    id: str = ""
    code: str = ""
    kind: Kind = "sign_table"
    topics: dict[str, str] = {}
    effects: tuple[Effect, ...] = ()
    replaces: tuple[str, ...] = ()
    """Provisions of the pack that is extended, in whose place this one stands."""
    draft: bool = False
    """Imported and not yet restated: the publisher's words, which are not to be told."""

    @property
    def name(self) -> str:
        """What distinguishes it in its pack."""
        return self.id or f"sign:{self.code}"

    @property
    def road_types(self) -> frozenset[str]:
        """The roads that it is about; none: it is about all, or about no road."""
        roads = [effect.when.road_types for effect in self.effects]
        return frozenset(road for each in roads for road in each) if all(roads) else frozenset()


class Text(msgspec.Struct, frozen=True, kw_only=True):
    """One passage as indexed."""

    passage_id: str
    """`<pack>/<provision or sign:code>/<language>`"""
    document: str
    start: int
    end: int
    excerpt: str
    section: str
    kind: Kind
    corpus: Corpus
    language: str
    jurisdiction: str
    rulepack_version: str
    topics: str = ""
    asked: str = ""
    """How drivers ask for it."""
    road_types: frozenset[str] = frozenset()
    replaces: tuple[str, ...] = ()
    effective: tuple[str, str | None] = ("", None)
    """ISO dates, first and last day."""

    @property
    def pack(self) -> str:
        """The id of its pack."""
        return self.passage_id.split("/")[0]

    @property
    def tongue(self) -> str:
        """`<corpus>/<language>`: what a corpus lacks in a language another may have."""
        return f"{self.corpus}/{self.language}"

    @property
    def name(self) -> str:
        """The provision or sign."""
        return self.passage_id.split("/")[1]

    def holds(self, road_type: str | None, on: str) -> bool:
        """Whether it may count on this type of road (None: not known) and on this ISO date (empty: not known)."""
        begin, end = self.effective
        here = road_type is None or not self.road_types or road_type in self.road_types
        return here and (not on or begin <= on <= (end or on))

    @property
    def indexed(self) -> str:
        """What is searched: section and everyday words belong to it, so that `Zeichen 274` and `fog` are found."""
        return f"{self.of_the_law} {self.asked}".strip()

    @property
    def of_the_law(self) -> str:
        """The same without the words of drivers, which may speak of more than the law does."""
        return f"{self.section}: {self.excerpt} {self.topics}".strip()


def read_pack(folder: Path) -> tuple[Text, ...]:
    """All texts of one pack, without those of the pack it extends. Raises CorpusError."""
    found = read_content(folder)  # once: what is checked is what is indexed
    for name, why in found.refused.items():
        raise CorpusError(f"{folder / name}: {why}")
    content = found.files
    manifest = _decoded(folder, content, "manifest.json", Manifest)
    provisions = _entries(folder, content, "provisions.json")
    signs = _entries(folder, content, "signs.json")
    asked = _asked(folder)
    texts = _texts(manifest, provisions, "statutes", asked) + _texts(
        manifest, signs, "signs", _with_looks(signs, asked)
    )
    _check(folder, content, texts)
    _check_sealed(folder, content, manifest)
    return texts


def digest(texts: tuple[Text, ...]) -> str:
    """SHA-256 over what is indexed, in order: embeddings made of other texts do not fit."""
    return hashlib.sha256("\0".join(text.indexed for text in texts).encode()).hexdigest()


def _asked(folder: Path) -> Asked:
    """How drivers ask. The law does not depend on it: what is there and cannot be used is told, and left out."""
    try:
        return msgspec.json.decode(read_regular(folder / ASKED).removeprefix(BOM_UTF8), type=Asked)
    except FileNotFoundError:
        return {}
    except (OSError, *MALFORMED) as error:
        logger.warning("%s is not searched: %s", folder / ASKED, error)
        return {}


@cache
def sign_looks() -> dict[str, dict[str, tuple[str, ...]]]:
    """How drivers ask for a sign by its code. Raises OSError or msgspec.MsgspecError: it is part of the program."""
    return msgspec.json.decode(LOOKS.read_bytes(), type=Asked)


def _with_looks(signs: list[Entry], asked: Asked) -> Asked:
    """What a pack says of its signs, and what is said of such signs everywhere, in the languages of its texts."""
    said: Asked = {}
    for sign in signs:
        own, looks = asked.get(sign.name, {}), sign_looks().get(sign.code, {})
        languages = {**own, **{source.language: () for source in sign.sources}}
        said[sign.name] = {each: (*own.get(each, ()), *looks.get(each, ())) for each in languages}
    return said


def _phrases(entry: Entry, source: Source, asked: Asked) -> str:
    """How drivers ask for an entry in the language of a text of it; with the first text also in languages without one."""
    said = asked.get(entry.name, {})
    own = {each.language for each in entry.sources}
    others = [language for language in said if language not in own] if source is entry.sources[0] else []
    phrases = (phrase for language in (source.language, *others) for phrase in said.get(language, ()))
    return " ".join(" ".join(phrase.split()) for phrase in itertools.islice(phrases, MOST_PHRASES))


def _texts(manifest: Manifest, entries: list[Entry], corpus: Corpus, asked: Asked) -> tuple[Text, ...]:
    return tuple(
        Text(
            passage_id=f"{manifest.id}/{entry.name}/{source.language}",
            document=f"{manifest.id}/{source.document}",
            start=source.start,
            end=source.end,
            excerpt=source.excerpt,
            section=entry.section,
            kind=entry.kind,
            corpus=corpus,
            language=source.language,
            jurisdiction=manifest.jurisdiction,
            topics=entry.topics.get(source.language, ""),
            asked=_phrases(entry, source, asked),
            road_types=entry.road_types,
            replaces=entry.replaces,
            effective=(manifest.effective_from, manifest.effective_until),
            rulepack_version=f"{manifest.id}@{manifest.version}#{manifest.content_sha256[:12]}",
        )
        for entry in entries
        for source in entry.sources
    )


def _entries(folder: Path, content: Mapping[str, bytes], name: str) -> list[Entry]:
    entries: list[Entry] = _decoded(folder, content, name, list[Entry])
    if drafts := [entry.id for entry in entries if entry.draft]:
        raise CorpusError(f"{folder / name}: {drafts[0]} is a draft")
    return entries


def _check(folder: Path, content: Mapping[str, bytes], texts: tuple[Text, ...]) -> None:
    """The excerpt that is cited is the document's text between the offsets."""
    documents: dict[str, str] = {}
    for text in texts:
        name = text.document.split("/", 1)[1]
        if name not in documents:
            documents[name] = _bytes(folder, content, name).decode("utf-8", errors="replace")
        if not text.excerpt or documents[name][text.start : text.end] != text.excerpt:
            where = f"{folder / name}: characters {text.start} to {text.end}"
            raise CorpusError(f"{where} are not the excerpt of {text.passage_id}")


def _check_sealed(folder: Path, content: Mapping[str, bytes], manifest: Manifest) -> None:
    """The content is what the version tag says it is."""
    found = content_sha256({name: _decoded(folder, content, name, Any) for name in FILES}, content)
    if found != manifest.content_sha256:
        said = f"says {manifest.content_sha256[:12]}, the content has {found[:12]}"
        raise CorpusError(f"{folder / 'manifest.json'}: content_sha256: {said}: drivemcp rulepack seal {folder}")


def _bytes(folder: Path, content: Mapping[str, bytes], name: str) -> bytes:
    if name not in content:
        raise CorpusError(f"{folder / name}: cannot be read: is it there?")
    return content[name]


def _decoded(folder: Path, content: Mapping[str, bytes], name: str, kind: Any) -> Any:
    try:
        return msgspec.json.decode(_bytes(folder, content, name), type=kind)
    except MALFORMED as error:
        raise CorpusError(f"{folder / name}: {error}") from None
