"""A drive as messages: what leaves at which step, and how advice reaches the driver."""

import hashlib
from typing import Any

import msgspec
import pytest

from drivemcp.paths import data
from proto import topics
from proto.decision import Advisory, BrakeCommand
from proto.rules import LegalLimit
from proto.sensors import CanFrame, CanFrames
from proto.truth import Truth
from services.simulator.car.state import BAR_PER_MPS2
from services.simulator.driver.driver import Advice, Driver
from services.simulator.scenario.load import parse_scenario
from services.simulator.scenario.plan import Scenario
from services.simulator.session import STEP_NS, Batch, SensorSet, Session
from tests.unit.services.simulator._scenes import scenario, scenario_text


def session(plan: Scenario | None = None, seed: int = 3, seconds: float = 60.0, **present: object) -> Session:
    sensors = SensorSet(**present)  # type: ignore[arg-type]
    dbc = data("vehicles/sim/sim.dbc")
    return Session(plan or scenario(), seed, seconds=seconds, epoch_ns=10**12, dbc=dbc, bus="can0", present=sensors)


def run(drive: Session, steps: int) -> list[Batch]:
    return [drive.advance() for _ in range(steps)]


def counts(batches: list[Batch]) -> dict[str, int]:
    names = [out.topic.name for batch in batches for out in batch.messages]
    return {name: names.count(name) for name in names}


def test_every_sensor_comes_at_its_rate() -> None:
    batches = run(session(), 40)
    found = counts(batches)
    assert found[topics.CLOCK.name] == found[topics.TRUTH.name] == found[topics.CAN_RX.name] == 40
    assert found[topics.LIDAR.name] == found[topics.MAP.name] == found[topics.GNSS.name] == 20
    assert found[topics.WEATHER_SENSING.name] == 2
    assert found[topics.SCENARIO.name] == 4
    shots = [shot.camera for batch in batches for shot in batch.shots]
    assert (shots.count("front"), shots.count("tele")) == (20, 10)
    assert all(len(batch.shots) <= 1 for batch in batches)


def test_a_sensor_that_is_left_out_is_silent_and_changes_no_other() -> None:
    whole, part = run(session(), 10), run(session(lidar=False, cameras=()), 10)
    assert topics.LIDAR.name not in counts(part)
    assert not any(batch.shots for batch in part)

    def fixes(batches: list[Batch]) -> list[msgspec.Struct]:
        return [out.message for batch in batches for out in batch.messages if out.topic is topics.GNSS]

    assert fixes(whole) == fixes(part)


def test_sweeps_at_crossings_come_while_somebody_crosses_and_are_those_that_always_come() -> None:
    cars = 'cars = [{ from_side = "right", speed_kmh = 28, when_ego_within_m = 95 }]'
    plan = scenario(rest=f"[[yields]]\nat_m = 150\n{cars}", speed=45, road_class="urban")

    def sweeps(**present: Any) -> list[tuple[int, msgspec.Struct]]:
        batches = run(session(plan, **present), 300)
        every = [(batch.stamp_ns, out) for batch in batches for out in batch.messages]
        return [(at, out.message) for at, out in every if out.topic is topics.LIDAR]

    always, crossed = sweeps(), sweeps(lidar=False, lidar_at_crossings=True)
    assert 20 <= len(crossed) <= 100
    assert set(crossed) <= set(always)
    assert crossed[0][0] > always[40][0], "before, nobody is there"


def test_the_truth_tells_whom_a_house_hides_until_he_comes_out_behind_it() -> None:
    cars = 'cars = [{ from_side = "right", speed_kmh = 28, when_ego_within_m = 95 }]'
    text = scenario_text(rest=f"[[yields]]\nat_m = 150\n{cars}", speed=45, road_class="urban")
    plan = parse_scenario(text.replace('"fields"', '"town"'), "test.toml")
    batches = run(session(plan, lidar=False, cameras=(), can=False), 200)
    told = [out.message for batch in batches for out in batch.messages if out.topic is topics.TRUTH]
    walled = [truth.actors[0].walled for truth in told if isinstance(truth, Truth) and 0.0 < truth.actors[0].x_m < 90.0]
    assert walled[0] > 0.9
    out = walled.index(0.0)
    assert 0 < out < 20
    assert not any(walled[out:])


def test_stamps_run_from_the_epoch_in_steps_and_frames_of_the_bus_within_them() -> None:
    batches = run(session(), 5)
    assert [batch.stamp_ns for batch in batches] == [10**12 + step * STEP_NS for step in range(1, 6)]
    sent = next(out.message for out in batches[-1].messages if out.topic is topics.CAN_RX)
    assert isinstance(sent, CanFrames)
    stamps = [frame.stamp_ns for frame in sent.frames]
    assert stamps == sorted(stamps)
    assert batches[-2].stamp_ns < stamps[0] <= stamps[-1] <= batches[-1].stamp_ns


def test_two_drives_with_one_seed_say_the_same_bytes() -> None:
    def digest(drive: Session) -> str:
        encoded = [msgspec.msgpack.encode(out.message) for batch in run(drive, 30) for out in batch.messages]
        return hashlib.sha256(b"".join(encoded)).hexdigest()

    assert digest(session()) == digest(session())
    assert digest(session()) != digest(session(seed=4))


