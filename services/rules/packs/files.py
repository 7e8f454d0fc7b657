"""A pack's folder read once: what is hashed is what is decoded, even while another program writes into the folder."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from drivemcp.errors import MALFORMED
from drivemcp.files.packfiles import FILES, SOURCES, content_sha256, read_content
from services.rules.errors import PackError, Problem
from services.rules.packs import json_positions
from services.rules.packs.remedies import remedy_for

SIGNATURE = "signature.json"
_BYTE = re.compile(r"\(byte (\d+)\)")
_PATH = re.compile(r" - at `(?:key in )?(\$[^`]*)`$")
T = TypeVar("T")


class Files(msgspec.Struct, frozen=True):
    """Content by name relative to the folder, and why a file that is there was not read."""

    folder: Path
    content: dict[str, bytes]
    refused: dict[str, str] = {}

    def text(self, name: str) -> str:
        """A file as text."""
        return self.content[name].decode("utf-8", errors="replace")

    def problem(self, name: str, path: json_positions.Path, message: str, remedy: str, shown: str = "") -> Problem:
        """A problem at a JSON path of a file; `shown` is added to the path for people: an entry's id."""
        field = json_positions.written(path) + (f" ({shown})" if shown else "")
        line = json_positions.line_of(self.text(name), path) if name in self.content else 0
        return Problem(file=self.folder / name, line=line, field=field, message=message, remedy=remedy)

    def unread(self) -> Iterator[Problem]:
        """Files that are there and were not read, and documents that are no text."""
        for name in self.refused:
            yield self.absent(name)
        for name in self.content:
            if name.startswith(SOURCES) and "\ufffd" in (text := self.text(name)):
                line = text.count("\n", 0, text.index("\ufffd")) + 1
                remedy = "save the file as UTF-8"
                yield Problem(file=self.folder / name, line=line, message="is no UTF-8 here", remedy=remedy)

    def absent(self, name: str) -> Problem:
        """Why there is no content of this name."""
        message, _, remedy = self.refused.get(name, "is not there; put it there, as in rulepacks/TEST-v1").partition(
            "; "
        )
        return Problem(file=self.folder / name, message=message, remedy=remedy)

    def sha256(self) -> str:
        """The content's hash. Raises PackError where a file cannot be read or decoded."""
        for problem in self.unread():
            raise PackError(str(problem))
        return content_sha256({name: self._value(name) for name in FILES}, self.content)

    def _value(self, name: str) -> Any:
        found, problems = decoded(self, name, Any)
        if problems:
            raise PackError(str(problems[0]))
        return found


def read_files(folder: Path, also: tuple[str, ...] = ()) -> Files:
    """Everything that belongs to a pack, and files of these names."""
    found = read_content(folder, (SIGNATURE, *also))
    return Files(folder, found.files, found.refused)


def write_json(path: Path, content: Any) -> None:
    """A pack's JSON file, as all of them are laid out."""
    path.write_text(json.dumps(content, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")


def decoded(files: Files, name: str, kind: Any) -> tuple[Any, tuple[Problem, ...]]:
    """A file as a value of a type, or None and what is wrong."""
    if name not in files.content:
        return None, (files.absent(name),)
    try:
        msgspec.json.decode(files.content[name])  # a value of a type is decoded without what the type does not know
        return msgspec.json.decode(files.content[name], type=kind), ()
    except MALFORMED as error:
        return None, (_malformed(files, name, error, kind),)


def decoded_list(files: Files, name: str, kind: type[T]) -> tuple[list[T | None], tuple[Problem, ...]]:
    """A file of entries, and what is wrong with each that does not fit; such an entry is `None` in its place."""
    raw, problems = decoded(files, name, list[Any])
    found: list[T | None] = []
    told = list[Problem](problems)
    for index, entry in enumerate(raw or ()):
        try:
            found.append(msgspec.convert(entry, kind))
        except MALFORMED as error:
            found.append(None)
            told.append(_malformed(files, name, error, kind, (index,), entry))
    return found, tuple(told)


def _malformed(
    files: Files, name: str, error: Exception, kind: Any, below: json_positions.Path = (), entry: object = None
) -> Problem:
    said, remedy = str(error), remedy_for(error, kind)
    if (at := _BYTE.search(said)) is not None:
        line = files.content[name].count(b"\n", 0, int(at[1])) + 1
        return Problem(file=files.folder / name, line=line, message=said, remedy=remedy)
    place = _PATH.search(said)
    path = below + (json_positions.parsed(place[1]) if place else ())
    shown = str(entry.get("id") or entry.get("code") or entry.get("name") or "") if isinstance(entry, dict) else ""
    return files.problem(name, path, said[: place.start()] if place else said, remedy, shown[:80])
