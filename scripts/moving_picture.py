"""Writes the README's moving picture from a drive: `python scripts/moving_picture.py [DRIVE]`. Without DRIVE it drives one itself.

The drive is in lockstep, so that the same code gives the same pictures.
"""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from itertools import islice
from pathlib import Path

import cv2
import numpy as np

ROOT = Path(__file__).parents[1]
if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))

from app.play.render import annotated  # noqa: E402

PICTURE = ROOT / "docs" / "images" / "drive.webp"
SCENARIO, SECONDS, SEED = "cross-border", 40, 1
EVERY, WIDTH_PX, QUALITY = 3, 560, 55
"""Of ten pictures a second every third is shown."""


def write(logs: Sequence[Path], target: Path, *, begin: int = 0, most: int = 270) -> int:
    """Write the pictures `begin` to `begin + most` of a drive. Returns how many are shown.

    Raises ValueError without pictures and where the file cannot be written, cv2.error where its suffix names no picture format.
    """
    frames = [_small(picture) for picture in islice(annotated(logs), begin, begin + most, EVERY)]
    if not frames:
        raise ValueError(f"no pictures of the front camera in {', '.join(map(str, logs))}")
    animation = cv2.Animation()
    animation.frames = frames
    animation.durations = [100 * EVERY] * len(frames)
    if not cv2.imwriteanimation(str(target), animation, [cv2.IMWRITE_WEBP_QUALITY, QUALITY]):
        raise ValueError(f"cannot write {target}")
    return len(frames)


def _small(picture: np.ndarray) -> np.ndarray:
    height, width = picture.shape[:2]
    return cv2.resize(picture, (WIDTH_PX, round(height * WIDTH_PX / width)), interpolation=cv2.INTER_AREA)


def drive(folder: Path) -> Path:
    """Drive the scenario into a folder."""
    flags = ("--scenario", SCENARIO, "--seconds", str(SECONDS), "--seed", str(SEED), "--lockstep", "--headless")
    subprocess.run([sys.executable, "-m", "drivemcp.cli", "up", *flags, "--out", str(folder)], check=True, cwd=ROOT)
    return folder


def main(arguments: Sequence[str]) -> int:
    """Write it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("drive", nargs="?", type=Path, metavar="DRIVE")
    parser.add_argument("--begin", type=int, default=0, help="the first picture that is shown")
    parser.add_argument("--most", type=int, default=270, help="how many pictures it goes on from there")
    parser.add_argument("--out", type=Path, default=PICTURE, metavar="FILE")
    flags = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        logs = sorted((flags.drive or drive(Path(folder))).rglob("*.mcap"))
        shown = write(logs, flags.out, begin=flags.begin, most=flags.most)
    sys.stdout.write(f"{flags.out}: {shown} pictures, {flags.out.stat().st_size / 1e6:.1f} MB\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
