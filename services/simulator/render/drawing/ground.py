"""Everything flat: lanes, strips, kerbs, markings, stop lines, crossings, as chunks in drawing order.

A later layer (meta's third byte, see ``LAYERS``) covers an earlier one, whatever the order of drawing.
Uses the common vertex format. For surfaces uv is in metres and alpha the place across (0 to 1). A marking's vertex lies
on its centre line, its normal points across, uv is (place along in metres, signed half width in metres). The shader
widens lines thinner than a pixel and fades them instead, so that they do not crumble at a distance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from services.simulator.render.models.mesh import Builder, Colour, Floats, Material, Mesh, grid_triangles
from services.simulator.render.models.textures import Layer
from services.simulator.scene.scene import Lane, Patch, Road, StopLine, Strip, Zebra

KERB_M = 0.11
CHUNK_POINTS = 24
LINE_WIDTH_M = 0.13
EDGE_WIDTH_M = 0.18
DASH_M, DASH_GAP_M = 4.0, 8.0
WHITE: Colour = (0.92, 0.92, 0.90)
SURFACES: dict[str, tuple[int, Colour]] = {
    "asphalt": (Layer.ASPHALT, (1.0, 1.0, 1.0)),
    "concrete": (Layer.CONCRETE, (1.0, 1.0, 1.0)),
    "pavement": (Layer.PAVEMENT, (1.0, 1.0, 1.0)),
    "verge": (Layer.GRASS, (1.0, 1.0, 1.0)),
}
LAYERS = {"meadow": 0, "strip": 1, "kerb": 2, "pavement": 3, "lane": 4, "marking": 5, "patch": 6, "bar": 7}
LANE_FLAG, LINE_FLAG = Material.PAINT, Material.RETRO  # meta.y in the ground shader: lane wear, painted line


@dataclass(frozen=True, slots=True, eq=False)
class Chunk:
    """A piece of ground with its bounding circle, for culling; ``line`` pieces are drawn by the line shader."""

    mesh: Mesh
    centre_m: tuple[float, float]
    radius_m: float
    line: bool


def resampled(line: Floats, step_m: float) -> Floats:
    """The polyline with points about every ``step_m`` metres (N, 2)."""
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    count = max(2, int(np.ceil(lengths[-1] / step_m)) + 1)
    s = np.linspace(0, lengths[-1], count)
    return np.stack([np.interp(s, lengths, line[:, 0]), np.interp(s, lengths, line[:, 1])], axis=1)


def across(line: Floats) -> Floats:
    """Unit vectors to the left of the driving direction at each point (N, 2)."""
    ahead = np.gradient(line, axis=0)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1, keepdims=True), 1e-9)
    return np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)


def _chunk(builder: Builder, layer: str, line: bool = False) -> Chunk:
    mesh = builder.build()
    mesh.vertices["meta"][:, 2] = LAYERS[layer]
    points = mesh.vertices["pos"][:, :2]
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(np.linalg.norm(points - centre, axis=1).max())
    return Chunk(mesh, (float(centre[0]), float(centre[1])), radius, line)


def _ribbon(line: Floats, width: float, layer: int, colour: Colour, z: float, place: str) -> list[Chunk]:
    points, side, flag = line, across(line), LANE_FLAG if place == "lane" else Material.PLAIN
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    chunks = []
    for start in range(0, len(points) - 1, CHUNK_POINTS):
        part = slice(start, min(start + CHUNK_POINTS + 1, len(points)))
        left, right = points[part] + side[part] * width / 2, points[part] - side[part] * width / 2
        rows = np.stack([left, right], axis=1)
        pos = np.concatenate([rows, np.full((*rows.shape[:2], 1), z)], axis=2).reshape(-1, 3)
        uv = np.stack([np.repeat(s[part], 2), np.tile([0.0, width], len(rows))], axis=1)
        builder = Builder()
        alpha = np.tile([0.0, 1.0], len(rows))
        builder.add(pos, (0, 0, 1), uv, grid_triangles(len(rows), 2), colour, layer, flag, alpha)
        chunks.append(_chunk(builder, place))
    return chunks


def _strip(strip: Strip) -> list[Chunk]:
    layer, colour = SURFACES[strip.surface]
    line = resampled(np.asarray(strip.centre_m), 4.0)
    if strip.surface != "pavement":
        return _ribbon(line, strip.width_m, layer, colour, 0.0, "strip")
    chunks = []
    for sense in (1.0, -1.0):
        chunks += _kerb(line + across(line) * sense * strip.width_m / 2, sense)
    return chunks + _ribbon(line, strip.width_m, layer, colour, KERB_M, "pavement")


def _kerb(edge: Floats, sense: float) -> list[Chunk]:
    """The upright stone face along a pavement's edge and its narrow top."""
    side = across(edge) * sense
    chunks = []
    for start in range(0, len(edge) - 1, CHUNK_POINTS):
        part = slice(start, min(start + CHUNK_POINTS + 1, len(edge)))
        low, top = edge[part], edge[part] - side[part] * 0.14
        zeros, high = np.zeros((len(low), 1)), np.full((len(low), 1), KERB_M)
        builder = Builder()
        rows = np.stack([np.hstack([low, zeros]), np.hstack([low, high]), np.hstack([top, high])], axis=1)
        normals = np.zeros_like(rows)
        normals[:, :2, :2] = side[part][:, None]
        normals[:, 2, 2] = 1.0
        uv = np.stack([np.repeat(np.arange(len(low)) * 2.0, 3), np.tile([0, 0.1, 0.2], len(low))], axis=1)
        triangles = grid_triangles(len(low), 3)
        builder.add(rows.reshape(-1, 3), normals.reshape(-1, 3), uv, triangles, (0.92, 0.92, 0.9), Layer.CONCRETE)
        chunks.append(_chunk(builder, "kerb"))
    return chunks


