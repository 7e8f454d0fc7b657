"""Photographed German signs (GTSRB), by track: the layout that INI Bochum publishes, and a zip with `labels.csv`.

Read from a folder: `Final_Training/Images/000xx/GT-000xx.csv` with `000TT_000FF.ppm` beside it (tracks `TT`),
`Final_Test/Images` with `GT-final_test.csv` (no tracks), or `gtsrb-train.zip`.
"""

import csv
import io
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from services.drivelm.reading.crops import Picture, Region
from services.drivelm.vocabulary.classes import OTHER

ZIP, TRAINING, TEST = "gtsrb-train.zip", "Final_Training", "GT-final_test.csv"
NAMES = (
    "speed_limit_20", "speed_limit_30", "speed_limit_50", "speed_limit_60", "speed_limit_70", "speed_limit_80",
    "speed_limit_80_end", "speed_limit_100", "speed_limit_120", "no_overtaking", "no_overtaking_heavy",
    "priority_intersection", "priority_road", "yield", "stop", "no_entry_vehicles", "no_entry_heavy", "do_not_enter",
    "warning_sign", "single_curve_left", "single_curve_right", "double_curve_left", "rough_road", "slippery_road",
    "narrows_right", "workers_in_road", "traffic_light", "pedestrian_warning", "children_warning", "cyclists_warning",
    "icy_road", "animals_warning", "restrictions_end", "right", "left", "straight", "straight_right", "straight_left",
    "right_obstacle", "left_obstacle", "roundabout", "no_overtaking_end", "no_overtaking_heavy_end",
)  # fmt: skip
"""The publisher's 43 classes in the order of their numbers, by the names that the zip gives them."""
_OURS: Mapping[str, str] = {
    **{f"speed_limit_{value}": f"limit:{value}" for value in (20, 30, 50, 60, 70, 80, 100, 120)},
    "speed_limit_80_end": "limit_end", "no_overtaking": "no_overtaking", "priority_intersection": "priority_here",
    "priority_road": "priority_road", "yield": "yield", "stop": "stop", "no_entry_vehicles": "no_vehicles",
    "do_not_enter": "no_entry", "warning_sign": "danger", "slippery_road": "slippery", "workers_in_road": "roadworks",
    "pedestrian_warning": "crossing", "children_warning": "children", "restrictions_end": "all_end",
    "straight": "ahead_only", "right_obstacle": "keep_right", "left_obstacle": "keep_left", "roundabout": "roundabout",
    "no_overtaking_end": "no_overtaking_end",
}  # fmt: skip
CLASSES: tuple[str, ...] = tuple(_OURS.get(name, OTHER) for name in NAMES)
"""What our reader is to say of each of them; a pedestrian in a triangle is what Britain posts before a crossing."""
HELD_OUT_ONE_IN = 8


class RealSign(NamedTuple):
    """A photograph cut around one sign: its encoded picture, where the sign lies in it, its class's number, and its track."""

    encoded: bytes
    region: Region
    number: int
    track: int | None
    frame: int = 0

    @property
    def label(self) -> str:
        """What our reader is to say of it."""
        return CLASSES[self.number]

    @property
    def held_out(self) -> bool:
        """Whether training leaves its whole track out; a sign of no track is of the publisher's test."""
        return self.track is None or is_held_out(self.number, self.track)

    def picture(self) -> Picture:
        """The picture, uint8 H x W x 3 RGB."""
        return decoded(self.encoded)


def is_held_out(number: int, track: int) -> bool:
    """Whether training leaves this track of this class out: one in eight of each class."""
    return (track + 3 * number) % HELD_OUT_ONE_IN == HELD_OUT_ONE_IN // 2


def decoded(encoded: bytes) -> Picture:
    """JPEG, PNG or PPM to uint8 H x W x 3 RGB. Raises ValueError for any other data."""
    picture = cv2.imdecode(np.frombuffer(encoded, np.uint8), cv2.IMREAD_COLOR_RGB)
    if picture is None:
        raise ValueError("a picture that cannot be decoded")
    return np.asarray(picture, np.uint8)


def signs(folder: Path) -> dict[str, list[RealSign]]:
    """Every set of signs below a folder by its name: the zip, the published training set, the published test set."""
    sets = {
        ZIP: [sign for path in sorted(folder.rglob(ZIP)) for sign in _zipped(path)],
        TRAINING: [
            sign for path in sorted(folder.rglob(f"{TRAINING}/Images/*/GT-*.csv")) for sign in _published(path, True)
        ],
        "Final_Test": [sign for path in sorted(folder.rglob(TEST)) for sign in _published(path, False)],
    }
    return {name: found for name, found in sets.items() if found}


def _zipped(path: Path) -> Iterator[RealSign]:
    with zipfile.ZipFile(path) as stored:
        for row in csv.DictReader(io.StringIO(stored.read("labels.csv").decode())):
            encoded = stored.read(row["file"])
            box = [float(row[edge]) for edge in ("x1", "y1", "x2", "y2") if row[edge]]
            region = Region(*box) if len(box) == 4 else inner(decoded(encoded))
            frame = int(Path(row["file"]).stem.rpartition("_")[2])
            yield RealSign(encoded, region, NAMES.index(row["class"]), int(row["track"]), frame)


def inner(picture: Picture) -> Region:
    """Where the sign is in a published crop whose box is not known: its publisher left a tenth around it."""
    height, width = picture.shape[:2]
    return Region(0.1 * width, 0.1 * height, 0.9 * width, 0.9 * height)


def _published(path: Path, tracks: bool) -> Iterator[RealSign]:
    """Signs of one of the publisher's tables; its pictures stand beside it or in `Final_Test/Images`."""
    beside = (
        path.parent if tracks or not (path.parent / "Final_Test").is_dir() else path.parent / "Final_Test" / "Images"
    )
    for row in csv.DictReader(io.StringIO(path.read_text(encoding="utf-8")), delimiter=";"):
        box = Region(*(float(row[f"Roi.{edge}"]) for edge in ("X1", "Y1", "X2", "Y2")))
        name = row["Filename"]
        track, frame = (int(part) for part in Path(name).stem.split("_")) if tracks else (None, 0)
        yield RealSign((beside / name).read_bytes(), box, int(row["ClassId"]), track, frame)
