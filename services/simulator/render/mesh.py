"""Triangle meshes built in code: positions, normals, texture coordinates, colour, texture layer, material, joint."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

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
        colour: ArrayLike,
        layer: int = 0,
        material: int = Material.PLAIN,
        alpha: ArrayLike = 1.0,
    ) -> None:
        """Append raw arrays: pos and normal (N, 3), uv (N, 2), triangles (M, 3) into them."""
        points = np.asarray(pos, dtype=np.float64)
        block = np.zeros(len(points), dtype=VERTEX)
        block["pos"], block["normal"], block["uv"] = points, normal, uv
        block["rgba"][:, :3] = np.clip(np.asarray(colour) * 255.0, 0, 255)
        block["rgba"][:, 3] = np.clip(np.asarray(alpha) * 255.0, 0, 255)
        block["meta"][:, 0], block["meta"][:, 1], block["meta"][:, 2] = layer, material, self.joint
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
            cross = np.cross(points[1] - points[0], points[2] - points[0])
            normal = cross / max(float(np.linalg.norm(cross)), 1e-9)
        self.add(points, np.tile(normal, (4, 1)), uv, ((0, 1, 2), (0, 2, 3)), colour, layer, material)

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
        along, across = np.gradient(p, axis=0), np.gradient(p, axis=1)
        normal = np.cross(along, across)
        normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-9)
        middle = p.reshape(-1, 3).mean(axis=0) if centre is None else np.asarray(centre)
        if np.sum((p - middle) * normal) < 0:
            normal = -normal
        if uv is None:
            u, v = np.meshgrid(np.linspace(0, 1, m), np.linspace(0, 1, n), indexing="ij")
            uv = np.stack([u, v], axis=2)
        self.add(
            p.reshape(-1, 3),
            normal.reshape(-1, 3),
            np.asarray(uv).reshape(-1, 2),
            grid_triangles(m, n),
            colour,
            layer,
            material,
        )

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
        c, s = np.asarray(centre, dtype=np.float64), np.asarray(size, dtype=np.float64) / 2
        turn = np.array([[np.cos(yaw_rad), -np.sin(yaw_rad), 0], [np.sin(yaw_rad), np.cos(yaw_rad), 0], [0, 0, 1]])
        for corners in BOX_SIDES:
            local = corners * s
            wide, high = np.linalg.norm(local[1] - local[0]), np.linalg.norm(local[3] - local[0])
            u, v = (float(wide) / uv_m, float(high) / uv_m) if uv_m > 0 else (1.0, 1.0)
            self.quad(local @ turn.T + c, colour, layer, material, ((0, 0), (u, 0), (u, v), (0, v)))

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
        caps: bool = False,
    ) -> None:
        """A cylinder or cone between two points."""
        a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
        axis = (b - a) / max(float(np.linalg.norm(b - a)), 1e-9)
        side = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0))
        side /= np.linalg.norm(side)
        other = np.cross(axis, side)
        turn = np.linspace(0, 2 * np.pi, sides + 1)
        ring = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other
        far = radius if end_radius is None else end_radius
        points = np.concatenate([a + ring * radius, b + ring * far])
        uv = np.stack([np.tile(turn / (2 * np.pi), 2), np.repeat([0.0, 1.0], sides + 1)], axis=1)
        self.add(points, np.tile(ring, (2, 1)), uv, grid_triangles(2, sides + 1), colour, layer, material)
        if caps:
            for middle, size, facing in ((a, radius, -axis), (b, far, axis)):
                self.disc(middle, facing, size, colour, sides=sides, material=material)

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
        side = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0))
        side /= np.linalg.norm(side)
        other = np.cross(axis, side)
        turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
        rim = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        points = np.concatenate([c[None], c + radius * (rim[:, :1] * side + rim[:, 1:] * other)])
        uv = np.concatenate([[[0.5, 0.5]], 0.5 + 0.5 * rim])
        steps = np.arange(sides)
        fan = np.stack([np.zeros(sides, dtype=int), 1 + steps, 1 + (steps + 1) % sides], axis=1)
        self.add(points, np.tile(axis, (sides + 1, 1)), uv, fan, colour, layer, material)

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
        up, turn = np.meshgrid(
            np.linspace(-np.pi / 2, np.pi / 2, rows), np.linspace(0, 2 * np.pi, sides + 1), indexing="ij"
        )
        unit = np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], axis=2).reshape(-1, 3)
        normal = unit / r
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        uv = np.stack([turn / (2 * np.pi) * 2, up / np.pi + 0.5], axis=2).reshape(-1, 2)
        self.add(c + unit * r, normal, uv, grid_triangles(rows, sides + 1), colour, layer, material)

    def build(self) -> Mesh:
        """Everything added so far as one mesh."""
        return Mesh(np.concatenate(self._vertices), np.concatenate(self._indices))


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


def merge(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one."""
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    indices = [mesh.indices + np.uint32(offset) for mesh, offset in zip(meshes, offsets, strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(indices))


def moved(mesh: Mesh, x_m: float, y_m: float, z_m: float, yaw_rad: float) -> Mesh:
    """The mesh turned about its upright axis and shifted."""
    turn = np.array([[np.cos(yaw_rad), -np.sin(yaw_rad), 0], [np.sin(yaw_rad), np.cos(yaw_rad), 0], [0, 0, 1]])
    vertices = mesh.vertices.copy()
    vertices["pos"] = mesh.vertices["pos"] @ turn.T + (x_m, y_m, z_m)
    vertices["normal"] = mesh.vertices["normal"] @ turn.T
    return Mesh(vertices, mesh.indices)
