"""The set of 500: labelled, the same per seed, and shown by the car's bus alone."""

import hashlib
import math
from collections import Counter
from dataclasses import replace
from typing import Any

import pytest
from cantools.database import load_file

from drivemcp.paths import data
from services.can.profiles.profile import load_profile
from services.simulator.car.sensors import SENSORS
from studies.car_faults.cases import FIELDS, Case, cases
from studies.car_faults.courses import draw_course
from studies.car_faults.drives import Onset, Step, drive
from studies.car_faults.verdicts import truth

DBC = data("vehicles/sim/sim.dbc")


def steps(case: Case, seconds: float = 20.0) -> list[Step]:
    return list(drive(replace(case.course, seconds=seconds), case.seed, case.onset, DBC))


def test_there_are_500_and_tuning_never_meets_the_test() -> None:
    test, calibration = cases("test"), cases("calibration")
    assert Counter(truth(case) for case in test) == {"sound": 139, "sensor": 235, "vehicle": 126}
    assert not {case.seed for case in test} & {case.seed for case in calibration}
    assert [case.label for case in test] == [case.label for case in calibration]


def test_every_sensor_feeds_a_curated_field() -> None:
    assert FIELDS.keys() == SENSORS.keys()
    assert set(FIELDS.values()) <= load_profile(data("vehicles/sim/profile.toml")).fields.keys()


def test_drives_are_as_long_and_their_onsets_as_late_as_they_are_said_to_be() -> None:
    for case in cases("test"):
        assert 60.0 <= case.course.seconds <= 180.0
        if case.onset is not None:
            assert 15.0 <= case.onset.at_s <= 90.0
            assert 0.5 <= case.onset.severity <= 1.0


def test_a_drive_is_bit_identical_per_seed() -> None:
    def digest(seed: int) -> str:
        case = Case(seed, Onset("wheel_fl_noisy", 1.0, 5.0), "wheel_fl", "noisy")
        return hashlib.sha256(b"".join(f.data for step in steps(case) for f in step.frames)).hexdigest()

    assert digest(7) == digest(7)
    assert digest(7) != digest(8)


def test_the_same_drive_with_and_without_a_sensor_fault_is_driven_alike() -> None:
    sound, faulty = (steps(Case(11, onset)) for onset in (None, Onset("acceleration_offset", 1.0, 5.0)))
    assert [step.state for step in sound] == [step.state for step in faulty]
    assert [step.frames for step in sound[:99]] == [step.frames for step in faulty[:99]]
    assert sound[-1].frames != faulty[-1].frames


def test_a_stuck_wheel_stands_still_on_the_bus_from_its_onset_on() -> None:
    database: Any = load_file(DBC)
    read = [
        (step.time_s, database.decode_message(0x100, frame.data))
        for step in steps(Case(12, Onset("wheel_rr_stuck", 1.0, 8.0)))
        for frame in step.frames
        if frame.arbitration_id == 0x100
    ]
    assert len({row["WheelSpeedRR"] for at_s, row in read if at_s >= 8.1}) == 1
    assert len({row["WheelSpeedRL"] for at_s, row in read if at_s >= 8.1}) > 50


@pytest.mark.parametrize("seed", range(5))
def test_a_course_has_bends_slowings_and_no_bend_that_a_car_cannot_take(seed: int) -> None:
    course = draw_course(seed)
    states = [step.state for step in drive(replace(course, seconds=60.0), seed, None, DBC)]
    assert max(abs(state.speed_mps * state.yaw_rate_radps) for state in states) < 4.5
    assert max(state.speed_mps for state in states) > 5.0
    assert all(math.isfinite(state.brake_pressure_bar) for state in states)
