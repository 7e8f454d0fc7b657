"""An actor that drops out is gone with track and box, however its track is numbered, and nobody else is."""

from hypothesis import given
from hypothesis import strategies as st

from evaluation.corruption.corruptor import Corruptor
from evaluation.corruption.spec import CorruptionSpec
from proto import topics
from proto.perception import Box
from tests.unit.evaluation.corruption.worlds import (
    ORIGIN,
    SOME,
    TICK,
    boxes_of,
    track,
    tracks_after,
    true_actor,
    truth,
)


def box(track_id: int, kind: str = "vehicle") -> Box:
    return Box(x0_px=0, y0_px=0, x1_px=9, y1_px=9, kind=kind, score=0.9, track_id=track_id)  # type: ignore[arg-type]


def seen(seed: int, *, switch: bool) -> list[set[float]]:
    """Where tracks are left of two cars, tick by tick; the first one's track changes its number where asked."""
    corruptor, out = Corruptor(CorruptionSpec(seed=seed, dropout=0.4)), []
    for number in range(150):
        at_ns = ORIGIN + number * TICK
        corruptor.truth(truth(number / 10, actors=(true_actor(1, 30.0), true_actor(2, 55.0, 3.5))), at_ns)
        first = 1 + (number // 20 if switch else 0) * 10
        after = tracks_after(corruptor, at_ns, track(first, 30.5), track(2, 54.0, 3.0), lead=first)
        out.append({each.x_m for each in after.tracks})
    return out


@SOME
@given(st.integers(0, 10**6))
def test_a_new_number_does_not_bring_a_lost_actor_back(seed: int) -> None:
    assert seen(seed, switch=True) == seen(seed, switch=False)


def test_actors_drop_out_each_for_itself() -> None:
    left = seen(3, switch=False)
    assert {frozenset(each) for each in left} == {
        frozenset(),
        frozenset({30.5}),
        frozenset({54.0}),
        frozenset({30.5, 54.0}),
    }


@SOME
@given(st.integers(0, 10**6))
def test_who_is_left_is_unchanged_and_leads_only_if_it_is_there(seed: int) -> None:
    corruptor = Corruptor(CorruptionSpec(seed=seed, dropout=0.5))
    near, far, aside = track(1, 30.0), track(2, 60.0), track(3, 20.0, 3.5)
    for number in range(40):
        after = tracks_after(corruptor, ORIGIN + number * TICK, near, far, aside, lead=1)
        assert [each for each in (near, far, aside) if each in after.tracks] == list(after.tracks)
        expected = 1 if near in after.tracks else 2 if far in after.tracks else None
        assert after.lead_track_id == expected


@SOME
@given(st.integers(0, 10**6))
def test_boxes_go_with_their_tracks_and_signs_stay(seed: int) -> None:
    corruptor = Corruptor(CorruptionSpec(seed=seed, dropout=0.5))
    for number in range(40):
        at_ns = ORIGIN + number * TICK
        left = {each.track_id for each in tracks_after(corruptor, at_ns, track(1, 30.0), track(2, 60.0)).tracks}
        after = corruptor.leave(
            topics.BOXES, boxes_of(box(1), box(2), box(1, "sign"), box(0)), "perception", at_ns
        ).message
        assert {each.track_id for each in after.boxes if each.kind == "vehicle"} == left | {0}
        assert box(1, "sign") in after.boxes
