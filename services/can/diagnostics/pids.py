"""The parameters of OBD service 01 that SAE J1979 gives a formula for, as data: value = raw * factor + offset, raw a
big-endian number of some of the bytes.
"""

from collections.abc import Mapping
from typing import NamedTuple


class Part(NamedTuple):
    """One value of a parameter. `needs`: the bit of byte 0 that says whether the unit has it (SAE's support bytes)."""

    name: str
    unit: str = ""
    start: int = 0
    size: int = 1
    factor: float = 1.0
    offset: float = 0.0
    signed: bool = False
    needs: int | None = None

    def value(self, data: bytes) -> float | int:
        """In `unit`."""
        raw = int.from_bytes(data[self.start : self.start + self.size], "big", signed=self.signed)
        value = raw * self.factor + self.offset
        return int(value) if self.factor == 1.0 and self.offset == int(self.offset) else round(value, 4)

    def present(self, data: bytes) -> bool:
        """Whether the unit says that it has this value."""
        return self.needs is None or bool(data[0] >> self.needs & 1)


class Pid(NamedTuple):
    """Number of data bytes, and what they say."""

    size: int
    parts: tuple[Part, ...]


SHARE, TRIM = 100 / 255, 100 / 128


def _one(
    name: str, unit: str = "", size: int = 1, factor: float = 1.0, offset: float = 0.0, signed: bool = False
) -> Pid:
    return Pid(size, (Part(name, unit, 0, size, factor, offset, signed),))


def _oxygen(name: str, bank_sensor: str) -> Pid:
    """Narrow band: voltage and the trim taken from it (0xFF: not used for trim)."""
    return Pid(
        2,
        (
            Part(f"{name}_{bank_sensor}_voltage", "V", 0, 1, 0.005),
            Part(f"{name}_{bank_sensor}_trim", "%", 1, 1, TRIM, -100),
        ),
    )


def _wide(number: int, second: str, unit: str, factor: float, offset: float) -> Pid:
    """Wide band: lambda, and voltage or current."""
    name = f"oxygen_sensor_{number}"
    return Pid(4, (Part(f"{name}_lambda", "", 0, 2, 2 / 65536), Part(f"{name}_{second}", unit, 2, 2, factor, offset)))


def _banks(name: str, first: int) -> Pid:
    """Secondary oxygen sensor trim of two banks."""
    return Pid(2, tuple(Part(f"{name}_bank_{first + 2 * i}", "%", i, 1, TRIM, -100) for i in (0, 1)))


def _flagged(size: int, names: tuple[str, ...], unit: str, width: int, factor: float, offset: float = 0.0) -> Pid:
    """A support byte, then values of one kind; each counts where its bit is set."""
    parts = (Part(n, unit, 1 + i * width, width, factor, offset, needs=i) for i, n in enumerate(names))
    return Pid(size, tuple(parts))


def _numbered(name: str, count: int) -> tuple[str, ...]:
    return tuple(f"{name}_{i + 1}" for i in range(count))


_NARROW = ("b1s1", "b1s2", "b1s3", "b1s4", "b2s1", "b2s2", "b2s3", "b2s4")
_CATALYSTS = ("b1s1", "b2s1", "b1s2", "b2s2")

