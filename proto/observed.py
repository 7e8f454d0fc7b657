"""One observed value of `world_state`: its value, confidence, source, time and validity."""

from typing import Generic, Literal, TypeVar

import msgspec

T = TypeVar("T")

Source = Literal["perception", "drivelm", "can", "map", "weather", "driver", "derived"]


class Observed(msgspec.Struct, Generic[T], frozen=True, kw_only=True):
    """A value with its confidence in [0, 1], its source, the stamp of the data it rests on, and its validity."""

    value: T
    confidence: float
    source: Source
    stamp_ns: int
    valid_for_ns: int
    evidence: str = ""
    """Where it was seen: a track id, a frame stamp, a signal name; for the trace."""


def value_of(observed: Observed[T] | None) -> T | None:
    """The value; None where it is unset."""
    return observed.value if observed is not None else None
