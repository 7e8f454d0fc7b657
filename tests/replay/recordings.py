"""The drives that the lock was recorded from: `python -m tests.replay --record` drives them anew. Modelled sensors, 20 s each."""

import math
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple
from unittest.mock import patch

import msgspec

from app.replay.again import traces
from drivemcp.node import Node
from evaluation.guard.outcome import GUARD, place_of, prepared
from evaluation.run.grant import granted
from evaluation.run.host import drive
from evaluation.run.spec import RunSpec
from proto import topics
from proto.truth import ScenarioState
from services.simulator.driver.driver import Driver, DriverView, Wish, pedals
from tests.replay.files import LOGS, write_lines
from tests.replay.ticks import logged

SECONDS = 20.0
QUIET: dict[str, dict[str, Any]] = {"logger": {"pictures": "none"}}


class Recording(NamedTuple):
    """One drive: where, how, and what the driver says at which second."""

    scenario: str
    seed: int = 1
    settings: Mapping[str, dict[str, Any]] = MappingProxyType({})
    corruption: str = "clean"
    said: tuple[tuple[float, str, Mapping[str, Any]], ...] = ()
    """(second, tool, arguments)."""
    seconds: float = SECONDS
    absent_from_s: float = math.inf
    """From when on the driver holds his foot and his wheel as they are, whatever comes."""
    without: tuple[str, ...] = ()


def faults(*presets: str) -> dict[str, dict[str, Any]]:
    """Settings under which the car has these faults: PRESET@SECOND."""
    return {"simulator": {"faults": list(presets)}}


ABSENT: dict[str, dict[str, Any]] = {"simulator": {"driver": "absent"}}
QUESTIONS = (
    (2.0, "ask", {"question": "What does this sign mean?"}),
    (4.0, "ask", {"question": "Are we in mph now?"}),
    (6.0, "set_preferences", {"language": "de", "verbosity": "full", "tone": "friendly"}),
    (8.0, "ask", {"question": "Warum gilt jetzt ein anderes Limit?"}),
    (10.0, "feedback", {"label": "annoying"}),
    (12.0, "ask", {"question": "A warning light came on, is it safe to drive on?"}),
    (14.0, "set_preferences", {"unit": "mph", "language": "en", "muted": True}),
    (16.0, "ask", {"question": "How fast may I drive here?"}),
)
SENSORS = "blackout=0.1,freeze=0.1,lidar_loss=0.2,jitter_ms=30,dropout=0.2,seed=3"
SIGNS = "sign_miss=0.3,limit_misread=0.3,seed=5"
PROMPTED: dict[str, dict[str, Any]] = {
    "orchestrator": {"method": "direct", "method_settings": {"passages": 3}},
    "drivelm": {"whole_prompts": True},
}

RECORDINGS: Mapping[str, Recording] = {
    "town": Recording("urb-rain/calibration/3"),
    "town-with-words": Recording("urb-rain/test/540", seed=1541, seconds=158.0),
    "town-in-rain": Recording("urb-rain/calibration/5", seed=2),
    "border": Recording("cross-border"),
    "border-to-miles": Recording("cross-border/calibration/2", seed=2),
    "motorway-gantries": Recording("dynamic-vsl"),
    "motorway": Recording("dynamic-vsl/calibration/4", seed=3),
    "car-warns": Recording(
        "dynamic-vsl/calibration/6", settings=faults("low_tyre@3", "abs_fault@9", "headlamps_out@14")
    ),
    "car-must-stop": Recording(
        "urb-rain/calibration/7", settings=faults("slow_leak_fl@2", "oil_pressure@7", "brakes_hot@12")
    ),
    "signs-misread": Recording("urb-rain/calibration/8", seed=4, corruption=SIGNS),
    "sensors-fail": Recording("cross-border/calibration/5", seed=2, corruption=SENSORS),
    "questions": Recording("cross-border/calibration/7", settings=faults("overheat@9"), said=QUESTIONS),
    "absent-driver": Recording("urb-rain/calibration/2", seconds=40.0, absent_from_s=5.0),
    "passed-on": Recording(
        "urb-rain/calibration/2", seconds=30.0, absent_from_s=5.0, settings={"arbiter": {"filter": "none"}}
    ),
    "prompted": Recording("urb-rain/calibration/9", settings=PROMPTED),
    "emergency-car-from-side": Recording(place_of("car from the side", 50, "dry"), seconds=14.0, settings=ABSENT),
    "emergency-person": Recording(place_of("crossing person", 40, "wet"), seconds=14.0, settings=ABSENT),
    "no-arbiter": Recording("urb-rain/calibration/3", without=("arbiter", "weather")),
}


def record(name: str) -> None:
    """Drive one of them, and keep what its ticks were decided from."""
    wanted = RECORDINGS[name]
    spec = RunSpec(
        scenario=wanted.scenario, seed=wanted.seed, seconds=wanted.seconds, sensors="model", corruption=wanted.corruption,
        settings={**QUIET, **wanted.settings}, without=wanted.without,
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder, _absent(wanted.absent_from_s):
        permitted = prepared if spec.scenario.startswith(GUARD) else granted
        drive(permitted(spec, Path(folder)), Path(folder), _speaker(wanted))
        log = traces(sorted((Path(folder) / "logs").glob("*.mcap")))
        write_lines(LOGS / name / "inputs.jsonl.gz", (msgspec.to_builtins(logged(trace)) for trace in log))


@contextmanager
def _absent(from_s: float) -> Iterator[None]:
    drives = Driver.drive

    def hold(self: Driver, view: DriverView, dt: float) -> Wish:
        return drives(self, view, dt) if view.time_s < from_s else pedals(0.0)

    with patch.object(Driver, "drive", hold):
        yield


def _speaker(wanted: Recording) -> Callable[[Node], None]:
    """The driver's questions and labels, each once its second has come."""

    def observe(node: Node) -> None:
        waiting = list(wanted.said)

        def on_state(state: ScenarioState, _: object) -> None:
            while waiting and state.time_s >= waiting[0][0]:
                _, tool, arguments = waiting.pop(0)
                node.call(tool, dict(arguments), deadline_ms=600.0)

        node.subscribe(topics.SCENARIO, on_state)

    return observe
