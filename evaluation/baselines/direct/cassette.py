"""Answers to whole prompts, recorded: a file of JSON lines that drives the same rows again without the model.

The first line is `{"cassette": 1, "behaviour": ...}`, with the behaviour lock's digest when the recording began. Each other line is one
answer: backend, SHA-256 of the prompt, text, score, latency, and what the prompt was filled with. A backend's prompt has one answer: a
recording asks for none that is there, so that the drive that records and the drive that plays hear the same, to the bit. Several
processes may record into one file. A file that is only read may be `.gz`.
"""

import fcntl
import gzip
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import IO, Annotated, TypeVar

import msgspec

from drivemcp.errors import MALFORMED, UserError
from evaluation.baselines.direct.template import Asked

VERSION = 1
T = TypeVar("T")
MOST_MS = 600_000.0
"""No answer takes longer."""


class Line(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, forbid_unknown_fields=True):
    """One answer."""

    backend: str
    """Backend, model and template, as in the trace."""
    prompt: str
    """SHA-256 of the whole prompt, and of the picture that went with it."""
    text: str = ""
    """Empty: an abstention."""
    score: Annotated[float, msgspec.Meta(ge=0, le=1)] = 0.0
    took_ms: Annotated[float, msgspec.Meta(ge=0, le=MOST_MS)] = 0.0
    context: str = ""
    query: str = ""
    passages: tuple[str, ...] = ()
    tools: tuple[str, ...] = ()
    sees: bool = False
    """Whether a picture went with it."""

    @property
    def asked(self) -> Asked:
        """What the prompt was filled with."""
        return Asked(self.context, self.query, self.passages, self.tools)


class Head(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True, forbid_unknown_fields=True):
    """The first line."""

    cassette: int
    behaviour: str = ""
    """The digest of the behaviour with which the recording began; empty: not noted."""


def read(file: Path) -> list[Line]:
    """All answers. Raises UserError naming the file and what is wrong with it."""
    return _of(file, _lines)


def recorded_at(file: Path) -> str:
    """The behaviour with which the recording began; empty: not noted. Raises UserError as `read` does."""
    return _of(file, _head).behaviour


def _of(file: Path, decoded: Callable[[bytes], T]) -> T:
    try:
        raw = file.read_bytes()
        return decoded(gzip.decompress(raw) if file.suffix == ".gz" else raw)
    except (OSError, EOFError, zlib.error) as error:
        raise UserError(f"cassette {file}: {getattr(error, 'strerror', None) or error}") from None
    except MALFORMED as error:
        raise UserError(f"cassette {file}: {error}") from None


def write(file: Path, lines: Iterable[Line], at: str = "") -> None:
    """A whole file, as `.gz` where its name says so: the same lines, recorded at the same behaviour, give the same bytes."""
    raw = b"".join(msgspec.json.encode(each) + b"\n" for each in (Head(cassette=VERSION, behaviour=at), *lines))
    file.write_bytes(gzip.compress(raw, mtime=0) if file.suffix == ".gz" else raw)


def kind_of(backend: str, decoding: str) -> str:
    """What the names of a backend's answers begin with (`gguf:forms`, `openai`)."""
    return f"gguf:{decoding}" if backend == "gguf" else backend


def model_of(lines: Iterable[Line], kind: str) -> str:
    """The name of the one backend of a kind (`gguf:forms`, `openai`); empty without an answer of it. Raises UserError on two."""
    names = sorted({each.backend for each in lines if each.backend.startswith(f"{kind}:") or each.backend == kind})
    if len(names) > 1:
        raise UserError(f"the cassette has answers of several backends of the kind {kind}: {', '.join(names)}")
    return names[0] if names else ""


class Cassette:
    """The answers of one backend."""

    def __init__(self, file: Path, backend: str, lines: Iterable[Line]) -> None:
        self.file, self.backend = file, backend
        self._answers = dict[str, Line]()
        self.take(lines)

    @property
    def sees(self) -> bool:
        """Whether pictures went with its prompts."""
        return any(each.sees for each in self._answers.values())

    def find(self, prompt: str) -> Line | None:
        """The answer to a prompt, by its hash."""
        return self._answers.get(prompt)

    def take(self, lines: Iterable[Line]) -> None:
        """Take in answers of this backend; the first to a prompt stays."""
        for each in lines:
            if each.backend == self.backend:
                self._answers.setdefault(each.prompt, each)


class Recording(Cassette):
    """A cassette that grows; a new file notes the behaviour `at`. Raises UserError where its file cannot be read or written."""

    def __init__(self, file: Path, backend: str, at: str = "") -> None:
        if file.suffix == ".gz":
            raise UserError(f"cassette {file}: answers are recorded into a plain file; compress it afterwards")
        super().__init__(file, backend, ())
        self._read_to, self._at = 0, at
        with self._open() as held:
            self._read_on(held)

    def add(self, line: Line) -> Line:
        """Write an answer down, and give it back; where another process was quicker, its answer."""
        with self._open() as held:
            self._read_on(held)
            if (found := self.find(line.prompt)) is not None:
                return found
            held.write(msgspec.json.encode(line) + b"\n")
            held.flush()
            self._read_to = held.tell()
        self.take((line,))
        return line

    def _open(self) -> IO[bytes]:
        """The file, held alone until it is closed."""
        try:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            held = self.file.open("a+b")
        except OSError as error:
            raise UserError(f"cassette {self.file}: {error.strerror}") from None
        fcntl.flock(held, fcntl.LOCK_EX)
        return held

    def _read_on(self, held: IO[bytes]) -> None:
        held.seek(self._read_to)
        rest = held.read()
        whole = rest[: rest.rfind(b"\n") + 1]
        if len(whole) < len(rest):  # a process was ended in the middle of a line
            held.truncate(self._read_to + len(whole))
        if not whole and not self._read_to:
            held.write(whole := msgspec.json.encode(Head(cassette=VERSION, behaviour=self._at)) + b"\n")
            held.flush()
        try:
            self.take(_lines(whole, begins=not self._read_to))
        except MALFORMED as error:
            raise UserError(f"cassette {self.file}: {error}") from None
        self._read_to += len(whole)


def _head(raw: bytes) -> Head:
    head = msgspec.json.decode(raw.partition(b"\n")[0], type=Head) if raw else None
    if head is None or head.cassette != VERSION:
        raise msgspec.ValidationError(f'its first line is not {{"cassette": {VERSION}}}')
    return head


def _lines(raw: bytes, *, begins: bool = True) -> list[Line]:
    lines = raw.splitlines()
    if begins:
        _head(raw)
    return [msgspec.json.decode(line, type=Line) for line in lines[begins:]]
