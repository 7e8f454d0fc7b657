"""What sensors deliver: pictures, sweeps, positions, frames of a CAN bus, the clock."""

from typing import Literal

import msgspec


class ClockTick(msgspec.Struct, frozen=True, kw_only=True):
    """The simulated time, published by the simulator."""

    now_ns: int
    lockstep: bool = False
    step: int = 0


class CameraFrame(msgspec.Struct, frozen=True, kw_only=True):
    """One picture, JPEG-encoded once at its source."""

    jpeg: bytes
    width_px: int
    height_px: int
    frame: int = 0


class Calibration(msgspec.Struct, frozen=True, kw_only=True):
    """A camera's pinhole intrinsics (px) and its mount in the ego frame (m, rad; x forward, y left, z up)."""

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    width_px: int
    height_px: int
    x_m: float = 0.0
    y_m: float = 0.0
    z_m: float = 1.4
    pitch_rad: float = 0.0
    yaw_rad: float = 0.0
    distortion: tuple[float, ...] = ()
    assumed: bool = False
    """The camera was not measured: the mount is a guess, and its pitch may be learned from the pictures."""
    focal_spread: float = 0.0
    """One sigma of the focal lengths as a share of them, where the field of view is a guess: all ranges may be wrong by as much."""


class LidarSweep(msgspec.Struct, frozen=True, kw_only=True):
    """Returns of one sweep in the ego frame: little-endian float32 rows (x_m, y_m, z_m, intensity)."""

    points: bytes
    count: int
    rings: int = 32


class GnssFix(msgspec.Struct, frozen=True, kw_only=True):
    """A noisy position in the local metric frame of the map."""

    x_m: float
    y_m: float
    heading_rad: float
    sigma_m: float
    latitude_deg: float | None = None
    """WGS 84; None: the map is not placed on the earth."""
    longitude_deg: float | None = None
    utc_s: float | None = None
    """UTC by the satellites, s since 1970; None: not told."""


class WeatherSensing(msgspec.Struct, frozen=True, kw_only=True):
    """What weather sensing reports; an absent field is unknown."""

    rain_mm_h: float | None = None
    snow_mm_h: float | None = None
    visibility_m: float | None = None
    air_temperature_c: float | None = None
    road_temperature_c: float | None = None
    water_film_mm: float | None = None
    wind_mps: float | None = None
    source: str = "simulator"
    dew_point_c: float | None = None
    gust_mps: float | None = None


class CanFrame(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """One frame of a CAN bus."""

    stamp_ns: int
    arbitration_id: int
    data: bytes
    extended: bool = False
    fd: bool = False
    remote: bool = False
    """A request for data; it carries none."""
    requested_bytes: int = 0
    """Of a remote frame: how many it asks for."""
    error: bool = False
    """Not a message: the controller tells of an error on the bus."""
    bitrate_switch: bool = False
    """CAN FD: the data went at the data bit rate."""
    error_state: bool = False
    """CAN FD: the sender is error passive."""


class CanFrames(msgspec.Struct, frozen=True, kw_only=True):
    """Frames in the order in which the bus carried them."""

    frames: tuple[CanFrame, ...]


class LanePath(msgspec.Struct, frozen=True, kw_only=True):
    """One lane in the ego frame: centre points (x_m, y_m) from near to far."""

    lane_id: str
    points: tuple[tuple[float, float], ...]
    width_m: float
    is_ego: bool = False
    oncoming: bool = False


class StopLine(msgspec.Struct, frozen=True, kw_only=True):
    """A stop line on the ego's lane: distance along the lane from the ego's centre."""

    distance_m: float
    kind: Literal["stop_line", "light", "crossing", "yield_line"] = "stop_line"


class MapView(msgspec.Struct, frozen=True, kw_only=True):
    """What a map knows ahead: lanes, stop lines, junctions. Never limits, signs, jurisdiction, units, traffic side."""

    segment_id: str
    lanes: tuple[LanePath, ...]
    stop_lines: tuple[StopLine, ...] = ()
    junction_distance_m: float | None = None
    carriageways_separated: bool | None = None
    road_class: Literal["urban", "rural", "motorway", "unknown"] = "unknown"
