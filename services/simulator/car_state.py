"""The simulated car as its own control units know it, derived from how it moves. Pure, no numpy: it runs every
physics step.
"""

import math
from dataclasses import dataclass, field, replace

TRACK_M = 1.56
WHEELBASE_M = 2.7
STEERING_RATIO = 15.0
WHEEL_RADIUS_M = 0.32
MASS_KG = 1500.0
FRONT_BRAKE_SHARE = 0.7
DISC_HEAT_J_PER_K = 6000.0
"""One front disc: about 12 kg of iron at 500 J/(kg K)."""
DISC_COOLING_W_PER_K = 12.0
"""Standing; with speed v it grows by half of this for each m/s."""
BAR_PER_MPS2 = 10.0
GEAR_RPM_PER_MPS = (0.0, 300.0, 180.0, 120.0, 88.0, 70.0, 58.0)
TANK_L = 50.0

Four = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Controls:
    """What the world tells the car in one step: motion, the driver's hands and feet, and what the car's own sensors
    feel.
    """

    speed_mps: float
    acceleration_mps2: float = 0.0
    yaw_rate_radps: float = 0.0
    road_wheel_rad: float = 0.0
    accelerator: float = 0.0
    brake: float = 0.0
    abs_active: bool = False
    esc_active: bool = False
    mu: float = 0.9
    wiper_stage: int = 0
    outside_temperature_c: float = 15.0
    headlamps: int = 0
    fog_front: bool = False
    fog_rear: bool = False
    indicator: str = "off"


@dataclass(frozen=True, slots=True)
class CarState:
    """Everything the car's frames say, in SI units; angles positive to the left. Tuples are FL, FR, RL, RR."""

    speed_mps: float = 0.0
    acceleration_mps2: float = 0.0
    yaw_rate_radps: float = 0.0
    lateral_acceleration_mps2: float = 0.0
    steering_wheel_rad: float = 0.0
    steering_wheel_rate_radps: float = 0.0
    accelerator: float = 0.0
    brake: float = 0.0
    brake_pressure_bar: float = 0.0
    wheel_speeds_mps: Four = (0.0, 0.0, 0.0, 0.0)
    abs_active: bool = False
    esc_active: bool = False
    abs_fault: bool = False
    esc_fault: bool = False
    brake_fluid_low: bool = False
    brake_lining_worn: bool = False
    brake_booster_fault: bool = False
    steering_assist_fault: bool = False
    parking_brake: bool = False
    tyre_pressure_bar: Four = (2.4, 2.4, 2.6, 2.6)
    tyre_temperature_c: Four = (20.0, 20.0, 20.0, 20.0)
    brake_temperature_c: Four = (20.0, 20.0, 20.0, 20.0)
    engine_rpm: float = 800.0
    engine_torque_nm: float = 0.0
    engine_running: bool = True
    gear: int = 1
    coolant_temperature_c: float = 90.0
    oil_temperature_c: float = 95.0
    oil_pressure_bar: float = 2.0
    intake_temperature_c: float = 20.0
    fuel_share: float = 0.6
    battery_voltage_v: float = 14.2
    wiper_stage: int = 0
    outside_temperature_c: float = 15.0
    headlamps: int = 0
    fog_front: bool = False
    fog_rear: bool = False
    indicator: str = "off"
    distance_km: float = 12_345.0
    run_time_s: float = 0.0
    stored_codes: tuple[str, ...] = ()
    pending_codes: tuple[str, ...] = ()
    lamps: frozenset[str] = field(default_factory=frozenset)
    """Of: engine, engine_flashing, abs, stability, brake, tyre, coolant, oil, battery, fuel, steering."""


class CarModel:
    """Carries the slow quantities (heat, fuel, distance, gear) from step to step."""

    def __init__(self, start: CarState | None = None) -> None:
        self.state = start if start is not None else CarState()

    def step(self, dt_s: float, controls: Controls) -> CarState:
        """The car `dt_s` later under `controls`."""
        before, speed = self.state, max(0.0, controls.speed_mps)
        gear = _gear(speed, before.gear)
        wheel_rad = controls.road_wheel_rad * STEERING_RATIO
        rpm = max(800.0, speed * GEAR_RPM_PER_MPS[gear])
        self.state = replace(
            before,
            speed_mps=speed,
            acceleration_mps2=controls.acceleration_mps2,
            yaw_rate_radps=controls.yaw_rate_radps,
            lateral_acceleration_mps2=speed * controls.yaw_rate_radps,
            steering_wheel_rad=wheel_rad,
            steering_wheel_rate_radps=(wheel_rad - before.steering_wheel_rad) / dt_s if dt_s > 0 else 0.0,
            accelerator=controls.accelerator,
            brake=controls.brake,
            brake_pressure_bar=_pressure_bar(controls),
            wheel_speeds_mps=_wheel_speeds(speed, controls),
            abs_active=controls.abs_active,
            esc_active=controls.esc_active,
            brake_temperature_c=_disc_heat(before, speed, controls, dt_s),
            tyre_temperature_c=_tyre_heat(before, speed, controls, dt_s),
            engine_rpm=rpm,
            engine_torque_nm=_torque_nm(controls),
            gear=gear,
            oil_pressure_bar=min(5.0, 1.2 + rpm / 1000.0),
            intake_temperature_c=controls.outside_temperature_c + 8.0,
            fuel_share=max(0.0, before.fuel_share - _fuel_l_per_s(speed, controls) * dt_s / TANK_L),
            wiper_stage=controls.wiper_stage,
            outside_temperature_c=controls.outside_temperature_c,
            headlamps=controls.headlamps,
            fog_front=controls.fog_front,
            fog_rear=controls.fog_rear,
            indicator=controls.indicator,
            distance_km=before.distance_km + speed * dt_s / 1000.0,
            run_time_s=before.run_time_s + dt_s,
        )
        return self.state


