"""Lockstep: one order of handling, whatever the threads do."""

import pytest

from drivemcp.bus.lockstep import matches
from drivemcp.config import ServiceConfig
from drivemcp.errors import LockstepError
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import bus
from proto import topics
from proto.sensors import GnssFix, WeatherSensing
from proto.vehicle import Ego

STEP_NS = 50_000_000


def chain_service(log: list[str]) -> tuple[Service[ServiceConfig], Service[ServiceConfig]]:
    """`can` turns a position into ego; `orchestrator` notes what it sees, in order."""

    def build_can(config: ServiceConfig, node: Node) -> None:
        node.subscribe(topics.GNSS, lambda fix, info: node.publish(topics.EGO, Ego(speed_mps=fix.x_m)))

    def build_orchestrator(config: ServiceConfig, node: Node) -> None:
        node.subscribe(topics.EGO, lambda ego, info: log.append(f"ego {ego.speed_mps} at {info.stamp_ns}"))
        node.subscribe(topics.WEATHER_SENSING, lambda sensing, info: log.append(f"rain {sensing.rain_mm_h}"))
        node.every(0.1, lambda: log.append(f"timer at {node.clock.now_ns()}"))

    return Service("can", ServiceConfig, build_can), Service("orchestrator", ServiceConfig, build_orchestrator)


def drive(steps: int) -> list[str]:
    """The log of a run."""
    log: list[str] = []
    config = ServiceConfig(lockstep=True)
    with bus() as b:
        for service in chain_service(log):
            b.start(service, config)
        conductor = b.node("simulator", config)
        for step in range(1, steps + 1):
            now_ns = step * STEP_NS
            conductor.set_clock(now_ns)
            conductor.publish(topics.WEATHER_SENSING, WeatherSensing(rain_mm_h=float(step)))
            conductor.publish(topics.GNSS, GnssFix(x_m=float(step), y_m=0.0, heading_rad=0.0, sigma_m=1.0))
            conductor.conduct_step(now_ns, {"can", "orchestrator"})
    return log


def test_every_step_is_handled_whole_and_in_the_order_of_the_data() -> None:
    log = drive(4)
    assert log[:3] == ["rain 1.0", "ego 1.0 at 50000000", "rain 2.0"]  # the sensor before what was made of it
    assert [line for line in log if line.startswith("timer")] == ["timer at 100000000", "timer at 200000000"]


def test_two_runs_are_identical() -> None:
    assert drive(20) == drive(20)


def test_a_service_that_is_not_there_fails_the_run_and_is_named() -> None:
    with bus() as b, pytest.raises(LockstepError, match="weather"):
        b.node("simulator", ServiceConfig(lockstep=True)).conduct_step(STEP_NS, {"weather"})


def test_a_pattern_matches_chunk_by_chunk() -> None:
    assert matches("drivemcp/ego/can/*/rx", "drivemcp/ego/can/main/rx")
    assert not matches("drivemcp/ego/can/*/rx", "drivemcp/ego/can/ego")


def test_what_a_tool_publishes_when_called_through_another_counts_in_the_next_step() -> None:
    log: list[str] = []
    config = ServiceConfig(lockstep=True)

    def build_can(config: ServiceConfig, node: Node) -> None:
        node.subscribe(topics.WEATHER_SENSING, lambda sensing, info: log.append(f"rain {sensing.rain_mm_h}"))

    def build_weather(config: ServiceConfig, node: Node) -> None:
        @node.tool(deadline_ms=1000)
        def inner(rain_mm_h: float) -> dict[str, float]:
            """Publish what is asked for."""
            node.publish(topics.WEATHER_SENSING, WeatherSensing(rain_mm_h=rain_mm_h))
            return {}

    def build_rules(config: ServiceConfig, node: Node) -> None:
        @node.tool(deadline_ms=1000)
        def outer(rain_mm_h: float) -> dict[str, float]:
            """Ask another."""
            assert node.call("inner", {"rain_mm_h": rain_mm_h}, deadline_ms=1000.0).ok
            return {}

    def build_orchestrator(config: ServiceConfig, node: Node) -> None:
        def ask() -> None:
            assert node.call("outer", {"rain_mm_h": node.clock.now_ns() / STEP_NS}, deadline_ms=1000.0).ok

        node.every(0.05, ask)

    with bus() as b:
        b.start(Service("can", ServiceConfig, build_can), config)
        for name, build in (("weather", build_weather), ("rules", build_rules), ("orchestrator", build_orchestrator)):
            b.start(Service(name, ServiceConfig, build), config).client.discover()
        conductor = b.node("simulator", config)
        for step in range(1, 4):
            conductor.set_clock(step * STEP_NS)
            conductor.conduct_step(step * STEP_NS, {"can", "weather", "rules", "orchestrator"})
            log.append(f"step {step}")
    assert log == ["step 1", "rain 1.0", "step 2", "rain 2.0", "step 3"]
