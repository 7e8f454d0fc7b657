"""The simulated car as its control units know it, derived from how it moves. Pure, no numpy: it runs every step."""

import math
from dataclasses import dataclass, field, replace

from domain.kinematics import GRAVITY_MPS2
from services.simulator.car import tyres
from services.simulator.car.condition import SOUND, Condition, Four, four

TRACK_M = 1.56
WHEELBASE_M = 2.7
STEERING_RATIO = 15.0
MASS_KG = 1500.0
TYRE_STIFFNESS = 30.0
"""Braking force for each unit of slip and of load, where the tyre is hardly strained."""
FRONT_BRAKE_SHARE = 0.7
DISC_HEAT_J_PER_K = 6000.0
"""One front disc: about 12 kg of iron at 500 J/(kg K)."""
DISC_COOLING_W_PER_K = 4.0
"""Standing; with speed v it grows by a fifth of this for each m/s."""
DISC_GLOW_W_PER_K4 = 6e-9
"""Radiation of one disc: 0.2 m2 of oxidised iron, emissivity 0.55."""
BAR_PER_MPS2 = 10.0
GEAR_RPM_PER_MPS = (0.0, 300.0, 180.0, 120.0, 88.0, 70.0, 58.0)
TANK_L = 50.0
CHARGING_V, LOADED_V, FLAT_V = 14.2, 12.1, 10.2
DISCHARGE_V_PER_S = 0.01
"""Lights, fan and wipers from the battery alone, which gives 12.1 V under them at first; ours."""
PEDAL_MM, SPONGE_MM = 60.0, 70.0
"""Pedal travel at full braking, and what an empty circuit adds to it."""


@dataclass(frozen=True, slots=True)
class Controls:
    """What the world tells the car in one step: motion, hands and feet of the driver, and what sensors feel."""

    speed_mps: float
    acceleration_mps2: float = 0.0
    climb_mps2: float = 0.0
    """Gravity along a climb, which an accelerometer feels as acceleration."""
    yaw_rate_radps: float = 0.0
    road_wheel_rad: float = 0.0
    accelerator: float = 0.0
    brake: float = 0.0
    """The foot's."""
    system_brake: float = 0.0
    """What the car brakes by itself, on the same scale; it moves no pedal."""
    abs_active: bool = False
    esc_active: bool = False
    locked: bool = False
    """Whether the braked wheels stand while the car slides."""
    mu: float = 0.9
    wiper_stage: int = 0
    rain_mm_h: float = 0.0
    light_lx: float = 20_000.0
    outside_temperature_c: float = 15.0
    headlamps: int = 0
    fog_front: bool = False
    fog_rear: bool = False
    indicator: str = "off"

    @property
    def braked(self) -> float:
        """What is braked in all, by foot or car."""
        return max(self.brake, self.system_brake)


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
    """The foot's."""
    braked: float = 0.0
    """By foot or car."""
    brake_pressure_bar: float = 0.0
    brake_pedal_travel_mm: float = 0.0
    speed_known: bool = True
    """False while the wheels say nothing about the speed over ground."""
    wheel_speeds_mps: Four = (0.0, 0.0, 0.0, 0.0)
    abs_active: bool = False
    esc_active: bool = False
    abs_fault: bool = False
    esc_fault: bool = False
    esc_off: bool = False
    brake_fluid_low: bool = False
    brake_lining_worn: bool = False
    brake_booster_fault: bool = False
    steering_assist_fault: bool = False
    parking_brake: bool = False
    tyre_pressure_bar: Four = tyres.NOMINAL_BAR
    tyre_lost_bar: Four = (0.0, 0.0, 0.0, 0.0)
    tyre_filled_c: float = 20.0
    """Temperature at which the tyres had their nominal pressure."""
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
    battery_voltage_v: float = CHARGING_V
    wiper_stage: int = 0
    rain_mm_h: float = 0.0
    light_lx: float = 20_000.0
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


def parked(outside_c: float) -> CarState:
    """A car that stood long at this temperature, its tyres filled there."""
    same = (outside_c, outside_c, outside_c, outside_c)
    return CarState(
        outside_temperature_c=outside_c, tyre_filled_c=outside_c, tyre_temperature_c=same, brake_temperature_c=same
    )