PIDS: Mapping[int, Pid] = {
    0x04: _one("engine_load", "%", 1, SHARE),
    0x05: _one("coolant_temperature", "degC", 1, 1, -40),
    0x06: _one("short_term_fuel_trim_bank_1", "%", 1, TRIM, -100),
    0x07: _one("long_term_fuel_trim_bank_1", "%", 1, TRIM, -100),
    0x08: _one("short_term_fuel_trim_bank_2", "%", 1, TRIM, -100),
    0x09: _one("long_term_fuel_trim_bank_2", "%", 1, TRIM, -100),
    0x0A: _one("fuel_pressure", "kPa", 1, 3),
    0x0B: _one("intake_manifold_pressure", "kPa"),
    0x0C: _one("engine_speed", "rpm", 2, 0.25),
    0x0D: _one("vehicle_speed", "km/h"),
    0x0E: _one("timing_advance", "deg", 1, 0.5, -64),
    0x0F: _one("intake_air_temperature", "degC", 1, 1, -40),
    0x10: _one("air_flow", "g/s", 2, 0.01),
    0x11: _one("throttle_position", "%", 1, SHARE),
    **{0x14 + i: _oxygen("oxygen_sensor", name) for i, name in enumerate(_NARROW)},
    0x1F: _one("run_time", "s", 2),
    0x21: _one("distance_with_lamp", "km", 2),
    0x22: _one("fuel_rail_pressure_to_manifold", "kPa", 2, 0.079),
    0x23: _one("fuel_rail_pressure", "kPa", 2, 10),
    **{0x24 + i: _wide(i + 1, "voltage", "V", 8 / 65536, 0) for i in range(8)},
    0x2C: _one("commanded_egr", "%", 1, SHARE),
    0x2D: _one("egr_error", "%", 1, TRIM, -100),
    0x2E: _one("commanded_evaporative_purge", "%", 1, SHARE),
    0x2F: _one("fuel_level", "%", 1, SHARE),
    0x30: _one("warm_ups_since_cleared"),
    0x31: _one("distance_since_cleared", "km", 2),
    0x32: _one("evaporative_vapour_pressure", "Pa", 2, 0.25, 0, True),
    0x33: _one("barometric_pressure", "kPa"),
    **{0x34 + i: _wide(i + 1, "current", "mA", 1 / 256, -128) for i in range(8)},
    **{0x3C + i: _one(f"catalyst_temperature_{name}", "degC", 2, 0.1, -40) for i, name in enumerate(_CATALYSTS)},
    0x42: _one("control_unit_voltage", "V", 2, 0.001),
    0x43: _one("absolute_load", "%", 2, SHARE),
    0x44: _one("commanded_lambda", "", 2, 2 / 65536),
    0x45: _one("relative_throttle", "%", 1, SHARE),
    0x46: _one("outside_temperature", "degC", 1, 1, -40),
    0x47: _one("throttle_position_b", "%", 1, SHARE),
    0x48: _one("throttle_position_c", "%", 1, SHARE),
    0x49: _one("accelerator_position", "%", 1, SHARE),
    0x4A: _one("accelerator_position_e", "%", 1, SHARE),
    0x4B: _one("accelerator_position_f", "%", 1, SHARE),
    0x4C: _one("commanded_throttle", "%", 1, SHARE),
    0x4D: _one("time_with_lamp", "min", 2),
    0x4E: _one("time_since_cleared", "min", 2),
    0x4F: Pid(
        4,
        (
            Part("lambda_range"),
            Part("oxygen_sensor_voltage_range", "V", 1),
            Part("oxygen_sensor_current_range", "mA", 2),
            Part("manifold_pressure_range", "kPa", 3, 1, 10),
        ),
    ),
    0x50: Pid(4, (Part("air_flow_range", "g/s", 0, 1, 10),)),
    0x52: _one("ethanol_share", "%", 1, SHARE),
    0x53: _one("evaporative_pressure_absolute", "kPa", 2, 0.005),
    0x54: _one("evaporative_pressure", "Pa", 2, 1, 0, True),
    0x55: _banks("short_term_secondary_trim", 1),
    0x56: _banks("long_term_secondary_trim", 1),
    0x57: _banks("short_term_secondary_trim", 2),
    0x58: _banks("long_term_secondary_trim", 2),
    0x59: _one("fuel_rail_pressure_absolute", "kPa", 2, 10),
    0x5A: _one("relative_accelerator_position", "%", 1, SHARE),
    0x5B: _one("hybrid_battery_charge", "%", 1, SHARE),
    0x5C: _one("oil_temperature", "degC", 1, 1, -40),
    0x5D: _one("injection_timing", "deg", 2, 1 / 128, -210),
    0x5E: _one("fuel_rate", "l/h", 2, 0.05),
    0x61: _one("torque_demanded", "%", 1, 1, -125),
    0x62: _one("torque_actual", "%", 1, 1, -125),
    0x63: _one("torque_reference", "N m", 2),
    0x64: Pid(5, tuple(Part(f"torque_at_point_{i + 1}", "%", i, 1, 1, -125) for i in range(5))),
    0x66: _flagged(5, _numbered("air_flow_sensor", 2), "g/s", 2, 1 / 32),
    0x67: _flagged(3, _numbered("coolant_temperature_sensor", 2), "degC", 1, 1, -40),
    0x68: _flagged(3, _numbered("intake_air_temperature_sensor", 2), "degC", 1, 1, -40),
    0x78: _flagged(9, _numbered("exhaust_temperature_bank_1", 4), "degC", 2, 0.1, -40),
    0x79: _flagged(9, _numbered("exhaust_temperature_bank_2", 4), "degC", 2, 0.1, -40),
    0x7C: _flagged(9, _numbered("particulate_filter_temperature", 4), "degC", 2, 0.1, -40),
    0x7F: _flagged(13, ("engine_run_time", "engine_idle_time", "power_take_off_time"), "s", 4, 1),
    0x84: _one("manifold_surface_temperature", "degC", 1, 1, -40),
    0x87: _flagged(5, _numbered("manifold_pressure_sensor", 2), "kPa", 2, 1 / 32),
    0x8D: _one("throttle_position_g", "%", 1, SHARE),
    0x8E: _one("engine_friction", "%", 1, 1, -125),
    0x9D: Pid(4, (Part("engine_fuel_rate", "g/s", 0, 2, 0.02), Part("vehicle_fuel_rate", "g/s", 2, 2, 0.02))),
    0x9E: _one("exhaust_flow", "kg/h", 2, 0.2),
    0xA2: _one("cylinder_fuel_rate", "mg/stroke", 2, 1 / 32),
    0xA4: Pid(4, (Part("gear_ratio", "", 2, 2, 0.001),)),
    0xA6: _one("odometer", "km", 4, 0.1),
}

