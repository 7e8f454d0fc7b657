"""What the car's health does to target, headway and words: worse never eases, unknown is careful, a trend is told once."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.vehicle import Degradation, DtcText, Indicator, SensorFault, Trend, VehicleHealth
from services.orchestrator.state import State
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    FEW,
    Drive,
    Played,
    conditions,
    fact,
    health,
    limit_sign,
    preferences,
    replace,
)

LEAK = Trend(
    name="slow_leak_fl", value=0.86, threshold=0.8, unit="share of nominal", rate_per_min=-0.005, minutes_left=12.0,
    minutes_low=8.0, minutes_high=20.0,
)  # fmt: skip
ADVICE = "The front left tyre is losing air; its warning comes in about 12 min."


def driven(car: Degradation, **said: Any) -> Drive:
    """A drive with this car, under a limit of 100."""
    drive = Drive(Played(EXPERTS | {"vehicle_health": lambda a: health(car.h or 0.0, **said)}), 20.0, "rural")
    drive.tick(limit_sign("limit:100"))
    drive.ticks(3)
    drive.car = car
    drive.ticks(3)
    return drive


def told(drive: Drive, advice: str, **said: Any) -> VehicleHealth:
    """As the tool answers: of all that the car names now."""
    assert drive.car is not None
    codes = (DtcText(code=code, system="", severity="careful", summary="", next_step="") for code in drive.car.dtcs)
    given = {"safe_to_drive": "with_care", "advice": advice, **said}
    return health(drive.car.h or 0.0, dtcs=tuple(codes), warning_lamps=drive.car.warning_lamps, **given)


def target(drive: Drive) -> float:
    drive.ticks(1)
    return drive.target_mps


def headway(drive: Drive) -> float:
    return drive.ticks(1).fused.headway_factor


@FEW
@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_less_braking_or_a_worse_car_never_raises_the_target_nor_shrinks_the_distance(
    h: float, worse: float, envelope: float, less: float
) -> None:
    before = driven(Degradation(h=h, brake_envelope=envelope))
    after = driven(Degradation(h=max(h, worse), brake_envelope=min(envelope, less)))
    assert target(after) <= target(before) + 1e-9
    assert headway(after) >= headway(before) - 1e-9


@pytest.mark.parametrize(("envelope", "factor", "distance"), [(0.64, 0.8, 1.56), (0.25, 0.5, 3.0), (0.04, 0.316, 3.0)])
def test_speed_falls_with_the_root_of_braking_and_distance_grows_with_its_inverse(
    envelope: float, factor: float, distance: float
) -> None:
    sound, weak = driven(Degradation(h=0.0, brake_envelope=1.0)), driven(Degradation(h=0.0, brake_envelope=envelope))
    assert target(weak) == pytest.approx(factor * target(sound), rel=0.01)
    assert headway(weak) == pytest.approx(distance, rel=0.02)


def test_brakes_of_which_nothing_is_known_are_not_taken_for_sound_ones() -> None:
    sound, unknown = driven(Degradation(h=0.0, brake_envelope=1.0)), driven(Degradation(h=0.0, brake_envelope=None))
    assert target(unknown) <= target(sound)


def test_an_envelope_that_falls_silent_keeps_what_was_last_told() -> None:
    drive = driven(Degradation(h=0.2, brake_envelope=0.3))
    before = target(drive), headway(drive)
    drive.car = Degradation(h=0.2, brake_envelope=None)
    drive.ticks(5)
    assert target(drive) <= before[0] + 1e-9
    assert headway(drive) >= before[1] - 1e-9


def test_a_trend_is_told_once_and_in_its_own_words() -> None:
    drive = driven(Degradation(h=0.0, brake_envelope=1.0))
    said = health(0.0, safe_to_drive="with_care", advice=ADVICE, trends=(LEAK,))
    drive.ask.table["vehicle_health"] = lambda a: said
    drive.car = Degradation(h=0.0, brake_envelope=1.0, trends=(LEAK,))
    drive.ticks(150)
    advisories = [each.advisory for _, _, each in drive.history if each.advisory.kind != "SILENT"]
    told = [each for each in advisories if "checked" in each.directive]
    assert [each.directive for each in told] == ["Have the car checked"]
    assert "front left tyre" in told[0].justification


def test_a_further_code_is_told_where_there_is_something_else_to_say_of_it() -> None:
    def lit(codes: tuple[str, ...]) -> Degradation:
        return Degradation(h=0.4, brake_envelope=0.8, warning_lamps=("abs",), dtcs=codes)

    drive = driven(Degradation(h=0.0, brake_envelope=1.0))
    advice = "The wheels may lock."
    drive.ask.table["vehicle_health"] = lambda a: told(drive, advice)
    for codes in ((), ("C0035",), ("C0035", "C0040")):
        drive.car = lit(codes)
        drive.ticks(60)
    assert drive.spoken().count("Drive gently: car fault") == 1
    advice = "The wheels may lock. Fill the tyre at the front left."
    drive.car = lit(("C0035", "C0040", "C0750"))
    drive.ticks(60)
    assert drive.spoken().count("Drive gently: car fault") == 2


def test_a_doubted_sensor_is_told_as_such_and_not_as_a_fault_of_the_car() -> None:
    fault = SensorFault(field="wheel_fl_mps", kind="stuck")
    drive = driven(Degradation(h=0.0, brake_envelope=1.0))
    drive.ask.table["vehicle_health"] = lambda a: health(0.1, safe_to_drive="with_care", sensor_faults=(fault,))
    drive.car = Degradation(h=0.1, brake_envelope=1.0, sensor_faults=(fault,))
    drive.ticks(60)
    assert drive.spoken().count("Car sensor faulty") == 1


def test_a_fault_is_called_by_its_indicators() -> None:
    weak = Indicator(name="brakes_weak", value=0.4, weight=1.2, source="can")
    codes = Indicator(name="trouble_codes", value=0.3, weight=0.5, source="obd", detail="C0035")
    drive = driven(Degradation(h=0.38, brake_envelope=0.6, indicators=(weak, codes), dtcs=("C0035",)))
    (event,) = [each for each in drive.history[-1][2].events if each.kind == "vehicle_fault"]
    assert event.detail == "C0035 brakes_weak"


def test_an_indicator_that_weighs_little_is_no_fault() -> None:
    fuel = Indicator(name="fuel_low", value=0.5, weight=0.1, source="can")
    drive = driven(Degradation(h=0.05, brake_envelope=1.0, indicators=(fuel,)))
    assert not [each for each in drive.history[-1][2].events if each.kind == "vehicle_fault"]


def lamps(*names: str, h: float = 0.6) -> Degradation:
    return Degradation(h=h, brake_envelope=1.0, warning_lamps=names)


@pytest.mark.parametrize("verdict", ["yes", "with_care", "stop_soon"])
@FEW
@given(st.integers(1, 60), st.booleans())
def test_an_answer_about_an_earlier_fault_mutes_no_new_one_though_the_tool_is_silent(
    verdict: str, later: int, muted: bool
) -> None:
    """To a muted driver too, and by the real arbiter: at the latest two seconds after the last word on the car."""
    drive = Drive(Played(dict(EXPERTS), arbiter=arbiter()))
    drive.ask.table["vehicle_health"] = lambda a: told(drive, "Check the tyres.", safe_to_drive=verdict)
    drive.tick(preferences=preferences(muted=muted))
    drive.ticks(60)
    drive.car = lamps("tyre", h=0.2)
    drive.ticks(later)
    del drive.ask.table["vehicle_health"]
    drive.car = lamps("oil", "tyre")
    drive.ticks(21)
    said = [
        (t.advisory.justification, t.advisory.directive)
        for _, _, t in drive.history[-21:]
        if t.advisory.kind != "SILENT"
    ]
    assert any("oil" in why for why, _ in said)
    assert all("notice" not in directive for _, directive in said)


@FEW
@given(st.integers(1, 60))
def test_of_a_new_fault_the_tool_is_asked_at_once_or_half_a_second_after_its_last_answer(later: int) -> None:
    drive = Drive(Played(dict(EXPERTS)))
    drive.ask.table["vehicle_health"] = lambda a: told(
        drive, "Stop.", safe_to_drive="stop_now" if drive.car == lamps("oil", "tyre") else "with_care"
    )
    drive.ticks(60)
    drive.car = lamps("tyre", h=0.2)
    drive.ticks(later)
    drive.car = lamps("oil", "tyre")
    drive.ticks(1 if 6 <= later <= 50 else 6)  # it is asked in the first tick and in the 51st
    assert drive.history[-1][2].fused.hazard == "vehicle_fault"


def test_a_tool_that_never_knows_of_a_fault_is_asked_twice_a_second() -> None:
    drive = driven(lamps("oil"))
    drive.ask.calls.clear()
    drive.ticks(50)
    assert [call.tool for call in drive.ask.calls].count("vehicle_health") == 10


def test_to_stop_stays_the_word_while_one_of_its_faults_stands() -> None:
    drive = Drive(Played(dict(EXPERTS)))
    drive.ask.table["vehicle_health"] = lambda a: told(drive, "Stop.", safe_to_drive="stop_now")
    drive.ticks(60)
    drive.car = lamps("oil")
    drive.ticks(3)
    del drive.ask.table["vehicle_health"]
    drive.car = lamps("oil", "tyre")
    assert drive.tick().fused.hazard == "vehicle_fault"
    drive.car = lamps("tyre", "abs")
    assert drive.tick().fused.hazard == ""


def test_a_lamp_that_flickers_is_one_episode() -> None:
    drive = Drive(Played(dict(EXPERTS), arbiter=arbiter()))
    del drive.ask.table["vehicle_health"]
    drive.tick(preferences=preferences(muted=True))
    drive.ticks(60)
    for tick in range(80):
        drive.car = lamps("oil", "tyre") if tick % 4 < 2 else lamps("tyre")
        drive.tick()
    assert drive.spoken().count("Drive gently: car fault") == 1


SILENT = {"degradation": None, "unhealthy": ("can/degradation",)}


def test_while_the_topic_is_silent_the_tools_answer_counts_and_is_told() -> None:
    drive = Drive(Played(dict(EXPERTS)))
    drive.ticks(60)
    stood = drive.target_mps
    grave = health(
        0.9, brake_envelope=0.3, warning_lamps=("brake",), safe_to_drive="stop_now", advice="Stop.", speed_factor=0.3,
        headway_factor=2.5,
    )  # fmt: skip
    drive.ask.table["vehicle_health"] = lambda a: grave
    drive.ticks(60, **SILENT)
    assert "Stop safely now" in drive.spoken()
    assert drive.target_mps <= 0.5 * stood
    assert drive.history[-1][2].fused.headway_factor >= 2.5
    assert drive.history[-1][2].request.h == 0.9
    drive.ticks(2)
    assert drive.target_mps == pytest.approx(stood), "the topic's own word, once it speaks again"


@FEW
@given(
    heard=st.booleans(), h=st.floats(0.0, 1.0), envelope=st.none() | st.floats(0.0, 1.0), said_h=st.none() | st.floats(),
    said_envelope=st.none() | st.floats(), said=st.sets(st.sampled_from(["oil", "tyre"])), ago=st.integers(0, 40),
)  # fmt: skip
def test_no_answer_of_the_tool_about_a_silent_topic_raises_the_target_or_shrinks_the_distance(
    heard: bool, h: float, envelope: float | None, said_h: float | None, said_envelope: float | None, said: set[str],
    ago: int,
) -> None:  # fmt: skip
    drive = Drive()
    drive.car = Degradation(h=h, brake_envelope=envelope)
    if not heard:
        held = replace(drive.state.held, degradation=None, degradation_ns=None, health=None)
        drive.state, drive.car = replace(drive.state, held=held), None
    drive.ask.table = {tool: expert for tool, expert in EXPERTS.items() if tool != "vehicle_health"}
    drive.ticks(3)
    drive.ticks(max(1, ago), **SILENT)
    stood, distance = drive.target_mps, headway(drive)
    answer = health(0.0, warning_lamps=tuple(sorted(said)), speed_factor=1.0, headway_factor=1.0)
    drive.ask.table = {**EXPERTS, "vehicle_health": lambda a: replace(answer, h=said_h, brake_envelope=said_envelope)}
    drive.ticks(40, **SILENT)
    assert drive.target_mps <= stood + 1e-9
    assert headway(drive) >= distance - 1e-9


def test_an_older_message_takes_back_no_newer_one() -> None:
    drive = Drive()
    older = drive.observations().degradation
    drive.ticks(5)
    drive.car = lamps("oil", h=0.5)
    drive.ticks(2)
    drive.tick(degradation=older)
    assert drive.state.held.degradation == lamps("oil", h=0.5)


def on_motorway(car: Degradation, limit: str = "limit:120", road: str = "motorway") -> Drive:
    """A drive with this car, after a while in which its fault was told."""
    drive = Drive(Played(dict(EXPERTS), arbiter=arbiter()), 20.0, road)
    drive.ask.table["vehicle_health"] = lambda a: told(drive, "The wheels may lock.")
    drive.state = State()  # no sign has said which road it is: the map does, as on most drives
    drive.tick(fact("jurisdiction", "DEU"), fact("units", "km/h"))
    drive.tick(limit_sign(limit))
    drive.car = car
    drive.ticks(60)
    return drive


WEAK = Degradation(h=0.5, brake_envelope=0.2, warning_lamps=("abs",), dtcs=("C0035",))
LEAVE = "Leave the motorway: car fault"


def test_whose_car_asks_for_too_little_on_a_motorway_is_told_to_leave_it_and_why() -> None:
    drive = on_motorway(WEAK)
    assert target(drive) < 60 / 3.6
    assert drive.spoken().count(LEAVE) == 1
    said = next(each.advisory for _, _, each in drive.history if each.advisory.directive == LEAVE)
    assert "whoever comes from behind: hazard lights on" in said.justification
    drive.ticks(200)
    assert drive.spoken().count(LEAVE) == 1, "no news"


@pytest.mark.parametrize(
    ("car", "limit", "road"),
    [
        (Degradation(h=0.3, brake_envelope=0.9, warning_lamps=("abs",)), "limit:120", "motorway"),
        (WEAK, "limit:60", "motorway"),
        (WEAK, "limit:100", "rural"),
    ],
)
def test_who_is_fast_enough_or_among_slow_ones_is_not(car: Degradation, limit: str, road: str) -> None:
    drive = on_motorway(car, limit, road)
    assert LEAVE not in drive.spoken()
    assert drive.spoken().count("Drive gently: car fault") == 1


def test_where_water_makes_it_too_slow_it_is_told_then_and_once_though_the_target_wavers() -> None:
    drive = on_motorway(Degradation(h=0.3, brake_envelope=0.7, warning_lamps=("abs",)))
    assert LEAVE not in drive.spoken()
    for slippery in range(40):
        drive.weather = conditions(speed_factor=0.5 if slippery % 2 else 0.9)
        drive.ticks(10)
    assert drive.spoken().count(LEAVE) == 1


def test_a_car_that_falls_silent_is_not_told_as_a_fault_of_the_car() -> None:
    drive = driven(Degradation(h=0.0, brake_envelope=1.0))
    drive.ask.table["vehicle_health"] = lambda a: health(0.3, safe_to_drive="with_care", advice="Part of it is silent.")
    drive.car = Degradation(h=0.3, brake_envelope=None, unknown=("abs_fault", "tyre_pressure"))
    drive.ticks(60)
    said = [each for each in drive.spoken() if "car" in each.lower()]
    assert said == ["Car data missing"]
