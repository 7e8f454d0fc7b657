"""What one run is: everything that decides how it comes out, and a key made of it."""

import hashlib
from typing import Any, Literal

import msgspec

from evaluation.corruption.spec import CLEAN
from evaluation.run.behaviour import behaviour
from evaluation.stand_ins.kinds import StandIn

Sensors = Literal["rendered", "model"]


class RunSpec(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One run. Equal specs come out alike by the same models and behaviour; `run_key` holds all three."""

    scenario: str
    """`family/split/number` (see `evaluation.scenarios`), a shipped scenario's name, or the path of a TOML file."""
    seed: int = 1
    """Varies driver, traffic, looks and noise: the same for every method that is compared."""
    seconds: float = 0.0
    """0: to the end of the route."""
    sensors: Sensors = "rendered"
    corruption: str = CLEAN
    settings: dict[str, dict[str, Any]] = {}
    """Service -> its settings: a method or an ablation is nothing else."""
    without: tuple[str, ...] = ()
    """Services that are not started."""
    stand_ins: tuple[StandIn, ...] = ()
    """What is published in place of what the services would (`evaluation/stand_ins`)."""
    modelled_ms: dict[str, float] = {}
    """Tool -> what each of its calls takes, ms (`evaluation.run.latencies`). Tools not named, and without it all: fixed, 4 ms."""
    method: str = "DriveMCP"
    """A label; what it means is in `settings`, `without` and `stand_ins` (`evaluation.run.methods`)."""


def run_key(spec: RunSpec, models: str = "") -> str:
    """16 hex digits of the spec, the digest of the models, and the behaviour lock."""
    return key_of(encoded(spec), driven_by(models))


def encoded(spec: RunSpec) -> bytes:
    """The spec's own form: equal specs give equal bytes."""
    return msgspec.json.encode(spec, order="deterministic")


def driven_by(models: str = "") -> str:
    """What drives runs: the behaviour lock's digest, then that of the models."""
    return f"{behaviour()}-{models}"


def key_of(spec: bytes, driver: str) -> str:
    """The key of an encoded spec; `driver` is what `driven_by` said where it was driven."""
    return hashlib.sha256(spec + b"\0" + driver.encode()).hexdigest()[:16]
