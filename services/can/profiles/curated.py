"""The curated fields: all that the service may take from a car's buses, with unit, meaning and place in COVESA VSS.

VSS is the COVESA Vehicle Signal Specification, release 6.0 (https://covesa.github.io/vehicle_signal_specification).
What it does not name has a path in its manner, a layer of ours over the catalogue, as VSS foresees: brake pressure and
temperature, faults of booster and steering assistance, `esc_off`, light outside and warning lamps.
Signs follow ISO 8855, as VSS does: forward, left and turning left are positive.
"""

import difflib

import msgspec

from services.can.errors import ProfileError


class Curated(msgspec.Struct, frozen=True, kw_only=True):
    """One curated field. `unit` is empty for flags, counts and named values."""

    unit: str
    vss: str
    purpose: str


def _row(unit: str, vss: str, purpose: str) -> Curated:
    return Curated(unit=unit, vss=f"Vehicle.{vss}", purpose=purpose)


WHEELS = {"fl": "Row1.Wheel.Left", "fr": "Row1.Wheel.Right", "rl": "Row2.Wheel.Left", "rr": "Row2.Wheel.Right"}

FIELDS: dict[str, Curated] = {
    "speed_mps": _row("m/s", "Speed", "speed over ground, every distance and limit rests on it"),
    "acceleration_mps2": _row(
        "m/s2", "Acceleration.Longitudinal", "forward positive: braking, crosscheck of the speed"
    ),
    "lateral_acceleration_mps2": _row("m/s2", "Acceleration.Lateral", "left positive: grip used in a bend"),
    "yaw_rate_radps": _row("rad/s", "AngularVelocity.Yaw", "left positive: path, crosscheck of the wheels"),
    "steering_angle_rad": _row("rad", "Chassis.Axle.Row1.SteeringAngle", "road wheel, left positive: path"),
    "brake_pressure_bar": _row("bar", "Chassis.Brake.Pressure", "what the brakes are asked for"),
    "brake_pedal": _row("share", "Chassis.Brake.PedalPosition", "how far the driver brakes"),
    "brake_pressed": _row("", "Chassis.Brake.IsBrakePedalPressed", "whether the driver brakes"),
    "accelerator_pedal": _row("share", "Chassis.Accelerator.PedalPosition", "what the driver wants"),
    "parking_brake": _row("", "Chassis.ParkingBrake.IsEngaged", "a car held by its parking brake"),
    "gear": _row("", "Powertrain.Transmission.CurrentGear", "-1 reverse, 0 neutral or park, 1 and more forward"),
    "engine_running": _row("", "Powertrain.CombustionEngine.IsRunning", "whether oil pressure is due"),
    "abs_active": _row("", "ADAS.ABS.IsEngaged", "grip is used up in braking"),
    "abs_fault": _row("", "ADAS.ABS.IsError", "wheels may lock"),
    "esc_active": _row("", "ADAS.ESC.IsEngaged", "grip is used up in a bend"),
    "esc_fault": _row("", "ADAS.ESC.IsError", "no stability control"),
    "esc_off": _row("", "ADAS.ESC.IsSwitchedOff", "no stability control by choice"),
    "traction_active": _row("", "ADAS.TCS.IsEngaged", "grip is used up in driving off"),
    "brake_fluid_low": _row("", "Chassis.Axle.Row1.Wheel.Left.Brake.IsFluidLevelLow", "braking may fail"),
    "brake_lining_worn": _row("", "Chassis.Axle.Row1.Wheel.Left.Brake.IsBrakesWorn", "brakes due for service"),
    "brake_booster_fault": _row("", "Chassis.Brake.IsBoosterError", "braking needs more force"),
    "steering_assist_fault": _row("", "Chassis.SteeringWheel.IsAssistError", "steering needs force"),
    "wiper_stage": _row("", "Body.Windshield.Front.Wiping.Mode", "0 off, 1 intermittent, 2 slow, 3 fast: rain"),
    "rain_sensor": _row("share", "Body.Raindetection.Intensity", "0 dry, 1 most: rain"),
    "outside_temperature_c": _row("degC", "Exterior.AirTemperature", "ice"),
    "outside_light_lux": _row("lx", "Exterior.LightIntensity", "day or night"),
    "headlamps": _row("", "Body.Lights.LightSwitch", "0 off, 1 position, 2 low beam, 3 high beam"),
    "fog_lamp_rear": _row("", "Body.Lights.Fog.Rear.IsOn", "how the driver judges sight"),
    "indicator_left": _row("", "Body.Lights.DirectionIndicator.Left.IsSignaling", "the driver's plan"),
    "indicator_right": _row("", "Body.Lights.DirectionIndicator.Right.IsSignaling", "the driver's plan"),
    "hazard_lights": _row("", "Body.Lights.Hazard.IsSignaling", "the driver warns others"),
    "coolant_temperature_c": _row("degC", "Powertrain.CombustionEngine.EngineCoolant.Temperature", "engine may fail"),
    "oil_pressure_bar": _row("bar", "Powertrain.CombustionEngine.EOP", "engine may fail"),
    "fuel_share": _row("share", "Powertrain.FuelSystem.RelativeLevel", "whether a way can be driven"),
    "battery_voltage_v": _row("V", "LowVoltageBattery.CurrentVoltage", "assistance and lamps may fail"),
    **{
        f"wheel_{wheel}_mps": _row("m/s", f"Chassis.Axle.{place}.Speed", "slip, crosscheck of the speed")
        for wheel, place in WHEELS.items()
    },
    **{
        f"tyre_pressure_{wheel}_bar": _row("bar", f"Chassis.Axle.{place}.Tire.Pressure", "grip, slow leaks")
        for wheel, place in WHEELS.items()
    },
    **{
        f"tyre_temperature_{wheel}_c": _row("degC", f"Chassis.Axle.{place}.Tire.AirTemperature", "warms the pressure")
        for wheel, place in WHEELS.items()
    },
    **{
        f"brake_temperature_{wheel}_c": _row("degC", f"Chassis.Axle.{place}.Brake.Temperature", "fading")
        for wheel, place in WHEELS.items()
    },
    "lamp_engine": _row("", "OBD.Status.IsMILOn", "what the car tells its driver"),
    **{
        f"lamp_{name}": _row("", f"Cabin.WarningLamp.{path}.IsOn", "what the car tells its driver")
        for name, path in {
            "engine_flashing": "EngineFlashing",
            "abs": "ABS",
            "stability": "ESC",
            "brake": "Brake",
            "tyre": "TirePressure",
            "coolant": "Coolant",
            "oil": "OilPressure",
            "battery": "Battery",
            "fuel": "Fuel",
            "steering": "Steering",
        }.items()
    },
}
"""Name of a field -> what it is. The distance travelled, seats, doors, phone and place are not here: driving safely
needs none of them, and they tell who drives where."""


def curated(name: str) -> Curated:
    """The field of this name. Raises ProfileError, with the nearest name where there is one."""
    try:
        return FIELDS[name]
    except KeyError:
        near = difflib.get_close_matches(name, FIELDS, n=1, cutoff=0.4)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise ProfileError(f"no curated field {name!r}{hint}") from None
