"""The car's state as frames of its bus, by the DBC: each message at the cycle time that the DBC states."""

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from cantools.database import load_file

from proto.sensors import CanFrame
from services.simulator.car.state import PEDAL_MM, CarState

KPH = 3.6
DEG = 180.0 / math.pi
NS_PER_MS = 1_000_000
FULL_RAIN_MM_H = 30.0
"""Rain at which the rain sensor says all."""
MAX_CATCH_UP = 25
"""After a pause no more than this many frames of one message are made up for."""

Signals = dict[str, float]


_WHEELS = ("FL", "FR", "RL", "RR")
_LAMPS = {
    "LampEngine": "engine", "LampEngineFlashing": "engine_flashing", "LampAbs": "abs", "LampStability": "stability",
    "LampBrake": "brake", "LampTyre": "tyre", "LampCoolant": "coolant", "LampOil": "oil", "LampBattery": "battery",
    "LampFuel": "fuel", "LampSteering": "steering",
}  # fmt: skip


def _by_wheel(name: str, values: Iterable[float]) -> Signals:
    return {f"{name}{wheel}": value for wheel, value in zip(_WHEELS, values, strict=True)}


MESSAGES: Mapping[str, Callable[[CarState], Signals]] = {
    "WheelSpeeds": lambda s: _by_wheel("WheelSpeed", (each * KPH for each in s.wheel_speeds_mps)),
    "Motion": lambda s: {
        "VehicleSpeed": s.speed_mps * KPH,
        "LongitudinalAcceleration": s.acceleration_mps2,
        "YawRate": s.yaw_rate_radps * DEG,
        "VehicleSpeedValid": s.speed_known and not math.isnan(s.speed_mps),
    },
    "StabilityControl": lambda s: {
        "LateralAcceleration": s.lateral_acceleration_mps2,
        "AbsActive": s.abs_active,
        "EscActive": s.esc_active,
        "TractionControlActive": s.esc_active and s.accelerator > 0.05,
        "AbsFault": s.abs_fault,
        "EscFault": s.esc_fault,
        "EscSwitchedOff": s.esc_off,
    },
    "Brakes": lambda s: {
        "BrakePressure": s.brake_pressure_bar,
        "BrakePedalPosition": min(100.0, s.brake_pedal_travel_mm / PEDAL_MM * 100.0),
        "BrakePedalPressed": s.brake > 0.01,
        "BrakeFluidLow": s.brake_fluid_low,
        "BrakeLiningWorn": s.brake_lining_worn,
        "BrakeBoosterFault": s.brake_booster_fault,
        "ParkingBrake": s.parking_brake,
    },
    "BrakePedal": lambda s: {"BrakePedalTravel": s.brake_pedal_travel_mm},
    "Steering": lambda s: {
        "SteeringWheelAngle": s.steering_wheel_rad * DEG,
        "SteeringWheelRate": s.steering_wheel_rate_radps * DEG,
        "SteeringDriverTorque": 0.5 * s.steering_wheel_rad,
        "SteeringAssistFault": s.steering_assist_fault,
    },
    "DriverPedals": lambda s: {
        "AcceleratorPosition": s.accelerator * 100.0,
        "KickDown": s.accelerator > 0.98,
        "CruiseActive": 0,
        "CruiseSetSpeed": 0,
    },
    "Engine": lambda s: {
        "EngineSpeed": s.engine_rpm,
        "EngineTorque": s.engine_torque_nm,
        "ThrottlePosition": s.accelerator * 100.0,
        "EngineRunning": s.engine_running,
    },
    "EngineThermal": lambda s: {
        "CoolantTemperature": s.coolant_temperature_c,
        "OilTemperature": s.oil_temperature_c,
        "OilPressure": s.oil_pressure_bar,
        "FuelLevel": s.fuel_share * 100.0,
        "BatteryVoltage": s.battery_voltage_v,
        "IntakeAirTemperature": s.intake_temperature_c,
    },
    "Transmission": lambda s: {"Gear": s.gear, "TransmissionTemperature": s.oil_temperature_c - 10.0},
    "TyrePressures": lambda s: {
        **_by_wheel("TyrePressure", s.tyre_pressure_bar),
        **_by_wheel("TyreTemperature", s.tyre_temperature_c),
    },
    "BrakeTemperatures": lambda s: _by_wheel("BrakeTemperature", s.brake_temperature_c),
    "WarningLamps": lambda s: {signal: lamp in s.lamps for signal, lamp in _LAMPS.items()},
    "Body": lambda s: {
        "WiperStage": s.wiper_stage,
        "Washer": 0,
        "OutsideTemperature": s.outside_temperature_c,
        "Headlamps": s.headlamps,
        "FogLampFront": s.fog_front,
        "FogLampRear": s.fog_rear,
        "IndicatorLeft": s.indicator == "left",
        "IndicatorRight": s.indicator == "right",
        "HazardLights": s.indicator == "hazard",
        "BrakeLamps": s.braked > 0.01,
        "SeatbeltDriver": 1,
    },
    "Surroundings": lambda s: {
        "RainSensor": min(100.0, s.rain_mm_h / FULL_RAIN_MM_H * 100.0),
        "LightSensor": s.light_lx,
    },
    "Odometer": lambda s: {"TotalDistance": s.distance_km},
}


