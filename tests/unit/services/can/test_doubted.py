"""A sensor that the others contradict, from the simulated car's frames to ego and health."""

from itertools import islice

from drivemcp.paths import data
from proto.sensors import CanFrame
from services.can.diagnostics.trouble_codes import DtcBook
from services.can.health import degradation
from services.can.profiles.dbc import Dbc
from services.can.profiles.profile import Profile
from services.can.vehicle import Vehicle
from studies.car_faults.courses import draw_course
from studies.car_faults.drives import Onset, drive

SEED, ONSET_S, STEPS = 20_500, 20.0, 1800


def frames(preset: str) -> list[CanFrame]:
    """What the bus carries until half a minute after the sensor failed."""
    course = draw_course(SEED)
    steps = islice(drive(course, SEED, Onset(preset, 1.0, ONSET_S), data("vehicles/sim/sim.dbc")), STEPS)
    return [frame for step in steps for frame in step.frames]


def heard(vehicle: Vehicle, carried: list[CanFrame], batch: int) -> Vehicle:
    """The vehicle after these frames, so many at a time."""
    for start in range(0, len(carried), batch):
        part = carried[start : start + batch]
        vehicle.ingest(part, part[-1].stamp_ns, "can0")
    return vehicle


def car(dbc: Dbc, profile: Profile, book: DtcBook) -> Vehicle:
    return Vehicle({"can0": dbc}, profile, book, lambda request_id, payload: None)


def test_a_lying_sensor_is_invalid_in_the_ego_and_named_in_the_health_however_frames_come(
    dbc: Dbc, profile: Profile, book: DtcBook
) -> None:
    carried = frames("yaw_rate_offset")
    now_ns = carried[-1].stamp_ns
    one, other = heard(car(dbc, profile, book), carried, 7), heard(car(dbc, profile, book), carried, 131)
    assert one.checks.faults == other.checks.faults
    assert one.checks.measured() == other.checks.measured()
    told = one.degradation(now_ns)
    ego = one.ego(now_ns)
    assert [(fault.field, fault.kind) for fault in told.sensor_faults] == [("yaw_rate_radps", "offset")]
    assert ego.yaw_rate_radps is None
    assert "yaw_rate_radps" in ego.invalid
    assert ego.speed_mps is not None
    advice = degradation.advise(one.table, one.assessment, book, "de")
    assert "Drehrate" in advice.advice
    assert advice.safe_to_drive == "with_care"
