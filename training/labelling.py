"""A renderer that labels as well: the scene drawn a second time into an integer target, and each object as if it stood alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import moderngl
import numpy as np
from numpy.typing import NDArray

from proto.perception import ObjectClass
from services.simulator.render.device.resources import Resources, Uniform
from services.simulator.render.drawing import frame
from services.simulator.render.drawing.frame import Cast
from services.simulator.render.drawing.static_world import World, light_centre
from services.simulator.render.drawing.view import NEAR_M
from services.simulator.render.models.actors import world_points
from services.simulator.render.models.mesh import Floats
from services.simulator.render.renderer import Renderer
from services.simulator.scene.scene import CameraSpec, Scene, StaticWorld
from services.simulator.scene.solids import LIGHT_HEAD_M

Box = tuple[float, float, float, float]
NOWHERE: Box = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """One object of which at least one pixel is visible.

    ``box_px`` (left, top, right, bottom; pixel edges) encloses the visible pixels; ``full_box_px`` the whole object as
    if nothing stood before it, not cut at the picture's rim. ``visible_fraction``: visible pixels by those of the
    object alone, times the share of the full box inside the picture. ``distance_m``: camera to the object's middle.
    ``disc_px``: true height in pixels of a sign's or panel's face, unoccluded (0 for others). ``part``: a face's index
    on its post, from the top. ``code``: sign code, panel code or light state; ``detail``: the actor's kind.
    """

    id: int
    kind: ObjectClass
    box_px: Box
    full_box_px: Box
    visible_fraction: float
    distance_m: float
    visible_px: int
    disc_px: float = 0.0
    mesh_family: int = 0
    code: str = ""
    country: str = ""
    detail: str = ""
    part: int = 0


def visible_boxes(ids: NDArray[np.uint32]) -> dict[int, tuple[Box, int]]:
    """Box and pixel count of each non-zero id in an (H, W) picture of ids."""
    rows, columns = np.nonzero(ids)
    values = ids[rows, columns]
    order = np.argsort(values, kind="stable")
    rows, columns, values = rows[order], columns[order], values[order]
    names, starts, counts = np.unique(values, return_index=True, return_counts=True)
    if not len(names):
        return {}
    left, right = np.minimum.reduceat(columns, starts), np.maximum.reduceat(columns, starts) + 1
    top, bottom = np.minimum.reduceat(rows, starts), np.maximum.reduceat(rows, starts) + 1
    return {
        int(name): ((float(left[k]), float(top[k]), float(right[k]), float(bottom[k])), int(counts[k]))
        for k, name in enumerate(names)
    }


def inside_share(box: Box, width: int, height: int) -> float:
    """Which share of a box's area lies inside the picture."""
    area = (box[2] - box[0]) * (box[3] - box[1])
    wide = min(box[2], width) - max(box[0], 0.0)
    high = min(box[3], height) - max(box[1], 0.0)
    return max(wide, 0.0) * max(high, 0.0) / area if area > 0 else 0.0


_blank = partial(Label, box_px=NOWHERE, full_box_px=NOWHERE, visible_fraction=0.0, distance_m=0.0, visible_px=0)
"""What is known of a label before its pixels are counted."""


@dataclass(slots=True, eq=False)
class Candidate:
    """An object that may be visible: how to draw it alone, its points in the world, what its label will say."""

    draw: Callable[[], None]
    points: Floats
    centre: Floats
    label: Label


class LabellingRenderer(Renderer):
    """Draws pictures as the simulator's does, and tells what is in them."""

    def __init__(self, static: StaticWorld, seed: int = 0) -> None:
        super().__init__(static, seed)
        self._ids: dict[tuple[int, int], moderngl.Framebuffer] = {}

    def render_labels(self, scene: Scene, camera: CameraSpec) -> list[Label]:
        """All labelled objects with at least one visible pixel, nearest first."""
        cast = self._cast(scene, camera)
        shared = frame.common(cast, self._world)
        target = self._target(camera.width_px, camera.height_px)
        return annotate(self._resources, self._world, cast, target, shared)

    def _target(self, width_px: int, height_px: int) -> moderngl.Framebuffer:
        """Two unsigned integers per pixel: instance id, distance in centimetres; with depth."""
        size, ctx = (width_px, height_px), self._resources.ctx
        if size not in self._ids:
            colour = ctx.texture(size, 2, dtype="u4")
            colour.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._ids[size] = ctx.framebuffer([colour], ctx.depth_renderbuffer(size))
        return self._ids[size]


def annotate(
    resources: Resources, world: World, cast: Cast, target: moderngl.Framebuffer, shared: dict[str, Uniform]
) -> list[Label]:
    """Labels of everything with a visible pixel, nearest first. Instance ids count from 1 in candidate order."""
    candidates = _candidates(resources, cast, shared)
    ids = _draw_all(resources, world, cast, target, candidates, shared)
    seen = visible_boxes(ids)
    labels = [_label(cast, target, candidates[k - 1], seen[k]) for k in sorted(seen)]
    return sorted(labels, key=lambda label: label.distance_m)


