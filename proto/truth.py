"""The simulator's truth, on keys that only evaluation may read."""

from typing import Literal

import msgspec


class TrueActor(msgspec.Struct, frozen=True, kw_only=True):
    """An actor as the simulator has it, in the ego frame."""

    actor_id: int
    kind: str
    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    length_m: float
    width_m: float
    in_ego_path: bool = False
    walled: float = 0.0
    """Share of it, 0 to 1, that houses hide from the front camera; told up to 90 m ahead."""


class TrueHazard(msgspec.Struct, frozen=True, kw_only=True):
    """A hazard that is on. Kind and onset tell one from another."""

    kind: str
    onset_s: float
    actor_id: int | None = None
    distance_m: float | None = None
    """From the ego's front; None: not told."""


class Truth(msgspec.Struct, frozen=True, kw_only=True):
    """What is really so at one instant."""

    time_s: float
    distance_m: float
    speed_mps: float
    acceleration_mps2: float
    law_limit_mps: float | None
    jurisdiction: str
    mu: float
    gap_m: float | None
    closing_mps: float | None
    actors: tuple[TrueActor, ...] = ()
    light: Literal["red", "red_amber", "amber", "green", "off"] | None = None
    light_distance_m: float | None = None
    signs: tuple[dict[str, str | float], ...] = ()
    hazard: str = ""
    hazard_onset_s: float | None = None
    infraction: str = ""
    collision: bool = False
    driver: dict[str, str | float] = {}
    film_mm: float | None = None
    """Water on the road."""
    visibility_m: float | None = None
    hazards: tuple[TrueHazard, ...] = ()
    """All that are on; `hazard` is the oldest of them."""
    stop_kind: str = ""
    """Where one has to stop now: `red_light`, `stop_sign`, `yield`. Empty: nowhere, or not told."""
    stop_distance_m: float | None = None
    """From the ego's front to that line."""
    faults: tuple[str, ...] | None = None
    """Presets of car faults that are on; None: not told."""
    brake_share: float = 1.0
    """What the car can brake, in ratio to a sound one on the same road."""
    rain_mm_h: float | None = None
    dark: bool | None = None
    """Whether cameras depend on lamps; None: not told."""
    heading_rad: float | None = None
    """Where the ego looks, anticlockwise on the map; None: not told."""
    driver_language: str = ""
    """What the driver reads; empty: not told."""


class ScenarioState(msgspec.Struct, frozen=True, kw_only=True):
    """Where the scenario stands; the live line and the end of a drive read it."""

    scenario: str
    seed: int
    time_s: float
    duration_s: float
    running: bool
    finished: bool = False
    late_frames: int = 0
    problem: str = ""
    """Why it ended before its time."""


CorruptionKind = Literal["sign_miss", "limit_misread", "dropout", "blackout", "freeze", "lidar_loss"]


class Corrupted(msgspec.Struct, frozen=True, kw_only=True):
    """One decision of a corruption, told when it first shows. Of signs the spared encounters are told too (`hit` false)."""

    kind: CorruptionKind
    subject: str
    """`sign/<id>`, `actor/<id>` where truth tells which; else the first track; a camera; a LiDAR."""
    stamp_ns: int
    hit: bool = True
    from_ns: int = 0
    """The start of a window; 0: from the encounter's first observation."""
    until_ns: int = 0
    """The end of a window; 0: for the whole encounter."""
    camera: str = ""
    """Whose track it was first seen as."""
    track_id: int = 0
    before: str = ""
    after: str = ""
