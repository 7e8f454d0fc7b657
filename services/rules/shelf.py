"""The rule book in use, and its successor once the packs on disk have changed."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Collection, Hashable, Mapping
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from drivemcp.files.packfiles import FILES
from drivemcp.runtime.folder_watch import Watch
from proto.rules import Retrieved, RulesAnswer
from services.rules.book import RuleBook, load_beside, load_book
from services.rules.errors import PackError
from services.rules.packs.files import SIGNATURE
from services.rules.packs.loading import Pack, extended_folders
from services.rules.packs.signature import Trust

V = TypeVar("V")
Load = Callable[[Path, Mapping[Path, Pack], Trust | None], Pack]
"""Reads the pack of a folder, beside those that are there. Raises PackError."""


class Cache(Generic[V]):
    """At most `size` answers, the one not used for longest forgotten first; safe across threads."""

    def __init__(self, size: int) -> None:
        self.size = size
        self._values: OrderedDict[Hashable, V] = OrderedDict()
        self._lock = threading.Lock()
        self.hits = 0
        self.misses = 0

    def get(self, key: Hashable, serves: Callable[[V], bool] | None = None) -> V | None:
        """The value, which counts as used now; `None` without one, or where the value does not serve."""
        with self._lock:
            value = self._values.get(key)
            if value is None or (serves is not None and not serves(value)):
                self.misses += 1
                return None
            self.hits += 1
            self._values.move_to_end(key)
            return value

    def put(self, key: Hashable, value: V) -> None:
        """Keep a value."""
        with self._lock:
            self._values[key] = value
            self._values.move_to_end(key)
            while len(self._values) > self.size:
                self._values.popitem(last=False)

    def said(self) -> str:
        """For people: how many of the questions were answered from here, and how full it is."""
        with self._lock:
            asked = self.hits + self.misses
            share = f"{self.hits / asked:.0%} of {asked}" if asked else "none asked"
            return f"hits {share}, kept {len(self._values)} of {self.size}"

    def __len__(self) -> int:
        return len(self._values)


class Edition(msgspec.Struct, frozen=True):
    """A book and what was answered from it. Swapped as a whole: an answer in flight keeps the edition it began with."""

    book: RuleBook
    versions: Mapping[str, str]
    """Version tag by pack id of all texts in the book, inherited ones too."""
    answers: Cache[RulesAnswer]
    retrieved: Cache[Retrieved]


class Change(msgspec.Struct, frozen=True, kw_only=True):
    """What a look at the folders found."""

    versions: tuple[tuple[str, str], ...] = ()
    """Of every pack that changed the version tag before (empty: it is new) and now."""
    refused: tuple[str, ...] = ()
    """Why folders that changed cannot be used; what was read from them before stays in use."""


class Shelf:
    """One writer, the thread that looks; any number of readers of `edition`."""

    def __init__(
        self,
        folders: tuple[Path, ...],
        *,
        expected: Mapping[str, str] | None = None,
        today: str = "",
        trust: Trust | None = None,
        cache_size: int = 512,
        load: Load = load_beside,
    ) -> None:
        """Raises PackError if the expectations are malformed; packs that cannot be used are `refused`."""
        self._folders = folders
        self._trust, self._load = trust, load
        self._cache_size = cache_size
        self._watch = Watch((*FILES, SIGNATURE, "sources/*.md"))
        self._family = {folder: extended_folders(folder) for folder in folders}
        self._watch.remember(self._watched())
        self._packs, self._refused = self._read(folders, {})
        self.edition = self._edition(load_book((), expected=expected, today=today)[0])

    @property
    def refused(self) -> tuple[str, ...]:
        """Why folders cannot be used as they are now."""
        return tuple(self._refused.values())

    def look(self) -> Change | None:
        """Read again what changed, and take it into use where it is sound; None where nothing changed."""
        changed = self._watch.changed(self._watched())
        touched = [f for f in self._folders if changed.intersection((f, *self._family[f]))]
        if not touched:
            return None
        self._family |= {folder: extended_folders(folder) for folder in touched}
        self._watch.remember(self._watched())  # a pack may extend another one than before
        packs, refused = self._read(touched, self._packs)
        self._refused = {f: why for f, why in {**self._refused, **refused}.items() if f not in touched or f in refused}
        versions = tuple(
            (self._packs[folder].version if folder in self._packs else "", pack.version)
            for folder, pack in packs.items()
            if pack != self._packs.get(folder)
        )
        if versions:
            self._packs = packs
            self.edition = self._edition(self.edition.book)
        return Change(versions=versions, refused=tuple(refused.values()))

    def _watched(self) -> tuple[Path, ...]:
        return tuple(dict.fromkeys(path for f in self._folders for path in (f, *self._family[f])))

    def _read(self, folders: Collection[Path], before: Mapping[Path, Pack]) -> tuple[dict[Path, Pack], dict[Path, str]]:
        packs, refused = dict(before), dict[Path, str]()
        for folder in folders:
            try:
                packs[folder] = self._load(folder, packs, self._trust)
            except PackError as error:
                refused[folder] = str(error)
        return {folder: packs[folder] for folder in self._folders if folder in packs}, refused

    def _edition(self, like: RuleBook) -> Edition:
        packs = {pack.manifest.id: pack for pack in self._packs.values()}
        book = msgspec.structs.replace(like, packs=packs)
        tags = {tag for pack in packs.values() for tag in (pack.version, *pack.origin.values())}
        versions = {tag.partition("@")[0]: tag for tag in sorted(tags)}
        return Edition(book, versions, Cache(self._cache_size), Cache(self._cache_size))
