"""Interventions from their beginning to their end, with the arbiter, the receiver and the car in one loop."""

from collections.abc import Callable

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.messages import Kind
from proto.speech import Message, News
from services.arbiter.assessment.assess import View
from services.arbiter.assessment.reading import Pedals
from services.arbiter.braking.act import Permission, budget_s
from services.arbiter.braking.budget import owed, resumed
from services.arbiter.state import Owed, fresh
from tests.unit.services.arbiter.closed_loop import EMERGENCY, Asked, Moment, as_is, braked, drive, impact_mps
from tests.unit.services.arbiter.support import CALIBRATED, GRANTED, HANDS_OFF

SOME = settings(max_examples=25, deadline=None)
speeds = st.floats(12 / 3.6, 60 / 3.6)
grounds = st.sampled_from(
    [
        {},
        {"mu": 0.5, "mu_bounds": (0.43, 0.82)},
        {"effect": 0.37},
    ]
)
"""Dry, wet, and with brakes of a third."""


def approach(speed_mps: float, **how: object) -> list[Moment]:
    """Six seconds before a car that stands."""
    return drive(speed_mps, 6.0 * speed_mps, **how)  # type: ignore[arg-type]


def first(moments: list[Moment]) -> int:
    """The tick of the first command."""
    return braked(moments).index(True)


@SOME
@given(speed_mps=speeds, ground=grounds)
def test_an_absent_driver_does_not_hit_a_car_that_stands_and_stays_before_it(
    speed_mps: float, ground: dict[str, object]
) -> None:
    moments = approach(speed_mps, **ground)
    assert impact_mps(moments) <= (5.0 / 3.6 if "effect" in ground else 0.0)
    assert all(braked(moments)[first(moments) :])
    assert moments[-1].speed_mps == 0.0


@SOME
@given(speed_mps=speeds)
def test_the_driver_is_warned_for_long_enough_before(speed_mps: float) -> None:
    moments = approach(speed_mps)
    warned = next(tick for tick, each in enumerate(moments) if each.hazard)
    assert first(moments) - warned >= CALIBRATED.act_warned_s * 10


def test_a_first_warning_that_comes_late_holds_braking_back_only_while_there_is_time() -> None:
    def unheard(tick: int, asked: Asked) -> Asked:
        """No message has been remembered."""
        state = msgspec.structs.replace(asked.inputs.state, warned_ns=None)
        return Asked(asked.request, msgspec.structs.replace(asked.inputs, state=state))

    moments = approach(10.0, change=unheard)
    assert "the driver is warned first" in {each.withheld for each in moments}
    assert first(moments) > first(approach(10.0))
    assert impact_mps(moments) == 0.0


def test_a_soft_grant_brakes_no_harder_and_no_longer_than_it_says() -> None:
    moments = approach(14.0, permission=GRANTED)
    values = [each.command.deceleration_mps2 for each in moments if each.command is not None]
    assert max(values) <= GRANTED.max_deceleration_mps2
    assert len(values) <= 10 * GRANTED.max_duration_s
    assert {each.command.envelope for each in moments if each.command is not None} == {"soft"}


def test_an_intervention_that_ends_while_its_danger_remains_is_said_at_once() -> None:
    moments = drive(22.0, 110.0, permission=GRANTED, ticks=60)
    over = first(moments) + braked(moments)[first(moments) :].index(False)
    assert moments[over].gap_m > 0.0
    assert moments[over].speed_mps > 5.0
    assert (moments[over].kind, moments[over].hazard) == ("SPEAK", "closing_lead")
    assert moments[over].withheld == "the longest braking allowed is over"


def test_what_the_words_of_an_intervention_leave_out_is_still_owed() -> None:
    """A held car loses sight of the road user ahead, and reports a fault. The words "Foot on the brake" do not tell the fault."""
    fault = Message(kind=Kind.VEHICLE, news=News(what="brake"), names=("brake",))

    def unseen(tick: int, asked: Asked) -> Asked:
        if tick < 100:
            return asked
        view = msgspec.structs.replace(asked.inputs.reading.view, actors=())
        quiet = msgspec.structs.replace(asked.request.fused, hazard="", first_notice=True, urgency="warning")
        told = msgspec.structs.replace(asked.request, lead=None, fused=quiet, message=fault)
        reading = msgspec.structs.replace(asked.inputs.reading, view=view)
        return Asked(told, msgspec.structs.replace(asked.inputs, reading=reading))

    moments = approach(8.0, change=unseen)
    assert {(each.kind, each.hazard) for each in moments[100:]} == {("ACT", "")}
    assert moments[-1].state.memory.noticed == ()
    assert moments[-1].state.memory.last(Kind.VEHICLE) is None


