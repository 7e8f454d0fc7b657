"""More signs than are remembered: what lowers the target is remembered first."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.scene import Fact
from services.orchestrator.signs.limits import in_force
from services.orchestrator.signs.signs import MOST_AHEAD
from services.orchestrator.world.stops import stops
from tests.unit.services.orchestrator.support import FEW, KMH, Drive, fact, limit_sign

IDLE = ("info", "danger", "children", "slippery", "roadworks", "no_overtaking", "keep_right", "one_way", "ahead_only")


@st.composite
def idle_signs(draw: st.DrawFn) -> list[Fact]:
    """Any number of signs that say nothing of speed, however sure they are."""
    kinds = st.lists(st.tuples(st.sampled_from(("sign", "message")), st.sampled_from(IDLE)), min_size=12, max_size=60)
    confidence, believed = draw(st.floats(0.0, 1.0)), draw(st.booleans())
    return [
        fact(kind, reading, confidence=confidence, believed=believed, track_id=100 + at, distance_m=50.0)
        for at, (kind, reading) in enumerate(draw(kinds))
    ]


@FEW
@given(flood=idle_signs(), at_once=st.booleans(), confidence=st.sampled_from((0.35, 0.95)))
def test_no_flood_of_idle_signs_removes_a_believed_limit(flood: list[Fact], at_once: bool, confidence: float) -> None:
    drive = Drive(speed_mps=10.0)
    drive.tick(limit_sign("limit:30", passed=False, distance_m=70.0, confidence=confidence))
    for facts in [flood] if at_once else [[each] for each in flood]:
        drive.tick(*facts)
        assert len(drive.state.signs.ahead) <= MOST_AHEAD
    drive.ticks(80)
    assert [each.posted.value for each in in_force(drive.state.signs)] == [30.0]


def flood(kind: str, reading: str, **fields: object) -> list[Fact]:
    given = {"distance_m": 50.0, **fields}
    return [fact(kind, reading, track_id=100 + at, **given) for at in range(40)]


@pytest.mark.parametrize(
    "signs",
    [
        flood("sign", "info"),
        flood("sign", "yield"),
        flood("limit", "limit_end", scope="end"),
        flood("limit", "limit:10", believed=False),
        flood("limit", "led:10", lane_id="offset:+1"),
        flood("limit", "limit:120"),
    ],
)
def test_what_lowers_most_is_remembered_longest(signs: list[Fact]) -> None:
    drive = Drive(speed_mps=5.0)
    stop = fact("sign", "stop", track_id=4, distance_m=45.0)
    drive.tick(limit_sign("limit:30", passed=False, distance_m=20.0), stop)
    drive.tick(*signs)
    assert {"limit:30", "stop"} <= {each.reading for each in drive.state.signs.ahead}
    assert "stop_sign" in {each.why for each in stops(drive.state)}
    drive.ticks(40)
    assert 30.0 in {each.posted.value for each in in_force(drive.state.signs)}


def test_ends_are_remembered_before_idle_signs() -> None:
    drive = Drive(speed_mps=10.0)
    drive.tick(limit_sign("limit:30"))
    drive.tick(fact("limit", "limit_end", scope="end", track_id=7, distance_m=20.0))
    drive.tick(*flood("sign", "danger"))
    drive.ticks(40)
    assert drive.target_mps == pytest.approx(50 * KMH)


def test_of_equals_the_oldest_is_forgotten() -> None:
    drive = Drive(speed_mps=0.0)
    drive.tick(*flood("sign", "info"))
    assert [each.track_id for each in drive.state.signs.ahead] == list(range(140 - MOST_AHEAD, 140))


@FEW
@given(st.lists(st.sampled_from((30, 50, 60, 80, 100, 120)), min_size=1, max_size=8))
def test_of_many_conditional_limits_the_lowest_stays(values: list[int]) -> None:
    drive = Drive(road="motorway")
    for number, value in enumerate(values):
        drive.tick(limit_sign(f"limit:{value}", track_id=50 + number, scope="when_wet", plates=("plate:when_wet:de",)))
    assert min(each.posted.value for each in in_force(drive.state.signs)) == min(values)
