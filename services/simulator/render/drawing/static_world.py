"""A static world on the device: ground chunks, buildings and posts as ranges of one buffer, plants as instances."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from services.simulator.render.device.resources import CONIFERS, HEDGES, TREES, Drawable, Resources
from services.simulator.render.drawing import ground
from services.simulator.render.models import buildings
from services.simulator.render.models.mesh import Builder, Floats, Mesh, grid_triangles, merge, moved
from services.simulator.render.models.plants import CONIFER_HEIGHT_M, HEDGE_LENGTH_M, TREE_HEIGHT_M
from services.simulator.render.models.street_furniture import street_furniture
from services.simulator.render.models.textures import Layer
from services.simulator.scene.scene import Gantry, Pose, Scenery, SignPost, StaticWorld, TrafficLight
from services.simulator.scene.solids import ABOVE_FACE_M, LAMP_HEIGHT_M, POST_HEIGHT_M, beside, hung
from services.simulator.signart import face_size_m


@dataclass(frozen=True, slots=True)
class FaceSpot:
    """Where a face hangs; ``owner`` is the post's or the panel's id, ``led`` tells a panel."""

    owner: int
    part: int
    country: str
    code: str
    text: str
    font: int
    seed: int
    centre: tuple[float, float, float]
    yaw_rad: float
    width_m: float
    height_m: float
    led: bool


@dataclass(slots=True, eq=False)
class Pieces:
    """Meshes in one buffer: piece k has ``counts[k]`` indices from ``firsts[k]`` on."""

    drawable: Drawable | None
    firsts: np.ndarray
    counts: np.ndarray
    centres: Floats
    radii: Floats
    lines: np.ndarray

    def runs(self, seen: np.ndarray) -> list[tuple[int, int, bool]]:
        """Visible pieces as (first index, count, is line), neighbours of a kind joined, in order."""
        out: list[tuple[int, int, bool]] = []
        for k in np.nonzero(seen)[0]:
            first, count, line = int(self.firsts[k]), int(self.counts[k]), bool(self.lines[k])
            if out and out[-1][2] == line and out[-1][0] + out[-1][1] == first:
                out[-1] = (out[-1][0], out[-1][1] + count, line)
            else:
                out.append((first, count, line))
        return out


@dataclass(slots=True, eq=False)
class Grove:
    """All instances of one plant or furniture variant: rows of (x, y, z, yaw, scale, height scale, tint, tint)."""

    near: Drawable
    far: Drawable
    rows: np.ndarray
    centres: Floats
    radii: Floats
    reach_m: float


def _pieces(resources: Resources, meshes: list[Mesh], lines: list[bool]) -> Pieces:
    counts = np.array([len(mesh.indices) for mesh in meshes], dtype=int)
    firsts = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(int) if len(counts) else counts
    boxes = [(mesh.vertices["pos"].min(axis=0), mesh.vertices["pos"].max(axis=0)) for mesh in meshes]
    centres = np.array([(low + high) / 2 for low, high in boxes]).reshape(-1, 3)
    radii = np.array([float(np.linalg.norm(high - low)) / 2 for low, high in boxes])
    drawable = resources.upload(merge(meshes)) if meshes else None
    return Pieces(drawable, firsts, counts, centres.astype(np.float64), radii, np.array(lines, dtype=bool))


def _standing(pose: Pose, draw: Callable[..., None], *sizes: object) -> Mesh:
    """What `draw` builds of those sizes, moved to `pose`."""
    builder = Builder()
    draw(builder, *sizes)
    return moved(builder.build(), pose.x_m, pose.y_m, pose.z_m, pose.yaw_rad)


def _house(item: Scenery) -> Mesh:
    draw = buildings.house if item.kind == "house" else buildings.tower
    return _standing(item.pose, draw, item.length_m, item.width_m, item.height_m, item.look_seed)


def _street_furniture(item: Scenery) -> Mesh:
    return _standing(item.pose, street_furniture, item.height_m, item.look_seed)


def post_faces(post: SignPost) -> list[FaceSpot]:
    """A post's faces with their true places."""
    pose, spots = post.pose, []
    for part, (face, place) in enumerate(zip(post.faces, hung(post), strict=True)):
        look = (post.id, part, face.country, face.code, face.text, face.font, face.look_seed)
        centre = (pose.x_m, pose.y_m, pose.z_m + place.z_m)
        spots.append(FaceSpot(*look, centre, pose.yaw_rad, place.width_m, place.height_m, led=False))
    return spots


