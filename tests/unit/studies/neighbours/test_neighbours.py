"""Neighbours: highway-env's IDM and a governor by RSS in place of an assistant."""

import math
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from drivemcp.node import Node
from evaluation.campaign.plan import Amount, as_asked, latencies_of, rows_of, runs_of
from evaluation.campaign.store import Store
from evaluation.metrics.conflicts import braking_mps2, violates_rss
from evaluation.run.host import drive
from evaluation.run.methods import METHODS, applied
from evaluation.run.spec import RunSpec
from proto import topics
from proto.truth import TrueActor, Truth
from services.simulator.driver.driver import DriverView
from services.simulator.driver.profile import draw_driver
from studies.neighbours.__main__ import main
from studies.neighbours.drive import NEIGHBOURS, key_of, neighbour_truths, run_any
from studies.neighbours.following import Following, FollowingAll, Model
from studies.neighbours.governor import FASTEST_MPS, cap_mps, governed_mps2
from studies.neighbours.table import LABELS, cells, sheet, specs

ROOT = Path(__file__).parents[4]
SPEC = RunSpec(scenario="urb-rain/development/0", seed=5, seconds=4.0, sensors="model")
DT = 0.05


def truth(**fields: Any) -> Truth:
    told: dict[str, Any] = {
        "time_s": 1.0, "distance_m": 10.0, "speed_mps": 20.0, "acceleration_mps2": 0.0, "law_limit_mps": 50 / 3.6,
        "jurisdiction": "DEU", "mu": 0.8, "gap_m": None, "closing_mps": None,
    }  # fmt: skip
    return Truth(**{**told, **fields})


def person(x_m: float) -> TrueActor:
    return TrueActor(
        actor_id=1, kind="pedestrian", x_m=x_m, y_m=0.0, vx_mps=0.0, vy_mps=0.0, length_m=0.5, width_m=0.6, in_ego_path=True
    )  # fmt: skip


def view(speed_mps: float) -> DriverView:
    return DriverView(time_s=1.0, speed_mps=speed_mps, mu=0.8, wet=False)


def test_without_a_neighbour_the_run_is_the_no_assistant_run_of_all_services(tmp_path: Path) -> None:
    seen: list[Truth] = []

    def follow(node: Node) -> None:
        node.subscribe(topics.TRUTH, lambda message, _: seen.append(message))

    drive(applied(METHODS["No-assistant"], SPEC), tmp_path, follow)
    assert neighbour_truths(SPEC) == tuple(seen)


@pytest.mark.parametrize("label", NEIGHBOURS)
def test_a_neighbour_drives_the_same_place_and_comes_out_alike_again(label: str) -> None:
    runs = [neighbour_truths(SPEC, NEIGHBOURS[label]) for _ in range(2)]
    assert runs[0] == runs[1]
    human = neighbour_truths(SPEC)
    assert len(runs[0]) == len(human) == 80
    assert {actor.actor_id for actor in runs[0][0].actors} == {actor.actor_id for actor in human[0].actors}


def test_the_model_is_the_published_one_with_highway_envs_constants() -> None:
    model, (a, b, headway_s, stand_m) = Model(), (3.0, 5.0, 1.5, 5.0)
    assert model.acceleration_mps2(10.0, 20.0, None) == pytest.approx(a * (1 - 0.5**4))
    wanted_m = stand_m + 10.0 * headway_s + 10.0 * (10.0 - 6.0) / (2 * math.sqrt(a * b))
    # highway-env measures from centre to centre: a length of 5 m more in the wished gap and in the gap
    expected = a * (1 - 0.5**4) - a * ((wanted_m + 5.0) / (40.0 + 5.0)) ** 2
    assert model.acceleration_mps2(10.0, 20.0, (40.0, 6.0)) == pytest.approx(expected)


@pytest.mark.parametrize(
    "ahead", [{"actors": (person(25.0),)}, {"stop_kind": "red_light", "stop_distance_m": 20.0}], ids=["person", "light"]
)
def test_alone_it_sees_vehicles_only_and_with_people_and_lines_it_brakes_for_them(ahead: dict[str, Any]) -> None:
    wishes = []
    for kind in (Following, FollowingAll):
        driver = kind(profile=draw_driver(5), believed_mps=None)
        driver.truth = truth(speed_mps=12.0, **ahead)
        wishes.append(driver.drive(view(12.0), DT).acceleration_mps2)
    assert wishes[0] > 0.0
    assert wishes[1] < -3.0


gaps = st.one_of(st.none(), st.floats(0.0, 200.0))
leads = st.floats(-40.0, -0.1) | st.floats(0.0, 60.0)
frictions = st.floats(0.1, 1.0)


