"""Photographed German road scenes (GTSDB): the layout that INI Bochum publishes (`gt.txt` beside `00001.ppm`), and a zip
with `labels.csv`. Scenes without a sign have no line in either table."""

import csv
import io
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

from services.drivelm.reading.crops import Picture, Region
from training.photographs.gtsrb import HELD_OUT_ONE_IN, decoded

ZIP, TABLE = "gtsdb-0-599.zip", "gt.txt"


class Labelled(NamedTuple):
    """A labelled sign of a scene: where it is, pixels, and its class's number (GTSRB's)."""

    region: Region
    number: int


class Scene(NamedTuple):
    """A road scene: its number, how to read it, and its labelled signs."""

    number: int
    encoded: Callable[[], bytes]
    signs: tuple[Labelled, ...]

    @property
    def held_out(self) -> bool:
        """Whether training leaves it out: one scene in eight, and all from 600 on, which the publisher has for its test."""
        return self.number >= 600 or self.number % HELD_OUT_ONE_IN == HELD_OUT_ONE_IN // 2

    def picture(self) -> Picture:
        """The picture, uint8 H x W x 3 RGB."""
        return decoded(self.encoded())


def scenes(folder: Path) -> Iterator[Scene]:
    """Every scene below a folder, in the order of its numbers."""
    for path in sorted(folder.rglob(ZIP)):
        with zipfile.ZipFile(path) as stored:
            text = stored.read("labels.csv").decode().partition("\n")[2]
            names = [name for name in stored.namelist() if name.endswith(".jpg")]
        yield from _scenes(_table(text, ","), names, partial(_unzipped, path))
    for path in sorted(folder.rglob(TABLE)):
        files = {file.name: file for file in path.parent.glob("*.ppm")}
        yield from _scenes(_table(path.read_text(encoding="utf-8"), ";"), list(files), partial(_bytes, files))


def _unzipped(path: Path, name: str) -> bytes:
    with zipfile.ZipFile(path) as stored:
        return stored.read(name)


def _bytes(files: dict[str, Path], name: str) -> bytes:
    return files[name].read_bytes()


def _table(text: str, mark: str) -> dict[int, list[Labelled]]:
    found: dict[int, list[Labelled]] = {}
    for row in csv.reader(io.StringIO(text), delimiter=mark):
        if row:
            name, x0, y0, x1, y1, number = row
            box = Region(float(x0), float(y0), float(x1), float(y1))
            found.setdefault(int(Path(name).stem), []).append(Labelled(box, int(number)))
    return found


def _scenes(table: dict[int, list[Labelled]], names: list[str], read: Callable[[str], bytes]) -> Iterator[Scene]:
    for name in sorted(names):
        number = int(Path(name).stem)
        yield Scene(number, partial(read, name), tuple(table.get(number, ())))
