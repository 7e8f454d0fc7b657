"""The files of a rulepack, where they lie, and the hash of what is in them: each service that uses a pack checks it by the same rule."""

import os
import stat
from codecs import BOM_UTF8
from collections.abc import Iterable, Iterator, Mapping
from hashlib import sha256
from itertools import islice
from pathlib import Path
from typing import Annotated, Any

import msgspec

from drivemcp.errors import MALFORMED
from drivemcp.paths import data, has_data

FILES = ("manifest.json", "provisions.json", "signs.json", "cases.json")
SOURCES = "sources/"
_SEEN = r"[^\x00-\x1f\x7f\u200b-\u200f\u202a-\u202e\u2066-\u2069]"
Phrase = Annotated[str, msgspec.Meta(min_length=2, max_length=200, pattern=rf"\A{_SEEN}*\w{_SEEN}*\Z")]
"""Some words, without characters that are not seen."""
Language = Annotated[str, msgspec.Meta(pattern=r"\A[a-z]{2}\Z")]
Asked = dict[str, dict[Language, Annotated[tuple[Phrase, ...], msgspec.Meta(max_length=40)]]]
"""The content of `asked.json`."""
ASKED = "asked.json"
"""How drivers ask: a provision's id, or a sign's code behind `sign:`, to language to phrases. Optional, and outside of the seal,
since it says nothing of the law: it is searched with a passage."""
MAX_BYTES = 4 << 20
"""Of one file; the largest that is shipped holds 0.3 MB."""
MAX_DOCUMENTS = 200
"""Of one pack; the most that are shipped are 19."""
_SAFELY = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)


class Content(msgspec.Struct, frozen=True):
    """What a pack's folder holds."""

    files: dict[str, bytes]
    """By name below the folder; what is not there is absent."""
    refused: dict[str, str]
    """Why a file that is there was not read: what is wrong, and what to do."""


def folder_of(name: str) -> Path:
    """The folder of a pack given by its name below `rulepacks/`, or by a path."""
    if "/" in name or not has_data(f"rulepacks/{name}"):
        return Path(name)
    return data(f"rulepacks/{name}")


def read_regular(path: Path, at_most: int = MAX_BYTES) -> bytes:
    """A regular file of bounded size. Raises OSError for a link, a pipe, a device or a folder, without waiting for it."""
    mode = path.lstat().st_mode
    if stat.S_ISREG(mode):
        with open(os.open(path, os.O_RDONLY | _SAFELY), "rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            content = file.read(at_most + 1) if stat.S_ISREG(mode) else b""
    if stat.S_ISLNK(mode):
        raise OSError("is a link; put the file itself there")
    if not stat.S_ISREG(mode):
        raise OSError("is no regular file; remove it, or put a file there")
    if len(content) > at_most:
        raise OSError(f"holds more than {at_most >> 20} MiB; divide it, or remove what does not belong to the pack")
    return content


def read_content(folder: Path, also: Iterable[str] = ()) -> Content:
    """Every file of a pack, and those named beside, once: without byte order mark, documents with LF at the ends of their lines.

    A pack whose hash was made of documents with their marks and CRLF keeps them, as its offsets count them.
    """
    read: dict[str, bytes] = {}
    refused: dict[str, str] = {}
    for name in (*FILES, *also, *_documents(folder, refused)):
        try:
            read[name] = read_regular(folder / name)
        except FileNotFoundError:
            continue
        except OSError as error:
            refused[name] = f"cannot be read: {error.strerror}; make it readable" if error.strerror else str(error)
    plain = {name: _plain(name, content) for name, content in read.items()}
    return Content(_as_sealed(plain, read), refused)


def content_sha256(values: Mapping[str, Any], content: Mapping[str, bytes]) -> str:
    """Over the canonical content: every JSON file with sorted keys, every source document as `read_content` gives it.

    `values`: what the files of `FILES` hold. The manifest's own `content_sha256` is left out.
    """
    digest = sha256()
    parts = [(name, _canonical(name, values[name])) for name in FILES]
    parts += [(name, content[name]) for name in sorted(content) if name.startswith(SOURCES)]
    for name, part in parts:
        digest.update(f"{name}\0{len(part)}\0".encode() + part)
    return digest.hexdigest()


def _documents(folder: Path, refused: dict[str, str]) -> tuple[str, ...]:
    """Names of the source documents, sorted; empty where they are more than `MAX_DOCUMENTS`, or their folder is a link."""
    sources = folder / SOURCES
    if sources.is_symlink():
        refused[SOURCES] = "is a link; put the folder itself there"
        return ()
    found = tuple(islice(_markdown(sources), MAX_DOCUMENTS + 1))
    if len(found) > MAX_DOCUMENTS:
        refused[SOURCES] = f"holds more than {MAX_DOCUMENTS} documents; put several texts into one"
        return ()
    return tuple(sorted(found))


def _markdown(sources: Path) -> Iterator[str]:
    try:
        with os.scandir(sources) as entries:
            yield from (SOURCES + entry.name for entry in entries if entry.name.endswith(".md"))
    except OSError:  # there is no such folder
        return


def _plain(name: str, content: bytes) -> bytes:
    content = content.removeprefix(BOM_UTF8)
    return content.replace(b"\r\n", b"\n") if name.startswith(SOURCES) else content


def _as_sealed(plain: dict[str, bytes], read: dict[str, bytes]) -> dict[str, bytes]:
    kept = {name: read[name] if name.startswith(SOURCES) else content for name, content in plain.items()}
    if kept == plain:
        return plain
    try:
        values = {name: msgspec.json.decode(plain[name]) for name in FILES}
        sealed = values["manifest.json"]["content_sha256"]
    except (KeyError, TypeError, *MALFORMED):
        return plain
    return kept if content_sha256(values, kept) == sealed else plain


def _canonical(name: str, value: Any) -> bytes:
    if name == "manifest.json" and isinstance(value, dict):
        value = {key: part for key, part in value.items() if key != "content_sha256"}
    return msgspec.json.encode(value, order="deterministic")
