"""Labelled objects of a frame: their boxes in the picture, and how deep their near surface and their centre lie."""

from pathlib import Path

import msgspec
import numpy as np

from drivemcp.errors import UserError
from proto.perception import ObjectClass

KINDS: dict[str, ObjectClass] = {
    "car": "vehicle", "truck": "vehicle", "bus": "vehicle", "trailer": "vehicle", "construction_vehicle": "vehicle",
    "bicycle": "vehicle", "motorcycle": "vehicle", "pedestrian": "pedestrian",
}  # fmt: skip
"""Labels that are road users, as perception names them."""
SAME_DEPTH_M = 0.01

Numbers4 = tuple[float, float, float, float]
Box3 = tuple[float, float, float, float, float, float, float]


class Solid(msgspec.Struct, frozen=True, kw_only=True):
    """A 3D label in the LiDAR's frame: x, y, z, length, width, height, yaw."""

    category: str
    box: Box3
    lidar_points: int


class Flat(msgspec.Struct, frozen=True, kw_only=True):
    """The same object in the picture, with the depth of its centre along the camera's axis."""

    category: str
    box_xyxy_px: Numbers4
    depth_m: float


class _Camera(msgspec.Struct, frozen=True, kw_only=True):
    lidar_to_camera: tuple[Numbers4, Numbers4, Numbers4, Numbers4]


class _Labelled(msgspec.Struct, frozen=True, kw_only=True):
    camera: _Camera
    objects_3d: tuple[Solid, ...]
    objects_2d_front: tuple[Flat, ...]


class Label(msgspec.Struct, frozen=True, kw_only=True):
    """One road user: box (x0, y0, x1, y1 px), depths (m) along the camera's axis, returns that labellers counted."""

    category: str
    kind: ObjectClass
    box_px: Numbers4
    near_m: float
    centre_m: float
    returns: int


def read_labels(file: Path) -> list[Label]:
    """The road users that are labelled in the picture and in space. Raises UserError naming file and field."""
    try:
        told = msgspec.json.decode(file.read_bytes(), type=_Labelled)
    except OSError as error:
        raise UserError(f"cannot read {file}: {error.strerror}") from None
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise UserError(f"{file}: {error}") from None
    mount = np.array(told.camera.lidar_to_camera)
    depths = [(solid, *_depths(solid, mount)) for solid in told.objects_3d]
    labels = []
    for flat in told.objects_2d_front:
        beside = [each for each in depths if each[0].category == flat.category]
        best = min(beside, key=lambda each: abs(each[2] - flat.depth_m), default=None)
        if flat.category in KINDS and best is not None and abs(best[2] - flat.depth_m) < SAME_DEPTH_M:
            labels.append(_label(flat, best[0], best[1]))
    return labels


def _label(flat: Flat, solid: Solid, near_m: float) -> Label:
    return Label(
        category=flat.category,
        kind=KINDS[flat.category],
        box_px=flat.box_xyxy_px,
        near_m=near_m,
        centre_m=flat.depth_m,
        returns=solid.lidar_points,
    )


def _depths(solid: Solid, mount: "np.ndarray[tuple[int, int], np.dtype[np.float64]]") -> tuple[float, float]:
    """Along the camera's axis: of the corner nearest to the camera, and of the centre."""
    x, y, z, length, width, height, yaw = solid.box
    signs = np.array([(a, b, c) for a in (-0.5, 0.5) for b in (-0.5, 0.5) for c in (-0.5, 0.5)])
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    corners = (signs * (length, width, height)) @ turn.T + (x, y, z)
    axis, offset = mount[2, :3], float(mount[2, 3])
    return float((corners @ axis).min()) + offset, float(np.array([x, y, z]) @ axis) + offset
