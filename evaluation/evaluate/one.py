"""One run: driven, measured, kept. The same function for a process of this machine and for Ray."""

import base64
import hashlib
import logging
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from drivemcp.grants import KeyPair, sign_grant
from drivemcp.node import Node
from evaluation.corruption.record import CorruptionLog
from evaluation.evaluate.moments import with_pictures, worst_moments
from evaluation.evaluate.plan import with_settings
from evaluation.evaluate.store import LOG, METRICS, SPEC, Kept, Store, measuring
from evaluation.metrics import Record, Recorder, from_log, keep, measure
from evaluation.run.host import drive
from evaluation.run.ready import RunError
from evaluation.run.spec import RunSpec
from proto.decision import Grant
from proto.topics import BRAKE

GRANT = Grant(
    grant_id="evaluation", vehicle="ego", capability=BRAKE.name, max_deceleration_mps2=4.0, max_duration_s=2.0,
    issued_at="2020-01-01T00:00:00+00:00", expires_at="2120-01-01T00:00:00+00:00",
)  # fmt: skip


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
    kept = _measure(recorder.record(), part, wall_s, cpu_s)
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


def _pair() -> KeyPair:
    """The same for all simulated cars, so that runs come out alike; nobody else trusts it."""
    key = Ed25519PrivateKey.from_private_bytes(hashlib.sha256(b"the simulated cars of the evaluation").digest())
    halves = key.private_bytes_raw(), key.public_key().public_bytes_raw()
    return KeyPair(*(base64.b64encode(half).decode() for half in halves))


def granted(spec: RunSpec, folder: Path) -> RunSpec:
    """The spec with permission for the simulated car to be braked; where the grant lies is no part of a run's key."""
    file, pair = folder / "grant.json", _pair()
    file.write_bytes(msgspec.json.encode(sign_grant(GRANT, pair.private)))
    return with_settings(spec, "arbiter", {"grant_file": str(file), "trusted_keys": [pair.public]})


def _tidy(folder: Path) -> None:
    """The log by its fixed name; the key that signed it goes, its public half stays."""
    logs = sorted((folder / "logs").glob("*.mcap"))
    if len(logs) != 1:
        raise RunError(f"the run left {len(logs)} log files, not one")
    logs[0].rename(folder / LOG)
    (folder / "logs").rmdir()
    (folder / "secrets" / "log-key.pub").rename(folder / "log-key.pub")
    shutil.rmtree(folder / "secrets")


def _measure(record: Record, folder: Path, wall_s: float, cpu_s: float) -> Kept:
    kept = Kept(
        metrics=msgspec.to_builtins(measure(record)), moments=with_pictures(worst_moments(record), folder / LOG),
        wall_s=wall_s, cpu_s=cpu_s, measured_by=measuring(),
    )  # fmt: skip
    (folder / METRICS).write_bytes(msgspec.json.format(msgspec.json.encode(kept)))
    return kept


def _measured_again(store: Store, key: str) -> Kept:
    folder = store.path(key)
    before = msgspec.json.decode((folder / METRICS).read_bytes(), type=dict)
    return _measure(from_log(folder / LOG), folder, before.get("wall_s", 0.0), before.get("cpu_s", 0.0))
