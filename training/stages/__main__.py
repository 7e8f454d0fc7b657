"""``python -m training stages FOLDER``: random stages as pictures, for looking at, with the time they took."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from services.simulator.render.device.context import RendererUnavailable
from services.simulator.scene.scene import FRONT, TELE, Road, StaticWorld
from training.labelling import Label, LabellingRenderer
from training.stages.stage import random_stage

COLOURS = {
    "vehicle": (60, 220, 60),
    "pedestrian": (240, 60, 60),
    "sign": (60, 220, 240),
    "panel": (240, 60, 240),
    "light": (240, 220, 60),
}


def boxed(picture: NDArray[np.uint8], labels: list[Label]) -> NDArray[np.uint8]:
    """The picture with every label's visible box."""
    out = picture.copy()
    for label in labels:
        left, top, right, bottom = (int(edge) for edge in label.box_px)
        cv2.rectangle(out, (left, top), (right - 1, bottom - 1), COLOURS[label.kind], 1)
    return out


def main() -> int:
    """Write front and tele pictures side by side, one file per stage; 2 where there is no OpenGL."""
    parser = argparse.ArgumentParser(prog="python -m training stages", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--stages", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0, help="first stage")
    parser.add_argument("--split", choices=["train", "test"], default="train")
    parser.add_argument("--boxes", action="store_true", help="draw the labels")
    options = parser.parse_args()
    try:
        renderer = LabellingRenderer(StaticWorld(road=Road()))
    except RendererUnavailable as error:
        parser.exit(2, f"{error}\n")
    options.folder.mkdir(parents=True, exist_ok=True)
    for seed in range(options.seed, options.seed + options.stages):
        _, scene = random_stage(seed, options.split)
        renderer.render(scene, FRONT)  # builds the meshes
        start = time.process_time()
        front = renderer.render(scene, FRONT)
        cpu_ms = (time.process_time() - start) * 1e3
        pair = [front, renderer.render(scene, TELE)]
        if options.boxes:
            cameras = (FRONT, TELE)
            pair = [boxed(p, renderer.render_labels(scene, c)) for p, c in zip(pair, cameras, strict=True)]
        path = options.folder / f"{options.split}-{seed:04d}.png"
        cv2.imwrite(str(path), np.hstack(pair)[:, :, ::-1])
        print(f"{path}: front picture in {cpu_ms:.0f} ms of one core, {len(scene.actors)} actors")  # noqa: T201
    renderer.close()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
