"""Limits for one way only, and those of school hours: they may lower, and end or raise nothing."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.scene import Fact
from services.orchestrator.signs.limits import in_force
from tests.unit.services.orchestrator.support import FEW, KMH, Drive, end_sign, fact, limit_sign

ARROWS = ("plate:arrow_left", "plate:arrow_right", "plate:arrow_ahead")


def at_fifty() -> Drive:
    drive = Drive(road="rural")
    drive.tick(limit_sign("limit:50"))
    assert drive.target_mps == pytest.approx(50 * KMH)
    return drive


@pytest.mark.parametrize("arrow", ARROWS)
def test_a_lower_limit_for_one_way_counts_and_a_higher_one_does_not(arrow: str) -> None:
    lower, higher = at_fifty(), at_fifty()
    lower.tick(limit_sign("limit:30", track_id=8, plates=(arrow,)))
    higher.tick(limit_sign("limit:80", track_id=8, plates=(arrow,)))
    assert lower.target_mps == pytest.approx(30 * KMH)
    assert higher.target_mps == pytest.approx(50 * KMH)
    assert len(in_force(higher.state.signs)) == 2, "it stands beside the other"


@pytest.mark.parametrize("arrow", ARROWS)
@pytest.mark.parametrize("code", ["limit_end", "all_end", "town_exit", "motorway", "border:AUT", "zone_end"])
def test_an_end_or_a_start_for_one_way_changes_nothing(code: str, arrow: str) -> None:
    drive = at_fifty()
    before = drive.state.signs
    drive.tick(end_sign(code, plates=(arrow,)))
    after = drive.state.signs
    assert (after.permanent, after.road_type, after.jurisdiction) == (
        before.permanent, before.road_type, before.jurisdiction,
    )  # fmt: skip
    assert drive.target_mps <= 50 * KMH + 1e-9


@FEW
@given(
    posted=st.lists(st.sampled_from([20, 30, 40, 50, 60, 70, 80, 100]), max_size=3),
    plate=st.sampled_from(ARROWS),
    first=st.booleans(),
)
def test_a_town_whose_sign_another_track_shows_with_an_arrow_slows_and_never_raises(
    posted: list[int], plate: str, first: bool
) -> None:
    """Town signs stand for one road: an arrow below one was misread, and 70 km/h was held through the town."""
    drive = Drive(road="rural")
    for number, value in enumerate(posted):
        drive.tick(limit_sign(f"limit:{value}", track_id=20 + number))
    for number, plates in enumerate([(plate,), ()] if first else [(), (plate,)]):
        drive.tick(end_sign("town_entry", track_id=30 + number, plates=plates))
    assert drive.target_mps <= 50 * KMH + 1e-9


@FEW
@given(posted=st.sampled_from([None, 20, 30, 50, 51, 60, 70, 100]), plate=st.sampled_from(ARROWS))
@pytest.mark.parametrize("road", ["urban", "rural", "living_street", "motorway"])
def test_a_town_under_an_arrow_never_raises_the_target(road: str, posted: int | None, plate: str) -> None:
    drive = Drive(road=road)
    drive.ticks(1)
    if posted is not None:
        drive.tick(limit_sign(f"limit:{posted}"))
    before_mps = drive.target_mps
    drive.tick(end_sign("town_entry", track_id=9, plates=(plate,)))
    assert drive.target_mps <= before_mps + 1e-9
    if road == "rural":
        assert drive.target_mps <= 50 * KMH + 1e-9


_SIGNS = st.one_of(
    st.builds(
        lambda value, arrow: limit_sign(f"limit:{value}", track_id=8, plates=(arrow,)),
        st.sampled_from([10, 30, 50, 80, 100, 130]),
        st.sampled_from(ARROWS),
    ),
    st.builds(
        lambda code, arrow: end_sign(code, track_id=9, plates=(arrow,)),
        st.sampled_from(
            ["limit_end", "all_end", "national", "town_entry", "town_exit", "motorway", "border:FRA", "led:end"]
        ),
        st.sampled_from(ARROWS),
    ),
)


@FEW
@given(st.lists(_SIGNS, min_size=1, max_size=6))
def test_nothing_under_an_arrow_ever_raises_the_target(signs: list[Fact]) -> None:
    drive = at_fifty()
    for sign in signs:
        drive.tick(sign)
        assert drive.target_mps <= 50 * KMH + 1e-9


@FEW
@given(
    later_s=st.one_of(st.floats(0.1, 4.5), st.floats(5.5, 60.0)),
    posted=st.sampled_from([30, 40, 50, 80]),
    confidence=st.sampled_from([0.35, 0.5, 0.6, 1.0]),
    plates=st.sampled_from([(), ("plate:time",), ("plate:lorries",), ("plate:arrow_left",), ("plate:distance",)]),
)
@pytest.mark.parametrize("arrow", ARROWS)
def test_a_limit_under_an_arrow_holds_until_a_later_post_shows_one_for_all(
    arrow: str, later_s: float, posted: int, confidence: float, plates: tuple[str, ...]
) -> None:
    """A plate misread as an arrow used to hold a town's limit for the rest of the road."""
    drive = at_fifty()
    drive.tick(limit_sign("limit:20", track_id=8, plates=(arrow,)))
    drive.now_ns += int(later_s * 1e9)
    drive.tick(limit_sign(f"limit:{posted}", track_id=9, plates=plates, confidence=confidence))
    for_all = confidence >= 0.6 and not plates and later_s > 5.0
    assert drive.target_mps == pytest.approx((posted if for_all else 20) * KMH)


def test_a_school_limit_counts_beside_the_other_until_its_own_end() -> None:
    drive = at_fifty()
    drive.tick(limit_sign("limit:20", track_id=8, plates=("plate:school",)))
    assert drive.target_mps == pytest.approx(20 * KMH)
    drive.tick(fact("sign", "school", track_id=9, passed=True))
    assert drive.target_mps == pytest.approx(20 * KMH)
    drive.tick(end_sign("school_end", track_id=10))
    assert drive.target_mps == pytest.approx(50 * KMH)


def test_the_end_of_a_school_zone_ends_no_other_limit() -> None:
    drive = at_fifty()
    drive.tick(limit_sign("limit:30", track_id=8, plates=("plate:time",)))
    drive.tick(end_sign("school_end", track_id=10))
    assert drive.target_mps == pytest.approx(30 * KMH)


def test_an_unsure_end_of_a_school_zone_ends_nothing() -> None:
    drive = at_fifty()
    drive.tick(limit_sign("limit:20", track_id=8, plates=("plate:school",)))
    drive.tick(end_sign("school_end", track_id=10, confidence=0.4))
    assert drive.target_mps == pytest.approx(20 * KMH)
