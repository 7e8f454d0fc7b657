"""Sensor faults told apart from faults of the car, in seeded drives from plain kinematics."""

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from proto.vehicle import SensorFault
from services.can.health.crosscheck import CLEAR_S, CrossChecks
from services.can.health.expected_values import AT_WORK, WHEELS, Expected, Motion, expected, middle, motion
from services.can.signals import reasons
from services.can.signals.field import Reading
from tests.unit.services.can.drives import NOMINAL, SHAPE, Drive, Fault, Guarded, make

NS = 1_000_000_000


def checked(drive: Drive) -> CrossChecks:
    """The checks at the end of a drive."""
    checks = None
    for stamp_ns, readings in drive.samples():
        checks = checks or CrossChecks(SHAPE, tuple(NOMINAL.values()), readings)
        checks.step(readings, stamp_ns)
    assert checks is not None
    return checks


def accused(drive: Drive) -> list[str]:
    return [f"{fault.kind} {fault.field}" for fault in checked(drive).faults]


@pytest.mark.parametrize("seed", range(4))
def test_in_a_sound_drive_no_sensor_is_accused(seed: int) -> None:
    assert accused(Drive(seed)) == []


@given(
    seed=st.integers(0, 99),
    speed=st.floats(3.0, 40.0),
    kept=st.sampled_from([0.0, 0.3, 0.7]),
    brakes=st.floats(0.5, 9.0),
    jerk=st.floats(5.0, 100.0),
)
@settings(max_examples=15, phases=(Phase.generate,))  # a drive takes long, and smaller ones show no more
def test_a_guard_that_brakes_without_a_foot_makes_no_sensor_suspect(
    seed: int, speed: float, kept: float, brakes: float, jerk: float
) -> None:
    drive = Guarded(seed, seconds=25.0, speed_mps=speed, until_mps=kept * speed, brakes_mps2=brakes, jerk_mps3=jerk)
    assert accused(drive) == []


@pytest.mark.parametrize(
    ("kind", "sensor", "size"),
    [
        ("stuck", "wheel_fl_mps", 0.0),
        ("offset", "wheel_rr_mps", 2.0),
        ("noisy", "speed_mps", 1.0),
        ("stuck", "speed_mps", 0.0),
        ("offset", "acceleration_mps2", -1.5),
        ("noisy", "acceleration_mps2", 0.9),
        ("noisy", "yaw_rate_radps", 0.06),
        ("noisy", "brake_pressure_bar", 8.0),
        ("offset", "yaw_rate_radps", 0.1),
        ("offset", "brake_pressure_bar", 15.0),
        ("stuck", "brake_pressure_bar", 0.0),
        ("offset", "tyre_pressure_rl_bar", -0.5),
        ("noisy", "tyre_pressure_fr_bar", 0.2),
        ("offset", "outside_temperature_c", 9.0),
        ("missing", "outside_temperature_c", 0.0),
    ],
)
def test_a_faulty_sensor_is_named_with_what_it_does(kind: str, sensor: str, size: float) -> None:
    assert accused(Drive(6, Fault(kind, sensor, size, 40.0), 100.0)) == [f"{kind} {sensor}"]


def test_a_tyre_that_is_really_soft_is_no_sensor_fault() -> None:
    checks = checked(Drive(3, Fault("soft_tyre", "tyre_pressure_fl_bar", 1.2, 30.0)))
    assert checks.faults == ()
    assert (checks.measured()["softness_fl"] or 0.0) > 0.006


def test_weak_brakes_are_no_sensor_fault_and_are_measured() -> None:
    weak, sound = checked(Drive(5, Fault("weak_brakes", "", 0.5, 15.0))), checked(Drive(5))
    assert weak.faults == ()
    assert (weak.measured()["brake_effect"] or 1.0) < 0.8
    assert (sound.measured()["brake_effect"] or 0.0) > 0.9


@pytest.mark.parametrize("seed", range(8))
def test_a_car_that_brakes_in_pulses_has_sound_sensors(seed: int) -> None:
    assert accused(Drive(seed, Fault("pulses", "", 2.0, 5.0))) == []


@pytest.mark.parametrize("spinning", [WHEELS[:2], WHEELS])
@pytest.mark.parametrize("system", AT_WORK)
def test_wheels_that_spin_under_control_convict_nobody(spinning: tuple[str, ...], system: str) -> None:
    checks: CrossChecks | None = None
    for stamp_ns, readings in Drive(7, seconds=25.0).samples():
        spins = 10 * NS < stamp_ns < 17 * NS
        readings[system] = Reading(float(spins), stamp_ns, "")
        for wheel in spinning if spins else ():
            readings[wheel] = Reading((readings[wheel].value or 0.0) * 1.15, stamp_ns, "")
        checks = checks or CrossChecks(SHAPE, tuple(NOMINAL.values()), readings)
        checks.step(readings, stamp_ns)
        assert checks.faults == ()


