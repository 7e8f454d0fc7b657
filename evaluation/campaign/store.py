"""Runs on disk: FOLDER/<run_key>/{spec.json, metrics.json, log.mcap, truth.msgpack.gz, *.jpg}. What is there is finished.

Beside them a store may know runs that were published: their numbers count, and nothing else of them is here.
"""

import fcntl
import hashlib
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any, get_args

import msgspec

from drivemcp.errors import MALFORMED, UserError
from drivemcp.paths import data
from evaluation.campaign.moments import Moment
from evaluation.metrics.labels import Drive
from evaluation.metrics.record import TRUTH_FILE
from evaluation.run.spec import RunSpec, Sensors, driven_by, run_key

DATA = ("models", "rulepacks", "vehicles", "scenarios")
PICTURES = ("detector", "people", "reader", "weather")
"""The networks that look at pictures, by how their files' names begin. Modelled sensors have no pictures (tested: they open none)."""
MEASURES = "2"
"""Raise it when a metric or a moment is computed otherwise: finished runs are then measured again, from their logs."""
LOG, SPEC, METRICS, FAILED = "log.mcap", "spec.json", "metrics.json", "failed.txt"


class Kept(msgspec.Struct, frozen=True, kw_only=True):
    """What a run came to. `metrics` has the fields of evaluation.metrics.Metrics."""

    metrics: dict[str, Any]
    moments: tuple[Moment, ...]
    wall_s: float
    cpu_s: float
    measured_by: str
    """`MEASURES` of then: runs measured by another are measured again, from the log."""
    outcome: str = ""
    """A digest of the run's truth and of what was decided and said in it (`evaluation.metrics.Record`): equal if a run came out alike."""
    machine: str = ""
    """The machine on which the run was driven; empty: it was not noted."""
    labelled: Drive = Drive((), 0.0)
    """What a driver who knows the truth would say of it: rows that adapt begin their next run with it."""


@cache
def world_digest(sensors: Sensors) -> str:
    """Of the data that such runs read."""
    digest = hashlib.sha256()
    for name, path in world_files(sensors):
        digest.update(name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:12]


def world_files(sensors: Sensors) -> Iterator[tuple[str, Path]]:
    """Models, rulepacks, vehicles and scenarios, by name; without pictures not the networks for them."""
    for root in map(data, DATA):
        for path in sorted(path for path in root.rglob("*") if path.is_file() and path.name != "README.md"):
            if sensors == "rendered" or root.name != "models" or not path.name.startswith(PICTURES):
                yield f"{root.name}/{path.relative_to(root).as_posix()}", path


def driving(sensors: Sensors) -> str:
    """What drives runs with such sensors today: the behaviour lock's digest and that of the data."""
    return driven_by(world_digest(sensors))


def drivers() -> frozenset[str]:
    """What drives the runs of today, by either kind of sensors."""
    return frozenset(map(driving, get_args(Sensors)))


class Store:
    """The folder of all runs; tables share them."""

    def __init__(self, folder: Path, published: Mapping[str, Kept] = MappingProxyType({})) -> None:
        self.folder = folder
        self._known: dict[str, Kept] = {}
        self._published = published

    def key(self, spec: RunSpec) -> str:
        """The run's name: of spec, models and behaviour lock."""
        return run_key(spec, world_digest(spec.sensors))

    def path(self, key: str) -> Path:
        """Where the run lies, or will."""
        return self.folder / key

    def kept(self, key: str) -> Kept | None:
        """What a finished run came to, by today's measures, here or as published; None: it has to be driven or measured again."""
        return self.here(key) or self._published.get(key)

    def here(self, key: str) -> Kept | None:
        """The same of runs in this folder alone."""
        if key in self._known:
            return self._known[key]
        try:
            kept = msgspec.json.decode((self.path(key) / METRICS).read_bytes(), type=Kept)
        except (OSError, *MALFORMED):
            return None
        if kept.measured_by != MEASURES:
            return None
        return self._known.setdefault(key, kept)

    def driven(self, key: str) -> bool:
        """Whether the run came to its end, by whichever `MEASURES` it was measured, and the files for measuring it again are here."""
        return all((self.path(key) / name).exists() for name in (LOG, TRUTH_FILE))

    @contextmanager
    def alone(self) -> Iterator[None]:
        """No other evaluation drives into this folder meanwhile. Raises UserError where one does, or where the folder cannot be written."""
        with self._locked() as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise UserError(
                    f"another evaluation drives into {self.folder}; wait for it, or take another --out"
                ) from None
            yield

    def _locked(self) -> IO[str]:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            return (self.folder / "lock").open("w")
        except OSError as error:
            raise UserError(f"runs cannot go into {self.folder}: {error.strerror}; take another --out") from None

    def start(self, key: str) -> Path:
        """An empty folder to drive in; `finish` gives it its name."""
        folder = self.folder / f"{key}.part"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        return folder

    def finish(self, key: str) -> None:
        """From now on the run counts as finished."""
        shutil.rmtree(self.path(key), ignore_errors=True)
        (self.folder / f"{key}.part").rename(self.path(key))

    def failed(self, key: str) -> str:
        """Why the last try failed; empty: it did not."""
        try:
            return (self.folder / f"{key}.{FAILED}").read_text(encoding="utf-8")
        except OSError:
            return ""

    def note(self, key: str, problem: str) -> None:
        """Keep why a run failed, or (empty) that it does no longer."""
        file = self.folder / f"{key}.{FAILED}"
        if problem:
            self.folder.mkdir(parents=True, exist_ok=True)
            file.write_text(problem, encoding="utf-8")
        else:
            file.unlink(missing_ok=True)
