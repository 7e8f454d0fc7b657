"""The table of populations: its windows, how outcomes are read, what was needed, and what holds."""

import json
from argparse import Namespace
from itertools import islice
from pathlib import Path
from typing import Any

import msgspec

from app.drive.screen import Screen
from drivemcp.cli import run
from evaluation.campaign.plan import DELTAS, RENDERED_ONLY
from evaluation.population import population, table
from evaluation.population.outcome import Contact, Outcome, name_of, outcome, run_driver, window_of
from evaluation.population.table import Driven
from evaluation.population.windows import Window, scenario_of, seed_of, windows
from evaluation.run.methods import ABLATIONS
from evaluation.run.spec import RunSpec
from evaluation.scenarios import Place
from proto.truth import TrueActor, Truth
from services.simulator.driver.kinds import DriverKind
from services.simulator.scenario.load import complaints
from services.simulator.world import World

WINDOW = Window(Place("urb-rain", "test", 0), 2)
LONG_S = 14.0


def truth(time_s: float, *actors: TrueActor, **fields: Any) -> Truth:
    return Truth(
        **{
            "time_s": time_s, "distance_m": 1500.0, "speed_mps": 10.0, "acceleration_mps2": 0.0, "law_limit_mps": None,
            "jurisdiction": "DEU", "mu": 0.8, "gap_m": None, "closing_mps": None, "actors": actors, **fields,
        }
    )  # fmt: skip


def actor(x_m: float, vx_mps: float, y_m: float = 0.0, vy_mps: float = 0.0) -> TrueActor:
    return TrueActor(
        actor_id=1, kind="vehicle", x_m=x_m, y_m=y_m, vx_mps=vx_mps, vy_mps=vy_mps, length_m=4.4, width_m=1.8
    )


def contact(time_s: float, kmh: float = 30.0, *, behind: bool = False) -> Contact:
    return Contact(time_s=time_s, kmh=kmh, behind=behind)


def driven(granted: tuple[Contact, ...], alone: tuple[Contact, ...] | None, began_s: float = 5.0) -> Driven:
    """A run with an intervention, and left alone; `alone` None: without an intervention."""
    if alone is None:
        return Driven(granted=Outcome(km=1.0, contacts=granted))
    return Driven(
        granted=Outcome(km=1.0, contacts=granted, interventions=(began_s,)),
        alone=(Outcome(km=1.0, contacts=alone),),
    )


def row(kind: DriverKind, where: table.Where, *runs: Driven) -> table.Row:
    return table.row_of(kind, "DriveMCP", where, runs, 0)


def test_in_every_window_a_driver_who_does_nothing_hits_somebody_before_its_end() -> None:
    for window, end_s in islice(windows(3), 3):
        plan = scenario_of(window)
        assert not list(complaints(plan))
        world = World(plan, seed_of(window.place), "absent")
        hits = [world.time_s for _ in range(round(end_s * 20)) if world.step().fact.collision]
        assert hits
        assert hits[0] < end_s


def test_a_window_is_named_as_a_run_names_its_scenario() -> None:
    assert window_of(name_of(WINDOW)) == WINDOW
    assert window_of("urb-rain/test/0") is None


def test_a_contact_tells_the_relative_speed_and_whether_it_came_from_behind() -> None:
    def found(*actors: TrueActor) -> Contact:
        (one,) = outcome([truth(0.0, *actors), truth(0.05, collision=True), truth(0.1, collision=True)], []).contacts
        return one

    assert found(actor(4.6, -5.0), actor(60.0, 0.0)) == contact(0.05, 18.0)
    assert found(actor(-4.6, 5.0)) == contact(0.05, 18.0, behind=True)
    assert found(actor(-1.0, -3.0, y_m=-2.0, vy_mps=4.0)) == contact(0.05, 18.0)


def test_commands_without_a_break_are_one_intervention() -> None:
    assert outcome([truth(0.0)], [1.0, 1.1, 1.2, 1.6, 3.0, 3.1]).interventions == (1.0, 3.0)


def test_an_intervention_was_needed_if_the_driver_left_alone_hits_somebody_soon() -> None:
    def needed(*contacts: Contact) -> bool:
        return table.is_needed(5.0, Outcome(km=1.0, contacts=contacts))

    assert needed(contact(9.0))
    assert not needed()
    assert not needed(contact(4.0))
    assert not needed(contact(5.0 + table.WITHIN_S + 0.1))
    assert not needed(contact(9.0, behind=True))


def test_what_a_driver_avoids_is_told_beside_what_is_hit_with_the_grant() -> None:
    found = row(
        "slow", "windows",
        driven((), (contact(8.0, 40.0),)), driven((contact(8.0, 10.0),), (contact(8.0, 30.0),)), driven((), None),
        driven((contact(7.0, 5.0, behind=True),), ()),
    )  # fmt: skip
    assert (found.hit_alone, found.hit, found.hit_behind) == (2, 1, 1)
    assert (found.contact_alone_kmh, found.contact_kmh) == (35.0, 5.0)
    assert (found.interventions, found.needed) == (3, 2)
    assert found.unneeded_per_1000_km is None