def doubting(ticks: frozenset[int], **fields: object) -> Callable[[int, Asked], Asked]:
    """In these ticks the car ahead is told with other fields, in both views."""

    def change(tick: int, asked: Asked) -> Asked:
        lead = asked.request.lead
        if tick not in ticks or lead is None:
            return asked
        told = msgspec.structs.replace(lead, **fields)
        view = msgspec.structs.replace(asked.inputs.reading.view, actors=(told,))
        reading = msgspec.structs.replace(asked.inputs.reading, view=view)
        request = msgspec.structs.replace(asked.request, lead=told)
        return Asked(request, msgspec.structs.replace(asked.inputs, reading=reading))

    return change


@SOME
@given(speed_mps=st.floats(40 / 3.6, 60 / 3.6), confidence=st.floats(0.7, 0.79))
def test_a_car_with_weak_brakes_asks_for_no_more_certainty_than_its_braking_needs(
    speed_mps: float, confidence: float
) -> None:
    doubted = doubting(frozenset(range(150)), confidence=confidence)
    weak, whole = approach(speed_mps, effect=0.37, change=doubted), approach(speed_mps, change=doubted)
    assert impact_mps(weak) <= 5.0 / 3.6
    for moments in (weak, whole):
        commands = (each.command.deceleration_mps2 for each in moments if each.command is not None)
        assert max(commands, default=0.0) <= CALIBRATED.act_brake_max_mps2


LEAPS = st.fixed_dictionaries(
    {"steady_s": st.just(0.0), "vx_mps": st.floats(-30.0, -0.1), "sigma_vx_mps": st.floats(0.0, 50.0)}
)
"""As tracks are told whose measured range or speed has leapt."""


@SOME
@given(speed_mps=st.floats(30 / 3.6, 60 / 3.6), after=st.integers(8, 40), count=st.integers(1, 4), leap=LEAPS)
def test_a_measurement_that_leaps_does_not_end_braking_for_a_car_that_is_surely_there(
    speed_mps: float, after: int, count: int, leap: dict[str, object]
) -> None:
    at = first(approach(speed_mps)) + after
    moments = approach(speed_mps, change=doubting(frozenset(range(at, at + count)), **leap))
    assert impact_mps(moments) == 0.0
    assert all(braked(moments)[first(moments) :])


@SOME
@given(after=st.integers(1, 15), leap=LEAPS)
def test_a_doubt_that_stays_ends_braking_within_a_second(after: int, leap: dict[str, object]) -> None:
    at = first(approach(16.0)) + after
    moments = approach(16.0, change=doubting(frozenset(range(at, 150)), **leap))
    near = next((tick for tick, each in enumerate(moments) if each.gap_m < 8.0), 150)
    assert not any(braked(moments)[at + 6 : near])


@pytest.mark.parametrize(
    "doubt",
    [
        {"confidence": 0.3},
        {"clearance_m": 1.0},
        {"vx_mps": 0.5},
        {"unseen_s": 1.0},
        {"sigma_vx_mps": -1.0},
        {"oncoming": True},
    ],
)
def test_braking_ends_at_once_for_a_car_that_is_no_longer_surely_in_the_way(doubt: dict[str, object]) -> None:
    at = first(approach(16.0)) + 5
    moments = approach(16.0, change=doubting(frozenset(range(at, at + 10)), steady_s=0.0, **doubt))
    assert not any(braked(moments)[at : at + 10])


def test_braking_ends_when_the_lead_is_no_slower() -> None:
    moments = drive(16.0, 40.0, lead_mps=6.0)
    on = braked(moments)
    assert impact_mps(moments) == 0.0
    assert not any(on[-30:])
    assert moments[-1].speed_mps >= 4.0


