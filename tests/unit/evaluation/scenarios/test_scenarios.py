"""Generated scenarios: sane in all layouts, apart between splits, and the check finds what is wrong."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.scenarios import FAMILIES, SPLITS, Family, Place, Split, generate, read_place
from evaluation.scenarios.__main__ import main
from evaluation.scenarios.check import faults
from evaluation.scenarios.generate import lay
from evaluation.scenarios.names import LAYOUTS
from evaluation.scenarios.through import drive_through
from services.simulator.scenario.plan import (
    CrosserPlan,
    HaltPlan,
    QueuePlan,
    Scenario,
    SignPlan,
    VehiclePlan,
    WaterPlan,
)

ALL = [Place(family, split, number) for family in FAMILIES for split in SPLITS for number in range(LAYOUTS)]
places = st.builds(Place, st.sampled_from(FAMILIES), st.sampled_from(SPLITS), st.integers(0, 10_000))


def made(place: Place) -> Scenario:
    return generate(place.family, place.number, place.split)


@pytest.mark.parametrize("family", FAMILIES)
def test_every_layout_is_sane(family: Family) -> None:
    assert [f"{place}: {fault}" for place in ALL if place.family == family for fault in faults(made(place))] == []


@given(places)
@settings(max_examples=40, deadline=None)
def test_so_is_any_number(place: Place) -> None:
    assert list(faults(made(place))) == []
    assert made(place) == made(place)
    assert read_place(str(place)) == place


@given(st.sampled_from(SPLITS), st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_a_sign_of_a_motorway_stands_on_both_sides_so_that_a_lorry_hides_no_more_than_one(
    split: Split, number: int
) -> None:
    assert {sign.side for sign in generate("dynamic-vsl", number, split).signs} <= {"both"}


@pytest.mark.parametrize("family", FAMILIES)
def test_all_layouts_of_a_family_differ(family: Family) -> None:
    layouts = [lay(family, number) for number in range(12 * LAYOUTS)]
    assert len({repr((each.road, each.signs, each.gantries)) for each in layouts}) == 12 * LAYOUTS


@given(places, places)
def test_no_two_places_of_a_family_have_the_same_layout(one: Place, other: Place) -> None:
    assert (one.layout == other.layout) == (one.split == other.split and one.number == other.number)


@given(places, places, st.integers(0, 10_000), st.integers(0, 10_000))
def test_splits_share_neither_layouts_nor_seeds(one: Place, other: Place, seed: int, another: int) -> None:
    if one.split != other.split:
        assert one.layout != other.layout
        assert one.world_seed(seed) != other.world_seed(another)


@pytest.mark.parametrize("split", SPLITS)
def test_every_split_has_every_hazard(split: Split) -> None:
    town, border, motorway = ([generate(family, number, split) for number in range(LAYOUTS)] for family in FAMILIES)
    for group in (town, border):
        assert any(each.hazard for plan in group for each in plan.crossers)
        assert any(each.stands_s for plan in group for each in plan.vehicles)
        assert any(halt.hazard for plan in group for each in plan.vehicles for halt in each.halts)
        assert any(each.cars for plan in group for each in plan.yields)
        assert any(plan.stops for plan in group)
    assert any("children" in sign.codes for plan in town for sign in plan.signs)
    assert any(plan.water for plan in town)
    assert len({plan.country for plan in border}) >= 5
    assert sum(plan.road.changeover_m is not None for plan in border) >= 4
    changes = [each.lane_change for plan in motorway for each in plan.vehicles if each.lane_change]
    assert {change.hazard for change in changes} == {True, False}
    assert any(plan.queues for plan in motorway)
    assert any(step.lanes for plan in motorway for gantry in plan.gantries for step in gantry.steps)
    for group in (town, border, motorway):
        assert {plan.daylight.sun_elevation_deg < -2.0 for plan in group} == {True, False}


def wet_sign(at_m: float, number: int) -> SignPlan:
    return SignPlan(at_m=at_m, codes=(f"limit:{number}", "plate:when_wet:de"))


WRONG: dict[str, tuple[Family, Callable[[Scenario], dict[str, object]]]] = {
    "ends nothing": ("urb-rain", lambda plan: {"signs": (*plan.signs, SignPlan(at_m=700.0, codes=("limit_end:80",)))}),
    "too near": ("urb-rain", lambda plan: {"signs": (*plan.signs, SignPlan(at_m=117.0, codes=("danger",)))}),
    "nothing more when wet": ("urb-rain", lambda plan: {"signs": (*plan.signs, wet_sign(600.0, 70))}),
    "at once": ("dynamic-vsl", lambda plan: {"signs": (*plan.signs, SignPlan(at_m=40.0, codes=("limit:30",)))}),
    "faster than a town": (
        "urb-rain",
        lambda plan: {"signs": tuple(s for s in plan.signs if "town_entry" not in s.codes)},
    ),
    "steps out": ("urb-rain", lambda plan: {"crossers": (CrosserPlan(at_m=300.0, when_ego_within_m=30.0),)}),
    "brakes too hard": (
        "urb-rain",
        lambda plan: {
            "vehicles": (VehiclePlan(at_m=50.0, speed_kmh=90.0, halts=(HaltPlan(at_m=200.0, brake_mps2=8.0),)),)
        },
    ),
    "behind no gantry": ("urb-rain", lambda plan: {"queues": (QueuePlan(tail_m=900.0),)}),
    "one floats": ("urb-rain", lambda plan: {"water": (WaterPlan(from_m=200.0, to_m=240.0, film_mm=20.0),)}),
    "stands": ("dynamic-vsl", lambda plan: {"vehicles": (VehiclePlan(at_m=900.0, speed_kmh=0.0, stands_s=9.0),)}),
    "m long": ("urb-rain", lambda plan: {"road": msgspec.structs.replace(plan.road, bends=plan.road.bends[:4])}),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_the_check_names_what_is_wrong(wrong: str) -> None:
    family, change = WRONG[wrong]
    plan = generate(family, 0, "development")
    assert any(wrong in fault for fault in faults(msgspec.structs.replace(plan, **change(plan))))


def test_a_plan_can_be_read_and_drawn(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["show", "urb-rain/development/0"]) == 0
    shown = capsys.readouterr().out
    assert "town_entry" in shown
    assert "!" in shown
    assert main(["show", "dynamic-vsl/development/0", "--svg", str(tmp_path / "plan.svg")]) == 0
    assert (tmp_path / "plan.svg").read_text().startswith("<svg")
    assert main(["show", "urb-rain/final/0"]) == 2


def test_a_folder_that_is_not_there_is_made_and_a_file_that_cannot_be_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "new" / "place.json"
    assert main(["write", "urb-rain/development/0", "--file", str(file)]) == 0
    assert msgspec.json.decode(file.read_bytes(), type=Scenario) == generate("urb-rain", 0, "development")
    assert main(["write", "urb-rain/development/0", "--file", str(file / "below")]) == 2
    assert f"--file {file / 'below'}: cannot be written: " in capsys.readouterr().err
    assert main(["show", "urb-rain/development/0", "--svg", str(tmp_path)]) == 2
    assert f"--svg {tmp_path}: cannot be written: " in capsys.readouterr().err


@pytest.mark.parametrize(
    "place", [Place("urb-rain", "development", 3), Place("cross-border", "development", 1)], ids=str
)
def test_a_driver_gets_through(place: Place) -> None:
    drive = drive_through(made(place), place.world_seed(1))
    assert drive.ended or drive.collision_s is not None
    assert drive.hazards


@pytest.mark.parametrize("number", [36, 46, 80, 91, 128])
def test_a_bend_as_long_as_its_block_leaves_a_straight_and_the_file_of_the_place_can_be_read(number: int) -> None:
    written = msgspec.json.encode(generate("dynamic-vsl", number, "test"))
    assert all(bend.length_m > 0.0 for bend in msgspec.json.decode(written, type=Scenario).road.bends)


@given(places)
def test_the_file_of_any_place_can_be_read(place: Place) -> None:
    scenario = generate(place.family, place.number, place.split)
    assert msgspec.json.decode(msgspec.json.encode(scenario), type=Scenario) == scenario