def test_verdicts_say_what_does_not_hold() -> None:
    avoided, hit = driven((), (contact(8.0),)), driven((contact(8.0, 20.0),), (contact(8.0),))
    assert row("absent", "windows", *[avoided] * 4, hit).verdict == "holds"
    assert row("absent", "windows", *[avoided] * 3, hit).verdict == "3 of 4 avoided"
    assert row("slow", "windows", avoided, hit).verdict == "holds"
    assert row("slow", "windows", hit).verdict == "contact speed not halved"
    assert row("slow", "windows", driven((), None)).verdict == ""
    assert row("attentive", "routes", driven((), None), avoided).verdict == "holds"
    assert row("attentive", "routes", driven((), ())).verdict == "1 not needed"


def test_on_routes_what_was_not_needed_is_told_by_distance() -> None:
    found = row("attentive", "routes", driven((), ()), driven((), None), driven((), (contact(8.0),)), driven((), None))
    assert found.unneeded_per_1000_km == 250.0
    assert found.unneeded_low is not None
    assert found.unneeded_high is not None
    assert found.unneeded_low < 250.0 < found.unneeded_high


def test_rows_of_a_table_are_driven_with_an_absent_driver_where_the_arbiter_acts(tmp_path: Path) -> None:
    flags = Namespace(population=[], by="delta", windows=1, quick=False, km=None, first=None, sensors="model")
    specs = population.specs_of(flags, tmp_path, Screen())
    assert {spec.settings["simulator"]["driver"] for spec in specs} == {"absent"}
    assert [spec.settings["arbiter"]["delta"] for spec in specs] == list(DELTAS)
    assert len({population.key_of(spec) for spec in specs}) == len(DELTAS)
    assert [spec.method for spec in specs] == [f"Delta {delta:g}" for delta in DELTAS]
    (left,) = population.alone(specs[0], Outcome(km=0.1, interventions=(5.0,)))
    assert left.settings["arbiter"]["delta"] == DELTAS[0]
    ablated = population.specs_of(Namespace(**{**vars(flags), "by": "ablation"}), tmp_path, Screen())
    assert {spec.method for spec in ablated} == set(ABLATIONS) - set(RENDERED_ONLY)


def spec_of(kind: DriverKind, **settings: Any) -> RunSpec:
    return RunSpec(
        scenario=name_of(WINDOW), seed=seed_of(WINDOW.place), seconds=LONG_S, sensors="model",
        settings={"simulator": {"driver": kind, **settings}},
    )  # fmt: skip


def test_left_alone_a_run_is_the_same_but_that_nothing_brakes_the_car(tmp_path: Path) -> None:
    granted = run_driver(str(tmp_path), "granted", spec_of("absent"))
    assert granted.interventions
    (alone, *_) = population.alone(spec_of("absent"), granted)
    left = run_driver(str(tmp_path), "alone", alone)
    assert table.is_needed(granted.interventions[0], left)
    assert left.interventions[0] == granted.interventions[0]
    assert sum(each.kmh for each in granted.contacts) < sum(each.kmh for each in left.contacts)


def test_the_table_is_written_from_runs_that_are_there(tmp_path: Path) -> None:
    """Each run's outcome is kept: with all of them there, nothing is driven."""
    out = tmp_path / "population"
    (runs := out / "runs").mkdir(parents=True)
    assert run(["evaluate", "results", "--windows", "2", "--out", str(tmp_path)]) == 2
    for kind in population.POPULATIONS:
        (window, end_s) = next(windows(1))
        granted = spec_of(kind)
        spec = msgspec.structs.replace(granted, scenario=name_of(window), seed=seed_of(window.place), seconds=end_s)
        began = Outcome(km=0.2, interventions=(5.0,))
        (left,) = population.alone(spec, began)
        (runs / f"{population.key_of(spec)}.json").write_bytes(msgspec.json.encode(began))
        hits = Outcome(km=0.1, contacts=(contact(7.0),))
        (runs / f"{population.key_of(left)}.json").write_bytes(msgspec.json.encode(hits))
    page = tmp_path / "page.md"
    assert run(["evaluate", "population", "--quick", "--out", str(tmp_path), "--docs", str(page)]) == 0
    told = json.loads((out / "population.json").read_text())
    assert [each["verdict"] for each in told["rows"]] == ["holds"] * len(population.POPULATIONS)
    assert "| absent | DriveMCP | windows | 1 |" in page.read_text()
    assert (out / "population.html").is_file()
    assert (out / "population.csv").read_text().count("\n") == len(told["rows"]) + 1