@SOME
@given(speed_mps=st.floats(30 / 3.6, 60 / 3.6), ground=grounds)
def test_a_slower_lead_is_not_touched_and_braking_ends_at_its_speed(
    speed_mps: float, ground: dict[str, object]
) -> None:
    lead_mps = 20 / 3.6
    moments = drive(speed_mps, 6.0 * (speed_mps - lead_mps), lead_mps=lead_mps, **ground)  # type: ignore[arg-type]
    assert min(each.gap_m for each in moments) > 0.0
    last = max(tick for tick, on in enumerate(braked(moments)) if on)
    assert moments[last].speed_mps == pytest.approx(lead_mps, abs=1.0)


@SOME
@given(speed_mps=st.floats(30 / 3.6, 60 / 3.6), lead_mps2=st.floats(1.0, 5.0))
def test_a_lead_that_brakes_to_a_halt_is_not_hit(speed_mps: float, lead_mps2: float) -> None:
    assert impact_mps(drive(speed_mps, 40.0, lead_mps=speed_mps, lead_mps2=lead_mps2, ticks=200)) == 0.0


def test_braking_ends_when_the_person_has_left_the_path() -> None:
    def leaves(tick: int, asked: Asked) -> Asked:
        if tick < 48:
            return asked
        reading = asked.inputs.reading
        nobody = msgspec.structs.replace(reading, view=msgspec.structs.replace(reading.view, actors=()))
        empty = msgspec.structs.replace(asked.request, pedestrian=None)
        return Asked(empty, msgspec.structs.replace(asked.inputs, reading=nobody))

    moments = approach(12.0, kind="pedestrian", change=leaves)
    assert any(braked(moments)[:48])
    assert not any(braked(moments)[48:])


# -- the driver --------------------------------------------------------------------------------------------------------------


@SOME
@given(brake=st.floats(0.06, 0.25), speed_mps=speeds)
def test_a_driver_who_brakes_too_little_is_helped(brake: float, speed_mps: float) -> None:
    foot = Pedals(brake=brake, accelerator=0.0, steering_rad=0.0)
    alone = approach(speed_mps)
    touched = approach(speed_mps, feet=lambda tick: HANDS_OFF if tick < first(alone) + 3 else foot)
    assert impact_mps(touched) == 0.0


def test_a_driver_who_brakes_enough_is_left_to_it() -> None:
    foot = Pedals(brake=0.6, accelerator=0.0, steering_rad=0.0)
    assert not any(braked(approach(14.0, feet=lambda tick: foot if tick >= 30 else HANDS_OFF)))


@pytest.mark.parametrize(
    "feet",
    [
        Pedals(brake=0.0, accelerator=0.7, steering_rad=0.0),
        Pedals(brake=0.0, accelerator=0.45, steering_rad=0.0),
        Pedals(brake=0.0, accelerator=0.2, steering_rad=0.7),
        Pedals(),
    ],
)
def test_a_driver_who_accelerates_or_steers_away_wins_and_so_do_pedals_that_are_not_seen(feet: Pedals) -> None:
    begins = first(approach(14.0))
    moments = approach(14.0, feet=lambda tick: HANDS_OFF if tick < begins + 5 else feet)
    rest = round(CALIBRATED.act_rest_s * 10)
    assert braked(moments)[begins + 4]
    assert not any(braked(moments)[begins + 5 : begins + 5 + rest])


# -- what must not begin or prolong braking --------------------------------------------------------------------------------


def only(ticks: frozenset[int], change: Callable[[int, Asked], Asked | None]) -> Callable[[int, Asked], Asked | None]:
    """A change in these ticks alone."""
    return lambda tick, asked: change(tick, asked) if tick in ticks else asked


def silent(tick: int, asked: Asked) -> Asked | None:
    """No decision is asked for."""
    return None


def blind(tick: int, asked: Asked) -> Asked | None:
    """The own pictures are late."""
    reading = msgspec.structs.replace(asked.inputs.reading, tracks_age_s=1.0, view=_nobody(asked))
    return Asked(asked.request, msgspec.structs.replace(asked.inputs, reading=reading))


def lost(tick: int, asked: Asked) -> Asked | None:
    """A tool is late, and the advice doubtful."""
    doubtful = msgspec.structs.replace(asked.request.fused, confidence=0.1)
    return Asked(msgspec.structs.replace(asked.request, tool_timed_out=True, fused=doubtful), asked.inputs)


def restarted(tick: int, asked: Asked) -> Asked | None:
    """The arbiter starts afresh."""
    return Asked(asked.request, msgspec.structs.replace(asked.inputs, state=fresh(CALIBRATED)))


