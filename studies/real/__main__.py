"""Measures photographs that others published, where they lie: `real reader FOLDER`, `real approaches FOLDER`.

FOLDER holds GTSRB as INI Bochum publishes it (`Final_Training/Images`, `Final_Test/Images` with `GT-final_test.csv`) or as
`gtsrb-train.zip`. Of a training set only the tracks count that our training leaves out; `--all-tracks` takes all.
"""

import argparse
import json
import sys
from pathlib import Path

import cv2

from drivemcp.errors import UserError
from drivemcp.paths import data
from services.drivelm.reading.reader import Reader
from studies.real import approaches
from training.real import scores
from training.real.gtsrb import signs


def main() -> int:
    """Print a table for each set that the folder holds, as JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("reader", "approaches"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--model", type=Path, default=None, help="a reader; the shipped one else")
    parser.add_argument("--home", default="", help="the car's home country, as the front end is told it; of approaches")
    parser.add_argument("--all-tracks", action="store_true", help="also the tracks that our training has")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    sets = signs(options.folder)
    if not sets:
        raise UserError(f"{options.folder} holds no GTSRB: see python -m studies real --help")
    path = options.model or data("models/reader.onnx")
    reader, sure = Reader.load(path), scores.sure_of(path.with_suffix(".json"))
    for name, found in sets.items():
        chosen = [sign for sign in found if options.all_tracks or sign.held_out]
        table = (
            scores.table(scores.read_all(reader, chosen), chosen, sure)
            if options.what == "reader"
            else approaches.table(approaches.driven(reader, chosen, options.home))
        )
        json.dump({"set": name, "model": path.name, **table}, sys.stdout, indent=1)
        sys.stdout.write("\n")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        sys.exit(str(error))