def _panel_size(country: str, code: str, width: float) -> tuple[float, float]:
    if not code:
        return width, width
    wide, high = face_size_m(country, code)
    return width, width * high / wide


def gantry_faces(gantry: Gantry) -> list[FaceSpot]:
    """A gantry's panels; an approaching driver's left is the gantry's own right."""
    pose, spots = gantry.pose, []
    c, s = np.cos(pose.yaw_rad), np.sin(pose.yaw_rad)
    for panel in gantry.panels:
        width, height = _panel_size(panel.country, panel.code, panel.size_m)
        x, y = 0.24, -panel.lateral_m
        centre = (pose.x_m + c * x - s * y, pose.y_m + s * x + c * y, pose.z_m + gantry.clearance_m + 0.75)
        look = (panel.id, 0, panel.country, panel.code, "", panel.font, 0)
        spots.append(FaceSpot(*look, centre, pose.yaw_rad, width, height, led=True))
    return spots


def _gantry(gantry: Gantry) -> Mesh:
    cases = [(-panel.lateral_m, *_panel_size(panel.country, panel.code, panel.size_m)) for panel in gantry.panels]
    return _standing(gantry.pose, buildings.gantry, gantry.span_m, gantry.clearance_m, cases)


def _post(post: SignPost) -> Mesh:
    return _standing(post.pose, buildings.sign_post, post.height_m + ABOVE_FACE_M)


def _pole(light: TrafficLight) -> Mesh:
    return _standing(light.pose, buildings.light_pole, light.height_m, -light.arm_m)


def light_mesh(light: TrafficLight) -> Mesh:
    """A traffic light's head in its own frame; ``arm_m`` counts to the driver's left, which is the light's right."""
    builder = Builder()
    buildings.light_head(builder, light.height_m, -light.arm_m)
    return builder.build()


def light_centre(light: TrafficLight) -> tuple[float, float, float]:
    """The middle of a light's head in the world."""
    head = beside(light.pose, -light.arm_m)
    return head.x_m, head.y_m, head.z_m + light.height_m


def _meadow() -> Mesh:
    """Grass tiles around the origin, moved under the camera in the shader."""
    steps = np.arange(-800.0, 801.0, 50.0)
    x, y = np.meshgrid(steps, steps, indexing="ij")
    pos = np.stack([x, y, np.zeros_like(x)], axis=2).reshape(-1, 3)
    builder = Builder()
    triangles = grid_triangles(len(steps), len(steps))
    builder.add(pos, np.tile((0, 0, 1), (len(pos), 1)), pos[:, :2], triangles, (1, 1, 1), Layer.GRASS)
    return builder.build()


class World:
    """The device side of a ``StaticWorld``."""

    def __init__(self, resources: Resources, static: StaticWorld) -> None:
        self.static = static
        parts = ground.chunks(static.road)
        self.ground = _pieces(resources, [part.mesh for part in parts], [part.line for part in parts])
        self.meadow = resources.upload(_meadow())
        solid = [_house(item) for item in static.scenery if item.kind in ("house", "tower")]
        solid += [_street_furniture(item) for item in static.scenery if item.kind == "street_furniture"]
        solid += [_gantry(gantry) for gantry in static.gantries] + [_post(post) for post in static.signs]
        solid += [_pole(light) for light in static.lights]
        self.solid = _pieces(resources, solid, [False] * len(solid))
        self.lights = [(light, resources.upload(light_mesh(light))) for light in static.lights]
        self.faces = [spot for post in static.signs for spot in post_faces(post)]
        self.faces += [spot for gantry in static.gantries for spot in gantry_faces(gantry)]
        self.plants = _groves(resources, static)
        self.furniture = _furniture(resources, static)
        self.street_lamps = _street_lamps(static)
        self.buildings = [item for item in static.scenery if item.kind in ("house", "tower")]

    def release(self) -> None:
        """Free this world's device memory."""
        for drawable in [self.ground.drawable, self.solid.drawable, self.meadow, *(item for _, item in self.lights)]:
            if drawable is not None:
                drawable.release()