class _Place:
    """Where one signal lies in its message: its number as bits, little-endian. A value beyond the DBC's range is held
    at its edge, as a control unit would; one that is not a number is "not available", the highest raw value.
    """

    def __init__(self, signal: Any) -> None:
        if signal.byte_order != "little_endian":
            raise ValueError(f"{signal.name}: only little-endian signals are written")
        self.name: str = signal.name
        self.start: int = signal.start
        self._scale, self._offset = float(signal.scale), float(signal.offset)
        self._low, self._high = float(signal.minimum), float(signal.maximum)
        self._mask: int = (1 << signal.length) - 1
        self._unavailable: int = self._mask >> 1 if signal.is_signed else self._mask

    def bits(self, value: float) -> int:
        """The value as it stands in the message's number."""
        if value != value:
            return self._unavailable << self.start
        held = self._low if value < self._low else self._high if value > self._high else value
        return (round((held - self._offset) / self._scale) & self._mask) << self.start


def _crc8_table() -> bytes:
    table = list(range(256))
    for _ in range(8):
        table = [(each << 1 ^ 0x1D if each & 0x80 else each << 1) & 0xFF for each in table]
    return bytes(table)


_CRC8 = _crc8_table()


def crc8(data: bytes) -> int:
    """The checksum of the fast messages: CRC-8 SAE J1850 (polynomial 0x1D, start and final value 0xFF)."""
    check = 0xFF
    for each in data:
        check = _CRC8[check ^ each]
    return check ^ 0xFF


class _Cycle:
    """One message: when it is due next, its counter, and its checksum in the last byte."""

    def __init__(self, message: Any, signals: Callable[[CarState], Signals]) -> None:
        self.message, self.signals = message, signals
        self.frame_id: int = message.frame_id
        self.period_ns: int = message.cycle_time * NS_PER_MS
        places = [_Place(signal) for signal in message.signals]
        self._counter = next((each for each in places if each.name.endswith("Counter")), None)
        self._checked = any(each.name.endswith("Checksum") for each in places)
        self._places = [each for each in places if not each.name.endswith(("Counter", "Checksum"))]
        self._length: int = message.length
        self._state: CarState | None = None
        self._number = 0
        """The signals of `_state` as they stand in the message: frames of one step differ by their counter alone."""
        self.counter = 0
        self.next_ns: int | None = None

    def encode(self, state: CarState) -> bytes:
        """The message's bytes."""
        if state is not self._state:
            values = self.signals(state)
            self._state, self._number = state, sum([place.bits(values[place.name]) for place in self._places])
        number = self._number
        if self._counter is not None:
            number |= self._counter.bits(self.counter)
            self.counter = (self.counter + 1) % 16
        body = number.to_bytes(self._length - self._checked, "little")
        return body + bytes([crc8(body)]) if self._checked else body

    def due(self, state: CarState, now_ns: int) -> list[CanFrame]:
        if (
            self.next_ns is None
            or now_ns - self.next_ns > MAX_CATCH_UP * self.period_ns
            or self.next_ns > now_ns + self.period_ns
        ):
            self.next_ns = now_ns
        frames = []
        while self.next_ns <= now_ns:
            frames.append(CanFrame(stamp_ns=self.next_ns, arbitration_id=self.frame_id, data=self.encode(state)))
            self.next_ns += self.period_ns
        return frames


class FrameEncoder:
    """Every cyclic message of the DBC, due when its cycle time has passed."""

    def __init__(self, dbc: Path) -> None:
        database: Any = load_file(dbc)
        self._cycles = [_Cycle(database.get_message_by_name(name), signals) for name, signals in MESSAGES.items()]

    def encode(self, message: str, state: CarState) -> CanFrame:
        """One message at once, stamped 0."""
        cycle = next(each for each in self._cycles if each.message.name == message)
        return CanFrame(stamp_ns=0, arbitration_id=cycle.message.frame_id, data=cycle.encode(state))

    def due(self, state: CarState, now_ns: int, silent: frozenset[str] = frozenset()) -> list[CanFrame]:
        """The frames due up to `now_ns`, each stamped when it was due, in that order, but for the `silent` messages."""
        cycles = [cycle for cycle in self._cycles if cycle.message.name not in silent] if silent else self._cycles
        frames = [frame for cycle in cycles for frame in cycle.due(state, now_ns)]
        frames.sort(key=lambda frame: (frame.stamp_ns, frame.arbitration_id))
        return frames
