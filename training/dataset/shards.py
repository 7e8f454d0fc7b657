"""Renders labelled pictures of random stages into a cache of shards, for training and testing the detector.

`python -m training dataset.shards --out DIR --split train --stages 400` writes `DIR/train-<first seed>.npz` files;
several processes may fill one folder with different seeds. Nothing of it is committed.

Each stage gives some places along its road, each seen by the front and by the tele camera with jittered mounts, in
weathers of its own; blur and JPEG compression follow as a real camera would add them. The split decides mesh family,
font, plants and the stages' random stream (`training.stages.stage`): what "test" shows, "train" never did.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from proto.perception import ObjectClass
from services.simulator.scene.scene import FRONT, TELE, CameraSpec, Pose, Scene, SignPost
from services.simulator.signart import CODES
from training.dataset.crossing import with_crossing
from training.dataset.people import with_people
from training.labelling import Label, LabellingRenderer
from training.stages.stage import Split, random_stage

CLASSES: tuple[ObjectClass, ...] = get_args(ObjectClass)
MIN_HEIGHT_PX = 12.0
WINDOW = "window"
"""In the notes of a picture that shows a part of one as large as the closer look would."""
MIN_VISIBLE = 0.5
"""Objects lower or less visible than this are ignored: neither to be found nor counted as a mistake (issue's target)."""
STAGES_PER_SHARD = 20
BOARDS = ("town_", "border:", "info:", "zone", "motorway", "calm", "one_way", "expressway")
CAMERAS = (FRONT, TELE)


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """Pictures with their objects.

    `pictures` N arrays (H, W, 3) uint8 RGB; `objects` one array (M, 8) for each: class index, x0, y0, x1, y1, visible share,
    distance in m, true height of a sign's or panel's face in px; `notes` one mapping for each: camera, seed, weather.
    """

    pictures: Sequence[NDArray[np.uint8]]
    objects: list[NDArray[np.float32]]
    notes: list[dict[str, str | float]]

    def __len__(self) -> int:
        return len(self.objects)

    def picked(self, indices: Sequence[int]) -> Frames:
        """Some of the frames."""
        return Frames(
            [self.pictures[i] for i in indices], [self.objects[i] for i in indices], [self.notes[i] for i in indices]
        )


def render_stage(
    renderer: LabellingRenderer | None,
    seed: int,
    split: Split,
    views: int,
    boards: float = 0.0,
    people: float = 0.0,
    crossing: float = 0.0,
) -> tuple[LabellingRenderer, list[Shot]]:
    """Some views of one stage by both cameras; makes the renderer where it is not given.

    `boards`: which share of the posts carries a board (town, border, information) instead, which are rare otherwise.
    `people`: in which share of the views more people stand where they are hard to see (`training.dataset.people`).
    `crossing`: in which share vehicles stand across (`training.dataset.crossing`).
    """
    static, first = random_stage(seed, split)
    rng = np.random.default_rng((77, seed, split == "test"))
    if boards > 0:
        static = replace(static, signs=tuple(_with_board(post, boards, rng) for post in static.signs))
        first = replace(first, static=static)
    if renderer is None:
        renderer = LabellingRenderer(static)
    shots = []
    for number in range(views):
        scene = first if number == 0 else _further(first, rng, split)
        if people > 0 and rng.uniform() < people:
            scene = with_people(scene, split, rng)
        if crossing > 0 and rng.uniform() < crossing:
            scene = with_crossing(scene, split, rng)
        for camera in CAMERAS:
            shots.append(shot_of(renderer, scene, jittered(camera, rng), rng, seed))
    return renderer, shots


def _with_board(post: SignPost, share: float, rng: np.random.Generator) -> SignPost:
    face = post.faces[0]
    codes = [code for code in CODES[face.country] if code.startswith(BOARDS)]
    if rng.uniform() >= share or not codes:
        return post
    return replace(post, faces=(replace(face, code=str(rng.choice(codes))), *post.faces[1:]))


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """One picture as JPEG with its objects."""

    jpeg: bytes
    objects: NDArray[np.float32]
    note: dict[str, str | float]


def _further(scene: Scene, rng: np.random.Generator, split: Split) -> Scene:
    """The ego further along, in another stage's weather; a road user that would stand in the ego or too near it is left out."""
    ego = further_along(scene.ego, float(rng.uniform(4.0, 32.0)), rng)
    c, s = math.cos(scene.ego.yaw_rad), math.sin(scene.ego.yaw_rad)
    _, other = random_stage(int(rng.integers(1 << 30)), split)
    actors = []
    for actor in scene.actors:
        dx, dy = actor.pose.x_m - ego.x_m, actor.pose.y_m - ego.y_m
        ahead, aside = c * dx + s * dy, abs(c * dy - s * dx)
        if abs(ahead) > actor.length_m / 2 + 3.5 or aside > actor.width_m / 2 + 1.2:
            actors.append(actor)
    return replace(scene, ego=ego, actors=tuple(actors), atmosphere=other.atmosphere, time_s=float(rng.uniform(0, 100)))


def further_along(pose: Pose, way_m: float, rng: np.random.Generator) -> Pose:
    """So far straight ahead, and not quite as straight as before."""
    return replace(
        pose,
        x_m=pose.x_m + math.cos(pose.yaw_rad) * way_m,
        y_m=pose.y_m + math.sin(pose.yaw_rad) * way_m,
        yaw_rad=pose.yaw_rad + float(rng.normal(0, 0.01)),
    )


def jittered(camera: CameraSpec, rng: np.random.Generator) -> CameraSpec:
    """The camera as another car carries it: height, pitch, field of view a little otherwise."""
    return replace(
        camera,
        fov_deg=camera.fov_deg * float(rng.uniform(0.96, 1.04)),
        z_m=float(rng.uniform(1.2, 1.55)),
        pitch_rad=camera.pitch_rad + math.radians(float(rng.normal(0, 0.7))),
    )


def shot_of(renderer: LabellingRenderer, scene: Scene, camera: CameraSpec, rng: np.random.Generator, seed: int) -> Shot:
    """A picture as a real camera gives it, with all that is in it."""
    picture = renderer.render(scene, camera)
    objects = rows_of(renderer.render_labels(scene, camera))
    jpeg = coded(_blurred(picture, rng), int(rng.integers(60, 96)))
    sky = scene.atmosphere
    note: dict[str, str | float] = {
        "camera": camera.id,
        "seed": seed,
        "night": float(sky.night),
        "rain_mm_h": sky.rain_mm_h,
        "visibility_m": sky.fog_visibility_m,
        "sun_deg": sky.sun_elevation_deg,
    }
    return Shot(jpeg, objects, note)


def coded(picture: NDArray[np.uint8], quality: int) -> bytes:
    """RGB as JPEG."""
    done, jpeg = cv2.imencode(".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise OSError("the picture could not be coded")
    return jpeg.tobytes()


def _blurred(picture: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Sometimes smeared by motion, sometimes out of focus."""
    chance = rng.uniform()
    if chance < 0.12:
        length = int(rng.integers(2, 5))
        kernel = np.zeros((5, 5), dtype=np.float32)
        kernel[2, 2 - length // 2 : 2 - length // 2 + length] = 1.0 / length
        return cv2.filter2D(picture, -1, kernel if rng.uniform() < 0.6 else kernel.T).astype(np.uint8, copy=False)
    if chance < 0.2:
        return cv2.GaussianBlur(picture, (0, 0), float(rng.uniform(0.5, 1.1))).astype(np.uint8, copy=False)
    return picture


def rows_of(labels: list[Label]) -> NDArray[np.float32]:
    """Labels as rows (M, 8): class index, the visible box, visible share, distance in m, a face's true height in px."""
    rows = [
        (CLASSES.index(label.kind), *label.box_px, label.visible_fraction, label.distance_m, label.disc_px)
        for label in labels
    ]
    return np.array(rows, dtype=np.float32).reshape(-1, 8)


def counted(objects: NDArray[np.float32], min_height_px: float = MIN_HEIGHT_PX) -> NDArray[np.bool_]:
    """Which rows are to be found; the others are ignored."""
    tall: NDArray[np.bool_] = (objects[:, 4] - objects[:, 2] >= min_height_px) & (objects[:, 5] >= MIN_VISIBLE)
    return tall


def inside(boxes: NDArray[np.float32], others: NDArray[np.float32]) -> NDArray[np.float32]:
    """The share (N, M) of each box (N, 4) that lies in each of the others (M, 4)."""
    low, high = np.maximum(boxes[:, None, :2], others[None, :, :2]), np.minimum(boxes[:, None, 2:], others[None, :, 2:])
    both = np.clip(high - low, 0, None).prod(axis=2)
    own = (boxes[:, 2:] - boxes[:, :2]).prod(axis=1)
    share: NDArray[np.float32] = both / np.maximum(own, 1e-6)[:, None]
    return share


def write_shard(path: Path, shots: list[Shot]) -> None:
    """One compressed file, written beside and moved, so that a reader never sees half of it."""
    blob = np.frombuffer(b"".join(shot.jpeg for shot in shots), dtype=np.uint8)
    objects = [np.column_stack([np.full(len(shot.objects), index), shot.objects]) for index, shot in enumerate(shots)]
    partial = path.with_suffix(".part.npz")
    np.savez(
        partial,
        blob=blob,
        sizes=np.array([len(shot.jpeg) for shot in shots]),
        objects=np.concatenate(objects).astype(np.float32),
        notes=np.array([json.dumps(shot.note) for shot in shots]),
    )
    partial.replace(path)


def load_frames(folder: Path, split: Split, limit: int | None = None) -> Frames:
    """All cached frames of a split (at most `limit`), decoded. Raises FileNotFoundError without frames."""
    pictures: list[NDArray[np.uint8]] = []
    objects: list[NDArray[np.float32]] = []
    notes: list[dict[str, str | float]] = []
    for path in shards(folder, split):
        for picture, rows, note in shard_frames(path):
            if limit is None or len(pictures) < limit:
                pictures.append(picture)
                objects.append(rows)
                notes.append(note)
    if not pictures:
        raise FileNotFoundError(f"no {split} frames in {folder}; make some: python -m training dataset.shards")
    return Frames(pictures, objects, notes)


def shards(folder: Path, split: str) -> list[Path]:
    """The files of a split that were written to their end."""
    return [path for path in sorted(folder.glob(f"{split}-*.npz")) if not path.name.endswith(".part.npz")]


def shard_frames(path: Path) -> Iterator[tuple[NDArray[np.uint8], NDArray[np.float32], dict[str, str | float]]]:
    """The frames of one file, decoded: picture (RGB), objects, notes."""
    with np.load(path) as shard:
        ends = np.cumsum(shard["sizes"])
        blob, rows, notes = shard["blob"], shard["objects"], shard["notes"]
    for index, (end, size) in enumerate(zip(ends, np.diff(ends, prepend=0), strict=True)):
        bgr = cv2.imdecode(blob[end - size : end], cv2.IMREAD_COLOR)
        if bgr is None:
            raise OSError(f"{path}: picture {index} cannot be decoded")
        yield (
            cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB).astype(np.uint8),
            rows[rows[:, 0] == index, 1:],
            json.loads(notes[index]),
        )


def main() -> None:
    """Render stages into shards, printing progress."""
    parser = argparse.ArgumentParser(prog="python -m training dataset.shards", description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder of the shards")
    parser.add_argument("--split", choices=get_args(Split), default="train")
    parser.add_argument("--stages", type=int, default=400)
    parser.add_argument("--first", type=int, default=0, help="first seed; give processes that share a folder their own")
    parser.add_argument("--views", type=int, default=3, help="places along each stage's road; each gives two pictures")
    parser.add_argument("--boards", type=float, default=0.0, help="share of posts that carry a board instead")
    parser.add_argument("--people", type=float, default=0.0, help="share of views with people who are hard to see")
    parser.add_argument("--crossing", type=float, default=0.0, help="share of views with vehicles across our way")
    flags = parser.parse_args()
    flags.out.mkdir(parents=True, exist_ok=True)
    renderer: LabellingRenderer | None = None
    started, done = time.monotonic(), 0
    for first in range(flags.first, flags.first + flags.stages, STAGES_PER_SHARD):
        shots: list[Shot] = []
        for seed in range(first, min(first + STAGES_PER_SHARD, flags.first + flags.stages)):
            renderer, new = render_stage(
                renderer, seed, flags.split, flags.views, flags.boards, flags.people, flags.crossing
            )
            shots += new
        write_shard(flags.out / f"{flags.split}-{first:06d}.npz", shots)
        done += len(shots)
        rate = done / (time.monotonic() - started)
        print(f"{flags.split} seeds {first}..{seed}: {done} pictures, {rate:.1f} a second", flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
