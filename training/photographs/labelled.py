"""Photographs whose boxes are labelled, in our classes: GTSDB's scenes, the 877-set, cinTA's traffic lights."""

import csv
import io
import zipfile
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proto.perception import ObjectClass
from services.drivelm.reading.crops import Picture, Region
from training.photographs import gtsdb
from training.photographs.gtsrb import HELD_OUT_ONE_IN, decoded
from training.photographs.sets import present

Boxes = Mapping[ObjectClass, tuple[Region, ...]]
LAMPS = ("green", "red", "yellow")
"""The names of cinTA's classes, in the order of their numbers."""


PLACES = {"red": 0, "yellow": 1, "green": 2}
"""The third of a head, from the top, in which each lamp is."""


class Photograph(NamedTuple):
    """A picture and its labelled boxes by class. Of the classes in `whole` all are labelled; of others some, or none."""

    name: str
    picture: Picture
    boxes: Boxes
    whole: frozenset[ObjectClass]
    set: str = ""
    """The name of its set (`training.photographs.sets`)."""


class Light(NamedTuple):
    """A labelled traffic light: the lamp that is lit, and where the head is."""

    lamp: str
    region: Region


def photographs(folder: Path, *, held_out: bool, without: Collection[str] = ()) -> Iterator[Photograph]:
    """Those that training has, or those that it leaves out, of all sets below a folder that have whole pictures."""
    for each in present(folder, without):
        if each.name in _SOURCES:
            for photograph in _SOURCES[each.name](folder / each.file, held_out):
                yield photograph._replace(set=each.name)


def is_held_out(name: str) -> bool:
    """Whether training leaves a picture of the 877-set or of cinTA out: ten in a row, as neighbours may be alike."""
    digits = int("".join(char for char in Path(name).stem if char.isdigit()))
    return digits // 10 % HELD_OUT_ONE_IN == HELD_OUT_ONE_IN // 2


def road_signs(path: Path) -> Iterator[tuple[str, Callable[[], Picture], list[tuple[str, Region]]]]:
    """The 877-set's pictures: name, how to read it, and labelled boxes by the publisher's class."""
    with zipfile.ZipFile(path) as stored:
        table: dict[str, list[tuple[str, Region]]] = {}
        for row in csv.DictReader(io.StringIO(stored.read("labels.csv").decode())):
            box = Region(*(float(row[edge]) for edge in ("x1", "y1", "x2", "y2")))
            table.setdefault(row["file"], []).append((row["class"], box))
        for name, boxes in table.items():
            yield name, partial(_read, stored, name), boxes


def traffic_lights(path: Path) -> Iterator[tuple[str, Picture, list[Light]]]:
    """cinTA's pictures: name, picture, labelled lights. Many are turned or washed out, some are upside down."""
    with zipfile.ZipFile(path) as stored:
        for name in sorted(each for each in stored.namelist() if each.startswith("images/")):
            picture = _read(stored, name)
            lines = stored.read(name.replace("images", "labels").replace(".jpg", ".txt")).decode().splitlines()
            yield name, picture, [_light(line, picture) for line in lines]


def is_upright(picture: Picture, light: Light) -> bool:
    """Whether the head is taller than wide and its most vivid third is the one where the lit lamp belongs."""
    place, head = PLACES[light.lamp], _head(picture, light.region)
    if min(head.shape[:2]) < 4 or light.region.height_px < 1.6 * light.region.width_px:
        return False
    thirds = _vividness(head)
    others = max(thirds[:place] + thirds[place + 1 :])
    red, green, _ = np.array_split(head, 3)[place].reshape(-1, 3).max(axis=0)
    return thirds[place] > 2.0 * others and bool((green > red) == (light.lamp == "green"))


def _is_upside_down(picture: Picture, lights: list[Light]) -> bool:
    """Whether more red and green lamps are rather lit where the other one belongs."""
    votes = 0
    for light in lights:
        head = _head(picture, light.region)
        if light.lamp != "yellow" and min(head.shape[:2]) >= 4 and light.region.height_px > 1.2 * light.region.width_px:
            thirds = _vividness(head)
            here, there = thirds[PLACES[light.lamp]] + 1, thirds[2 - PLACES[light.lamp]] + 1
            votes += int(there > 1.25 * here) - int(here > 1.25 * there)
    return votes > 0


def _head(picture: Picture, region: Region) -> NDArray[np.float32]:
    x0, y0, x1, y1 = (max(0, round(edge)) for edge in region)
    return picture[y0:y1, x0:x1].astype(np.float32)


def _vividness(head: NDArray[np.float32]) -> list[float]:
    """Of the upper, middle and lower third."""
    vivid = (head.max(axis=2) - head.min(axis=2)) * head.max(axis=2)
    return [float(np.quantile(part, 0.85)) for part in np.array_split(vivid, 3)]


def _read(stored: zipfile.ZipFile, name: str) -> Picture:
    return decoded(stored.read(name))


def _light(line: str, picture: Picture) -> Light:
    number, x, y, width, height = (float(part) for part in line.split())
    high, wide = picture.shape[:2]
    box = Region((x - width / 2) * wide, (y - height / 2) * high, (x + width / 2) * wide, (y + height / 2) * high)
    return Light(LAMPS[int(number)], box)


def _scenes(path: Path, held_out: bool) -> Iterator[Photograph]:
    for scene in gtsdb.scenes(path.parent):
        if scene.held_out == held_out:
            signs = tuple(sign.region for sign in scene.signs)
            yield Photograph(f"{scene.number:05d}", scene.picture(), {"sign": signs}, frozenset({"sign"}))


def _road_signs(path: Path, held_out: bool) -> Iterator[Photograph]:
    for name, read, labelled in road_signs(path):
        if is_held_out(name) == held_out:
            lights = tuple(box for kind, box in labelled if kind == "trafficlight")
            signs = tuple(box for kind, box in labelled if kind != "trafficlight")
            yield Photograph(name, read(), {"sign": signs, "light": lights}, frozenset())


def _traffic_lights(path: Path, held_out: bool) -> Iterator[Photograph]:
    for name, picture, lights in traffic_lights(path):
        if is_held_out(name) == held_out and not _is_upside_down(picture, lights):
            yield Photograph(name, picture, {"light": tuple(each.region for each in lights)}, frozenset({"light"}))


_SOURCES: Mapping[str, Callable[[Path, bool], Iterator[Photograph]]] = {
    "gtsdb": _scenes,
    "road-signs-877": _road_signs,
    "traffic-lights": _traffic_lights,
}
