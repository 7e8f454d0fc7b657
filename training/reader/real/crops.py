"""Crops of photographed signs and lights for the reader, and of background, from the folder of `training.photographs.sets`.

``python -m training reader.real.crops FOLDER --out FILE`` writes two files, FILE and one for what training leaves out
(``-held-out`` before its ending): one in eight tracks, scenes and pictures.
"""

import argparse
import csv
import io
import sys
import zipfile
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from services.drivelm.reading.crops import Picture, Region, crop
from training.photographs import gtsrb
from training.photographs.sets import SETS, present
from training.reader.real.augment import flipped, seen
from training.reader.real.scenes import scene_samples
from training.reader.rendered import Sample, stacked
from training.sign_pictures.degrade import Chance

VARIANTS, LIMIT_VARIANTS = 4, 5
COMMON = 350
"""A class of so many crops gets as many variants as said; a rarer one more, a more frequent one fewer (`_variants`)."""
_LAMPS = {"red": ("light:red", 0), "yellow": ("light:amber", 1), "green": ("light:green", 2)}


def collect(
    folder: Path, seed: int, held_out: bool, without: Collection[str] = (), unseen: Collection[int] = ()
) -> tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.float32]]:
    """Crops, class indexes and sizes in pixels (0 for `other`) of all sets present; `unseen`: GTSRB's numbers to leave out."""
    chance = np.random.default_rng([seed, 81, int(held_out)])
    samples = [
        sample
        for each in present(folder, without)
        for sample in _SOURCES[each.name](folder / each.file, chance, held_out, unseen)
    ]
    return stacked(samples)


def _variants(label: str, count: int) -> int:
    usual = LIMIT_VARIANTS if label.startswith("limit") else VARIANTS
    return int(np.clip(round(usual * (COMMON / count) ** 0.5), 2, 12))


def _signs(path: Path, chance: Chance, held_out: bool, unseen: Collection[int]) -> Iterator[Sample]:
    """GTSRB's: as they are where they are held out; else in variants, and some turned into what they are not."""
    signs = [each for each in gtsrb.signs(path.parent)[gtsrb.ZIP] if each.number not in unseen]
    counts = Counter(each.number for each in signs)
    for sign in signs:
        if sign.held_out != held_out:
            continue
        picture, size = sign.picture(), sign.region.height_px
        if held_out:
            if (cut := crop(picture, sign.region)) is not None:
                yield Sample(cut, sign.label, size)
            continue
        for _ in range(_variants(sign.label, counts[sign.number])):
            yield from seen(picture, sign.region, sign.label, chance)
        if chance.random() < 0.5:
            yield from flipped(picture, sign.region, sign.number, chance)


def _scenes(path: Path, chance: Chance, held_out: bool, unseen: Collection[int]) -> Iterator[Sample]:
    yield from scene_samples(path.parent, chance, held_out, unseen)


def _crossings(path: Path, chance: Chance, held_out: bool, _unseen: Collection[int]) -> Iterator[Sample]:
    """Of the 877-set the crossings and stop signs: its limits have no number, its lights no state."""
    names = {"crosswalk": "crossing", "stop": "stop"}
    with zipfile.ZipFile(path) as stored:
        for row in csv.DictReader(io.StringIO(stored.read("labels.csv").decode())):
            if row["class"] not in names or _is_held_out(row["file"]) != held_out:
                continue
            region = Region(*(float(row[edge]) for edge in ("x1", "y1", "x2", "y2")))
            picture, label = gtsrb.decoded(stored.read(row["file"])), names[row["class"]]
            if held_out and (cut := crop(picture, region)) is not None:
                yield Sample(cut, label, region.height_px)
            for _ in range(0 if held_out else 5):
                yield from seen(picture, region, label, chance)


def _lights(path: Path, chance: Chance, held_out: bool, _unseen: Collection[int]) -> Iterator[Sample]:
    """Upright lights, the lit lamp in its usual place."""
    with zipfile.ZipFile(path) as stored:
        for name in sorted(each for each in stored.namelist() if each.startswith("images/")):
            if _is_held_out(name) != held_out:
                continue
            picture = gtsrb.decoded(stored.read(name))
            for line in stored.read(name.replace("images", "labels").replace(".jpg", ".txt")).decode().splitlines():
                kind, region = _light(line, picture)
                label, place = _LAMPS[kind]
                if region.height_px < 12 or not _upright(picture, region, place):
                    continue
                if held_out and (cut := crop(picture, region)) is not None:
                    yield Sample(cut, label, region.height_px)
                for _ in range(0 if held_out else 3):
                    yield from seen(picture, region, label, chance)


def _light(line: str, picture: Picture) -> tuple[str, Region]:
    number, x, y, width, height = (float(part) for part in line.split())
    high, wide = picture.shape[:2]
    box = Region((x - width / 2) * wide, (y - height / 2) * high, (x + width / 2) * wide, (y + height / 2) * high)
    return ("green", "red", "yellow")[int(number)], box


def _upright(picture: Picture, region: Region, place: int) -> bool:
    """Whether the head is taller than wide and its most vivid third is the one where this lamp belongs."""
    x0, y0, x1, y1 = (max(0, round(edge)) for edge in region)
    head = picture[y0:y1, x0:x1].astype(np.float32)
    if min(head.shape[:2]) < 4 or region.height_px < 1.6 * region.width_px:
        return False
    vivid = (head.max(axis=2) - head.min(axis=2)) * head.max(axis=2)
    thirds = [float(np.quantile(part, 0.85)) for part in np.array_split(vivid, 3)]
    others = max(thirds[:place] + thirds[place + 1 :])
    red, green, _ = np.array_split(head, 3)[place].reshape(-1, 3).max(axis=0)
    return thirds[place] > 2.0 * others and bool((green > red) == (place == 2))


def _is_held_out(name: str) -> bool:
    digits = int("".join(char for char in Path(name).stem if char.isdigit()))
    return digits // 10 % gtsrb.HELD_OUT_ONE_IN == gtsrb.HELD_OUT_ONE_IN // 2


_SOURCES: dict[str, Callable[[Path, Chance, bool, Collection[int]], Iterator[Sample]]] = {
    "gtsrb": _signs, "gtsdb": _scenes, "road-signs-877": _crossings, "traffic-lights": _lights,
}  # fmt: skip


def main() -> int:
    """Write crops, labels and sizes to two files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--without", nargs="*", default=(), choices=[each.name for each in SETS], metavar="SET")
    parser.add_argument(
        "--unseen", type=int, nargs="*", default=(), help="numbers of GTSRB's classes to leave out, for a test"
    )
    options = parser.parse_args()
    cv2.setNumThreads(1)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    for held_out in (False, True):
        path = options.out.with_stem(f"{options.out.stem}-held-out") if held_out else options.out
        unseen = () if held_out else options.unseen
        crops, labels, sizes = collect(options.folder, options.seed, held_out, options.without, unseen)
        sets = [each.name for each in present(options.folder, options.without)]
        np.savez(path, crops=crops, labels=labels, sizes=sizes, sets=np.array(sets))
        sys.stderr.write(f"{path.name}: {len(crops)} crops\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
