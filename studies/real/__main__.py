"""Measures photographs that others published, where they lie: `real reader FOLDER`, `real approaches FOLDER`, `real scenes FOLDER`.

FOLDER holds GTSRB as INI Bochum publishes it (`Final_Training/Images`, `Final_Test/Images` with `GT-final_test.csv`) or as
`gtsrb-train.zip`; for scenes GTSDB as published (`gt.txt` beside `00001.ppm`) or as `gtsdb-0-599.zip`. Of what training has
only the tracks and scenes count that it leaves out; `--all` takes all.
"""

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from drivemcp.errors import UserError
from drivemcp.paths import data
from services.drivelm.reading.reader import Reader
from services.perception.detect.detector import DetectorOptions
from services.perception.detect.loading import load_detector
from studies.real import approaches, scenes
from training.photographs import gtsdb
from training.photographs.gtsrb import signs
from training.reader.real import scores
from training.sign_pictures.degrade import jittered


def main(arguments: list[str] | None = None) -> int:
    """Print a table for each set that the folder holds, as JSON, one after the other. Raises UserError where it holds none."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("reader", "approaches", "scenes"))
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--model", type=Path, default=None, help="a reader, or a detector for scenes; the shipped one else"
    )
    parser.add_argument(
        "--judge", type=Path, default=None, help="a COCO-style detector; what it says of people, vehicles, lights"
    )
    parser.add_argument("--home", default="", help="the car's home country, as the front end is told it; of approaches")
    parser.add_argument(
        "--off", type=float, default=0.0, metavar="SHARE",
        help="edges of signs' boxes off by this share of their size (one sigma), as a detector's are",
    )  # fmt: skip
    parser.add_argument("--all", action="store_true", help="also the tracks and scenes that our training has")
    options = parser.parse_args(arguments)
    cv2.setNumThreads(1)
    tables = list(_scenes(options) if options.what == "scenes" else _signs(options))
    if not tables:
        raise UserError(f"{options.folder} holds nothing to measure: see python -m studies real --help")
    for table in tables:
        json.dump(table, sys.stdout, indent=1)
        sys.stdout.write("\n")
    return 0


def _signs(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    path = options.model or data("models/reader.onnx")
    reader, sure = Reader.load(path), scores.sure_of(path.with_suffix(".json"))
    for name, found in signs(options.folder).items():
        chosen = [sign for sign in found if options.all or sign.held_out]
        if options.off:
            chance = np.random.default_rng(5)
            chosen = [sign._replace(region=jittered(sign.region, chance, options.off)) for sign in chosen]
        head = {"set": name, "model": path.name}
        if options.what == "reader" and chosen:
            yield head | scores.table(scores.read_all(reader, chosen), chosen, sure)
        elif options.what == "approaches" and any(sign.track is not None for sign in chosen):
            yield head | approaches.table(approaches.driven(reader, chosen, options.home))


def _scenes(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    path = options.model or data("models/detector.onnx")
    judge = load_detector(options.judge, DetectorOptions(score_floor=scenes.JUDGE_SEES)) if options.judge else None
    chosen = (scene for scene in gtsdb.scenes(options.folder) if options.all or scene.held_out)
    if seen := scenes.looked(load_detector(path), chosen, judge):
        yield {"model": path.name, **scenes.table(seen, judge is not None)}


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        sys.exit(str(error))
