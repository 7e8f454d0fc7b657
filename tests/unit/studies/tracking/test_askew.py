"""How far aside of where they are vehicles in bends are told to be."""

import math
import statistics
from pathlib import Path

import pytest

from drivemcp.errors import UserError
from proto.perception import Track
from proto.truth import TrueActor, Truth
from studies.tracking.askew import compared, main, sheet, told_in


def car(x_m: float, y_m: float, ahead_mps: float, askew_rad: float, ego_mps: float = 10.0) -> TrueActor:
    """Drives over ground so fast in that direction, as truth tells it."""
    return TrueActor(
        actor_id=1, kind="vehicle", x_m=x_m, y_m=y_m, vx_mps=ahead_mps * math.cos(askew_rad) - ego_mps,
        vy_mps=ahead_mps * math.sin(askew_rad), length_m=4.5, width_m=1.8,
    )  # fmt: skip


def truth(*actors: TrueActor) -> Truth:
    return Truth(
        time_s=0.0, distance_m=0.0, speed_mps=10.0, acceleration_mps2=0.0, law_limit_mps=None, jurisdiction="DEU", mu=0.8,
        gap_m=None, closing_mps=None, actors=actors,
    )  # fmt: skip


def track(x_m: float, y_m: float, confidence: float = 0.9) -> Track:
    return Track(
        track_id=1, kind="vehicle", x_m=x_m, y_m=y_m, vx_mps=0.0, vy_mps=0.0, length_m=4.5, width_m=1.8,
        sigma_x_m=0.2, sigma_y_m=0.2, sigma_vx_mps=0.3, sigma_vy_mps=0.3, confidence=confidence, age_s=1.0,
    )  # fmt: skip


@pytest.mark.parametrize("askew_rad", [-0.4, 0.2])
def test_an_oncoming_car_is_compared_by_its_axis_and_its_place(askew_rad: float) -> None:
    (told,) = compared([track(30.5, 5.2)], truth(car(30.0, 6.0, -12.0, askew_rad), car(60.0, 0.0, 12.0, 0.0)))
    assert told.oncoming
    assert told.askew_rad == pytest.approx(abs(askew_rad))
    assert told.aside_m == pytest.approx(0.8)
    assert told.along_m == pytest.approx(0.5)


def test_what_is_unsure_stands_or_is_nobodys_is_left_out() -> None:
    moving, parked = car(30.0, 6.0, 12.0, 0.1), car(20.0, -3.0, 0.0, 0.0)
    told = list(compared([track(30.0, 6.0, 0.5), track(20.0, -3.0), track(50.0, 0.0)], truth(moving, parked)))
    assert told == []


def test_each_vehicle_counts_in_the_row_of_its_axis() -> None:
    seen = [*compared([track(30.0, 6.5)], truth(car(30.0, 6.0, -12.0, 0.4))), *compared([], truth())]
    assert ("oncoming", "0.3 to 0.5", 1, 0.5, 0.5) in sheet(seen).rows
    assert ("our way", "0.3 to 0.5", 0, None, None) in sheet(seen).rows


def test_a_drives_tracks_are_laid_beside_its_own_truth(log: Path) -> None:
    told = list(told_in(log))
    assert len(told) > 20
    assert statistics.median(each.aside_m for each in told) < 0.3
    assert statistics.median(each.along_m for each in told) < 0.5, "of the same instant"


def test_a_log_without_truth_is_refused(log: Path, tmp_path: Path) -> None:
    (alone := tmp_path / "log.mcap").write_bytes(log.read_bytes())
    with pytest.raises(UserError, match="no truth beside it"):
        list(told_in(alone))


def test_a_file_that_is_no_log_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (file := tmp_path / "no.mcap").write_bytes(b"this is no log of any drive")
    monkeypatch.setattr("sys.argv", ["askew", str(file)])
    assert main() == 2
    assert "no.mcap" in capsys.readouterr().err
