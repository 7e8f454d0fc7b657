"""`python -m studies ranging FRAME --detector NAME|FILE`: prints the table of docs/explanation/perception.md, section "On photographs"."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from drivemcp.errors import UserError
from drivemcp.files.models import find_model
from evaluation.tables.columns import Column
from studies.output import Sheet, add_json, percent, show
from studies.ranging.labels import read_labels
from studies.ranging.measure import Ranged, measure, share_within

WITHIN = 0.05


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m studies ranging", description=__doc__)
    parser.add_argument("frame", help="a frame.json with labels, or its folder")
    parser.add_argument("--detector", required=True, metavar="NAME|FILE")
    parser.add_argument(
        "--floor", type=float, default=0.3, help="score below which boxes are dropped (perception's own: 0.3)"
    )
    add_json(parser)
    flags = parser.parse_args()
    try:
        file = Path(flags.frame) / "frame.json" if Path(flags.frame).is_dir() else Path(flags.frame)
        ranged = measure(file, read_labels(file), find_model(flags.detector), flags.floor)
    except UserError as error:
        sys.stderr.write(f"studies.ranging: {error}\n")
        return 2
    show([sheet(ranged)], as_json=flags.json)
    return 0


COLUMNS = (
    "label", "score", "source", Column(title="range", unit="m"), Column(title="near surface", unit="m"), percent("off"),
    Column(title="centre", unit="m"), Column(title="track", unit="m"), percent("track off"),
)  # fmt: skip


def sheet(ranged: Sequence[Ranged]) -> Sheet:
    """A row an object, and their sums."""
    rows = [
        (
            one.category,
            one.score,
            one.source,
            one.depth_m,
            one.near_m,
            one.error,
            one.centre_m,
            one.track_m,
            one.track_error,
        )
        for one in ranged
    ]
    by_lidar = [one for one in ranged if one.source == "lidar"]
    notes = (
        f"{len(ranged)} detected objects with a label, {len(by_lidar)} of them ranged by LiDAR",
        f"within {WITHIN:.0%} of the label's near surface: {share_within([one.error for one in by_lidar], WITHIN)}",
        f"within {WITHIN:.0%} of the label's centre, track's body: {share_within([one.track_error for one in by_lidar], WITHIN)}",
    )
    return Sheet(COLUMNS, rows, notes)


if __name__ == "__main__":
    sys.exit(main())