def advisory(kind: str, directive: str = "Slow down to 50 km/h.") -> Advisory:
    return Advisory(
        tick=1,
        snapshot_stamp_ns=0,
        kind=kind,  # type: ignore[arg-type]
        directive=directive,
        justification="",
        urgency="warning",
        topic="limit",
        hazard="",
        target_mps=13.9,
        legal_limit=LegalLimit(value=50, unit="km/h", mps=13.9),
        unit="km/h",
        language="en",
        confidence=1.0,
    )


@pytest.mark.parametrize(
    ("kind", "directive", "times"),
    [("SPEAK", "Slow down.", 1), ("ACT", "Brake!", 1), ("SILENT", "", 0), ("SPEAK", "", 0)],
)
def test_the_driver_hears_what_is_spoken_and_nothing_else(
    kind: str, directive: str, times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: list[Advice] = []
    monkeypatch.setattr(Driver, "hear", lambda self, advice, time_s: heard.append(advice))
    drive = session()
    drive.hear(advisory(kind, directive))
    drive.advance()
    assert [advice.topic for advice in heard] == ["limit"] * times


def test_the_driver_learns_of_the_limit_only_by_words_that_tell_it(monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[Advice] = []
    monkeypatch.setattr(Driver, "hear", lambda self, advice, time_s: heard.append(advice))
    drive = session()
    drive.hear(advisory("SPEAK", "Slippery: drive 50 km/h"))
    drive.hear(msgspec.structs.replace(advisory("SPEAK", "Limit 50 km/h"), told_limit_mps=13.9))
    drive.advance()
    assert [advice.limit_mps for advice in heard] == [None, 13.9]


def test_a_drive_ends_after_its_seconds_or_at_the_end_of_the_route() -> None:
    short = session(seconds=1.0)
    run(short, 20)
    assert short.finished
    assert short.scenario_state(1.0).finished
    route = session(scenario(length=300, speed=100), seconds=600.0)
    while not route.finished:
        assert route.advance().snapshot.time_s < 30.0


def test_the_units_answer_a_request_for_the_speed() -> None:
    drive = session()
    run(drive, 4)
    request = CanFrame(stamp_ns=0, arbitration_id=0x7DF, data=bytes([2, 1, 0x0D, 0, 0, 0, 0, 0]))
    answers = drive.request([request], 10**12 + 4 * STEP_NS)
    assert answers[0].arbitration_id == 0x7E8
    assert answers[0].data[3] == pytest.approx(drive.world.ego.speed * 3.6, abs=1.0)


def test_a_fault_of_the_scenario_begins_at_its_second_and_changes_the_drive() -> None:
    stop = "[[stops]]\nat_m = 180\n"
    fault = '[[faults]]\npreset = "booster_lost"\nat_s = 1.0\nseverity = 0.9\n'
    sound, lost = (session(scenario(rest=rest, speed=70, road_class="urban")) for rest in (stop, stop + fault))
    before = zip(run(sound, 20), run(lost, 20), strict=True)
    assert all(one.snapshot.ego == other.snapshot.ego for one, other in before)
    assert not lost.state.stored_codes
    ends = [run(drive, 220)[-1].snapshot.ego for drive in (sound, lost)]
    assert lost.state.stored_codes == ("C0021",)
    assert lost.state.brake_booster_fault
    assert ends[1].s_m > ends[0].s_m + 2.0


def test_the_same_seed_stops_later_for_a_braking_command_with_a_lost_circuit() -> None:
    fault = '[[faults]]\npreset = "circuit_lost"\n'
    ways = []
    for rest in ("", fault):
        drive = session(scenario(rest=rest, speed=104))
        for _ in range(50):
            drive.brake(BrakeCommand(deceleration_mps2=6.0, jerk_mps3=10.0, grant_id="g"))
            end = drive.advance().snapshot.ego
        ways.append(end.s_m)
    assert ways[1] > ways[0] + 3.0


def test_what_the_car_brakes_by_itself_moves_no_pedal() -> None:
    """Else whoever commands it would take its own braking for the driver's, and let go at once."""
    drive = session(scenario(speed=104))
    foot = run(drive, 60)[-1].snapshot.wish
    brake(drive, 20)
    state = drive.state
    assert state.acceleration_mps2 == pytest.approx(-4.0, abs=0.5)
    assert state.brake_pressure_bar == pytest.approx(4.0 * BAR_PER_MPS2, rel=0.15)
    assert (state.brake, state.brake_pedal_travel_mm) == (foot.brake, 0.0) == (0.0, 0.0)


def test_nobody_steps_on_the_accelerator_to_keep_the_speed_as_the_car_brakes() -> None:
    drive = session(scenario(speed=50))
    before = run(drive, 100)[-1].snapshot
    after = brake(drive, 40).snapshot
    assert after.ego.speed_mps < before.ego.speed_mps - 6.0
    assert after.wish.accelerator <= before.wish.accelerator


def brake(drive: Session, steps: int) -> Batch:
    """Let the car brake by itself, and the last step of it."""
    for _ in range(steps):
        drive.brake(BrakeCommand(deceleration_mps2=4.0, jerk_mps3=10.0, grant_id="g"))
        end = drive.advance()
    return end


def test_a_stuck_wheel_speed_sensor_takes_the_anti_lock_away_from_the_real_car() -> None:
    drive = session(scenario(rest='[[faults]]\npreset = "wheel_fl_stuck"\nat_s = 3.0\n', speed=20))
    run(drive, 280)
    assert drive.state.abs_fault
    assert drive.state.stored_codes == ("C0035",)