def test_two_witnesses_that_differ_accuse_nobody() -> None:
    assert middle((10.0, None, 14.0), 1.0) is None
    assert middle((10.0, 10.4, 14.0), 1.0) == 10.4


def test_a_convicted_sensor_is_believed_again_only_after_a_while_of_plausible_values() -> None:
    checks, since_ns, cleared_ns = None, 0, 0
    for stamp_ns, readings in Drive(11, Fault("offset", "yaw_rate_radps", 0.15, 15.0), 100.0).samples():
        if stamp_ns > 30 * NS:  # mended
            value = readings["yaw_rate_radps"].value or 0.0
            readings["yaw_rate_radps"] = Reading(value - 0.15, stamp_ns, "")
        checks = checks or CrossChecks(SHAPE, tuple(NOMINAL.values()), readings)
        checks.step(readings, stamp_ns)
        if checks.faults and not since_ns:
            since_ns = stamp_ns
        if since_ns and not checks.faults and not cleared_ns:
            cleared_ns = stamp_ns
    assert 0 < since_ns < 30 * NS
    assert cleared_ns >= (30 + CLEAR_S) * NS


def test_the_same_samples_give_the_same_verdicts() -> None:
    drive, _ = make(14, 40)
    first, second = checked(drive), checked(drive)
    assert first.faults == second.faults
    assert first.measured() == second.measured()


