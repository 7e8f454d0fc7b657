"""Crops of photographed signs and lights for the reader, and of background, from the folder of `training.photographs.sets`.

``python -m training reader.real.crops FOLDER --out FILE`` writes two files, FILE and one for what training leaves out
(``-held-out`` before its ending): one in eight tracks, scenes and pictures.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from services.drivelm.reading.crops import crop
from training.photographs import gtsrb
from training.photographs.labelled import Light, is_held_out, is_upright, road_signs, traffic_lights
from training.photographs.sets import SETS, present
from training.reader.real.augment import flipped, seen
from training.reader.real.scenes import scene_samples
from training.reader.rendered import Sample, stacked
from training.sign_pictures.degrade import Chance

VARIANTS, LIMIT_VARIANTS = 4, 5
COMMON = 350
"""A class of so many crops gets as many variants as said; a rarer one more, a more frequent one fewer (`_variants`)."""
_LABELS = {"red": "light:red", "yellow": "light:amber", "green": "light:green"}


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
    for name, read, labelled in road_signs(path):
        for label, region in [(names[kind], region) for kind, region in labelled if kind in names]:
            if is_held_out(name) != held_out:
                continue
            picture = read()
            if held_out and (cut := crop(picture, region)) is not None:
                yield Sample(cut, label, region.height_px)
            for _ in range(0 if held_out else 5):
                yield from seen(picture, region, label, chance)


def _lights(path: Path, chance: Chance, held_out: bool, _unseen: Collection[int]) -> Iterator[Sample]:
    """Upright lights, the lit lamp in its usual place."""
    for name, picture, lights in traffic_lights(path):
        if is_held_out(name) != held_out:
            continue
        for lamp, region in lights:
            label = _LABELS[lamp]
            if region.height_px < 12 or not is_upright(picture, Light(lamp, region)):
                continue
            if held_out and (cut := crop(picture, region)) is not None:
                yield Sample(cut, label, region.height_px)
            for _ in range(0 if held_out else 3):
                yield from seen(picture, region, label, chance)


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
