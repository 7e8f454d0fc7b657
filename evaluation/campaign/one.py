"""One run: driven, measured, kept. The same function for a process of this machine and for Ray."""

import logging
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec

from drivemcp.errors import MALFORMED, UserError
from drivemcp.node import Node
from evaluation.campaign.machine import machine
from evaluation.campaign.moments import with_pictures, worst_moments
from evaluation.campaign.replacing import write_whole
from evaluation.campaign.store import LOG, MEASURES, METRICS, SPEC, Kept, Store
from evaluation.corruption.record import CorruptionLog
from evaluation.metrics import Record, Recorder, keep, measure
from evaluation.metrics.labels import labelled
from evaluation.run.grant import granted
from evaluation.run.host import drive
from evaluation.run.ready import RunError
from evaluation.run.recorded import record_of
from evaluation.run.spec import RunSpec


def run_one(folder: str, key: str, spec: RunSpec) -> Kept:
    """Drive the run if it is not there, measure it, keep it. Raises what `drive` raises."""
    store = Store(Path(folder))
    return _measured_again(store, key) if store.driven(key) else _driven(store, key, spec)


def _driven(store: Store, key: str, spec: RunSpec) -> Kept:
    part, recorder = store.start(key), Recorder()
    corrupted = CorruptionLog(part)

    def observe(node: Node) -> None:
        recorder.follow(node)
        corrupted.follow(node)

    wall_s, cpu_s = time.monotonic(), _cpu_s()
    with _told_of_failures() as failures:
        drive(granted(spec, part), part, observe)
    if failures:
        raise RunError(f"{len(failures)} errors in services, the first: {failures[0]}")
    wall_s, cpu_s = time.monotonic() - wall_s, _cpu_s() - cpu_s
    _tidy(part)
    (part / SPEC).write_bytes(msgspec.json.format(msgspec.json.encode(spec)))
    keep(recorder, part)
    kept = _measure(recorder.record(), part, _Took(round(wall_s, 2), round(cpu_s, 2), machine()))
    store.finish(key)
    return kept


@contextmanager
def _told_of_failures() -> Iterator[list[str]]:
    """What services log as errors. They go on after a handler's bug; a run in which one failed measures that bug."""
    found: list[str] = []

    class Listen(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            found.append(logging.Formatter().format(record))

    listen = Listen(logging.ERROR)
    logging.getLogger().addHandler(listen)
    try:
        yield found
    finally:
        logging.getLogger().removeHandler(listen)


def _cpu_s() -> float:
    """Of this process and of those it has seen end, the one that draws among them."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def _tidy(folder: Path) -> None:
    """The log by its fixed name; the key that signed it goes, its public half stays."""
    logs = sorted((folder / "logs").glob("*.mcap"))
    if len(logs) != 1:
        raise RunError(f"the run left {len(logs)} log files, not one")
    logs[0].rename(folder / LOG)
    (folder / "logs").rmdir()
    (folder / "secrets" / "log-key.pub").rename(folder / "log-key.pub")
    shutil.rmtree(folder / "secrets")


class _Took(msgspec.Struct):
    """Of whichever metrics: how long the run took to drive, and on what."""

    wall_s: float = 0.0
    cpu_s: float = 0.0
    machine: str = ""


def _measure(record: Record, folder: Path, took: _Took) -> Kept:
    kept = Kept(
        metrics=msgspec.to_builtins(measure(record)), moments=with_pictures(worst_moments(record), folder / LOG),
        wall_s=took.wall_s, cpu_s=took.cpu_s, machine=took.machine, measured_by=MEASURES, outcome=record.outcome(),
        labelled=labelled(record),
    )  # fmt: skip
    write_whole(folder / METRICS, msgspec.json.format(msgspec.json.encode(kept)))
    return kept


def _measured_again(store: Store, key: str) -> Kept:
    folder = store.path(key)
    before = _before(folder / METRICS)
    try:
        record = record_of(folder / LOG)
    except UserError as error:
        raise RunError(f"{folder}: what was logged is damaged ({error}); delete the folder to drive it again") from None
    return _measure(record, folder, before)


def _before(file: Path) -> _Took:
    """What an earlier measuring kept; nothing of a file that was cut."""
    try:
        return msgspec.json.decode(file.read_bytes(), type=_Took)
    except (OSError, *MALFORMED):
        return _Took()
