"""Bounded braking: deceleration, jerk, and a budget of seconds in a sliding window."""

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from proto.decision import Envelope
from services.arbiter.assessment.assess import Numbers, View, act_bounds, measure
from services.arbiter.assessment.reading import Pedals
from services.arbiter.braking.act import Need, Permission, brake, danger_mps2, needed_mps2, overridden, stop
from services.arbiter.braking.budget import LONGEST_STEP_NS, advanced
from services.arbiter.state import Intervention
from tests.unit.services.arbiter.closed_loop import EMERGENCY
from tests.unit.services.arbiter.support import CALIBRATED, GRANTED, HANDS_OFF, PAPER, SECOND, track

TICK = SECOND // 10
needs = st.builds(
    Need, mps2=st.floats(0.0, 1e6), hard=st.booleans(), grip_mps2=st.floats(0.0, 12.0), stands=st.just(False),
)  # fmt: skip
permissions = st.builds(
    Permission, grant_id=st.just("g"), max_deceleration_mps2=st.floats(0.5, 10.0), max_duration_s=st.floats(0.2, 30.0),
    refused=st.just(""), envelope=st.sampled_from(("soft", "emergency")),
)  # fmt: skip


def drive(
    needed: Sequence[Need | None], permission: Permission = GRANTED, pedals: list[Pedals] | None = None
) -> tuple[list[float], list[str]]:
    """Deceleration commanded tick by tick, and why there is none; None: nothing to brake for in that tick."""
    running, values, ends = Intervention(), [], []
    for tick, need in enumerate(needed):
        feet = pedals[tick] if pedals else HANDS_OFF
        if need is None:
            values.append(0.0)
            ends.append("")
            continue
        running, command, why = brake(running, need, permission, feet, tick * TICK, CALIBRATED)
        values.append(command.deceleration_mps2 if command else 0.0)
        ends.append(why)
    return values, ends


def test_braking_builds_up_with_bounded_jerk_to_the_grants_bound() -> None:
    values, _ = drive([Need(9.0)] * 8)
    assert values[:5] == [1.0, 2.0, 3.0, 4.0, 4.0]


def test_soft_braking_ends_with_its_budget_and_the_window_brings_it_back() -> None:
    values, ends = drive([Need(9.0)] * 80)
    assert values[19] > 0.0
    assert set(values[20:70]) == {0.0}
    assert ends[20] == "the longest braking allowed is over"
    assert set(ends[21:70]) == {"resting after an intervention"}
    assert values[70] > 0.0


def _behind(gap_m: float, ego_mps: float, lead_mps: float, ax_mps2: float) -> Numbers:
    lead, view = track(gap_m=gap_m, closing_mps=ego_mps - lead_mps, ax_mps2=ax_mps2), View(mu_low=0.7, mu_high=0.9)
    return measure(lead, view, act_bounds(view, CALIBRATED), CALIBRATED)


@given(st.floats(1.0, 80.0), st.floats(3.0, 40.0), st.floats(0.0, 1.0, exclude_max=True), st.floats(-9.0, 3.0))
def test_what_stands_is_braked_for_as_if_no_deceleration_of_it_were_measured(
    gap_m: float, ego_mps: float, share: float, ax_mps2: float
) -> None:
    seems = _behind(gap_m, ego_mps, share * CALIBRATED.stands_mps * 0.5, ax_mps2)
    assert danger_mps2(seems, ego_mps, CALIBRATED) == needed_mps2(seems, ego_mps, CALIBRATED)


@given(st.floats(1.0, 80.0), st.floats(6.0, 40.0), st.floats(0.5, 1.0), st.floats(0.0, 9.0), st.floats(0.0, 3.0))
def test_a_lead_that_brakes_is_braked_for_no_less_than_one_that_brakes_less(
    gap_m: float, ego_mps: float, share: float, mps2: float, more_mps2: float
) -> None:
    less, more = (_behind(gap_m, ego_mps, share * ego_mps, -each) for each in (mps2, mps2 + more_mps2))
    assert danger_mps2(more, ego_mps, CALIBRATED) >= danger_mps2(less, ego_mps, CALIBRATED) - 1e-9
    assert danger_mps2(less, ego_mps, CALIBRATED) >= needed_mps2(less, ego_mps, CALIBRATED)


def test_an_emergency_brakes_harder_where_the_grip_is_sure_and_no_softer_where_it_is_not() -> None:
    sure, unsure = (drive([Need(9.0, hard=True, grip_mps2=grip)] * 10, EMERGENCY)[0] for grip in (7.0, 3.0))
    assert max(sure) == CALIBRATED.emergency_brake_max_mps2
    assert max(unsure) == CALIBRATED.act_brake_max_mps2


def test_no_profile_without_emergency_braking_brakes_as_hard() -> None:
    running, hardest = Intervention(), 0.0
    for tick in range(20):
        need = Need(9.0, hard=True, grip_mps2=9.0)
        running, command, _ = brake(running, need, EMERGENCY, HANDS_OFF, tick * TICK, PAPER)
        hardest = max(hardest, command.deceleration_mps2 if command else 0.0)
        assert command is None or command.envelope == "soft"
    assert 0.0 < hardest <= PAPER.act_brake_max_mps2


