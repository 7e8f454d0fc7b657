"""Which scenarios there are: `family/split/number`, and how the splits keep apart."""

from random import Random
from typing import Literal, NamedTuple, get_args

from drivemcp.errors import UserError

Family = Literal["urb-rain", "cross-border", "dynamic-vsl"]
Split = Literal["calibration", "development", "test"]
FAMILIES: tuple[Family, ...] = get_args(Family)
SPLITS: tuple[Split, ...] = get_args(Split)
LAYOUTS = 12
"""Kinds of layouts of a family. Every number has a layout of its own, which no other number and no other split has."""
SEEDS = 10_000_000
"""Seeds of the world per split: those of one split are in a block of their own."""


class Place(NamedTuple):
    """One scenario's name, taken apart."""

    family: Family
    split: Split
    number: int

    @property
    def layout(self) -> int:
        """The layout's number within the family: 0 to 11 calibration, 12 to 23 development, 24 to 35 test, then so on again."""
        round_, kind = divmod(self.number, LAYOUTS)
        return (round_ * len(SPLITS) + SPLITS.index(self.split)) * LAYOUTS + kind

    def world_seed(self, seed: int) -> int:
        """The simulator's seed for a run's: another in every split, for every number."""
        within = Random(f"{self.family} {self.number} {seed}").randrange(SEEDS)
        return SPLITS.index(self.split) * SEEDS + within

    def __str__(self) -> str:
        return f"{self.family}/{self.split}/{self.number}"


def read_place(name: str) -> Place | None:
    """The place of `family/split/number`; None: no such name (a shipped scenario or a path). Raises UserError."""
    parts = name.split("/")
    if parts[0] not in FAMILIES or len(parts) != 3:
        return None
    family, split, number = parts
    if split not in SPLITS:
        raise UserError(f"scenario {name}: no split {split!r}; there are {', '.join(SPLITS)}")
    if not number.isdecimal():
        raise UserError(f"scenario {name}: {number!r} is no number")
    return Place(family, split, int(number))  # type: ignore[arg-type]
