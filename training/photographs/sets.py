"""The photographs that training may have: who published them, under what licence, and which file of the folder holds them."""

from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple


class RealSet(NamedTuple):
    """A set of photographs: its name for `--without`, its file, and what a model's card says of it."""

    name: str
    file: str
    title: str
    publisher: str
    licence: str


SETS = (
    RealSet("gtsrb", "gtsrb-train.zip", "German Traffic Sign Recognition Benchmark, training set (IJCNN 2011)", "INI Bochum",
            "published for free use in research; its text could not be read at the publisher's"),
    RealSet("gtsdb", "gtsdb-0-599.zip", "German Traffic Sign Detection Benchmark, scenes 0 to 599 (IJCNN 2013)", "INI Bochum",
            "free to use this data package for any purpose"),
    RealSet("road-signs-877", "road-signs-877.zip", "877-set of road signs", "not named", "CC0 1.0"),
    RealSet("traffic-lights", "traffic-lights.zip", "cinTA_v2, traffic lights", "wawan-pradana (Roboflow universe)",
            "CC BY 4.0"),
)  # fmt: skip


def present(folder: Path | None, without: Collection[str] = ()) -> tuple[RealSet, ...]:
    """The sets that the folder holds and that are not left out. Raises ValueError for a name of no set."""
    if unknown := set(without) - {each.name for each in SETS}:
        raise ValueError(f"no set of photographs is named {', '.join(sorted(unknown))}")
    if folder is None:
        return ()
    return tuple(each for each in SETS if each.name not in without and (folder / each.file).is_file())


def carded(used: Collection[RealSet]) -> dict[str, object]:
    """What the card of a model says: the sets that it was trained on, and those that were left out or absent."""
    rows = [{"set": each.title, "publisher": each.publisher, "licence": each.licence} for each in used]
    return {"used": rows, "left_out": [each.name for each in SETS if each not in used]}
