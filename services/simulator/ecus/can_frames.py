"""The car's state as frames of its bus, by the DBC: each message at the cycle time that the DBC states."""

import math
from collections.abc import Callable, Mapping
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


def _wheels(state: CarState) -> Signals:
    return {
        f"WheelSpeed{wheel}": value * KPH
        for wheel, value in zip(("FL", "FR", "RL", "RR"), state.wheel_speeds_mps, strict=True)
    }


def _motion(state: CarState) -> Signals:
    return {
        "VehicleSpeed": state.speed_mps * KPH,
        "LongitudinalAcceleration": state.acceleration_mps2,
        "YawRate": state.yaw_rate_radps * DEG,
        "VehicleSpeedValid": state.speed_known and not math.isnan(state.speed_mps),
    }


def _stability(state: CarState) -> Signals:
    return {
        "LateralAcceleration": state.lateral_acceleration_mps2,
        "AbsActive": state.abs_active,
        "EscActive": state.esc_active,
        "TractionControlActive": state.esc_active and state.accelerator > 0.05,
        "AbsFault": state.abs_fault,
        "EscFault": state.esc_fault,
        "EscSwitchedOff": state.esc_off,
    }


def _brakes(state: CarState) -> Signals:
    return {
        "BrakePressure": state.brake_pressure_bar,
        "BrakePedalPosition": min(100.0, state.brake_pedal_travel_mm / PEDAL_MM * 100.0),
        "BrakePedalPressed": state.brake > 0.01,
        "BrakeFluidLow": state.brake_fluid_low,
        "BrakeLiningWorn": state.brake_lining_worn,
        "BrakeBoosterFault": state.brake_booster_fault,
        "ParkingBrake": state.parking_brake,
    }


def _pedal(state: CarState) -> Signals:
    return {"BrakePedalTravel": state.brake_pedal_travel_mm}


def _steering(state: CarState) -> Signals:
    return {
        "SteeringWheelAngle": state.steering_wheel_rad * DEG,
        "SteeringWheelRate": state.steering_wheel_rate_radps * DEG,
        "SteeringDriverTorque": 0.5 * state.steering_wheel_rad,
        "SteeringAssistFault": state.steering_assist_fault,
    }


def _pedals(state: CarState) -> Signals:
    return {
        "AcceleratorPosition": state.accelerator * 100.0,
        "KickDown": state.accelerator > 0.98,
        "CruiseActive": 0,
        "CruiseSetSpeed": 0,
    }


def _engine(state: CarState) -> Signals:
    return {
        "EngineSpeed": state.engine_rpm,
        "EngineTorque": state.engine_torque_nm,
        "ThrottlePosition": state.accelerator * 100.0,
        "EngineRunning": state.engine_running,
    }


def _thermal(state: CarState) -> Signals:
    return {
        "CoolantTemperature": state.coolant_temperature_c,
        "OilTemperature": state.oil_temperature_c,
        "OilPressure": state.oil_pressure_bar,
        "FuelLevel": state.fuel_share * 100.0,
        "BatteryVoltage": state.battery_voltage_v,
        "IntakeAirTemperature": state.intake_temperature_c,
    }


def _transmission(state: CarState) -> Signals:
    return {"Gear": state.gear, "TransmissionTemperature": state.oil_temperature_c - 10.0}


def _tyres(state: CarState) -> Signals:
    signals: Signals = {}
    for index, wheel in enumerate(("FL", "FR", "RL", "RR")):
        signals[f"TyrePressure{wheel}"] = state.tyre_pressure_bar[index]
        signals[f"TyreTemperature{wheel}"] = state.tyre_temperature_c[index]
    return signals


def _discs(state: CarState) -> Signals:
    return {
        f"BrakeTemperature{wheel}": value
        for wheel, value in zip(("FL", "FR", "RL", "RR"), state.brake_temperature_c, strict=True)
    }


def _lamps(state: CarState) -> Signals:
    names = {
        "LampEngine": "engine",
        "LampEngineFlashing": "engine_flashing",
        "LampAbs": "abs",
        "LampStability": "stability",
        "LampBrake": "brake",
        "LampTyre": "tyre",
        "LampCoolant": "coolant",
        "LampOil": "oil",
        "LampBattery": "battery",
        "LampFuel": "fuel",
        "LampSteering": "steering",
    }
    return {signal: lamp in state.lamps for signal, lamp in names.items()}


def _body(state: CarState) -> Signals:
    return {
        "WiperStage": state.wiper_stage,
        "Washer": 0,
        "OutsideTemperature": state.outside_temperature_c,
        "Headlamps": state.headlamps,
        "FogLampFront": state.fog_front,
        "FogLampRear": state.fog_rear,
        "IndicatorLeft": state.indicator == "left",
        "IndicatorRight": state.indicator == "right",
        "HazardLights": state.indicator == "hazard",
        "BrakeLamps": state.braked > 0.01,
        "SeatbeltDriver": 1,
    }


def _surroundings(state: CarState) -> Signals:
    return {"RainSensor": min(100.0, state.rain_mm_h / FULL_RAIN_MM_H * 100.0), "LightSensor": state.light_lx}


def _odometer(state: CarState) -> Signals:
    return {"TotalDistance": state.distance_km}


MESSAGES: Mapping[str, Callable[[CarState], Signals]] = {
    "WheelSpeeds": _wheels,
    "Motion": _motion,
    "StabilityControl": _stability,
    "Brakes": _brakes,
    "BrakePedal": _pedal,
    "Steering": _steering,
    "DriverPedals": _pedals,
    "Engine": _engine,
    "EngineThermal": _thermal,
    "Transmission": _transmission,
    "TyrePressures": _tyres,
    "BrakeTemperatures": _discs,
    "WarningLamps": _lamps,
    "Body": _body,
    "Surroundings": _surroundings,
    "Odometer": _odometer,
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
