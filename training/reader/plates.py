"""How well the numbers on plates are read by character recognition: drawn plates that grow frame by frame, in fresh noise.

Target: no plate believed wrong. ``python -m training reader.plates`` prints, by the height of the letters, what
single pictures are read as, and for several least heights what whole approaches are believed to say. Needs ``rapidocr``;
the letters are all that this computer has, the degradations drawn, not camera pictures.
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from services.drivelm.ocr import plate_reading
from services.drivelm.ocr.engine import Engine, Recognise
from services.drivelm.ocr.lettering import PLATE_MARGIN, cut
from services.drivelm.ocr.plate_numbers import number_of
from services.drivelm.ocr.plate_reading import MIN_SCORE, Read, agreed, line_on
from services.drivelm.reading.crops import Picture
from services.simulator.signart.catalogue import COUNTRIES
from services.simulator.signart.draw import draw_lettered, face_size_m
from training.sign_pictures.backgrounds import background_bank
from training.sign_pictures.degrade import Chance, any_conditions, jittered, view
from training.sign_pictures.faces import Face
from training.sign_pictures.fonts import letterings
from training.sign_pictures.texts import text_for

SMALLEST_PX, LARGEST_PX, FRAMES = 26.0, 120.0, 7
"""Widths of the plate in the first and the last frame of an approach, and how many there are."""
LEAST_PX = (5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0)
_BUCKETS = (0.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 1e3)
_PLATES = ("plate:time", "plate:time", "plate:distance", "plate:length")


class Plate(NamedTuple):
    """A drawn plate, and what it is to be read as; empty: it must stay unread."""

    code: str
    text: str
    truth: str
    face: Face


def plates(count: int, fonts: tuple[Path, ...], chance: Chance) -> Iterator[Plate]:
    """Any hours, distances and lengths, in all letterings and ways of writing, those that must stay unread among them."""
    letters = {**letterings("train", fonts), **letterings("test", fonts)}
    names = sorted(letters)
    for _ in range(count):
        code, land = str(chance.choice(_PLATES)), str(chance.choice(COUNTRIES))
        text = text_for(code.removeprefix("plate:") + f":{land}", chance)
        width_m, height_m = face_size_m(land, code)
        seed = int(chance.integers(0, 1 << 30)) if chance.random() < 0.8 else 0
        picture = draw_lettered(land, code, letters[str(chance.choice(names))], text=text, size_px=256, seed=seed)
        yield Plate(code, text, number_of(code, text) if "\n" not in text else "", Face(picture, width_m / height_m))


def approach(plate: Plate, grounds: Sequence[Picture], recognise: Recognise, chance: Chance, hard: float) -> list[Read]:
    """Drive towards a plate in constant weather, with a fresh box and noise in each frame."""
    now, ground = any_conditions(chance, hard), grounds[int(chance.integers(len(grounds)))]
    reads = []
    for width_px in np.geomspace(SMALLEST_PX, LARGEST_PX, FRAMES):
        taken = view(plate.face, ground, float(width_px), now, chance, glows=False)
        image = cut(taken.picture, jittered(taken.region, chance), PLATE_MARGIN)
        reads.append(_read(plate, image, recognise) if image is not None else Read())
    return reads


def _read(plate: Plate, image: Picture, recognise: Recognise) -> Read:
    """As on the road, but of letters of any height: which are high enough is what is to be found."""
    line = line_on(plate.code, image)
    if line is None or line.height_px < min(LEAST_PX):
        return Read()
    text, score = recognise(line.picture)
    return Read(number_of(plate.code, text) if score >= MIN_SCORE else "", line.height_px)


def _verdict(number: str, truth: str) -> str:
    return "unread" if not number else "right" if number == truth else "wrong"


def table(count: int, fonts: tuple[Path, ...], recognise: Recognise, hard: float, seed: int) -> dict[str, Any]:
    """Counts over `count` approaches; also each that was believed wrong, with what it said."""
    chance = np.random.default_rng([seed, 77])
    grounds = background_bank("test", 60, seed)
    drives = [(plate, approach(plate, grounds, recognise, chance, hard)) for plate in plates(count, fonts, chance)]
    single: dict[str, Counter[str]] = {}
    for plate, reads in drives:
        for each in reads:
            low = max(edge for edge in _BUCKETS if edge <= each.text_px)
            single.setdefault(f"{low:g}", Counter())[_verdict(each.number, plate.truth)] += 1
    whole: dict[str, Any] = {}
    for least in LEAST_PX:
        said = [(plate, agreed([each for each in reads if each.text_px >= least])) for plate, reads in drives]
        counts = Counter(_verdict(number, plate.truth) for plate, number in said)
        wrong = [[plate.text, number] for plate, number in said if _verdict(number, plate.truth) == "wrong"]
        whole[f"{least:g}"] = {**counts, "wrongly": wrong}
    readable = sum(bool(plate.truth) for plate, _ in drives)
    return {"plates": count, "readable": readable, "hard": hard, "single": single, "approaches": whole}


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m training reader.plates", description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--hard", type=float, default=1.0, help="0: fine days, 1: blur, dirt, rain and night on most")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--fonts", type=Path, nargs="*", default=[Path("/usr/share/fonts")])
    options = parser.parse_args(arguments)
    found = table(options.count, tuple(options.fonts), Engine().line, options.hard, options.seed)
    found["believed_from_px"] = plate_reading.MIN_TEXT_PX
    sys.stdout.write(json.dumps(found, indent=1, ensure_ascii=False) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
