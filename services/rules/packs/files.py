"""A pack's folder read once: what is hashed is what is decoded, even while somebody writes into the folder."""

import json
import re
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from drivemcp.choices import choices
from drivemcp.errors import MALFORMED
from drivemcp.files.packfiles import FILES, content_sha256, read_content
from services.rules.errors import PackError, Problem
from services.rules.packs import json_positions

SIGNATURE = "signature.json"
_BYTE = re.compile(r"\(byte (\d+)\)")
_PATH = re.compile(r" - at `(?:key in )?(\$[^`]*)`$")
T = TypeVar("T")


class Files(msgspec.Struct, frozen=True):
    """Content by name relative to the folder; a file that cannot be read is absent."""

    folder: Path
    content: dict[str, bytes]

    def text(self, name: str) -> str:
        """A file as text."""
        return self.content[name].decode("utf-8", errors="replace")

    def problem(self, name: str, path: json_positions.Path, message: str, shown: str = "") -> Problem:
        """A problem at a JSON path of a file; `shown` is added to the path for people: an entry's id."""
        field = json_positions.written(path) + (f" ({shown})" if shown else "")
        line = json_positions.line_of(self.text(name), path) if name in self.content else 0
        return Problem(file=self.folder / name, line=line, field=field, message=message)

    def sha256(self) -> str:
        """The content's hash. Raises PackError where a file cannot be read or decoded."""
        return content_sha256({name: self._value(name) for name in FILES}, self.content)

    def _value(self, name: str) -> Any:
        found, problems = decoded(self, name, Any)
        if problems:
            raise PackError(str(problems[0]))
        return found


def read_files(folder: Path) -> Files:
    """Everything that belongs to a pack."""
    return Files(folder, read_content(folder, (SIGNATURE,)))


def write_json(path: Path, content: Any) -> None:
    """A pack's JSON file, as all of them are laid out."""
    path.write_text(json.dumps(content, ensure_ascii=False, indent=1) + "\n", encoding="utf-8")


def decoded(files: Files, name: str, kind: Any) -> tuple[Any, tuple[Problem, ...]]:
    """A file as a value of a type, or None and what is wrong."""
    if name not in files.content:
        return None, (Problem(file=files.folder / name, message="cannot be read: is it there?"),)
    try:
        return msgspec.json.decode(files.content[name], type=kind), ()
    except MALFORMED as error:
        return None, (_malformed(files, name, error, kind),)


def decoded_list(files: Files, name: str, kind: type[T]) -> tuple[list[T | None], tuple[Problem, ...]]:
    """A file of entries; one that does not fit is None in its place, each with what is wrong with it."""
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
    said = str(error)
    if (at := _BYTE.search(said)) is not None:
        line = files.content[name].count(b"\n", 0, int(at[1])) + 1
        return Problem(file=files.folder / name, line=line, message=said)
    place = _PATH.search(said)
    path = below + (json_positions.parsed(place[1]) if place else ())
    shown = str(entry.get("id") or entry.get("code") or entry.get("name") or "") if isinstance(entry, dict) else ""
    message = said[: place.start()] if place else said
    return files.problem(name, path, f"{message}{choices(error, kind)}", shown[:80])
