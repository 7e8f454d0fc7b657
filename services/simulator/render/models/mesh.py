"""Triangle meshes built in code: positions, normals, texture coordinates, colour, texture layer, material, joint."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Colour = tuple[float, float, float]

VERTEX = np.dtype(
    [("pos", "<f4", 3), ("normal", "<f4", 3), ("uv", "<f4", 2), ("rgba", "u1", 4), ("meta", "u1", 4)]
)  # meta: texture layer, material, joint, free
VERTEX_FORMAT = "3f 3f 2f 4f1 4f1"
VERTEX_NAMES = ("in_pos", "in_normal", "in_uv", "in_rgba", "in_meta")


class Material(IntEnum):
    """How a surface answers to light; the lamp materials glow by the level that the draw call sets for them."""

    PLAIN = 0
    GLASS = 1
    PAINT = 2
    TAIL = 3
    BRAKE = 4
    HEAD = 5
    LEFT = 6
    RIGHT = 7
    RETRO = 8
    STREET = 9
    FACADE = 10
    RED = 11
    AMBER = 12
    GREEN = 13
    FOLIAGE = 14
    METAL = 15


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Vertices of dtype ``VERTEX`` and triangle indices (M,)."""

    vertices: NDArray[np.void]
    indices: NDArray[np.uint32]

    def points(self) -> Floats:
        """Vertex positions (N, 3) in metres."""
        return self.vertices["pos"].astype(np.float64)