def _line(points: Floats, width: float) -> list[Chunk]:
    side = across(points)
    chunks = []
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    for start in range(0, len(points) - 1, CHUNK_POINTS):
        part = slice(start, min(start + CHUNK_POINTS + 1, len(points)))
        builder = Builder()
        _line_quads(builder, points[part], side[part], s[part], width)
        chunks.append(_chunk(builder, "marking", line=True))
    return chunks


def _line_quads(builder: Builder, points: Floats, side: Floats, s: Floats, width: float) -> None:
    count = len(points)
    pos = np.repeat(np.hstack([points, np.full((count, 1), 0.004)]), 2, axis=0)
    normal = np.repeat(np.hstack([side, np.zeros((count, 1))]), 2, axis=0)
    uv = np.stack([np.repeat(s, 2), np.tile([width / 2, -width / 2], count)], axis=1)
    builder.add(pos, normal, uv, grid_triangles(count, 2), WHITE, Layer.WHITE, LINE_FLAG)


def _dashes(line: Floats, width: float) -> list[Chunk]:
    points = resampled(line, 1.0)
    side, step = across(points), int(DASH_M + DASH_GAP_M)
    chunks, builder, filled = [], Builder(), 0
    for start in range(0, len(points) - int(DASH_M), step):
        part = slice(start, start + int(DASH_M) + 1)
        along = np.arange(start, start + DASH_M + 1.0)[: len(points[part])]
        _line_quads(builder, points[part], side[part], along, width)
        filled += 1
        if filled == 6:
            chunks.append(_chunk(builder, "marking", line=True))
            builder, filled = Builder(), 0
    return chunks + ([_chunk(builder, "marking", line=True)] if filled else [])


def _markings(lane: Lane) -> list[Chunk]:
    centre = resampled(np.asarray(lane.centre_m), 3.0)
    side = across(centre)
    chunks: list[Chunk] = []
    for sense, kind in ((1.0, lane.left), (-1.0, lane.right)):
        border = centre + side * sense * lane.width_m / 2
        if kind == "solid":
            chunks += _line(border, LINE_WIDTH_M)
        elif kind == "edge":
            chunks += _line(border - side * sense * EDGE_WIDTH_M, EDGE_WIDTH_M)
        elif kind == "dashed":
            chunks += _dashes(border, LINE_WIDTH_M)
        elif kind == "double":
            chunks += _line(border + side * 0.12, 0.12) + _line(border - side * 0.12, 0.12)
    return chunks


def _bar(builder: Builder, x: float, y: float, yaw: float, along: float, wide: float) -> None:
    ahead, left = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
    ends = np.array([(x, y) - ahead * along / 2, (x, y) + ahead * along / 2])
    _line_quads(builder, ends, np.tile(left, (2, 1)), np.array([0.0, along]), wide)


def _stop(line: StopLine) -> Chunk:
    builder = Builder()
    _bar(builder, line.pose.x_m, line.pose.y_m, line.pose.yaw_rad + np.pi / 2, line.width_m, line.depth_m)
    return _chunk(builder, "bar", line=True)


def _zebra(zebra: Zebra) -> Chunk:
    builder, yaw = Builder(), zebra.pose.yaw_rad
    left = np.array([-np.sin(yaw), np.cos(yaw)])
    for offset in np.arange(-zebra.span_m / 2 + 0.5, zebra.span_m / 2, 1.0):
        x, y = np.array([zebra.pose.x_m, zebra.pose.y_m]) + left * offset
        _bar(builder, float(x), float(y), yaw, zebra.depth_m, 0.5)
    return _chunk(builder, "bar", line=True)


def _patch(patch: Patch) -> Chunk:
    layer, colour = SURFACES[patch.surface]
    outline = np.asarray(patch.outline_m)
    builder = Builder()
    fan = [(0, k, k + 1) for k in range(1, len(outline) - 1)]
    pos = np.hstack([outline, np.zeros((len(outline), 1))])
    builder.add(pos, (0, 0, 1), outline, fan, colour, layer, Material.PLAIN, 0.5)
    return _chunk(builder, "patch")


def chunks(road: Road) -> list[Chunk]:
    """The road in drawing order: strips, lanes, markings, patches, stop lines, zebras."""
    out: list[Chunk] = []
    for strip in road.strips:
        out += _strip(strip)
    for lane in road.lanes:
        line = resampled(np.asarray(lane.centre_m), 4.0)
        out += _ribbon(line, lane.width_m + 0.06, *SURFACES["asphalt"], 0.0, "lane")
    for lane in road.lanes:
        out += _markings(lane)
    out += [_patch(patch) for patch in road.patches]
    out += [_stop(line) for line in road.stop_lines]
    return out + [_zebra(zebra) for zebra in road.zebras]
