"""Frames of a surveyed drive: a picture, a LiDAR sweep and their calibration, as a `frame.json` tells (nuScenes' conventions).

The file names the picture, the camera's intrinsics (3 x 3) and `lidar_to_camera` (4 x 4), and the sweep: little-endian float32
rows of x, y, z, intensity, ring in the LiDAR's frame (x right, y forward, z up). `ego.speed_mps` may be told; else it is unknown.
"""

import math
from codecs import BOM_UTF8
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import msgspec
import numpy as np

from drivemcp.errors import UserError
from proto import topics
from proto.sensors import Calibration, CameraFrame, LidarSweep
from proto.vehicle import Ego
from services.player.recording import FRONT, Options, Recording, TimedMessage, frame_of, read_picture

Floats = np.ndarray[Any, np.dtype[np.float64]]
FRAME_FILE = "frame.json"
TO_EGO = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""From the LiDAR's axes (x right, y forward) to the ego's (x forward, y left)."""
HOLD_RATE_HZ = 10.0
ROAD_RADII_M = (3.0, 20.0)
ROAD_BELOW_M = (0.5, 4.0)
_COLUMNS = 5

Row3 = tuple[float, float, float]
Row4 = tuple[float, float, float, float]
Size = Annotated[int, msgspec.Meta(gt=0, le=8192)]


class CameraPart(msgspec.Struct, frozen=True, kw_only=True):
    """The picture and its camera."""

    file: str
    size: tuple[Size, Size]
    intrinsic: tuple[Row3, Row3, Row3]
    lidar_to_camera: tuple[Row4, Row4, Row4, Row4]


class LidarPart(msgspec.Struct, frozen=True, kw_only=True):
    """The sweep. `height_m`: the sensor above the road; measured from the returns where it is not told."""

    file: str
    height_m: Annotated[float, msgspec.Meta(gt=0.0, le=5.0)] | None = None


class EgoPart(msgspec.Struct, frozen=True, kw_only=True):
    """How the ego moves."""

    speed_mps: Annotated[float, msgspec.Meta(ge=-20.0, le=100.0)] | None = None
    yaw_rate_radps: float | None = None


class FrameFile(msgspec.Struct, frozen=True, kw_only=True):
    """What we read of a `frame.json`; labels and other fields are left alone."""

    timestamp_s: float
    camera: CameraPart
    lidar: LidarPart
    ego: EgoPart | None = None


class StreetFrame(NamedTuple):
    """One frame as messages."""

    at_s: float
    picture: CameraFrame
    calibration: Calibration
    sweep: LidarSweep
    ego: Ego | None


def frame_files(path: Path) -> list[Path]:
    """The frame.json of a folder or of its subfolders, or the file itself; none where this is something else."""
    if path.is_file():
        return [path] if path.name == FRAME_FILE else []
    if (path / FRAME_FILE).is_file():
        return [path / FRAME_FILE]
    return sorted(path.glob(f"*/{FRAME_FILE}"))


def open_street(files: list[Path], name: str, options: Options) -> Recording:
    """Frames at the pace of their stamps; a single one is shown for `hold_s`, ten times a second: nothing moves in it.

    Raises UserError naming file and field.
    """
    frames = sorted((read_frame(file) for file in files), key=lambda frame: frame.at_s)
    first_s = frames[0].at_s
    ego = any(frame.ego is not None for frame in frames)
    shown = [frame._replace(at_s=frame.at_s - first_s) for frame in frames]
    if len(shown) == 1:
        count = max(1, round(options.hold_s * HOLD_RATE_HZ))
        shown = [shown[0]._replace(at_s=number / HOLD_RATE_HZ) for number in range(count)]
    messages = (each for number, frame in enumerate(shown) for each in messages_of(frame, number))
    return Recording(name, len(shown), shown[-1].at_s, messages, ego=ego, brings="pictures, LiDAR, calibration")


def messages_of(frame: StreetFrame, number: int) -> Iterator[TimedMessage]:
    """Calibration, sweep and ego before the picture that they explain."""
    yield TimedMessage(frame.at_s, topics.CALIBRATION, frame.calibration, FRONT)
    if frame.ego is not None:
        yield TimedMessage(frame.at_s, topics.EGO, frame.ego)
    yield TimedMessage(frame.at_s, topics.LIDAR, frame.sweep, "roof")
    picture = msgspec.structs.replace(frame.picture, jpeg=numbered(frame.picture.jpeg, number), frame=number)
    yield TimedMessage(frame.at_s, topics.CAMERA, picture, FRONT)


def numbered(jpeg: bytes, number: int) -> bytes:
    """The same picture with its number as a comment: one that is shown on and on is no camera that froze."""
    comment = str(number).encode()
    return jpeg[:2] + b"\xff\xfe" + (len(comment) + 2).to_bytes(2, "big") + comment + jpeg[2:]


def read_frame(file: Path) -> StreetFrame:
    """One frame. Raises UserError naming file and field."""
    told = _told(file)
    points = _points(file, told.lidar)
    height_m = told.lidar.height_m or road_below_m(points)
    if height_m is None:
        raise UserError(f"{file}: lidar.height_m is not told, and the sweep shows no road to measure it from")
    calibration, moved = place_camera(told.camera, points, height_m, file)
    ego = Ego(speed_mps=told.ego.speed_mps, yaw_rate_radps=told.ego.yaw_rate_radps) if told.ego else None
    return StreetFrame(told.timestamp_s, _picture(file, told.camera), calibration, sweep_of(moved, points[:, 3]), ego)


def _told(file: Path) -> FrameFile:
    try:
        return msgspec.json.decode(file.read_bytes().removeprefix(BOM_UTF8), type=FrameFile)
    except OSError as error:
        raise UserError(f"cannot read {file}: {error.strerror}") from None
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise UserError(f"{file}: {error}") from None


def _picture(file: Path, told: CameraPart) -> CameraFrame:
    bgr = read_picture(file.parent / told.file)
    height, width = bgr.shape[:2]
    if (width, height) != told.size:
        raise UserError(f"{file}: camera.size is {told.size[0]} x {told.size[1]}, the picture {width} x {height}")
    return frame_of(bgr, 0)


def _points(file: Path, told: LidarPart) -> Floats:
    path = file.parent / told.file
    try:
        values = np.frombuffer(path.read_bytes(), "<f4")
    except OSError as error:
        raise UserError(f"{file}: lidar.file: cannot read {path}: {error.strerror}") from None
    except ValueError:
        values = np.zeros(1, "<f4")
    if not len(values) or len(values) % _COLUMNS:
        raise UserError(f"{file}: lidar.file: {path.name} does not hold rows of x, y, z, intensity, ring (float32)")
    rows = values.reshape(-1, _COLUMNS).astype(np.float64)
    good: Floats = rows[np.isfinite(rows).all(axis=1)]
    if np.any(good[:, 3] < 0.0):
        raise UserError(
            f"{file}: lidar.file: {path.name} holds intensities below 0; are its rows x, y, z, intensity alone? Add a column for the ring"
        )
    return good


def road_below_m(points: Floats) -> float | None:
    """How far below the sensor the road lies: the most frequent height of the returns around; None where they are few."""
    around = np.hypot(points[:, 0], points[:, 1])
    below = -points[(around > ROAD_RADII_M[0]) & (around < ROAD_RADII_M[1]), 2]
    counts, edges = np.histogram(below, bins=np.arange(ROAD_BELOW_M[0], ROAD_BELOW_M[1], 0.05))
    if counts.max(initial=0) < 50:
        return None
    best = int(counts.argmax())
    return float((edges[best] + edges[best + 1]) / 2)


def place_camera(told: CameraPart, points: Floats, height_m: float, file: Path) -> tuple[Calibration, Floats]:
    """The camera in the ego frame, whose origin is the road below the LiDAR, and the returns (N, 3) in that frame.

    A calibration knows no roll: returns are turned about the camera's axis instead, so that they fall on the same pixels.
    """
    mount = np.array(told.lidar_to_camera)
    (fx, _, cx), (_, fy, cy), _ = told.intrinsic
    turn = mount[:3, :3]
    if not np.allclose(turn @ turn.T, np.eye(3), atol=1e-3) or np.linalg.det(turn) < 0:
        raise UserError(f"{file}: camera.lidar_to_camera is no rotation and translation")
    if not (fx > 0 and fy > 0):
        raise UserError(f"{file}: camera.intrinsic has no positive focal lengths")
    axes, lift = turn @ TO_EGO.T, np.array([0.0, 0.0, height_m])
    eye = TO_EGO @ (-turn.T @ mount[:3, 3]) + lift
    forward = axes[2]
    pitch, yaw = math.asin(float(np.clip(forward[2], -1.0, 1.0))), math.atan2(float(forward[1]), float(forward[0]))
    right = np.array([math.sin(yaw), -math.cos(yaw), 0.0])
    level = np.stack([right, np.cross(forward, right), forward])
    moved: Floats = (points[:, :3] @ TO_EGO.T + lift - eye) @ (level.T @ axes).T + eye
    x_m, y_m, z_m = eye.tolist()
    calibration = Calibration(
        fx_px=fx, fy_px=fy, cx_px=cx, cy_px=cy, width_px=told.size[0], height_px=told.size[1],
        x_m=x_m, y_m=y_m, z_m=z_m, pitch_rad=pitch, yaw_rad=yaw,
    )  # fmt: skip
    return calibration, moved


def sweep_of(points: Floats, intensity: Floats) -> LidarSweep:
    """Returns in the ego frame as a message."""
    rows = np.column_stack([points, intensity]).astype("<f4")
    return LidarSweep(points=rows.tobytes(), count=len(rows))
