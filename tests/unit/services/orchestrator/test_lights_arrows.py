"""Arrows: a red one is red, a green one permits nothing, and no arrow ends a round red."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.scene import Fact
from tests.unit.services.orchestrator.support import FEW, Drive
from tests.unit.services.orchestrator.world.test_lights import at_red, lamp, state

WAYS = ("left", "straight", "right")


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("colour", ["red", "amber"])
def test_a_red_or_amber_arrow_counts_as_the_round_lamp(colour: str, way: str) -> None:
    drive = Drive(speed_mps=5.0)
    drive.tick(lamp(f"{colour}_{way}"))
    assert state(drive) == colour


@pytest.mark.parametrize("way", WAYS)
def test_a_green_arrow_is_no_permission(way: str) -> None:
    drive = Drive(speed_mps=5.0)
    drive.tick(lamp(f"green_{way}"))
    assert state(drive) is None


@pytest.mark.parametrize("way", WAYS)
def test_an_arrow_lamp_that_turns_green_ends_its_own_red_and_permits_nothing(way: str) -> None:
    drive = Drive(speed_mps=0.0)
    drive.tick(lamp(f"red_{way}"))
    drive.tick(lamp(f"green_{way}"))
    assert state(drive) is None


@pytest.mark.parametrize("doubtful", [lamp("green_left", believed=False), lamp("green_left", confidence=0.4)])
def test_a_doubtful_green_arrow_ends_nothing(doubtful: Fact) -> None:
    drive = Drive(speed_mps=0.0)
    drive.tick(lamp("red_left"))
    drive.tick(doubtful)
    assert state(drive) == "red"


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("way", WAYS)
def test_a_green_arrow_beside_a_round_red_leaves_it_red(way: str, first: bool) -> None:
    drive = at_red(speed_mps=0.0)
    arrow = lamp(f"green_{way}", track_id=2)
    for _ in range(3):
        drive.tick(*((arrow, lamp("red")) if first else (lamp("red"), arrow)))
        assert state(drive) == "red"
    drive.tick(arrow)
    assert state(drive) == "red"


def test_an_arrows_red_never_takes_the_place_of_a_round_red_that_its_green_could_then_end() -> None:
    drive = at_red(speed_mps=0.0)
    for _ in range(5):
        drive.tick(lamp("red_left", track_id=2, distance_m=29.0))
    drive.tick(lamp("green_left", track_id=2, distance_m=29.0))
    assert state(drive) == "red"


def test_a_round_red_takes_the_place_of_an_arrows_red() -> None:
    drive = Drive(speed_mps=0.0)
    drive.tick(lamp("red_left", track_id=2))
    drive.tick(lamp("red"), lamp("red_left", track_id=2))
    drive.tick(lamp("green_left", track_id=2))
    assert state(drive) == "red"


_LAMPS = st.builds(
    lambda colour, way, track_id, sure: lamp(f"{colour}_{way}", track_id=track_id, confidence=sure),
    st.sampled_from(["red", "amber", "green"]),
    st.sampled_from(WAYS),
    st.integers(2, 4),
    st.sampled_from([0.4, 0.95]),
)


@FEW
@given(st.lists(st.lists(_LAMPS, max_size=3), min_size=1, max_size=8))
def test_no_sequence_of_arrows_ends_a_round_red_or_becomes_green(ticks: list[list[Fact]]) -> None:
    drive, alone = at_red(speed_mps=0.0), Drive(speed_mps=0.0)
    for lamps in ticks:
        drive.tick(*lamps)
        alone.tick(*lamps)
        assert state(drive) in ("red", "amber")
        assert state(alone) in (None, "red", "amber")
