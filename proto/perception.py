"""What perception publishes: boxes, tracks, lanes."""

from typing import Literal

import msgspec

ActorClass = Literal["vehicle", "pedestrian", "cyclist"]
ObjectClass = Literal["vehicle", "pedestrian", "sign", "panel", "light"]


class Box(msgspec.Struct, frozen=True, kw_only=True):
    """A detection in one picture, in pixels, with the id of the track it belongs to (0: none yet)."""

    x0_px: float
    y0_px: float
    x1_px: float
    y1_px: float
    kind: ObjectClass
    score: float
    track_id: int = 0
    range_m: float | None = None
    range_source: Literal["lidar", "ground", "size", "none"] = "none"
    seen_through: bool = False
    """LiDAR measured what lies behind a road user's box, and nothing at its range."""


class Boxes(msgspec.Struct, frozen=True, kw_only=True):
    """All detections of one picture; published with the picture's stamp."""

    camera: str
    frame: int
    boxes: tuple[Box, ...]
    detector: str = ""


class Track(msgspec.Struct, frozen=True, kw_only=True):
    """A tracked object in the ego frame (x forward, y left, metres; speeds over ground relative to the ego)."""

    track_id: int
    kind: ActorClass
    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    ax_mps2: float = 0.0
    length_m: float = 4.5
    width_m: float = 1.8
    heading_rad: float = 0.0
    sigma_x_m: float = 1.0
    """With what `range_spread` adds."""
    sigma_y_m: float = 1.0
    sigma_vx_mps: float = 1.0
    sigma_vy_mps: float | None = None
    """None: not told."""
    confidence: float = 0.0
    age_s: float = 0.0
    unseen_s: float = 0.0
    steady_s: float | None = None
    """From the first to the last of its sightings that came without a break and where they were expected. None: not told."""
    lane_id: str = ""
    in_ego_path: bool = False
    oncoming: bool = False
    clearance_m: float | None = None
    """Free room between its body and the ego's on the way that the ego's lane takes; below 0 they would meet. None: unknown."""
    range_spread: float = 0.0
    """One sigma of the share by which place and speed ahead may be wrong together: the camera's field of view is a guess."""


class Tracks(msgspec.Struct, frozen=True, kw_only=True):
    """The tracked actors at a camera frame's stamp: the snapshot that starts a tick."""

    camera: str
    frame: int
    tracks: tuple[Track, ...]
    lead_track_id: int | None = None
    ego_speed_used_mps: float | None = None
    lidar_used: bool = False


class Lanes(msgspec.Struct, frozen=True, kw_only=True):
    """The ego's lane, and whether it comes from a map or is the straight-corridor fallback."""

    ego_lane_id: str
    lane_count: int
    lane_width_m: float
    lateral_offset_m: float
    source: Literal["map", "corridor"]
    stop_line_distance_m: float | None = None
    stop_line_kind: str = ""
    junction_distance_m: float | None = None
    segment_id: str = ""
    road_class: Literal["urban", "rural", "motorway", "unknown"] = "unknown"
    carriageways_separated: bool | None = None
