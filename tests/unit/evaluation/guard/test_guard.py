"""The table of what the guard avoids alone: its cells, how outcomes are read, and what holds."""

import json
from pathlib import Path
from typing import Any

import pytest

from drivemcp.cli import run
from evaluation.guard import guard, table
from evaluation.guard.outcome import Outcome, Told, cell_of, outcome, place_of, run_cell
from evaluation.guard.scenes import GROUNDS, SCENES, scenario
from proto.decision import BrakeCommand
from proto.truth import Truth
from services.simulator.scenario.load import complaints
from services.simulator.world import World

SECOND = 10**9


def truth(time_s: float, speed_mps: float, **fields: Any) -> Truth:
    return Truth(
        **{
            "time_s": time_s, "distance_m": 0.0, "speed_mps": speed_mps, "acceleration_mps2": 0.0, "law_limit_mps": None,
            "jurisdiction": "DEU", "mu": 0.8, "gap_m": None, "closing_mps": None, **fields,
        }
    )  # fmt: skip


def ended(**fields: Any) -> Outcome:
    return Outcome(**{"impact_kmh": 0.0, "physics_kmh": 0.0, "braked": True, **fields})


@pytest.mark.parametrize("name", sorted(SCENES))
@pytest.mark.parametrize("ground", GROUNDS)
def test_every_cell_is_a_scenario_that_can_be_driven(name: str, ground: str) -> None:
    for speed in SCENES[name].speeds:
        plan = scenario(SCENES[name], speed, ground)  # type: ignore[arg-type]
        assert not list(complaints(plan))
        world = World(plan, 1, "absent")
        assert world.step().ego.speed_mps == pytest.approx(speed / 3.6, abs=0.2)


def test_a_cell_is_named_as_a_run_names_its_scenario() -> None:
    assert cell_of(place_of("standing car", 40, "weak brakes")) == ("standing car", 40, "weak brakes")


def test_nobody_is_hit_while_nothing_brakes_where_nothing_threatens_and_somebody_is_where_something_does() -> None:
    for scene in SCENES.values():
        speed = scene.quick[0]
        world = World(scenario(scene, speed, "dry"), 1, "absent")
        steps = round(scene.seconds(speed / 3.6) * 20)
        hit = any(world.step().fact.collision for _ in range(steps))
        assert hit == (scene.kind == "avoid"), scene.name


def test_an_impact_is_read_at_the_step_before_contact() -> None:
    truths = [
        (0, truth(0.0, 10.0, gap_m=5.0, closing_mps=4.0)),
        (SECOND, truth(0.05, 9.0, gap_m=0.1, closing_mps=3.0)),
        (2 * SECOND, truth(0.1, 2.0, gap_m=0.0, closing_mps=1.0, collision=True)),
    ]
    command = BrakeCommand(deceleration_mps2=6.0, jerk_mps3=10.0, grant_id="g")
    found = outcome(Told(truths, [], [], [(SECOND, command)]))
    assert found.impact_kmh == pytest.approx(10.8)
    assert found.braked
    assert found.demanded_mps2 == 6.0
    assert found.warned_s is None


def test_a_run_of_the_same_seed_comes_out_alike_wherever_it_is_written(tmp_path: Path) -> None:
    (spec,) = guard.specs_of(("moving car", 40, "dry"), 1, "model")
    found = []
    for name in ("one", "other"):
        (folder := tmp_path / name).mkdir()
        found.append(run_cell(str(folder), "key", spec))
    assert found[0] == found[1]
    assert found[0].braked


def test_verdicts_say_what_does_not_hold() -> None:
    def verdict(scene: str, speed: int, ground: str, *outcomes: Outcome) -> str:
        return table.cell_of(scene, speed, ground, outcomes, 0).verdict  # type: ignore[arg-type]

    assert verdict("standing car", 40, "dry", ended()) == "holds"
    assert verdict("standing car", 40, "dry", ended(), ended(impact_kmh=0.4)) == "harder than permitted"
    assert verdict("standing car", 60, "dry", ended(impact_kmh=30.0)) == "holds"
    assert verdict("standing car", 60, "wet", ended(impact_kmh=9.0, physics_kmh=5.0)) == "holds"
    assert (
        verdict("standing car", 60, "wet", ended(impact_kmh=11.0, physics_kmh=5.0)) == "more than 5 km/h above physics"
    )
    assert verdict("manhole", 50, "dry", ended(braked=False)) == "holds"
    assert verdict("manhole", 50, "dry", ended()) == "false reaction"
    assert verdict("cut-in", 50, "dry", ended()) == ""
    assert verdict("standing car", 40, "dry") == ""


def test_the_table_is_written_from_runs_that_are_there(tmp_path: Path) -> None:
    """Each run's outcome is kept: with all of them there, nothing is driven."""
    runs = tmp_path / "guard" / "runs"
    runs.mkdir(parents=True)
    specs = [spec for place in guard.places(True) for spec in guard.specs_of(place, 1, "model")]
    for spec in specs:
        kind = SCENES[cell_of(spec.scenario)[0]].kind
        (runs / f"{guard.key_of(spec)}.json").write_text(
            json.dumps({"impact_kmh": 0.0, "physics_kmh": 0.0, "braked": kind == "avoid"})
        )
    page = tmp_path / "page.md"
    assert run(["evaluate", "guard", "--quick", "--out", str(tmp_path), "--docs", str(page)]) == 0
    told = json.loads((tmp_path / "guard" / "guard.json").read_text())
    assert len(told["cells"]) == len(guard.places(True))
    assert {cell["verdict"] for cell in told["cells"]} == {"holds", ""}
    assert "| standing car | dry | 40 |" in page.read_text()
    assert (tmp_path / "guard" / "guard.html").is_file()
    assert (tmp_path / "guard" / "guard.csv").read_text().count("\n") == len(told["cells"]) + 1


def test_seeds_are_for_this_table_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", "results", "--seeds", "2", "--out", str(tmp_path)]) == 2
    assert "--seeds: the table results has none" in capsys.readouterr().err
