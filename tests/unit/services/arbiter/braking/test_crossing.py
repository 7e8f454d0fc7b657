"""Vehicles out of side roads: braked for at the last moment, and only those that will surely be in the way."""

from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from proto.decision import ArbitrationRequest
from proto.messages import Kind
from proto.perception import Track
from proto.speech import Memory, News, Spoken
from services.arbiter.braking.lasting import UNSEEN_ACROSS_NS
from services.arbiter.decide import Inputs, decide
from tests.unit.services.arbiter.closed_loop import EMERGENCY
from tests.unit.services.arbiter.support import CALIBRATED, SECOND, acts, mirror, request, track

EGO_MPS, GAP_M, MEETS_M = 14.0, 18.0, 14.0
"""A gap that 14 m/s needs all of, and a clearance from which 8 m/s come into the way while the ego passes."""
gaps = st.floats(1.0, 60.0)
clearances = st.floats(0.1, 40.0)
speeds = st.floats(0.0, 20.0)


def aside(clearance_m: float = MEETS_M, vy_mps: float = 8.0, gap_m: float = GAP_M, **fields: object) -> Track:
    """A car on the right that drives to the left."""
    return track(
        gap_m, EGO_MPS, y_m=-clearance_m - 1.9, vy_mps=vy_mps, sigma_vy_mps=0.3, sigma_y_m=0.2,
        clearance_m=clearance_m, length_m=4.5, width_m=1.9, **fields,
    )  # fmt: skip


def asked_for(*tracks: Track) -> ArbitrationRequest:
    return request(None, others=tracks, ego_speed_mps=EGO_MPS)


def inputs_for(asked: ArbitrationRequest, *, gives_way: bool = False, **fields: object) -> Inputs:
    """The arbiter sees the same; `gives_way`: the driver was told to give way here."""
    inputs = mirror(asked, permission=EMERGENCY, **fields)
    told = Spoken(kind=Kind.GIVE_WAY, news=News(what="give_way"), stamp_ns=inputs.now_ns - 4 * SECOND)
    memory = Memory(spoken=(told,) if gives_way else ())
    return replace(inputs, state=replace(inputs.state, memory=memory, warned_ns=0, run_ns=10 * SECOND))


def brakes(*tracks: Track, gives_way: bool = False) -> bool:
    asked = asked_for(*tracks)
    return acts(asked, inputs_for(asked, gives_way=gives_way))


def test_a_car_that_can_halt_no_longer_is_braked_for_and_one_that_can_is_not() -> None:
    assert not brakes(aside())
    assert brakes(aside(clearance_m=9.0))


def test_a_car_that_the_ego_gives_way_to_is_not_expected_to_halt() -> None:
    assert brakes(aside(), gives_way=True)
    assert not brakes(aside(gap_m=40.0, clearance_m=20.0), gives_way=True)


def test_a_word_to_give_way_at_a_place_far_behind_counts_no_more() -> None:
    asked = asked_for(aside())
    inputs = inputs_for(asked, gives_way=True)
    for minutes in (1, 60):
        told = tuple(
            replace(each, stamp_ns=inputs.now_ns - minutes * 60 * SECOND) for each in inputs.state.memory.spoken
        )
        state = replace(inputs.state, memory=Memory(spoken=told))
        assert not acts(asked, replace(inputs, state=state))


@given(gap_m=gaps, clearance_m=clearances, vy_mps=speeds, gives_way=st.booleans())
def test_a_car_that_drives_away_or_stands_is_never_braked_for(
    gap_m: float, clearance_m: float, vy_mps: float, gives_way: bool
) -> None:
    assert not brakes(aside(clearance_m, -vy_mps, gap_m), gives_way=gives_way)


@given(gap_m=gaps, clearance_m=clearances, vy_mps=speeds, gives_way=st.booleans())
def test_a_car_that_comes_behind_the_ego_or_is_through_before_it_is_never_braked_for(
    gap_m: float, clearance_m: float, vy_mps: float, gives_way: bool
) -> None:
    passes_s = (gap_m + 4.5 + 4.5 + 2.0) / EGO_MPS
    comes_behind = vy_mps * passes_s < clearance_m - 1.3
    is_through = vy_mps * gap_m / EGO_MPS > clearance_m + 1.9 + 4.5 + 1.0
    if comes_behind or is_through:
        assert not brakes(aside(clearance_m, vy_mps, gap_m), gives_way=gives_way)


@given(gap_m=gaps, clearance_m=clearances, vy_mps=speeds, lead_m=st.floats(0.5, 60.0), gives_way=st.booleans())
def test_a_car_or_a_person_beside_the_way_hides_no_danger_in_it(
    gap_m: float, clearance_m: float, vy_mps: float, lead_m: float, gives_way: bool
) -> None:
    """Whom braking may not begin for yet never takes the place of one that it may begin for."""
    lead = track(lead_m, EGO_MPS, track_id=1)
    person = track(gap_m, EGO_MPS, track_id=2, kind="pedestrian", clearance_m=clearance_m, vy_mps=1.4)
    alone = brakes(lead, gives_way=gives_way)
    for other in (aside(clearance_m, vy_mps, gap_m), person):
        assert brakes(lead, other, gives_way=gives_way) or not alone


def under_way(seen: Track) -> Inputs:
    """An intervention for that car, one tick old."""
    asked = asked_for(seen)
    inputs = inputs_for(asked, gives_way=True)
    verdict = decide(asked, inputs, CALIBRATED)
    assert verdict.command is not None
    return replace(inputs, state=verdict.state)


def next_tick(inputs: Inputs, *tracks: Track, after_ns: int = SECOND // 10, tracks_age_s: float = 0.05) -> bool:
    """Whether the braking goes on."""
    asked = asked_for(*tracks)
    state = replace(inputs.state, sightings=mirror(asked).state.sightings)
    for step in range(1, after_ns // (SECOND // 10) + 1):
        after = inputs_for(asked, gives_way=True, now_ns=inputs.now_ns + step * SECOND // 10)
        reading = replace(after.reading, tracks_age_s=tracks_age_s)
        verdict = decide(asked, replace(after, state=state, reading=reading), CALIBRATED)
        state = verdict.state
    return verdict.command is not None


def test_braking_goes_on_while_the_car_is_out_of_sight_and_not_through_yet() -> None:
    inputs = under_way(aside())
    assert next_tick(inputs)
    assert next_tick(inputs, aside(MEETS_M - 0.8, unseen_s=0.4))
    assert not next_tick(inputs, after_ns=UNSEEN_ACROSS_NS + SECOND // 10)


def test_braking_ends_for_a_car_that_is_seen_to_halt_and_without_fresh_pictures() -> None:
    inputs = under_way(aside())
    assert not next_tick(inputs, aside(MEETS_M - 0.8, vy_mps=0.0))
    assert not next_tick(inputs, tracks_age_s=0.6)
