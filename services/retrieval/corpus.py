"""The texts of the rulepacks as passages. Only what retrieval needs is read; the Rules service checks packs in full."""

import hashlib
from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec

from drivemcp.errors import UserError

Kind = Literal["statute", "sign_table", "guidance"]
Corpus = Literal["statutes", "signs"]
T = TypeVar("T")


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
    road_types: frozenset[str] = frozenset()
    effective: tuple[str, str | None] = ("", None)
    """ISO dates, first and last day."""

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
        return f"{self.section}: {self.excerpt} {self.topics}".strip()


def read_pack(folder: Path) -> tuple[Text, ...]:
    """All texts of one pack, without those of the pack it extends. Raises CorpusError."""
    manifest = _read(folder / "manifest.json", Manifest)
    provisions = _texts(manifest, _read(folder / "provisions.json", list[Entry]), "statutes")
    signs = _texts(manifest, _read(folder / "signs.json", list[Entry]), "signs")
    _check(folder, provisions + signs)
    return provisions + signs


def digest(texts: tuple[Text, ...]) -> str:
    """SHA-256 over what is indexed, in order: embeddings made of other texts do not fit."""
    return hashlib.sha256("\0".join(text.indexed for text in texts).encode()).hexdigest()


def _texts(manifest: Manifest, entries: list[Entry], corpus: Corpus) -> tuple[Text, ...]:
    return tuple(
        Text(
            passage_id=f"{manifest.id}/{entry.id or f'sign:{entry.code}'}/{source.language}",
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
            road_types=entry.road_types,
            effective=(manifest.effective_from, manifest.effective_until),
            rulepack_version=f"{manifest.id}@{manifest.version}#{manifest.content_sha256[:12]}",
        )
        for entry in entries
        for source in entry.sources
    )


def _check(folder: Path, texts: tuple[Text, ...]) -> None:
    """The excerpt that is cited is the document's text between the offsets."""
    documents: dict[str, str] = {}
    for text in texts:
        path = folder / text.document.split("/", 1)[1]
        if text.document not in documents:
            documents[text.document] = _bytes(path).decode("utf-8", errors="replace")
        if not text.excerpt or documents[text.document][text.start : text.end] != text.excerpt:
            raise CorpusError(f"{path}: characters {text.start} to {text.end} are not the excerpt of {text.passage_id}")


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise CorpusError(f"cannot read {path}: {error.strerror}") from None


def _read(path: Path, kind: Any) -> Any:
    try:
        return msgspec.json.decode(_bytes(path), type=kind)
    except msgspec.MsgspecError as error:
        raise CorpusError(f"{path}: {error}") from None