def _nobody(asked: Asked) -> View:
    return msgspec.structs.replace(asked.inputs.reading.view, actors=())


faults = st.sampled_from([silent, blind, lost, restarted])
windows = st.builds(
    lambda start, length: frozenset(range(start, start + length)), st.integers(0, 90), st.integers(1, 30)
)


@SOME
@given(speed_mps=st.floats(5.0, 30.0), fault=faults, window=windows)
def test_no_fault_brakes_a_car_with_nothing_to_brake_for(
    speed_mps: float, fault: Callable[[int, Asked], Asked | None], window: frozenset[int]
) -> None:
    """Following at the lead's own speed."""
    moments = drive(speed_mps, 1.8 * speed_mps, lead_mps=speed_mps, change=only(window, fault), ticks=100)
    assert not any(braked(moments))


@SOME
@given(fault=faults, window=windows, permission=st.sampled_from([GRANTED, EMERGENCY]))
def test_a_fault_begins_no_braking_sooner(
    fault: Callable[[int, Asked], Asked | None], window: frozenset[int], permission: Permission
) -> None:
    sound = approach(13.0, permission=permission)
    faulty = approach(13.0, permission=permission, change=only(window, fault))
    if any(braked(faulty)):
        assert first(faulty) >= first(sound)


@SOME
@given(after=st.integers(0, 25), fault=st.sampled_from([silent, blind]))
def test_silence_ends_braking_within_half_a_second(after: int, fault: Callable[[int, Asked], Asked | None]) -> None:
    begins = first(approach(16.0))
    ticks = frozenset(range(begins + after, 150))
    moments = approach(16.0, change=only(ticks, fault))
    assert all(each.applied_mps2 == 0.0 for each in moments[begins + after + 5 :] if each.speed_mps > 0.3)


@SOME
@given(frozen_at=st.integers(0, 70))
def test_a_frozen_picture_begins_no_braking_and_ends_it_within_a_second(frozen_at: int) -> None:
    """The same place of the car ahead in each picture, stamped as new, while the ego drives on."""
    kept: list[Asked] = []

    def frozen(tick: int, asked: Asked) -> Asked:
        if tick < frozen_at:
            return asked
        kept.append(asked)
        old = kept[0]
        view = msgspec.structs.replace(asked.inputs.reading.view, actors=old.inputs.reading.view.actors)
        reading = msgspec.structs.replace(asked.inputs.reading, view=view)
        request = msgspec.structs.replace(asked.request, lead=old.request.lead)
        return Asked(request, msgspec.structs.replace(asked.inputs, reading=reading))

    sound, moments = approach(14.0), approach(14.0, change=frozen)
    begins = first(sound)
    if frozen_at < begins - 3:
        assert not any(braked(moments))
    moving = [tick for tick, each in enumerate(moments) if each.command is not None and each.speed_mps > 0.3]
    assert not moving or max(moving) <= max(frozen_at + 10, begins + 3)


@SOME
@given(
    restarts=st.lists(st.integers(0, 149), max_size=6),
    permission=st.builds(
        Permission, grant_id=st.just("g"), max_deceleration_mps2=st.floats(0.5, 2.0), max_duration_s=st.floats(0.5, 6.0),
        refused=st.just(""), envelope=st.sampled_from(("soft", "emergency")),
    ),
)  # fmt: skip
def test_no_restart_renews_the_budget(restarts: list[int], permission: Permission) -> None:
    """Too weak a braking to end the danger: each arbiter would go on for as long as it may."""
    kept = [Owed()]

    def restarting(tick: int, asked: Asked) -> Asked:
        state = asked.inputs.state
        kept.append(owed(state.intervention, state.run_ns, kept[-1]))
        if tick in restarts:
            state = msgspec.structs.replace(
                fresh(CALIBRATED),
                intervention=resumed(kept[-1], CALIBRATED.act_rest_s),
                sightings=state.sightings,
            )
        return Asked(asked.request, msgspec.structs.replace(asked.inputs, state=state))

    on = braked(approach(16.0, permission=permission, change=restarting))
    budget = budget_s(permission, CALIBRATED)
    window = round((budget + CALIBRATED.act_rest_s) * 10)
    assert all(sum(on[start : start + window]) <= 10 * budget + 2 for start in range(len(on)))


def test_nothing_changes_without_a_fault() -> None:
    assert braked(approach(13.0, change=as_is)) == braked(approach(13.0))