def _groves(resources: Resources, static: StaticWorld) -> list[Grove]:
    counts = {"tree": TREES, "conifer": CONIFERS, "hedge": HEDGES}
    rows: dict[tuple[str, int], list[list[float]]] = {}
    for item in static.scenery:
        if item.kind in counts:
            rows.setdefault((item.kind, item.look_seed % counts[item.kind]), []).append(_plant_row(item))
    heights = {"tree": TREE_HEIGHT_M, "conifer": CONIFER_HEIGHT_M, "hedge": 2.0}
    return [
        _grove(*resources.plants[kind][variant], values, heights[kind], 280.0)
        for (kind, variant), values in rows.items()
    ]


def _plant_row(item: Scenery) -> list[float]:
    rng = np.random.default_rng((83, item.look_seed))
    if item.kind == "hedge":
        wide, high = (item.length_m or HEDGE_LENGTH_M) / HEDGE_LENGTH_M, (item.height_m or 1.4) / 1.4
    else:
        natural = TREE_HEIGHT_M if item.kind == "tree" else CONIFER_HEIGHT_M
        high = (item.height_m or natural * float(rng.uniform(0.65, 1.3))) / natural
        wide = high * float(rng.uniform(0.9, 1.15))
    warm, cold = float(rng.uniform(0.8, 1.15)), float(rng.uniform(0.8, 1.1))
    return [item.pose.x_m, item.pose.y_m, item.pose.z_m, item.pose.yaw_rad, wide, high, warm, cold]


def _furniture(resources: Resources, static: StaticWorld) -> list[Grove]:
    out = []
    for kind, natural in (("lamp", LAMP_HEIGHT_M), ("post", POST_HEIGHT_M)):
        rows = [_upright_row(item, natural) for item in static.scenery if item.kind == kind]
        if rows:
            out.append(_grove(resources.furniture[kind], resources.furniture[kind], rows, natural, 180.0))
    return out


def _upright_row(item: Scenery, natural: float) -> list[float]:
    high = (item.height_m or natural) / natural
    wide = high if item.kind == "lamp" else 1.0
    return [item.pose.x_m, item.pose.y_m, item.pose.z_m, item.pose.yaw_rad, wide, high, 1.0, 1.0]


def _grove(near: Drawable, far: Drawable, rows: list[list[float]], height: float, reach_m: float) -> Grove:
    table = np.array(rows, dtype="<f4")
    scale = table[:, 5]
    centres = table[:, :3].astype(np.float64)
    centres[:, 2] += scale * height / 2
    return Grove(near, far, table, centres, (scale * height * 0.75 + 1.5).astype(np.float64), reach_m)


def _street_lamps(static: StaticWorld) -> Floats:
    rows = []
    for item in (item for item in static.scenery if item.kind == "lamp"):
        pose, height = item.pose, item.height_m or LAMP_HEIGHT_M
        x, y = np.cos(pose.yaw_rad), np.sin(pose.yaw_rad)
        reach = height * 0.2 + 0.25
        rows.append((pose.x_m + x * reach, pose.y_m + y * reach, pose.z_m + height))
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def fill_instances(drawable: Drawable, rows: np.ndarray) -> int:
    """Upload instances of a plant or furniture variant; returns how many."""
    if len(rows) and drawable.instances is not None:
        rows = rows[: drawable.instances.size // 32]
        drawable.instances.write(np.ascontiguousarray(rows).tobytes())
    return len(rows)