def test_a_dead_bus_accuses_no_sensor() -> None:
    checks: CrossChecks | None = None
    last_ns = 0
    for stamp_ns, readings in Drive(2, seconds=20.0).samples():
        checks = checks or CrossChecks(SHAPE, tuple(NOMINAL.values()), readings)
        checks.step(readings, stamp_ns)
        last_ns = stamp_ns
    assert checks is not None
    dead = {name: Reading(None, last_ns, "silent") for name in readings}
    for index in range(400):
        checks.step(dead, last_ns + index * NS // 20)
    assert checks.faults == ()


@pytest.mark.parametrize("reason", sorted(reasons.GONE))
def test_a_sensor_of_which_nothing_usable_comes_while_the_bus_is_alive_is_missing(reason: str) -> None:
    checks: CrossChecks | None = None
    for stamp_ns, readings in Drive(2, seconds=20.0).samples():
        checks = checks or CrossChecks(SHAPE, tuple(NOMINAL.values()), readings)
        checks.step({**readings, "yaw_rate_radps": Reading(None, stamp_ns, reason)}, stamp_ns)
    assert checks is not None
    assert [(fault.field, fault.kind) for fault in checks.faults] == [("yaw_rate_radps", "missing")]


def test_a_sensor_that_its_sender_calls_not_available_is_no_faulty_one() -> None:
    checks: CrossChecks | None = None
    for stamp_ns, readings in Drive(2, seconds=20.0).samples():
        checks = checks or CrossChecks(SHAPE, tuple(NOMINAL.values()), readings)
        checks.step({**readings, "yaw_rate_radps": Reading(None, stamp_ns, reasons.NOT_AVAILABLE)}, stamp_ns)
    assert checks is not None
    assert checks.faults == ()


def ends_silent(drive: Drive, name: str, reason: str, at_s: float) -> tuple[CrossChecks, dict[str, float | None]]:
    """The checks at the end of a drive of which one sensor gives nothing usable from some second on; what was measured
    before.
    """
    checks, before = None, dict[str, float | None]()
    for stamp_ns, readings in drive.samples():
        checks = checks or CrossChecks(SHAPE, tuple(NOMINAL.values()), readings)
        if stamp_ns >= at_s * NS:
            readings[name] = Reading(None, stamp_ns, reason)
        else:
            before = checks.measured()
        checks.step(readings, stamp_ns)
    assert checks is not None
    return checks, before


@pytest.mark.parametrize("reason", [reasons.SILENT, reasons.OUT_OF_RANGE, reasons.WRONG_CHECKSUM])
def test_weak_brakes_stay_weak_when_the_pressure_sensor_that_proved_them_falls_silent(reason: str) -> None:
    drive = Drive(5, Fault("weak_brakes", "", 0.5, 15.0))
    checks, before = ends_silent(drive, "brake_pressure_bar", reason, 70.0)
    assert [(fault.field, fault.kind) for fault in checks.faults] == [("brake_pressure_bar", "missing")]
    assert (before["brake_effect"] or 1.0) < 0.8
    assert checks.measured()["brake_effect"] == pytest.approx(before["brake_effect"], abs=0.05)


def test_a_soft_tyre_stays_soft_when_its_wheel_s_sensor_falls_silent() -> None:
    drive = Drive(3, Fault("soft_tyre", "tyre_pressure_fl_bar", 1.2, 30.0))
    checks, before = ends_silent(drive, "wheel_fl_mps", reasons.SILENT, 80.0)
    assert ("wheel_fl_mps", "missing") in [(fault.field, fault.kind) for fault in checks.faults]
    assert (checks.measured()["softness_fl"] or 0.0) == pytest.approx(before["softness_fl"] or 1.0, abs=0.002)


def test_what_a_lying_pressure_sensor_measured_of_the_brakes_is_void() -> None:
    checks = checked(Drive(5, Fault("offset", "brake_pressure_bar", 25.0, 70.0)))
    assert [(fault.field, fault.kind) for fault in checks.faults] == [("brake_pressure_bar", "offset")]
    assert "brake_effect" not in checks.measured()


def test_a_residual_is_how_far_a_value_lies_outside() -> None:
    sound = Expected(2.0, 3.0, 0.5)
    assert [sound.residual(value) for value in (1.5, 2.0, 2.5, 4.0)] == [-0.5, 0.0, 0.0, 1.0]


def test_a_seeded_set_is_told_apart_nine_times_in_ten() -> None:
    """A part of it; the whole set of 500 stands in the evaluation."""
    right = 0
    for index in range(20):
        drive, label = make(index, 9000)
        right += accused(drive) == ([] if label in ("none", "car") else [label])
    assert right >= 18


def test_a_verdict_names_field_kind_and_reason() -> None:
    (fault,) = checked(Drive(7, Fault("missing", "speed_mps", 0.0, 10.0), 20.0)).faults
    assert fault == SensorFault(field="speed_mps", kind="missing", detail="no usable value while the bus is alive")


@pytest.mark.parametrize(
    ("pedal", "pressure_bar", "sound"), [(0.011, 7.0, True), (0.0, 7.0, True), (0.0, 20.0, False), (0.011, 30.0, False)]
)
def test_foot_or_car_may_brake_softly_as_much_as_the_car_slows(
    pedal: float, pressure_bar: float, *, sound: bool
) -> None:
    moved = Motion(speed_mps=10.0, yaw_rate_radps=0.0, acceleration_mps2=-0.65)
    told = expected({"brake_pedal": pedal, "brake_pressure_bar": pressure_bar}, moved, SHAPE)
    pressure = told["brake_pressure_bar"]
    assert (abs(pressure.residual(pressure_bar)) <= pressure.tolerance) is sound


@pytest.mark.parametrize(
    ("slows_mps2", "pressure_bar", "sound"),
    [(4.0, 40.0, True), (4.0, 0.0, True), (4.0, 60.0, False), (0.5, 20.0, False)],
)
def test_a_car_that_brakes_by_itself_needs_no_foot_for_its_pressure(
    slows_mps2: float, pressure_bar: float, *, sound: bool
) -> None:
    moved = Motion(speed_mps=15.0, yaw_rate_radps=0.0, acceleration_mps2=-slows_mps2)
    pressure = expected({"brake_pedal": 0.0, "brake_pressure_bar": pressure_bar}, moved, SHAPE)["brake_pressure_bar"]
    assert (abs(pressure.residual(pressure_bar)) <= pressure.tolerance) is sound


@pytest.mark.parametrize(("seconds_ago", "sound"), [(0.3, True), (5.0, False)])
def test_who_has_just_set_off_is_not_held_against_the_mean_of_the_last_moments(
    seconds_ago: float, *, sound: bool
) -> None:
    started_s = 1.0 - seconds_ago
    speeds = [(k / 20, 2.0 * max(0.0, k / 20 - started_s)) for k in range(5, 21)]
    told = expected({}, motion({}, speeds, SHAPE), SHAPE)["acceleration_mps2"]
    asked = 2.0 if sound else 3.0
    assert (abs(told.residual(asked)) <= told.tolerance) is sound


@pytest.mark.parametrize("speed_mps", [0.0, 1.5])
def test_a_car_that_stands_may_be_held_by_its_brakes_without_a_foot(speed_mps: float) -> None:
    held = {"brake_pedal": 0.0, "brake_pressure_bar": 40.0}
    moved = Motion(speed_mps=speed_mps, yaw_rate_radps=0.0, acceleration_mps2=0.0)
    assert "brake_pressure_bar" not in expected(held, moved, SHAPE)


def test_a_car_that_creeps_tells_nothing_of_the_pressure_of_a_resting_foot() -> None:
    moved = Motion(speed_mps=1.0, yaw_rate_radps=0.0, acceleration_mps2=-0.65)
    values = {"brake_pedal": 0.011, "brake_pressure_bar": 7.0}
    assert "brake_pressure_bar" not in expected(values, moved, SHAPE)
