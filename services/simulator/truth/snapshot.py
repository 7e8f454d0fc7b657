"""One instant of the simulated world, as a value: the sensors and the truth are made from it."""

from dataclasses import dataclass

from services.simulator.car.brake_receiver import Brake
from services.simulator.driver.driver import Wish
from services.simulator.environment.weather import Weather
from services.simulator.scene.scene import Pose, Scene
from services.simulator.truth.ledger import LedgerEntry


@dataclass(frozen=True, slots=True, kw_only=True)
class EgoMotion:
    """How the ego moves; `pose` is the middle of its footprint."""

    pose: Pose
    s_m: float
    d_m: float
    lane: int
    speed_mps: float
    acceleration_mps2: float
    yaw_rate_radps: float
    road_wheel_rad: float
    mu: float
    """Peak friction that its tyres find here."""
    abs_active: bool
    locked: bool
    """Whether it slides on locked wheels."""
    length_m: float
    width_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Mover:
    """A road user's velocity in the world frame, beside its picture in the scene."""

    actor_id: int
    vx_mps: float
    vy_mps: float
    in_ego_path: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """The world at one step."""

    step: int
    time_s: float
    ego: EgoMotion
    scene: Scene
    movers: tuple[Mover, ...]
    weather: Weather
    wish: Wish
    brake: Brake
    fact: LedgerEntry
    ended: bool
    """The route is driven to its end."""