def test_a_foot_on_the_brake_ends_nothing() -> None:
    foot = Pedals(brake=0.1, accelerator=0.0, steering_rad=0.0)
    values, _ = drive([Need(9.0)] * 6, pedals=[HANDS_OFF] * 3 + [foot] * 3)
    assert min(values[3:]) == 4.0


def test_a_foot_on_the_brake_takes_over_a_car_that_is_held() -> None:
    foot = Pedals(brake=0.1, accelerator=0.0, steering_rad=0.0)
    held = Need(0.0, stands=True)
    values, ends = drive([Need(9.0)] * 3 + [held] * 4, EMERGENCY, [HANDS_OFF] * 5 + [foot] * 2)
    assert min(values[:5]) > 0.0
    assert values[5:] == [0.0, 0.0]
    assert ends[5] == "the driver brakes"


def test_holding_at_standstill_spends_no_budget() -> None:
    values, _ = drive([Need(9.0)] * 3 + [Need(0.0, stands=True)] * 600, EMERGENCY)
    assert min(values) > 0.0


def test_pressing_on_or_steering_away_since_it_began_is_an_override() -> None:
    assert overridden(Pedals(brake=0.0, accelerator=0.4, steering_rad=0.0), HANDS_OFF, CALIBRATED)
    assert overridden(Pedals(brake=0.0, accelerator=0.2, steering_rad=1.0), HANDS_OFF, CALIBRATED)
    assert not overridden(Pedals(brake=0.0, accelerator=0.2, steering_rad=0.1), HANDS_OFF, CALIBRATED)


@given(st.lists(st.none() | needs, min_size=1, max_size=400), permissions)
def test_no_need_and_no_grant_gets_past_the_bounds(needed: list[Need | None], permission: Permission) -> None:
    values, _ = drive(needed, permission)
    soft = permission.envelope == "soft"
    most = CALIBRATED.act_brake_max_mps2 if soft else CALIBRATED.emergency_brake_max_mps2
    assert max(values) <= min(permission.max_deceleration_mps2, most) + 1e-9
    longest = CALIBRATED.act_duration_s if soft else CALIBRATED.emergency_duration_s
    budget = min(permission.max_duration_s, longest)
    window = round((budget + CALIBRATED.act_rest_s) * 10)
    for tick, value in enumerate(values):
        held = max(values[max(0, tick - 2) : tick], default=0.0)  # a command holds for 0.2 s
        assert value - held <= CALIBRATED.act_jerk_mps3 * 0.2 + 1e-9
    for start in range(max(1, len(values) - window)):
        assert sum(value > 0.0 for value in values[start : start + window]) / 10 <= budget + 0.2


@given(
    steps=st.lists(st.integers(-(10**16), 10**16) | st.integers(0, 2 * 10**8), min_size=1, max_size=60),
    start=st.integers(0, 10**18),
)
def test_no_clock_makes_the_running_clock_leap_or_go_back(steps: list[int], start: int) -> None:
    run_ns, now_ns = 0, start
    for step in steps:
        after = advanced(run_ns, now_ns, now_ns + step)
        assert 0 <= after - run_ns <= LONGEST_STEP_NS
        run_ns, now_ns = after, now_ns + step


@given(st.floats(0.5, 6.5), st.floats(0.1, 6.5), st.sampled_from(("soft", "emergency")), st.booleans())
def test_a_grant_that_takes_the_place_of_one_under_way_binds_at_once(
    braked_mps2: float, most_mps2: float, envelope: Envelope, hard: bool
) -> None:
    running = Intervention(since_ns=0, last_ns=9 * TICK, brake_mps2=braked_mps2, pedals=HANDS_OFF)
    later = replace(EMERGENCY, max_deceleration_mps2=most_mps2, envelope=envelope)
    _, command, _ = brake(running, Need(9.0, hard=hard, grip_mps2=9.0), later, HANDS_OFF, 10 * TICK, CALIBRATED)
    assert command is not None
    assert command.deceleration_mps2 <= most_mps2


@given(st.floats(-1e9, -0.06) | st.floats(1.7, 1e9), st.sampled_from(("brake", "accelerator", "steering_rad")))
def test_a_pedal_or_a_wheel_that_shows_what_none_can_is_not_seen(absurd: float, which: str) -> None:
    absurd = absurd - 2.0 if which == "steering_rad" and absurd < 0.0 else absurd
    _, command, why = brake(Intervention(), Need(9.0), GRANTED, replace(HANDS_OFF, **{which: absurd}), 0, CALIBRATED)
    assert command is None
    assert why


def test_an_override_begins_a_rest() -> None:
    running, _, _ = brake(Intervention(), Need(9.0), GRANTED, HANDS_OFF, 0, CALIBRATED)
    assert stop(running, TICK, CALIBRATED).rest_until_ns == TICK + round(CALIBRATED.act_rest_s * SECOND)
    assert stop(Intervention(), TICK, CALIBRATED) == Intervention()
