"""Draws reliability diagrams: of all that was told with some confidence, how much was right. The diagonal is honest.

`python -m training reliability reader --rendered FILE --out docs/images/reader-reliability.svg`: single crops that
training never saw, as `training.reader.train` scores them. `... detector --cache DIR [--model FILE] --out FILE`: boxes on
the frames of the split "test", at the floors in use; right is what lies on an object of its class. The ending of --out chooses SVG or PNG.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from drivemcp.errors import UserError
from drivemcp.paths import data
from training.bins import Bins, Floats, binned

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TOLD, RIGHT, GAP = "#9aa5b1", "#1f5fa8", "#d64545"


def of_reader(flags: argparse.Namespace) -> dict[str, Bins]:
    """Clean, hard and (where there are any) rendered crops: the highest probability, and whether it was the right class."""
    from services.drivelm.reading.reader import Reader
    from training.reader.samples import Source
    from training.reader.train import crops_of, held_out

    source = Source("test", flags.seed, tuple(flags.fonts), each=10)
    sets = held_out(Reader.load(flags.model), source, flags.seed, flags.tests, crops_of(flags.rendered))
    names = [name for name in ("clean", "hard", "rendered") if name in sets]
    return {f"{name} crops": sets[name].bins() for name in names}


def of_detector(flags: argparse.Namespace) -> dict[str, Bins]:
    """Each class's boxes: the score, and whether it lies on an object of the class."""
    from services.perception.detect.loading import load_detector
    from training.dataset.shards import CLASSES, load_frames
    from training.detector.probabilities import THERE
    from training.detector.scores import run, tally

    frames = load_frames(flags.cache, "test")
    found = run(load_detector(flags.model), frames)
    tallies = {kind: tally(found, frames, kind, THERE) for kind in CLASSES}
    return {kind: binned(each.scores, each.right) for kind, each in tallies.items()}


def draw(title: str, sets: Mapping[str, Bins]) -> Figure:
    """One diagram beside the other, counts below. Raises UserError where matplotlib is not installed."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise UserError("matplotlib is missing; install the extra: pip install 'drivemcp[tables]'") from error
    figure = Figure(figsize=(2.9 * len(sets), 4.2), layout="constrained")
    figure.suptitle(title, fontsize=11)
    axes = figure.subplots(2, len(sets), sharex=True, squeeze=False, height_ratios=(3, 1))
    for column, (name, bins) in enumerate(sets.items()):
        _shares(axes[0, column], name, bins)
        _counts(axes[1, column], bins)
    axes[0, 0].set_ylabel("share right")
    axes[1, 0].set_ylabel("count")
    return figure


def _shares(axis: Any, name: str, bins: Bins) -> None:
    width, full = 1 / len(bins.counts), bins.counts > 0
    axis.plot([0, 1], [0, 1], color=TOLD, linestyle="--", linewidth=1)
    axis.bar(_middles(bins)[full], bins.right[full], width=0.92 * width, color=RIGHT, alpha=0.75)
    axis.vlines(bins.told[full], bins.told[full], bins.right[full], color=GAP, linewidth=2)
    axis.set_title(f"{name}\nn = {bins.counts.sum():,}, ECE {bins.error:.3f}", fontsize=10)
    axis.set(xlim=(0, 1), ylim=(0, 1))


def _counts(axis: Any, bins: Bins) -> None:
    axis.bar(_middles(bins), bins.counts, width=0.92 / len(bins.counts), color=TOLD)
    axis.set(xlabel="confidence told")
    if bins.counts.any():
        axis.set(yscale="log", ylim=(0.7, 30 * bins.counts.max()))
    for middle, count in zip(_middles(bins), bins.counts.tolist(), strict=True):
        if count:
            axis.text(middle, 1.3 * count, f"{count}", ha="center", va="bottom", fontsize=5.5, rotation=45)


def _middles(bins: Bins) -> Floats:
    return (np.arange(len(bins.counts)) + 0.5) / len(bins.counts)


def save(figure: Figure, path: Path) -> None:
    """Write it; the same figure gives the same file. Raises UserError."""
    import matplotlib

    if path.suffix not in (".svg", ".png"):
        raise UserError(f"{path}: a diagram is an .svg or .png file")

    path.parent.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": "drivemcp", "font.family": "sans-serif"}):
        figure.savefig(path, dpi=110, metadata={"Date": None} if path.suffix == ".svg" else None)


def table(sets: Mapping[str, Bins]) -> str:
    """The figures behind the diagrams, as Markdown."""
    rows = ["| | told | right | count |", "|---|---|---|---|"]
    for name, bins in sets.items():
        cells = zip(bins.told, bins.right, bins.counts.tolist(), strict=True)
        rows += [f"| {name} | {told:.3f} | {right:.3f} | {count} |" for told, right, count in cells if count]
        rows.append(f"| {name}, all: ECE {bins.error:.4f} | | | {bins.counts.sum()} |")
    return "\n".join(rows)


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m training reliability", description=__doc__)
    subjects = parser.add_subparsers(dest="subject", required=True)
    reader = subjects.add_parser("reader")
    reader.add_argument("--model", type=Path, default=data("models/reader.onnx"))
    reader.add_argument("--rendered", type=Path, help="crops of rendered pictures (reader_rendered, split test)")
    reader.add_argument("--fonts", type=Path, nargs="*", default=(Path("/usr/share/fonts"),))
    reader.add_argument("--tests", type=int, default=8000, help="hard crops; half as many clean ones")
    reader.add_argument("--seed", type=int, default=1)
    detector = subjects.add_parser("detector")
    detector.add_argument("--model", type=Path, default=data("models/detector.onnx"))
    detector.add_argument("--cache", type=Path, required=True, help="folder of shards with the split test")
    for each, measured in ((reader, of_reader), (detector, of_detector)):
        each.add_argument("--out", type=Path, required=True, help="an .svg or .png file")
        each.set_defaults(measured=measured)
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, draw, print the figures; 2 where something is missing."""
    flags = _options(arguments)
    cv2.setNumThreads(1)
    sets = flags.measured(flags)
    try:
        save(draw(f"{flags.subject}: what is told, and how often it is right", sets), flags.out)
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write(table(sets) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
