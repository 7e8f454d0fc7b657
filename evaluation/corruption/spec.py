"""What to corrupt and how often: read from `sign_miss=0.2,dropout=0.1,seed=3`, from a TOML file, or from the paper's names."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated

import msgspec

from drivemcp.errors import UserError

Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Seconds = Annotated[float, msgspec.Meta(gt=0.0, le=600.0)]
CLEAN = "clean"


class CorruptionSpec(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Rates in [0, 1]. Of signs: the share of encounters. Of actors, cameras and the LiDAR: the share of their time."""

    seed: int = 1
    sign_miss: Share = 0.0
    limit_misread: Share = 0.0
    misread_unit: Share = 0.25
    """Of the misread limits, how many keep their number and change their unit."""
    dropout: Share = 0.0
    blackout: Share = 0.0
    freeze: Share = 0.0
    lidar_loss: Share = 0.0
    jitter_ms: Annotated[float, msgspec.Meta(ge=0.0, le=1000.0)] = 0.0
    """Stamps of pictures and sweeps are shifted by up to this much, either way."""
    jitter_keeps_order: bool = True
    shortest_s: Seconds = 0.5
    longest_s: Seconds = 3.0

    def __post_init__(self) -> None:
        if self.shortest_s > self.longest_s:
            raise ValueError(f"`shortest_s` {self.shortest_s:g} is longer than `longest_s` {self.longest_s:g}")

    def text(self) -> str:
        """As it is read again; `clean` where nothing differs from its default."""
        default = CorruptionSpec()
        pairs = ((name, getattr(self, name)) for name in self.__struct_fields__)
        changed = [(name, value) for name, value in pairs if value != getattr(default, name)]
        return ",".join(f"{name}={msgspec.json.encode(value).decode()}" for name, value in changed) or CLEAN

    def touches(self, *rates: str) -> bool:
        """Whether one of the named rates is above zero."""
        return any(getattr(self, rate) > 0 for rate in rates)


PAPER: Mapping[str, CorruptionSpec] = MappingProxyType(
    {
        CLEAN: CorruptionSpec(),
        "sign_miss_10": CorruptionSpec(sign_miss=0.1),
        "sign_miss_30": CorruptionSpec(sign_miss=0.3),
        "limit_misread_10": CorruptionSpec(limit_misread=0.1),
        "actor_dropout_10": CorruptionSpec(dropout=0.1),
        "actor_dropout_30": CorruptionSpec(dropout=0.3),
    }
)
"""The rows of the paper's corruption table, by their names in its `tables.json`."""


def read_spec(text: str) -> CorruptionSpec:
    """The settings of a TOML file, of a row of the paper's table, or of `key=value` pairs. Raises UserError naming the field."""
    if text in PAPER:
        return PAPER[text]
    try:
        loaded = tomllib.loads(_file(text) if text.endswith(".toml") else "\n".join(text.split(",")))
    except tomllib.TOMLDecodeError as error:
        raise UserError(
            f"corruption {text!r} is neither key=value pairs nor one of {', '.join(PAPER)}: {error}"
        ) from None
    try:
        return msgspec.convert(loaded, CorruptionSpec)
    except msgspec.ValidationError as error:
        raise UserError(f"corruption {text!r}: {error}") from None


def _file(path: str) -> str:
    try:
        return Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise UserError(f"cannot read the corruption file {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise UserError(f"the corruption file {path} is not text") from None
