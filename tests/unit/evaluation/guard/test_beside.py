"""What is put beside the guard: by what it brakes, and that it brakes in the arbiter's place."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.rss import GRAVITY_MPS2
from drivemcp.cli import run
from evaluation.guard import guard, table
from evaluation.guard.beside import BESIDE, IDM_BRAKING_MPS2, idm_mps2, rss_mps2
from evaluation.guard.outcome import Outcome, run_cell
from proto.perception import Track
from services.arbiter.assessment.assess import View
from services.arbiter.profiles.profile import load

PROFILE = load("calibrated")
MU = 0.7


def lead(gap_m: float, closing_mps: float, confidence: float = 0.9) -> Track:
    length_m = 4.5
    return Track(
        track_id=1, kind="vehicle", x_m=gap_m + (length_m + PROFILE.ego_length_m) / 2.0, y_m=0.0, vx_mps=-closing_mps,
        vy_mps=0.0, length_m=length_m, width_m=1.8, confidence=confidence, in_ego_path=True,
    )  # fmt: skip


def view(*actors: Track, **fields: Any) -> View:
    return View(**{"ego_speed_mps": 15.0, "actors": actors, "mu_low": MU, "brake_envelope": 1.0, **fields})


def test_rss_alone_brakes_as_hard_as_its_distance_counts_on_while_the_distance_is_violated() -> None:
    # 15 m/s: 0.7 s and 16.3 m of braking and 2 m are about 29 m before a standing car
    assert rss_mps2(view(lead(40.0, 15.0)), PROFILE) == 0.0
    assert rss_mps2(view(lead(20.0, 15.0)), PROFILE) == pytest.approx(MU * GRAVITY_MPS2)
    assert rss_mps2(view(lead(20.0, 15.0), brake_envelope=0.5), PROFILE) == pytest.approx(MU * GRAVITY_MPS2 / 2.0)


def test_idm_brakes_by_its_own_demand_once_that_is_more_than_comfortable() -> None:
    # s* = 2 + 15 * 1.6 + 15 * 15 / (2 * sqrt(0.73 * 1.67)) = 127.9 m; 0.73 (s* / 60)^2 = 3.32 m/s^2
    assert idm_mps2(view(lead(60.0, 15.0)), PROFILE) == pytest.approx(3.32, abs=0.01)
    assert idm_mps2(view(lead(100.0, 15.0)), PROFILE) == 0.0
    assert idm_mps2(view(lead(60.0, 0.0)), PROFILE) == 0.0


@given(st.floats(0.0, 100.0), st.floats(-10.0, 30.0))
def test_neither_brakes_for_what_is_too_doubtful_to_warn_of_nor_without_a_speed(gap: float, closing: float) -> None:
    doubtful = lead(gap, closing, confidence=PROFILE.hazard_confidence - 0.01)
    for governor in BESIDE.values():
        assert governor(view(doubtful), PROFILE) == 0.0
        assert governor(view(lead(gap, closing), ego_speed_mps=None), PROFILE) == 0.0


@given(st.floats(0.5, 100.0), st.floats(-10.0, 15.0), st.floats(0.0, 50.0))
def test_a_nearer_lead_is_never_braked_for_less(gap: float, closing: float, nearer: float) -> None:
    for governor in BESIDE.values():
        far = governor(view(lead(gap, closing)), PROFILE)
        assert governor(view(lead(max(0.0, gap - nearer), closing)), PROFILE) >= far


def test_a_run_is_braked_by_the_governor_in_the_arbiters_place(tmp_path: Path) -> None:
    (ours,) = guard.specs_of(("standing car", 40, "dry"), 1, "model")
    (spec,) = guard.specs_of(("standing car", 40, "dry"), 1, "model", "IDM")
    assert guard.key_of(spec) != guard.key_of(ours)
    found = run_cell(str(tmp_path), "key", spec)
    assert found.braked
    assert found.impact_kmh == 0.0
    assert IDM_BRAKING_MPS2 < found.demanded_mps2 < PROFILE.emergency_brake_max_mps2


def test_the_table_has_a_column_for_each_that_was_put_beside() -> None:
    hit = Outcome(impact_kmh=9.0, physics_kmh=0.0, braked=False)
    clear = Outcome(impact_kmh=0.0, physics_kmh=0.0, braked=True)
    beside = {"IDM": table.beside_of([hit, clear], 1)}
    avoid = table.cell_of("standing car", 50, "dry", [clear], 0, beside)
    lets_pass = table.cell_of("manhole", 50, "dry", [clear], 0, beside)
    assert table.titles([avoid, lets_pass])[-1].startswith("IDM")
    assert list(table.shown(avoid))[-1] == "4.5 (9), 1 of 2 hit"
    assert list(table.shown(lets_pass))[-1] == "1 of 2 runs braked"
    head, first, _ = table.as_csv([avoid, lets_pass]).splitlines()
    assert dict(zip(head.split(","), first.split(","), strict=True))["IDM: impact_mean_kmh"] == "4.5"


def test_the_columns_are_for_this_table_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", "results", "--beside", "--out", str(tmp_path)]) == 2
    assert "--beside: the table results has no such columns" in capsys.readouterr().err
