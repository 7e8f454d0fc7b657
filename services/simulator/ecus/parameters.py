"""The parameters of each simulated control unit, by SAE J1979's formulas, inverted."""

from collections.abc import Callable, Mapping

from services.simulator.car.state import CarState

ENGINE, TRANSMISSION, BRAKES, BODY, TEST_UNIT = 0x7E0, 0x7E1, 0x7E2, 0x7E3, 0x7E7
UNITS: Mapping[int, str] = {ENGINE: "engine", TRANSMISSION: "transmission", BRAKES: "brakes", BODY: "body"}
ADDRESSES: Mapping[int, int] = {ENGINE: 0x10, TRANSMISSION: 0x18, BRAKES: 0x28, BODY: 0x40}
"""Of 29-bit ids (ISO 15765-4 gives engine and transmission theirs)."""

DISPLACEMENT_L, PEAK_TORQUE_NM, AIR_KG_M3 = 1.5, 220.0, 1.2
GEAR_RATIOS = (0.0, 3.6, 2.1, 1.4, 1.05, 0.83, 0.69)

Say = Callable[[CarState], bytes]


def byte(value: float) -> bytes:
    """One byte, kept within its range."""
    return bytes([min(255, max(0, round(value)))])


def word(value: float) -> bytes:
    """Two bytes, kept within their range."""
    return min(65535, max(0, round(value))).to_bytes(2, "big")


def load(state: CarState) -> float:
    """Share of the engine's torque that is used."""
    return min(1.0, abs(state.engine_torque_nm) / PEAK_TORQUE_NM)


def manifold_kpa(state: CarState) -> float:
    """Throttled at idle, nearly the air's pressure at full load."""
    return 32.0 + 66.0 * load(state)


def air_g_per_s(state: CarState) -> float:
    """Every second turn fills the cylinders once, as full as the manifold's pressure."""
    return state.engine_rpm / 120.0 * DISPLACEMENT_L * AIR_KG_M3 * manifold_kpa(state) / 101.0


def _share(value: float) -> bytes:
    return byte(value * 255)


_ENGINE: Mapping[int, Say] = {
    0x03: lambda s: bytes([2 if s.coolant_temperature_c > 60.0 else 1, 0]),
    0x04: lambda s: _share(load(s)),
    0x05: lambda s: byte(s.coolant_temperature_c + 40),
    0x06: lambda s: byte(128),
    0x07: lambda s: byte(130),
    0x0B: lambda s: byte(manifold_kpa(s)),
    0x0C: lambda s: word(s.engine_rpm * 4),
    0x0D: lambda s: byte(s.speed_mps * 3.6),
    0x0E: lambda s: byte((10.0 + 15.0 * (1.0 - load(s)) + 64) * 2),
    0x0F: lambda s: byte(s.intake_temperature_c + 40),
    0x10: lambda s: word(air_g_per_s(s) * 100),
    0x11: lambda s: _share(s.accelerator),
    0x13: lambda s: bytes([0b0011]),
    0x14: lambda s: byte(0.45 / 0.005) + byte(128),
    0x15: lambda s: byte(0.62 / 0.005) + b"\xff",
    0x1C: lambda s: byte(6),
    0x1F: lambda s: word(s.run_time_s),
    0x2F: lambda s: _share(s.fuel_share),
    0x33: lambda s: byte(101),
    0x3C: lambda s: word((420.0 + 300.0 * load(s) + 40) * 10),
    0x42: lambda s: word(s.battery_voltage_v * 1000),
    0x43: lambda s: word(load(s) * 255),
    0x44: lambda s: word(32768),
    0x45: lambda s: _share(s.accelerator),
    0x46: lambda s: byte(s.outside_temperature_c + 40),
    0x47: lambda s: _share(s.accelerator),
    0x49: lambda s: _share(s.accelerator),
    0x4A: lambda s: _share(s.accelerator / 2),
    0x4C: lambda s: _share(s.accelerator),
    0x51: lambda s: byte(1),
    0x5C: lambda s: byte(s.oil_temperature_c + 40),
    0x61: lambda s: byte(s.engine_torque_nm / PEAK_TORQUE_NM * 100 + 125),
    0x62: lambda s: byte(s.engine_torque_nm / PEAK_TORQUE_NM * 100 + 125),
    0x63: lambda s: word(PEAK_TORQUE_NM),
    0x67: lambda s: b"\x01" + byte(s.coolant_temperature_c + 40) + b"\x00",
    0xA6: lambda s: round(s.distance_km * 10).to_bytes(4, "big"),
}
_TRANSMISSION: Mapping[int, Say] = {
    0x1C: lambda s: byte(6),
    0x42: lambda s: word(s.battery_voltage_v * 1000),
    0xA4: lambda s: bytes([0x02, s.gear << 4]) + word(GEAR_RATIOS[min(s.gear, 6)] * 1000),
}
PARAMETERS: Mapping[int, Mapping[int, Say]] = {ENGINE: _ENGINE, TRANSMISSION: _TRANSMISSION, BRAKES: {}, BODY: {}}

# Identifiers of ISO 14229 beside the parameters as F4xx: text of each unit, and the unit's own measurements.
OWN: Mapping[int, Mapping[int, Say]] = {
    ENGINE: {},
    TRANSMISSION: {0x0201: lambda s: bytes([s.gear])},
    BRAKES: {
        0x0201: lambda s: b"".join(word(each * 100) for each in s.wheel_speeds_mps),
        0x0202: lambda s: word(s.brake_pressure_bar * 100),
    },
    BODY: {
        0x0201: lambda s: b"".join(byte(each / 0.02) for each in s.tyre_pressure_bar),
        0x0202: lambda s: bytes([s.wiper_stage, s.headlamps]),
    },
}
LOCKED = frozenset({0x0100})
"""Coding: read after security access only, which is never given."""


def code_bytes(code: str) -> bytes:
    """A trouble code as the two bytes on the bus: P0300 is 03 00."""
    return bytes(["PCBU".index(code[0]) << 6 | int(code[1]) << 4 | int(code[2], 16), int(code[3:], 16)])


def unit_of(code: str) -> int:
    """Which unit stores a code."""
    if code.startswith("P07"):
        return TRANSMISSION
    return {"C": BRAKES, "B": BODY}.get(code[0], ENGINE)


def bitmap(base: int, known: set[int]) -> bytes:
    """Of parameters base + 1 to base + 32; the last bit says that a further bitmap follows."""
    bits = sum(1 << (32 - (pid - base)) for pid in known if base < pid <= base + 32)
    if any(pid > base + 32 for pid in known):
        bits |= 1
    return bits.to_bytes(4, "big")