@given(gap_m=gaps, lead_mps=leads, mu=frictions, people=st.lists(st.floats(3.0, 160.0), max_size=2))
@example(gap_m=1.0, lead_mps=-2.220446049250313e-16, mu=1.0, people=[])
def test_at_the_cap_rss_holds_and_above_it_it_does_not(
    gap_m: float | None, lead_mps: float, mu: float, people: list[float]
) -> None:
    def at(speed_mps: float) -> Truth:
        closing = None if gap_m is None else speed_mps - lead_mps
        actors = tuple(person(x_m) for x_m in people)
        return truth(speed_mps=speed_mps, gap_m=gap_m, closing_mps=closing, mu=mu, actors=actors)

    cap = cap_mps(at(20.0))
    if cap > 0.0:
        assert not violates_rss(at(cap))
    if cap < FASTEST_MPS:
        assert violates_rss(at(cap + 1e-3))


@given(speed=st.floats(0.0, 60.0), gap_m=st.floats(0.0, 200.0), lead_mps=st.floats(0.0, 60.0), mu=frictions)
def test_the_governor_keeps_to_its_cap_or_brakes_as_hard_as_it_can(
    speed: float, gap_m: float, lead_mps: float, mu: float
) -> None:
    now = truth(speed_mps=speed, gap_m=gap_m, closing_mps=speed - lead_mps, mu=mu)
    most = governed_mps2(speed, now, DT)
    if most == math.inf:
        assert cap_mps(now) >= FASTEST_MPS, "nothing to keep to at any speed"
    else:
        assert speed + most * DT <= cap_mps(now) + 1e-9 or most == -braking_mps2(now)


def test_the_table_has_every_row_of_each_family_and_all_together() -> None:
    run = {
        "distance_m": 2500.0, "seconds": 250.0, "collisions": 0, "near_collisions": 1, "infractions_total": 2,
        "headway_median_s": 1.5, "hard_brakings": 0,
    }  # fmt: skip
    wreck = {**run, "collisions": 1, "seconds": 900.0}
    rows = cells({(family, label): [run, wreck] for family in ("urb-rain", "dynamic-vsl") for label in LABELS})
    assert [row.family for row in rows[-len(LABELS) :]] == ["all"] * len(LABELS)
    assert (rows[-1].runs, rows[-1].km, rows[-1].collisions) == (4, 10.0, 2)
    assert rows[0].values[-1].value == pytest.approx(100.0), "a wreck has no travel time"
    assert rows[0].values[2].value == pytest.approx(8.0), "4 infractions in 5 km"
    assert "| RSS governor | 2 | 5.0 |" in sheet(rows).markdown()


def test_runs_with_services_are_those_of_the_results_table_and_neighbours_have_keys_of_their_own(
    tmp_path: Path,
) -> None:
    store = Store(tmp_path)
    (ours,), (idm,) = (specs(label, ("urb-rain",), 1) for label in ("DriveMCP", "IDM alone"))
    assert key_of(ours, store) == store.key(ours)
    assert len({key_of(ours, store), key_of(idm, store), store.key(idm)}) == 3


def test_latencies_and_settings_make_them_those_of_a_results_table_with_the_same() -> None:
    latencies, quiet = (
        latencies_of(str(ROOT / "docs/results/measured/results/latencies.json")),
        ["logger.pictures=none"],
    )
    (ours,) = specs("DriveMCP", ("urb-rain",), 1, 0.0, latencies, quiet)
    rows = [
        msgspec.structs.replace(row, spec=as_asked(row.spec, latencies, quiet)) for row in rows_of("results", "model")
    ]
    assert ours in [run.spec for run in runs_of(rows, Amount(runs=1))]
    (idm,) = specs("IDM alone", ("urb-rain",), 1, 0.0, latencies, quiet)
    assert (idm.modelled_ms, idm.settings) == ({}, {})


def test_a_neighbours_run_is_measured_and_kept(tmp_path: Path) -> None:
    store, spec = Store(tmp_path), msgspec.structs.replace(SPEC, method="RSS governor", seconds=2.0)
    key = key_of(spec, store)
    kept = run_any(str(tmp_path), key, spec)
    assert kept.metrics["seconds"] == pytest.approx(2.0)
    assert kept.metrics["distance_m"] > 10.0
    assert kept.metrics["messages"] == 0
    again = Store(tmp_path).kept(key)
    assert again is not None
    assert again.metrics == msgspec.json.decode(msgspec.json.encode(kept.metrics))


@pytest.mark.parametrize(
    "wrong", [("--runs", "0"), ("--jobs", "0"), ("--seconds", "-1"), ("--seconds", "nan"), ("--seconds", "inf")]
)
def test_amounts_that_are_none_are_refused(wrong: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([*wrong])
    assert ended.value.code == 2
    assert f"{wrong[0]}: {wrong[1]!r} is no " in capsys.readouterr().err


def test_settings_that_no_run_would_take_are_refused_before_anything_is_driven(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--out", str(tmp_path / "out"), "--set", "arbiter.nosuch=1"]) == 2
    assert "--set arbiter: Object contains unknown field `nosuch`" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