def _gear(speed_mps: float, gear: int) -> int:
    gear = min(max(gear, 1), 6)
    if gear < 6 and speed_mps * GEAR_RPM_PER_MPS[gear] > 2600.0:
        return gear + 1
    if gear > 1 and speed_mps * GEAR_RPM_PER_MPS[gear] < 1300.0:
        return gear - 1
    return gear


def _pressure_bar(controls: Controls) -> float:
    """Master cylinder pressure: what the deceleration takes on a sound brake, or what the foot asks for where grip
    holds it back.
    """
    wanted = max(-controls.acceleration_mps2 if controls.brake > 0.01 else 0.0, controls.brake * 9.0)
    return min(180.0, wanted * BAR_PER_MPS2)


def _wheel_speeds(speed_mps: float, controls: Controls) -> Four:
    """Each wheel on its own arc; under braking they run slower than the ground by the slip, at the limit of grip by
    12 %.
    """
    if speed_mps <= 0.0:
        return (0.0, 0.0, 0.0, 0.0)
    used = abs(controls.acceleration_mps2) / max(0.05, controls.mu * 9.81)
    slip = 0.12 if controls.abs_active else 0.03 * min(1.0, used)
    along = speed_mps * (1.0 - math.copysign(slip, -controls.acceleration_mps2)) if slip else speed_mps
    across = controls.yaw_rate_radps * TRACK_M / 2.0
    left, right = max(0.0, along - across), max(0.0, along + across)
    return (left, right, left, right)


def _disc_heat(before: CarState, speed_mps: float, controls: Controls, dt_s: float) -> Four:
    """Each disc takes its share of the braking power and gives heat to the air, more so when driving."""
    braking_w = MASS_KG * max(0.0, -controls.acceleration_mps2) * speed_mps if controls.brake > 0.01 else 0.0
    cooling = DISC_COOLING_W_PER_K * (1.0 + 0.5 * speed_mps)

    def disc(now_c: float, share: float) -> float:
        gained = braking_w * share / 2.0 * dt_s / DISC_HEAT_J_PER_K
        lost = 1.0 - math.exp(-cooling * dt_s / DISC_HEAT_J_PER_K)
        return now_c + gained - (now_c - controls.outside_temperature_c) * lost

    front, rear = FRONT_BRAKE_SHARE, 1.0 - FRONT_BRAKE_SHARE
    left_front, right_front, left_rear, right_rear = before.brake_temperature_c
    return (disc(left_front, front), disc(right_front, front), disc(left_rear, rear), disc(right_rear, rear))


def _tyre_heat(before: CarState, speed_mps: float, controls: Controls, dt_s: float) -> Four:
    """Tyres run about half a degree above the air for each m/s, reached over ten minutes."""
    goal, share = controls.outside_temperature_c + 0.6 * speed_mps, min(1.0, dt_s / 600.0)
    front_left, front_right, rear_left, rear_right = (
        each + (goal - each) * share for each in before.tyre_temperature_c
    )
    return (front_left, front_right, rear_left, rear_right)


def _torque_nm(controls: Controls) -> float:
    return 220.0 * controls.accelerator if controls.accelerator > 0.01 else -30.0


def _fuel_l_per_s(speed_mps: float, controls: Controls) -> float:
    """Idle 0.8 l/h; under power about 250 g/kWh of drag and acceleration."""
    force_n = 0.4 * speed_mps**2 + 150.0 + MASS_KG * max(0.0, controls.acceleration_mps2)
    power_kw = force_n * speed_mps / 1000.0 if controls.accelerator > 0.01 else 0.0
    return 0.8 / 3600.0 + power_kw * 0.25 / 0.745 / 3600.0
