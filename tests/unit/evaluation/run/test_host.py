"""A run in one process: the services of production, in lockstep."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from drivemcp.errors import UserError
from drivemcp.node import Node
from evaluation.run.host import drive
from evaluation.run.spec import RunSpec, run_key
from evaluation.scenarios import generate
from proto import topics
from proto.decision import Advisory
from proto.truth import Truth
from services.logger.verification.verifier import verify
from services.simulator.scenario.load import load_scenario

SPEC = RunSpec(scenario="dynamic-vsl", seed=3, seconds=1.5)


class Seen:
    def __init__(self) -> None:
        self.advisories: list[Advisory] = []
        self.truths: list[Truth] = []

    def follow(self, node: Node) -> None:
        node.subscribe(topics.ADVISORY, lambda message, _: self.advisories.append(message))
        node.subscribe(topics.TRUTH, lambda message, _: self.truths.append(message))


def test_runs_of_one_spec_come_to_their_end_and_come_out_alike(tmp_path: Path) -> None:
    told = []
    for name in ("a", "b"):
        seen = Seen()
        state = drive(SPEC, tmp_path / name, seen.follow)
        assert state.finished
        assert len(seen.truths) == 30, "20 steps a second"
        assert len(seen.advisories) >= 14, "one a picture"
        (log,) = (tmp_path / name).glob("**/*.mcap")
        assert verify(log).intact
        told.append([msgspec.json.encode(each) for each in seen.advisories])
    assert told[0] == told[1]


def test_an_unknown_scenario_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="nowhere"):
        drive(RunSpec(scenario="nowhere"), tmp_path)


def test_the_key_tells_runs_apart() -> None:
    others: list[dict[str, Any]] = [
        {"seed": 4},
        {"corruption": "sign_miss=0.1"},
        {"settings": {"arbiter": {"delta": 0.1}}},
    ]
    keys = {
        run_key(SPEC),
        run_key(SPEC, "models"),
        *(run_key(msgspec.structs.replace(SPEC, **each)) for each in others),
    }
    assert len(keys) == 5
    assert run_key(SPEC) == run_key(msgspec.convert(msgspec.to_builtins(SPEC), RunSpec))


def test_a_generated_scenario_is_driven_and_kept_beside_the_log(tmp_path: Path) -> None:
    state = drive(msgspec.structs.replace(SPEC, scenario="urb-rain/development/3", seconds=0.5), tmp_path)
    assert state.finished
    assert state.scenario == "urb-rain-development-3"
    assert load_scenario(tmp_path / "scenario.json") == generate("urb-rain", 3, "development")


def test_the_driver_is_spoken_to_in_his_own_language(tmp_path: Path) -> None:
    spec = msgspec.structs.replace(SPEC, scenario="urb-rain/test/0", seconds=0.5, sensors="model")
    german, english = Seen(), Seen()
    # a preference of the user's leaves the others as they are
    drive(
        msgspec.structs.replace(spec, settings={"orchestrator": {"preferences": {"unit": "mph"}}}),
        tmp_path / "de",
        german.follow,
    )
    drive(msgspec.structs.replace(spec, scenario="urb-rain/test/1"), tmp_path / "en", english.follow)
    assert {truth.driver_language for truth in german.truths} == {"de"}
    assert {(each.language, each.unit) for each in german.advisories} == {("de", "mph")}
    assert any("Gesetzliches Limit" in each.justification for each in german.advisories)
    assert {truth.driver_language for truth in english.truths} == {"en"}
    assert {(each.language, each.unit) for each in english.advisories} == {("en", "km/h")}


@pytest.mark.parametrize(("name", "wrong"), [("urb-rain/final/3", "final"), ("urb-rain/test/x", "'x'")])
def test_a_generated_scenario_that_is_not_there_is_named(tmp_path: Path, name: str, wrong: str) -> None:
    with pytest.raises(UserError, match=wrong):
        drive(msgspec.structs.replace(SPEC, scenario=name), tmp_path)