class Builder:
    """Collects surfaces; colours are 0 to 1 as seen on a screen, positions in metres."""

    def __init__(self) -> None:
        self._vertices: list[NDArray[np.void]] = []
        self._indices: list[NDArray[np.uint32]] = []
        self._count = 0
        self.joint = 0

    def add(
        self,
        pos: ArrayLike,
        normal: ArrayLike,
        uv: ArrayLike,
        triangles: ArrayLike,
        colour: Colour,
        layer: int = 0,
        material: int = Material.PLAIN,
        alpha: ArrayLike = 1.0,
    ) -> None:
        """Append raw arrays: pos (N, 3), normal (N, 3) or one for all, uv (N, 2), triangles (M, 3) into them."""
        points = np.asarray(pos, dtype=np.float64)
        block = np.zeros(len(points), dtype=VERTEX)
        block["pos"], block["normal"], block["uv"] = points, normal, uv
        red, green, blue = (min(max(int(channel * 255), 0), 255) for channel in colour)
        block["rgba"][:, :3] = (red, green, blue)
        block["rgba"][:, 3] = np.asarray(alpha) * 255.0
        block["meta"] = (layer, material, self.joint, 0)
        self._vertices.append(block)
        self._indices.append(np.asarray(triangles, dtype=np.uint32).reshape(-1) + self._count)
        self._count += len(points)

    def quad(
        self,
        corners: ArrayLike,
        colour: Colour,
        layer: int = 0,
        material: int = Material.PLAIN,
        uv: ArrayLike = ((0, 0), (1, 0), (1, 1), (0, 1)),
        normal: ArrayLike | None = None,
    ) -> None:
        """Four corners, anticlockwise as seen from outside (that decides the normal unless it is given)."""
        points = np.asarray(corners, dtype=np.float64)
        if normal is None:
            normal = unit(crossed(points[1] - points[0], points[2] - points[0]))
        self.add(points, normal, uv, QUAD, colour, layer, material)

    def grid(
        self,
        points: ArrayLike,
        colour: Colour,
        layer: int = 0,
        material: int = Material.PLAIN,
        uv: ArrayLike | None = None,
        centre: ArrayLike | None = None,
    ) -> None:
        """A smooth surface over points (m, n, 3); ``centre`` lies inside, so that normals look away from it."""
        p = np.asarray(points, dtype=np.float64)
        m, n = p.shape[:2]
        normal = unit(crossed(_slope(p), _slope(p.swapaxes(0, 1)).swapaxes(0, 1)))
        middle = p.reshape(-1, 3).mean(axis=0) if centre is None else np.asarray(centre)
        if np.sum((p - middle) * normal) < 0:
            normal = -normal
        if uv is None:
            uv = _unit_grid(m, n)
        spots = np.asarray(uv).reshape(-1, 2)
        self.add(p.reshape(-1, 3), normal.reshape(-1, 3), spots, grid_triangles(m, n), colour, layer, material)

    def box(
        self,
        centre: ArrayLike,
        size: ArrayLike,
        colour: Colour,
        layer: int = 0,
        material: int = Material.PLAIN,
        uv_m: float = 0.0,
        yaw_rad: float = 0.0,
    ) -> None:
        """An upright box; ``uv_m`` > 0 repeats the texture each so many metres, else once per side."""
        half = np.asarray(size, dtype=np.float64) / 2
        corners, normals = BOX_SIDES * half, BOX_NORMALS
        if yaw_rad:
            turn = turning(yaw_rad)
            corners, normals = corners @ turn.T, normals @ turn.T
        uv = np.tile(UNIT_SQUARE, (6, 1))
        if uv_m > 0:
            uv = uv * np.repeat(2 * half[BOX_SPANS] / uv_m, 4, axis=0)
        points = corners.reshape(-1, 3) + np.asarray(centre, dtype=np.float64)
        self.add(points, np.repeat(normals, 4, axis=0), uv, BOX_TRIANGLES, colour, layer, material)

    def tube(
        self,
        start: ArrayLike,
        end: ArrayLike,
        radius: float,
        colour: Colour,
        end_radius: float | None = None,
        sides: int = 8,
        layer: int = 0,
        material: int = Material.PLAIN,
    ) -> None:
        """A cylinder or cone between two points."""
        a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
        axis = unit(b - a)
        side, other = _around(axis)
        circle = _circle(sides)
        ring = circle[:, :1] * side + circle[:, 1:] * other
        far = radius if end_radius is None else end_radius
        points = np.concatenate([a + ring * radius, b + ring * far])
        uv = _unit_grid(2, sides + 1)[:, :, ::-1].reshape(-1, 2)
        self.add(points, np.concatenate([ring, ring]), uv, grid_triangles(2, sides + 1), colour, layer, material)

    def disc(
        self,
        centre: ArrayLike,
        normal: ArrayLike,
        radius: float,
        colour: Colour,
        sides: int = 16,
        layer: int = 0,
        material: int = Material.PLAIN,
    ) -> None:
        """A flat disc whose texture is the square around it."""
        c, axis = np.asarray(centre, dtype=np.float64), np.asarray(normal, dtype=np.float64)
        side, other = _around(axis)
        rim = _circle(sides)[:-1]
        points = np.concatenate([c[None], c + radius * (rim[:, :1] * side + rim[:, 1:] * other)])
        uv = np.concatenate([[[0.5, 0.5]], 0.5 + 0.5 * rim])
        self.add(points, axis, uv, _fan(sides), colour, layer, material)

    def ball(
        self,
        centre: ArrayLike,
        radii: ArrayLike,
        colour: Colour,
        rows: int = 6,
        sides: int = 10,
        layer: int = 0,
        material: int = Material.PLAIN,
    ) -> None:
        """An ellipsoid."""
        c, r = np.asarray(centre, dtype=np.float64), np.broadcast_to(np.asarray(radii, dtype=np.float64), 3)
        sphere, uv = _sphere(rows, sides)
        self.add(c + sphere * r, unit(sphere / r), uv, grid_triangles(rows, sides + 1), colour, layer, material)

    def build(self) -> Mesh:
        """Everything added so far as one mesh."""
        return Mesh(_joined(self._vertices), np.concatenate(self._indices))


def crossed(a: Floats, b: Floats) -> Floats:
    """Cross products along the last axis (numpy's own is many times slower on small arrays)."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out


def unit(vectors: Floats) -> Floats:
    """Vectors of length 1 along the last axis."""
    lengths = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
    out: Floats = vectors / np.maximum(lengths, 1e-9)
    return out


def turning(yaw_rad: float) -> Floats:
    """The rotation about the upright axis, 3 x 3."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _slope(p: Floats) -> Floats:
    """Central differences along the first axis, one-sided at its ends (unscaled)."""
    out = np.empty_like(p)
    out[1:-1] = p[2:] - p[:-2]
    out[0], out[-1] = p[1] - p[0], p[-1] - p[-2]
    return out