class CarModel:
    """Carries the slow quantities (heat, fuel, distance, gear) from step to step."""

    def __init__(self, start: CarState | None = None) -> None:
        self.state = start if start is not None else CarState()

    def step(self, dt_s: float, controls: Controls, condition: Condition = SOUND) -> CarState:
        """The car `dt_s` later under `controls`, with what is broken in it."""
        before, speed = self.state, max(0.0, controls.speed_mps)
        gear = _gear(speed, before.gear)
        wheel_rad = controls.road_wheel_rad * STEERING_RATIO
        rpm = max(800.0, speed * GEAR_RPM_PER_MPS[gear])
        lacking = tyres.lack(before.tyre_pressure_bar)
        lost, warmth = _lost(before, condition, dt_s), _tyre_heat(before, speed, controls, lacking, dt_s)
        self.state = replace(
            before,
            speed_mps=speed,
            acceleration_mps2=controls.acceleration_mps2 + controls.climb_mps2,
            yaw_rate_radps=controls.yaw_rate_radps,
            lateral_acceleration_mps2=speed * controls.yaw_rate_radps,
            steering_wheel_rad=wheel_rad,
            steering_wheel_rate_radps=(wheel_rad - before.steering_wheel_rad) / dt_s if dt_s > 0 else 0.0,
            accelerator=controls.accelerator,
            brake=controls.brake,
            braked=controls.braked,
            brake_pressure_bar=_pressure_bar(controls, condition),
            brake_pedal_travel_mm=_travel_mm(controls, condition),
            speed_known=not controls.locked,
            wheel_speeds_mps=_wheel_speeds(speed, controls, lacking),
            abs_active=controls.abs_active,
            esc_active=controls.esc_active,
            brake_temperature_c=_disc_heat(before, speed, controls, condition, dt_s),
            tyre_temperature_c=warmth,
            tyre_lost_bar=lost,
            tyre_pressure_bar=_pressures(before.tyre_filled_c, lost, warmth),
            engine_rpm=rpm,
            engine_torque_nm=_torque_nm(controls),
            gear=gear,
            oil_pressure_bar=min(5.0, 1.2 + rpm / 1000.0),
            intake_temperature_c=controls.outside_temperature_c + 8.0,
            fuel_share=max(0.0, before.fuel_share - _fuel_l_per_s(speed, controls) * dt_s / TANK_L),
            battery_voltage_v=_voltage_v(before, condition, dt_s),
            wiper_stage=controls.wiper_stage if condition.wipers else 0,
            rain_mm_h=controls.rain_mm_h,
            light_lx=controls.light_lx,
            outside_temperature_c=controls.outside_temperature_c,
            headlamps=controls.headlamps if condition.headlamps else 0,
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


def _pressure_bar(controls: Controls, condition: Condition) -> float:
    """Master cylinder pressure: what the deceleration takes on a sound brake, or what foot or car ask for where grip
    or a fault holds it back; without the booster the foot gives less of it.
    """
    wanted = max(-controls.acceleration_mps2 if controls.braked > 0.01 else 0.0, controls.braked * 9.0)
    return min(180.0, wanted * BAR_PER_MPS2 * (condition.assisted if controls.braked > 0.01 else 1.0))


def _travel_mm(controls: Controls, condition: Condition) -> float:
    """How far the foot goes: without the booster it moves less fluid, a circuit without fluid lets the pedal sink."""
    return controls.brake * condition.assisted * (PEDAL_MM + 2.0 * SPONGE_MM * (1.0 - condition.circuits))


def _wheel_speeds(speed_mps: float, controls: Controls, lacking: Four) -> Four:
    """Each wheel on its own arc and radius; under braking they run slower than the ground by the slip, at the limit
    of grip by 12 %; locked ones stand.
    """
    if speed_mps <= 0.0 or controls.locked:
        return (0.0, 0.0, 0.0, 0.0)
    used = abs(controls.acceleration_mps2) / max(0.05, controls.mu * GRAVITY_MPS2)
    slip = 0.12 if controls.abs_active else _slip(min(1.0, used), controls.mu)
    along = speed_mps * (1.0 - math.copysign(slip, -controls.acceleration_mps2)) if slip else speed_mps
    across = controls.yaw_rate_radps * TRACK_M / 2.0
    left, right = max(0.0, along - across), max(0.0, along + across)
    return four(
        ground / tyres.radius_share(each) for ground, each in zip((left, right, left, right), lacking, strict=True)
    )


def _slip(used: float, mu: float) -> float:
    """Slip at which a tyre gives this share of its grip, by the brush model (Pacejka, Tire and Vehicle Dynamics, ch. 3).
    The stiffness belongs to the tyre and not to the road, so a slippery road shows in the slip only once the tyre is
    strained.
    """
    slip: float = 3.0 * mu / TYRE_STIFFNESS * (1.0 - (1.0 - used) ** (1.0 / 3.0))
    return min(0.12, slip)


def _disc_heat(before: CarState, speed_mps: float, controls: Controls, condition: Condition, dt_s: float) -> Four:
    """Each disc takes its share of the braking power; it loses heat to the air it drives through, and by glowing."""
    braked = controls.braked > 0.01 and not controls.locked
    braking_w = MASS_KG * max(0.0, -controls.acceleration_mps2) * speed_mps if braked else 0.0
    cooling, air_k = DISC_COOLING_W_PER_K * (1.0 + 0.2 * speed_mps), controls.outside_temperature_c + tyres.KELVIN

    def disc(now_c: float, share: float) -> float:
        now_k = now_c + tyres.KELVIN
        conductance = cooling + DISC_GLOW_W_PER_K4 * (now_k**2 + air_k**2) * (now_k + air_k)
        gained = braking_w * share / 2.0 * dt_s / DISC_HEAT_J_PER_K
        lost = 1.0 - math.exp(-conductance * dt_s / DISC_HEAT_J_PER_K)
        return max(condition.discs_at_least_c, now_c + gained - (now_c - controls.outside_temperature_c) * lost)

    front, rear = FRONT_BRAKE_SHARE, 1.0 - FRONT_BRAKE_SHARE
    left_front, right_front, left_rear, right_rear = before.brake_temperature_c
    return (disc(left_front, front), disc(right_front, front), disc(left_rear, rear), disc(right_rear, rear))


def _tyre_heat(before: CarState, speed_mps: float, controls: Controls, lacking: Four, dt_s: float) -> Four:
    """Tyres run about half a degree above the air for each m/s, reached over ten minutes; a soft one flexes more and
    runs up to three times as far above it.
    """
    share = min(1.0, dt_s / 600.0)
    return four(
        now + (controls.outside_temperature_c + 0.6 * speed_mps * (1.0 + 2.0 * each) - now) * share
        for now, each in zip(before.tyre_temperature_c, lacking, strict=True)
    )


def _lost(before: CarState, condition: Condition, dt_s: float) -> Four:
    """Air lost so far as cold pressure; a tyre that does not leak has been mended and filled."""
    return four(
        min(nominal - condition.leak_to_bar, lost + leak * dt_s / 60.0) if leak > 0.0 else 0.0
        for nominal, lost, leak in zip(tyres.NOMINAL_BAR, before.tyre_lost_bar, condition.leak_bar_per_min, strict=True)
    )


def _pressures(filled_c: float, lost_bar: Four, temperature_c: Four) -> Four:
    return four(
        tyres.warm_bar(nominal - lost, filled_c, now_c)
        for nominal, lost, now_c in zip(tyres.NOMINAL_BAR, lost_bar, temperature_c, strict=True)
    )


def _voltage_v(before: CarState, condition: Condition, dt_s: float) -> float:
    if condition.charging:
        return CHARGING_V
    return max(FLAT_V, min(LOADED_V, before.battery_voltage_v) - DISCHARGE_V_PER_S * dt_s)


def _torque_nm(controls: Controls) -> float:
    return 220.0 * controls.accelerator if controls.accelerator > 0.01 else -30.0


def _fuel_l_per_s(speed_mps: float, controls: Controls) -> float:
    """Idle 0.8 l/h; under power about 250 g/kWh of drag and acceleration."""
    force_n = 0.4 * speed_mps**2 + 150.0 + MASS_KG * max(0.0, controls.acceleration_mps2)
    power_kw = force_n * speed_mps / 1000.0 if controls.accelerator > 0.01 else 0.0
    return 0.8 / 3600.0 + power_kw * 0.25 / 0.745 / 3600.0
