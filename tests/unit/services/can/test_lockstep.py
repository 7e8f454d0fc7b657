"""The simulated car, the CAN service and the Weather service in simulated time: two runs are one run."""

from typing import Any

import msgspec

from drivemcp.config import ServiceConfig
from drivemcp.paths import data
from drivemcp.testing import bus
from proto import topics
from proto.sensors import CanFrame, CanFrames, WeatherSensing
from services.can.service import SERVICE, CanConfig
from services.simulator.car.state import CarModel, Controls
from services.simulator.ecus.bank import EcuBank
from services.simulator.ecus.can_frames import FrameEncoder
from services.weather.service import SERVICE as WEATHER
from services.weather.service import WeatherConfig

STEP_NS = 50_000_000


def drive(steps: int, fault_at: int) -> list[bytes]:
    """Everything published in a run with an anti-lock fault, encoded."""
    log: list[bytes] = []
    model, encoder, ecus = CarModel(), FrameEncoder(data("vehicles/sim/sim.dbc")), EcuBank()
    with bus() as b:
        b.start(SERVICE, CanConfig(lockstep=True))
        b.start(WEATHER, WeatherConfig(lockstep=True))
        conductor = b.node("simulator", ServiceConfig(lockstep=True))
        asked: list[CanFrame] = []

        def note(message: msgspec.Struct, info: Any) -> None:
            log.append(msgspec.json.encode((info.stamp_ns, message)))

        conductor.subscribe(topics.EGO, note)
        conductor.subscribe(topics.DEGRADATION, note)
        conductor.subscribe(topics.CONDITIONS, note)
        conductor.subscribe(topics.CAN_TX, lambda message, info: asked.extend(message.frames), id="can0")
        for step in range(1, steps + 1):
            now_ns = step * STEP_NS
            conductor.set_clock(now_ns)
            if step == fault_at:
                ecus.activate("abs_fault")
            model.step(0.05, Controls(speed_mps=12.0 + step * 0.01, wiper_stage=2, outside_temperature_c=9.0))
            state = ecus.affect(model.state, now_ns)
            answers = [answer for frame in asked for answer in ecus.on_frame(frame, state, now_ns)]
            asked.clear()
            frames = encoder.due(state, now_ns) + answers + ecus.step(now_ns)
            conductor.publish(topics.CAN_RX, CanFrames(frames=tuple(frames)), id="can0")
            conductor.publish(
                topics.WEATHER_SENSING, WeatherSensing(rain_mm_h=12.0, visibility_m=1500.0, water_film_mm=0.3)
            )
            conductor.conduct_step(now_ns, {"can", "weather"})
    return log


def test_two_runs_publish_the_same_bytes_and_the_fault_is_found_with_its_code() -> None:
    first, second = drive(80, 30), drive(80, 30)
    assert first == second
    assert any(b'"dtcs":["C0035"]' in line for line in first)
    assert sum(b'"speed_mps"' in line for line in first) >= 75
