"""A verdict is right where it names the fault and nothing else."""

import pytest

from proto.vehicle import Degradation, Indicator, SensorFault
from studies.car_faults.cases import Case
from studies.car_faults.drives import Onset
from studies.car_faults.hearing import Heard, hear
from studies.car_faults.scores import score, sheets
from studies.car_faults.verdicts import Verdict, right, right_kind, verdict

STUCK = Case(1, Onset("wheel_fl_stuck", 1.0, 20.0), "wheel_fl", "stuck")
BOOSTER = Case(2, Onset("booster_lost", 1.0, 20.0))
SOUND = Case(3)


def said(*indicators: str, sensors: tuple[tuple[str, str], ...] = ()) -> Verdict:
    return verdict(
        Degradation(
            indicators=tuple(Indicator(name=name, value=0.5, weight=1.0, source="can") for name in indicators),
            sensor_faults=tuple(SensorFault(field=field, kind=kind) for field, kind in sensors),  # type: ignore[arg-type]
        )
    )


def test_the_sensor_must_be_the_one_and_nothing_else() -> None:
    own, other = ("wheel_fl_mps", "stuck"), ("speed_mps", "offset")
    assert right_kind(STUCK, said("abs_fault", sensors=(own,)))
    assert right(STUCK, said(sensors=(("wheel_fl_mps", "offset"),)))
    assert not right_kind(STUCK, said(sensors=(("wheel_fl_mps", "offset"),)))
    for wrong in (said(), said("abs_fault"), said(sensors=(other,)), said(sensors=(own, other))):
        assert not right(STUCK, wrong)


def test_a_fault_of_the_car_may_bring_its_consequences_but_no_stranger() -> None:
    assert right(BOOSTER, said("brake_booster_fault", "brake_lamp", "trouble_codes"))
    for wrong in (said(), said("brake_lamp"), said("brake_booster_fault", "fuel_low"), said("fuel_low")):
        assert not right(BOOSTER, wrong)
    assert not right(BOOSTER, said("brake_booster_fault", sensors=(("speed_mps", "noisy"),)))


def test_a_sound_drive_is_right_only_in_silence() -> None:
    assert right(SOUND, said())
    assert not right(SOUND, said("fuel_low"))


def test_scores_count_what_was_heard() -> None:
    heard = [
        Heard(SOUND, said("fuel_low"), None),
        Heard(STUCK, said(sensors=(("wheel_fl_mps", "stuck"),)), 2.0),
        Heard(BOOSTER, said(), 1.0),
    ]
    scores = score("test", heard)
    assert (scores.overall.right, scores.overall.all) == (1, 3)
    assert scores.false_alarms == 1.0
    assert scores.kinds_named == 1.0
    assert scores.confusion["vehicle"] == {"sound": 1, "sensor": 0, "vehicle": 0}
    assert [miss.once_right for miss in scores.misses] == [False, True]
    assert any("wheel_fl" in each.markdown() for each in sheets(scores))


@pytest.mark.parametrize("preset", ["booster_lost", "steering_assist", "stability_off"])
def test_what_the_car_says_of_itself_is_heard_at_once(preset: str) -> None:
    heard = hear(Case(41, Onset(preset, 1.0, 20.0)))
    assert heard.after_s is not None
    assert heard.after_s < 1.0