_FUEL_SYSTEM = {
    0: "off", 1: "open loop, engine cold", 2: "closed loop", 4: "open loop, load or overrun",
    8: "open loop, fault", 16: "closed loop, fault in a sensor",
}  # fmt: skip
_AIR = {1: "upstream", 2: "downstream of the catalyst", 4: "outside air or off", 8: "pump on for diagnosis"}
_STANDARD = {
    1: "OBD-II (CARB)", 2: "OBD (EPA)", 3: "OBD and OBD-II", 4: "OBD-I", 5: "none", 6: "EOBD",
    7: "EOBD and OBD-II",
}  # fmt: skip
_FUEL = {
    0: "none", 1: "petrol", 2: "methanol", 3: "ethanol", 4: "diesel", 5: "LPG", 6: "CNG", 7: "propane",
    8: "electric", 17: "hybrid petrol", 19: "hybrid diesel",
}  # fmt: skip
CODED: Mapping[int, tuple[tuple[str, Mapping[int, str]], ...]] = {
    0x03: (("fuel_system_1", _FUEL_SYSTEM), ("fuel_system_2", _FUEL_SYSTEM)),
    0x12: (("secondary_air", _AIR),),
    0x13: (("oxygen_sensors_present", {}),),
    0x1C: (("obd_standard", _STANDARD),),
    0x1D: (("oxygen_sensors_present_4_banks", {}),),
    0x1E: (("auxiliary_input", {0: "off", 1: "power take-off active"}),),
    0x51: (("fuel_type", _FUEL),),
    0x5F: (("emission_requirements", {}),),
}
"""Coded bytes: parameter -> for each byte its name and what its codes mean; others are given as their number."""
MONITORS = frozenset({0x01, 0x41})
FREEZE_CODE = 0x02
BITMAPS = frozenset(range(0x00, 0x100, 0x20))


def size_of(pid: int) -> int | None:
    """Number of data bytes; None where it is not known."""
    if pid in BITMAPS or pid in MONITORS:
        return 4
    if pid == FREEZE_CODE:
        return 2
    if pid in CODED:
        return len(CODED[pid])
    return PIDS[pid].size if pid in PIDS else None
