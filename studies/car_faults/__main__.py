"""`python -m studies car_faults`: how well faults of the car and of its sensors are distinguished, over 500 drives.

Tune on `--seeds calibration`; `test` is for the figures in the docs. With `--least`, 1 where fewer are right.
"""

import argparse
import multiprocessing
import sys
from collections.abc import Sequence

from studies.car_faults.cases import Case, cases
from studies.car_faults.hearing import Heard, hear
from studies.car_faults.scores import score, sheets
from studies.output import add_json, show


def main() -> int:
    """Measure and print."""
    flags = _parser().parse_args()
    chosen = [case for case in cases(flags.seeds) if flags.only in case.label][:: flags.every]
    if not chosen:
        sys.stderr.write(f"no case is called {flags.only!r}\n")
        return 2
    scores = score(flags.seeds, _hear(chosen, flags.jobs))
    show(sheets(scores), as_json=flags.json, figures=scores)
    return 0 if scores.overall.share >= flags.least else 1


def _hear(chosen: Sequence[Case], jobs: int) -> list[Heard]:
    if jobs <= 1:
        return [hear(case) for case in chosen]
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        return pool.map(hear, chosen, chunksize=4)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m studies car_faults", description=__doc__)
    parser.add_argument("--seeds", choices=("test", "calibration"), default="test")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument(
        "--only", default="", metavar="TEXT", help="cases with this in their label: wheel, offset, leak"
    )
    parser.add_argument("--every", type=int, default=1, metavar="N", help="only each Nth case")
    parser.add_argument("--least", type=float, default=0.0, metavar="SHARE", help="status 1 below this share")
    add_json(parser)
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