def _around(axis: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors square to an axis and to one another."""
    helper = np.array((0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0))
    side = unit(crossed(axis, helper))
    return side, crossed(axis, side)


@cache
def _circle(sides: int) -> Floats:
    turn = np.linspace(0, 2 * np.pi, sides + 1)
    return np.stack([np.cos(turn), np.sin(turn)], axis=1)


@cache
def _fan(sides: int) -> NDArray[np.uint32]:
    steps = np.arange(sides)
    return np.stack([np.zeros(sides, dtype=int), 1 + steps, 1 + (steps + 1) % sides], axis=1).astype(np.uint32)


@cache
def _sphere(rows: int, sides: int) -> tuple[Floats, Floats]:
    """Points (N, 3) and texture coordinates (N, 2) of a unit ball."""
    up, turn = np.meshgrid(
        np.linspace(-np.pi / 2, np.pi / 2, rows), np.linspace(0, 2 * np.pi, sides + 1), indexing="ij"
    )
    points = np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], axis=2)
    return points.reshape(-1, 3), np.stack([turn / np.pi, up / np.pi + 0.5], axis=2).reshape(-1, 2)


@cache
def _unit_grid(m: int, n: int) -> Floats:
    u, v = np.meshgrid(np.linspace(0, 1, m), np.linspace(0, 1, n), indexing="ij")
    return np.stack([u, v], axis=2)


@cache
def grid_triangles(m: int, n: int) -> NDArray[np.uint32]:
    """Triangle indices over an (m, n) grid of points, row by row."""
    a = (np.arange(m - 1)[:, None] * n + np.arange(n - 1)[None, :]).reshape(-1)
    triangles = np.stack([a, a + 1, a + n, a + 1, a + n + 1, a + n], axis=1)
    return triangles.reshape(-1, 3).astype(np.uint32)


BOX_SIDES = np.array(
    [
        [(1, -1, -1), (1, 1, -1), (1, 1, 1), (1, -1, 1)],
        [(-1, 1, -1), (-1, -1, -1), (-1, -1, 1), (-1, 1, 1)],
        [(1, 1, -1), (-1, 1, -1), (-1, 1, 1), (1, 1, 1)],
        [(-1, -1, -1), (1, -1, -1), (1, -1, 1), (-1, -1, 1)],
        [(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)],
        [(-1, 1, -1), (1, 1, -1), (1, -1, -1), (-1, -1, -1)],
    ],
    dtype=np.float64,
)


BOX_NORMALS = unit(crossed(BOX_SIDES[:, 1] - BOX_SIDES[:, 0], BOX_SIDES[:, 2] - BOX_SIDES[:, 0]))
BOX_SPANS = np.array([(1, 2), (1, 2), (0, 2), (0, 2), (0, 1), (0, 1)])  # axes that run along u and v of each side
UNIT_SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
QUAD = np.array([(0, 1, 2), (0, 2, 3)], dtype=np.uint32)
BOX_TRIANGLES = (QUAD[None] + 4 * np.arange(6, dtype=np.uint32)[:, None, None]).reshape(-1, 3)


def _joined(blocks: list[NDArray[np.void]]) -> NDArray[np.void]:
    """Blocks one after the other, by their bytes: numpy would compare the fields of each."""
    return np.frombuffer(bytearray(b"".join(block.tobytes() for block in blocks)), dtype=VERTEX)


def merge(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one."""
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    indices = [mesh.indices + np.uint32(offset) for mesh, offset in zip(meshes, offsets, strict=True)]
    return Mesh(_joined([mesh.vertices for mesh in meshes]), np.concatenate(indices))


def moved(mesh: Mesh, x_m: float, y_m: float, z_m: float, yaw_rad: float) -> Mesh:
    """The mesh turned about its upright axis and shifted."""
    turn = turning(yaw_rad)
    vertices = mesh.vertices.copy()
    vertices["pos"] = mesh.vertices["pos"] @ turn.T + (x_m, y_m, z_m)
    vertices["normal"] = mesh.vertices["normal"] @ turn.T
    return Mesh(vertices, mesh.indices)
