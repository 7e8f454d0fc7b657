"""`python -m studies ranging FRAME --detector NAME|FILE`: prints the table of docs/perception.md, section "On photographs"."""

import argparse
import sys
from pathlib import Path

from drivemcp.errors import UserError
from drivemcp.files.models import find_model
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
    flags = parser.parse_args()
    try:
        file = Path(flags.frame) / "frame.json" if Path(flags.frame).is_dir() else Path(flags.frame)
        ranged = measure(file, read_labels(file), find_model(flags.detector), flags.floor)
    except UserError as error:
        sys.stderr.write(f"studies.ranging: {error}\n")
        return 2
    for line in lines(ranged):
        sys.stdout.write(line + "\n")
    return 0


def lines(ranged: list[Ranged]) -> list[str]:
    """The table and its sums."""
    head = f"{'label':12} {'score':>5} {'source':>7} {'range':>7} {'near surface':>13} {'off':>7} {'centre':>7} {'track':>7} {'off':>7}"
    rows = [
        f"{one.category:12} {one.score:5.2f} {one.source:>7} {one.depth_m:6.2f}m {one.near_m:12.2f}m {one.error:+7.1%} "
        f"{one.centre_m:6.2f}m {_metres(one.track_m)} {_percent(one.track_error)}"
        for one in ranged
    ]
    by_lidar = [one for one in ranged if one.source == "lidar"]
    return [
        head,
        *rows,
        f"{len(ranged)} detected objects with a label, {len(by_lidar)} of them ranged by LiDAR",
        f"within {WITHIN:.0%} of the label's near surface: {share_within([one.error for one in by_lidar], WITHIN)}",
        f"within {WITHIN:.0%} of the label's centre, track's body: {share_within([one.track_error for one in by_lidar], WITHIN)}",
    ]


def _metres(value: float | None) -> str:
    return "      -" if value is None else f"{value:6.2f}m"


def _percent(value: float | None) -> str:
    return "      -" if value is None else f"{value:+7.1%}"


if __name__ == "__main__":
    sys.exit(main())
