"""Runs in one file that is committed, a line each, so that tables grow over sittings and machines: FILE.jsonl or FILE.jsonl.gz.

A line says what a run was and what it came to. Its log is not there: driving the run again makes it anew.
"""

import fcntl
import gzip
import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from drivemcp.errors import MALFORMED, UserError
from evaluation.campaign.moments import Moment
from evaluation.campaign.replacing import write_whole
from evaluation.campaign.store import MEASURES, Kept, Store, drivers, driving
from evaluation.metrics import Metrics
from evaluation.metrics.labels import Drive
from evaluation.metrics.record import DAMAGED
from evaluation.run.spec import RunSpec, encoded, key_of

ALL = "all"
"""In place of a key: every run of the file."""


class Line(msgspec.Struct, frozen=True, kw_only=True):
    """One run. What is raw is decoded only where the run is of today's models, behaviour and measures: older ones may have other fields."""

    key: str
    """Of the bytes of `spec` and of `driven_by`."""
    spec: msgspec.Raw
    driven_by: str
    measured_by: str
    outcome: str
    wall_s: float
    cpu_s: float
    metrics: msgspec.Raw
    moments: msgspec.Raw
    labelled: msgspec.Raw
    machine: str = ""
    """The machine on which the run was driven; empty: it was not noted."""

    @property
    def of_today(self) -> bool:
        """Whether it has today's models, behaviour and measures."""
        return self.driven_by in drivers() and self.measured_by == MEASURES

    def kept(self) -> Kept:
        """What the run came to. Raises msgspec.MsgspecError; only of today's."""
        return Kept(
            metrics=msgspec.json.decode(self.metrics, type=dict[str, Any]),
            moments=msgspec.json.decode(self.moments, type=tuple[Moment, ...]),
            labelled=msgspec.json.decode(self.labelled, type=Drive),
            wall_s=self.wall_s, cpu_s=self.cpu_s, machine=self.machine, measured_by=self.measured_by, outcome=self.outcome,
        )  # fmt: skip


def line_of(key: str, spec: RunSpec, kept: Kept) -> Line:
    """The line of a run that is here."""
    return Line(
        key=key, spec=msgspec.Raw(encoded(spec)), driven_by=driving(spec.sensors),
        measured_by=kept.measured_by, outcome=kept.outcome, wall_s=kept.wall_s, cpu_s=kept.cpu_s, machine=kept.machine,
        metrics=msgspec.Raw(msgspec.json.encode(kept.metrics)), moments=msgspec.Raw(msgspec.json.encode(kept.moments)),
        labelled=msgspec.Raw(msgspec.json.encode(kept.labelled)),
    )  # fmt: skip


def read(file: Path) -> dict[str, Line]:
    """A file's lines by key. Raises UserError naming file, line and field."""
    lines: dict[str, Line] = {}
    for number, text in enumerate(_bytes(file).splitlines(), 1):
        try:
            line = msgspec.json.decode(text, type=Line)
            problem = "`$.key`: it is there twice" if line.key in lines else _problem(line)
        except MALFORMED as error:
            problem = str(error)
        if problem:
            raise UserError(f"{file}, line {number}: {problem}")
        lines[line.key] = line
    return lines


def _bytes(file: Path) -> bytes:
    try:
        whole = file.read_bytes()
        if file.suffix != ".gz":
            return whole
        if not whole:
            raise EOFError("the file is empty")  # gzip takes it for whole
        return gzip.decompress(whole)
    except DAMAGED as error:
        raise UserError(f"{file}: no published runs: {error}") from None


_FORMS = (("metrics", Metrics), ("moments", tuple[Moment, ...]), ("labelled", Drive))


def _problem(line: Line) -> str:
    """What is wrong with a line, and in which field; empty: nothing."""
    key = key_of(bytes(line.spec), line.driven_by)
    if line.key != key:
        return f"`$.key`: {line.key} does not fit `$.spec` and `$.driven_by`, which make {key}"
    if line.measured_by != MEASURES:
        return ""
    spec = (("spec", RunSpec),) if line.driven_by in drivers() else ()
    for name, kind in (*spec, *_FORMS):
        try:
            msgspec.json.decode(getattr(line, name), type=kind)
        except MALFORMED as error:
            return f"`$.{name}`: {error}"
    odd = set(line.kept().metrics) ^ set(Metrics.__struct_fields__)
    return f"`$.metrics.{min(odd)}`: missing, or no metric" if odd else ""


def taken(lines: Mapping[str, Line], again: Sequence[str]) -> dict[str, Kept]:
    """The runs of today, less those that are to be driven again. Raises UserError where one of these is not published."""
    for key in again:
        if key not in lines and (key != ALL or not lines):
            raise UserError(f"--again {key}: no such run in the file of --published")
    return {key: line.kept() for key, line in lines.items() if line.of_today and not {key, ALL} & set(again)}


def fit(lines: Mapping[str, Line]) -> str:
    """How many lines have today's behaviour, models and measures; the others are ignored."""
    count = sum(line.of_today for line in lines.values())
    others = f"; the other {len(lines) - count} are ignored" if count < len(lines) else ""
    return f"{count} of its {len(lines)} runs have this behaviour and these models{others}"


def told(file: str, lines: Mapping[str, Line], wanted: Collection[str], store: Store) -> str:
    """For the report: how many of the wanted runs come from the file, and what of the file does not fit."""
    if not file:
        return ""
    count = sum(store.here(key) is None and store.kept(key) is not None for key in wanted)
    told = f"{count} runs are taken from {file} ({fit(lines)})"
    if not count:
        return f"{told}: with this amount, these latencies and settings no other run of these tables is in it."
    return (
        f"{told}, driven before or elsewhere: their logs are not here. With --again KEY the command drives one of them here, with "
        "--again all all; each comes out the same, bit for bit, or the command says that it did not."
    )


def publish(file: Path, ours: Iterable[Line]) -> int:
    """Add runs to a file, sorted by key; how many are new. What is there stays, older ones too, unless it is now measured otherwise."""
    with _alone(file):
        there = read(file) if file.exists() else {}
        new = {line.key: line for line in ours if _is_new(line, there.get(line.key))}
        write(file, {**there, **new})
    return len(new)


def _is_new(line: Line, there: Line | None) -> bool:
    return there is None or (line.of_today and not there.of_today)


@contextmanager
def _alone(file: Path) -> Iterator[None]:
    """No other `publish` reads or writes files of that folder meanwhile: the runs that two publish at once are all kept."""
    file.parent.mkdir(parents=True, exist_ok=True)
    folder = os.open(file.parent, os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        yield
    finally:
        os.close(folder)


def write(file: Path, lines: Mapping[str, Line]) -> None:
    """A file of these lines, sorted by key; it is there whole, or stays as it was."""
    whole = b"".join(msgspec.json.encode(lines[key]) + b"\n" for key in sorted(lines))
    write_whole(file, gzip.compress(whole, mtime=0) if file.suffix == ".gz" else whole)


def otherwise(published: Mapping[str, Line], here: Iterable[Line]) -> list[str]:
    """The keys of runs that came out otherwise here than they were published by the same code: that should not be."""
    pairs = ((line, published[line.key]) for line in here if line.key in published)
    return [line.key for line, other in pairs if other.of_today and came_to(line.kept()) != came_to(other.kept())]


def came_to(kept: Kept) -> Kept:
    """All but how long it took to drive, and on what."""
    return msgspec.structs.replace(kept, wall_s=0.0, cpu_s=0.0, machine="")
