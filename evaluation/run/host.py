"""All services of a run on one in-process Zenoh session, stepped by the simulator. The services are those of production."""

import gc
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import msgspec

from app.drive.start import start_settings
from drivemcp.bus.session import Bus, open_bus
from drivemcp.config import BusConfig, ServiceConfig, settings_of
from drivemcp.errors import UserError
from drivemcp.node import Node
from drivemcp.registry import load_service
from drivemcp.service import Service
from evaluation.corruption.chance import chance
from evaluation.corruption.hosted import hosted, hosts
from evaluation.corruption.spec import read_spec
from evaluation.modelled_sensors.hosted import MODELLED, modelled
from evaluation.run.ready import RunError, wait_for_tools
from evaluation.run.spec import RunSpec
from evaluation.scenarios import generate, read_place
from evaluation.stand_ins.hosted import stood_in
from proto import topics
from proto.services import SERVICES
from proto.truth import ScenarioState
from services.simulator.scenario.load import ScenarioError
from services.simulator.scenario.plan import Scenario
from services.simulator.service import find_scenario

SOURCE = "simulator"
NOT_NEEDED = ("gateway", "player", "cockpit")
STALL_S = 120.0
"""Wall time without a step after which a run counts as stuck."""
_CAMERAS: Mapping[str, tuple[str, ...]] = {"rendered": ("front", "tele"), "model": ()}


def drive(
    spec: RunSpec,
    folder: Path,
    observe: Callable[[Node], None] = lambda node: None,
    wrapped: Callable[[Service[Any]], Service[Any]] = lambda service: service,
) -> ScenarioState:
    """Drive one run to its end; its log comes to `folder`. `observe` subscribes to what it wants to see, `wrapped` may look
    into a service before it starts.

    Raises RunError naming what went wrong, and UserError where the spec is the user's mistake.
    """
    with open_bus(BusConfig(mode="peer")) as bus:
        nodes: list[Node] = []
        try:
            for service in _services(spec):
                nodes.append(wrapped(service).start(bus, _config(service, spec, folder)))
            wait_for_tools(nodes)
            end = _watch(bus, observe, nodes)
            nodes.append(_start_source(bus, spec, folder))
            gc.freeze()  # what the services have read stays for all of the run: no collection need look through it
            return end()
        finally:
            gc.unfreeze()
            for node in reversed(nodes):
                node.close()


def _services(spec: RunSpec) -> list[Service[Any]]:
    """The services of a run but its source, in the order in which they start."""
    left_out = {SOURCE, *NOT_NEEDED, *spec.without}
    rows = sorted((row for row in SERVICES if row.name not in left_out), key=lambda row: row.start_order)
    return [_corrupted(_service(row.name, spec), spec) for row in rows]


def _service(name: str, spec: RunSpec) -> Service[Any]:
    service = load_service(name)
    return modelled(service) if spec.sensors == "model" else service


def _corrupted(service: Service[Any], spec: RunSpec) -> Service[Any]:
    service, corruption = stood_in(service, spec.stand_ins), read_spec(spec.corruption)
    return hosted(service, corruption) if service.name in hosts(corruption) else service


def _start_source(bus: Bus, spec: RunSpec, folder: Path) -> Node:
    service = _corrupted(load_service(SOURCE), spec)
    return service.start(bus, _config(service, spec, folder))


def _config(service: Service[Any], spec: RunSpec, folder: Path) -> ServiceConfig:
    settings: dict[str, Any] = {
        "lockstep": True,
        "modelled_ms": spec.modelled_ms,
        "out_dir": str(folder),
        **_defaults(service.name, spec, folder),
    }
    config: ServiceConfig = msgspec.convert(_over(settings, spec.settings.get(service.name, {})), service.config)
    return config


def _over(settings: Mapping[str, Any], wanted: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with those that are wanted; one within a group leaves the group's others as they are."""
    both = {key for key, value in wanted.items() if isinstance(value, dict) and isinstance(settings.get(key), dict)}
    return {**settings, **wanted, **{key: _over(settings[key], wanted[key]) for key in both}}


def _defaults(name: str, spec: RunSpec, folder: Path) -> dict[str, Any]:
    if name == "logger":
        return {"view": {"mode": "off"}, "secret_dir": str(folder / "secrets")}
    if name == SOURCE:
        return {
            **_drive(spec, folder),
            "seconds": spec.seconds,
            "cameras": _CAMERAS[spec.sensors],
            "lidar": spec.sensors == "rendered",
            "lidar_at_crossings": spec.sensors == "model",
        }
    scenario = _scenario(spec)
    start = settings_of(start_settings(scenario.country, scenario.driver_language)).get(name, {})
    return start | ({"seed": _drawn_by(spec)} if spec.sensors == "model" and name in MODELLED else {})


def _drawn_by(spec: RunSpec) -> int:
    """The seed of modelled sensors: of runs with the same seed on other routes they draw other chances.

    A scenario in a file draws by the file's name: where the file lies changes nothing.
    """
    route = spec.scenario if read_place(spec.scenario) is not None else Path(spec.scenario).stem
    return int(chance(spec.seed, route) * 2**31)


def _scenario(spec: RunSpec) -> Scenario:
    place = read_place(spec.scenario)
    try:
        return find_scenario(spec.scenario) if place is None else generate(place.family, place.number, place.split)
    except ScenarioError as error:
        raise UserError(str(error)) from error


def _drive(spec: RunSpec, folder: Path) -> dict[str, Any]:
    """Scenario and seed for the simulator; a generated scenario comes to `folder`."""
    place = read_place(spec.scenario)
    if place is None:
        return {"scenario": spec.scenario, "seed": spec.seed}
    folder.mkdir(parents=True, exist_ok=True)
    (file := folder / "scenario.json").write_bytes(msgspec.json.encode(_scenario(spec)))
    return {"scenario": str(file), "seed": place.world_seed(spec.seed)}


def _watch(bus: Bus, observe: Callable[[Node], None], nodes: list[Node]) -> Callable[[], ScenarioState]:
    """A node that looks on; returns the wait for the end."""
    changed, states, stepped_s = threading.Event(), list[ScenarioState](), [time.monotonic()]

    def on_state(state: ScenarioState, _: object) -> None:
        stepped_s[0] = time.monotonic()
        states.append(state)
        if state.finished or state.problem:
            changed.set()

    node = Node(bus, "evaluation", ServiceConfig())
    nodes.append(node)
    node.subscribe(topics.SCENARIO, on_state)
    observe(node)
    node.open(announce=False)

    def end() -> ScenarioState:
        while not changed.wait(1.0):
            if time.monotonic() - stepped_s[0] > STALL_S:
                raise RunError(
                    f"no step within {STALL_S:.0f} s; the last was at {states[-1].time_s if states else 0.0:.2f} s"
                )
        if states[-1].problem:
            raise RunError(states[-1].problem)
        return states[-1]

    return end
