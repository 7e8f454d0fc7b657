"""Evidence adds up over frames; one frame alone never decides, and nothing never becomes something."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.drivelm.reading.crops import Region
from services.drivelm.reading.evidence import CONTESTED, LEGIBLE_PX, Evidence, belief, fused, weight
from services.drivelm.reading.sign_tracks import SignTrack
from services.drivelm.vocabulary.classes import OTHER

Ranked = tuple[tuple[str, float], ...]
SURE: Ranked = (("limit:80", 0.98), ("limit:60", 0.01))


def _seen(frames: Sequence[Ranked], height_px: float = 30.0, keep: float = 1.0) -> Evidence:
    evidence = Evidence()
    for ranked in frames:
        evidence = fused(evidence, ranked, height_px, keep)
    return evidence


def _track(frames: Sequence[Ranked], height_px: float = 30.0, kind: str = "sign") -> SignTrack:
    region = Region(0, 0, height_px, height_px)
    track = SignTrack.opened(("tele", 1), kind, region, 0)
    for ranked in frames:
        track = track.read(ranked, region, 0)
    return track


def test_a_single_frame_however_sure_is_not_believed() -> None:
    track = _track([(("limit:80", 1.0),)])
    assert not track.believed(track.belief())


def test_three_clear_agreeing_frames_are_believed() -> None:
    track = _track([SURE] * 3)
    best = track.belief()
    assert best.reading == "limit:80"
    assert track.believed(best)


def test_frames_that_contradict_each_other_are_not_believed() -> None:
    other = (("limit:60", 0.98), ("limit:80", 0.01))
    track = _track([SURE, other] * 4)
    assert not track.believed(track.belief())


def test_many_blurred_frames_do_not_add_up_to_belief() -> None:
    track = _track([(("limit:80", 0.5), ("limit:60", 0.3))] * 30)
    assert not track.believed(track.belief())


@given(st.lists(st.booleans(), min_size=2, max_size=40))
def test_no_number_is_believed_that_is_lower_in_more_than_a_small_share_of_the_frames(lower: list[bool]) -> None:
    track = _track([(("limit:50" if each else "limit:80", 0.98),) for each in lower])
    share = 0.98 * sum(lower) / len(lower)
    believed = track.believed(track.belief()) and track.belief().reading == "limit:80"
    assert not believed or share < CONTESTED


def test_a_lower_number_seen_now_and_then_is_told_as_a_candidate() -> None:
    best = _track([SURE] * 9 + [(("limit:50", 0.98),)] * 2 + [SURE] * 5).belief()
    assert best.reading == "limit:80"
    assert dict(best.ranked)["limit:50"] >= CONTESTED


def test_a_higher_number_seen_now_and_then_keeps_no_lower_one_from_belief() -> None:
    track = _track([SURE] * 9 + [(("limit:100", 0.98),)] + [SURE] * 5)
    assert track.believed(track.belief())


@pytest.mark.parametrize(("kind", "empty"), [("sign", "no_vehicles"), ("panel", "led:blank")])
@pytest.mark.parametrize(("height_px", "believed"), [(LEGIBLE_PX - 1, False), (LEGIBLE_PX, True)])
def test_nothing_in_a_ring_is_believed_only_where_a_number_could_be_read(
    kind: str, empty: str, height_px: float, believed: bool
) -> None:
    track = _track([((empty, 0.98),)] * 20, height_px, kind)
    assert track.believed(track.belief()) is believed


def test_background_is_never_believed_to_be_a_sign() -> None:
    track = _track([((OTHER, 0.97), ("limit:30", 0.02))] * 20)
    assert not track.believed(track.belief())
    assert not track.doubted(track.belief())


def test_small_crops_count_for_less() -> None:
    assert weight(9) < weight(15) < weight(26) == weight(60)
    small, large = belief(_seen([SURE] * 2, 10)), belief(_seen([SURE] * 2, 40))
    assert small.probability < large.probability


def test_a_light_that_changes_is_believed_anew_within_three_frames() -> None:
    red, green = (("light:red", 0.98),), (("light:green", 0.98),)
    track = _track([red] * 20 + [green] * 3, kind="light")
    best = track.belief()
    assert best.reading == "light:green"
    assert track.believed(best)


def test_a_narrow_light_is_believed_from_twenty_pixels() -> None:
    region = Region(0, 0, 9, 20)
    track = SignTrack.opened(("tele", 1), "light", region, 0)
    for _ in range(6):
        track = track.read((("light:red", 0.97),), region, 0)
    assert track.believed(track.belief())


_READINGS = st.sampled_from(["limit:30", "limit:50", "limit:80", OTHER])
_FRAME = st.lists(st.tuples(_READINGS, st.floats(0, 1)), max_size=3, unique_by=lambda row: row[0]).map(tuple)


@given(st.lists(_FRAME, max_size=12))
def test_the_posterior_is_a_probability_whatever_is_offered(frames: Sequence[Ranked]) -> None:
    best = belief(_seen(frames))
    assert 0.0 <= best.probability <= 1.0
    assert sum(share for _, share in best.ranked) <= 1.0 + 1e-9