def _draw_all(
    resources: Resources,
    world: World,
    cast: Cast,
    target: moderngl.Framebuffer,
    candidates: list[Candidate],
    shared: dict[str, Uniform],
) -> np.ndarray:
    target.use()
    target.clear(depth=1.0)
    resources.surfaces.use(0)
    resources.faces.texture.use(1)
    resources.ctx.disable(moderngl.BLEND | moderngl.CULL_FACE)
    resources.ctx.enable(moderngl.DEPTH_TEST)
    resources.set("id_object", shared)
    for candidate in candidates:
        candidate.draw()
    frame.draw_solid(resources, world, cast, "id_object", shared)
    frame.draw_plants(resources, world, cast, "id_", shared)
    data = np.frombuffer(target.read(components=2, dtype="u4", alignment=1), dtype="<u4")
    return data.reshape(target.height, target.width, 2)[::-1, :, 0]


def _candidates(resources: Resources, cast: Cast, shared: dict[str, Uniform]) -> list[Candidate]:
    out: list[Candidate] = []
    for actor in cast.actors:
        number = len(out) + 1
        model = cast.models[actor.id].model
        if model is None:  # never: actors are uploaded with their models
            continue
        points = world_points(model, actor)
        kind: ObjectClass = "pedestrian" if actor.kind == "pedestrian" else "vehicle"
        label = _blank(id=actor.id, kind=kind, mesh_family=actor.mesh_family, detail=actor.kind)
        draw = partial(frame.draw_actor, resources, actor, cast, "id_object", number)
        out.append(Candidate(draw, points, points.mean(axis=0), label))
    for item in cast.lights:
        number, centre = len(out) + 1, np.array(light_centre(item[0]))
        points = _box_points(centre, item[0].pose.yaw_rad, *LIGHT_HEAD_M)
        label = _blank(id=item[0].id, kind="light", code=item[2])
        out.append(Candidate(partial(frame.draw_light, resources, item, "id_object", number), points, centre, label))
    return out + _face_candidates(resources, cast, len(out) + 1, shared)


def _face_candidates(resources: Resources, cast: Cast, first: int, shared: dict[str, Uniform]) -> list[Candidate]:
    rows, out = frame.face_rows(resources, cast, first), []
    for k, (spot, code) in enumerate(cast.faces):
        centre, right, up = (rows[k][name].astype(np.float64) for name in ("centre", "right", "up"))
        points = np.array([centre + a * right + b * up for a in (-1, 1) for b in (-1, 1)])
        depth = float(cast.view.camera_points(centre[None])[0, 2])
        disc = cast.view.spec.focal_px * spot.height_m / max(depth, NEAR_M)
        kind: ObjectClass = "panel" if spot.led else "sign"
        label = _blank(id=spot.owner, kind=kind, code=code, country=spot.country, part=spot.part, disc_px=disc)
        row = rows[k : k + 1]
        out.append(Candidate(partial(frame.draw_faces, resources, row, "id_face", shared), points, centre, label))
    return out


def _box_points(centre: Floats, yaw: float, deep: float, wide: float, high: float) -> Floats:
    c, s = np.cos(yaw), np.sin(yaw)
    unit = np.array([(a, b, d) for a in (-1, 1) for b in (-1, 1) for d in (-1, 1)]) * (deep / 2, wide / 2, high / 2)
    out: Floats = unit @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + centre
    return out


def _full_box(cast: Cast, points: Floats) -> Box:
    ahead = points[cast.view.camera_points(points)[:, 2] > NEAR_M]
    pixels = cast.view.pixels(ahead if len(ahead) else points)
    (left, top), (right, bottom) = pixels.min(axis=0), pixels.max(axis=0)
    return float(left), float(top), float(right), float(bottom)


def _alone(target: moderngl.Framebuffer, box: Box, candidate: Candidate) -> int:
    """Pixels of the candidate drawn alone into the picture."""
    left, right = max(int(box[0]) - 2, 0), min(int(box[2]) + 3, target.width)
    top, bottom = max(int(box[1]) - 2, 0), min(int(box[3]) + 3, target.height)
    size = (left, target.height - bottom, right - left, bottom - top)
    target.clear(depth=1.0, viewport=size)
    candidate.draw()
    data = np.frombuffer(target.read(viewport=size, components=2, dtype="u4", alignment=1), dtype="<u4")
    return int(np.count_nonzero(data[::2]))


def _label(cast: Cast, target: moderngl.Framebuffer, candidate: Candidate, seen: tuple[Box, int]) -> Label:
    box, visible = seen
    full = _full_box(cast, candidate.points)
    alone = max(_alone(target, full, candidate), visible)
    inside = inside_share(full, cast.view.spec.width_px, cast.view.spec.height_px)
    return replace(
        candidate.label,
        box_px=box,
        full_box_px=full,
        visible_fraction=visible / alone * inside,
        distance_m=float(np.linalg.norm(candidate.centre - cast.view.eye)),
        visible_px=visible,
    )
