"""The law's own limit behind a sign that has no number: asked before it is passed, announced, and only ever a bound."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.rules import LegalLimit, SignMeaning
from proto.scene import Fact
from tests.unit.services.orchestrator.support import EXPERTS, FEW, KMH, Drive, Played, fact, limit_sign, meaning

RURAL_MPS = 27.0


def town(distance_m: float, **fields: Any) -> Fact:
    return fact("sign", "town_entry", **{"track_id": 8, "distance_m": distance_m, **fields})


def told(kmh: float, confidence: float = 0.9) -> Played:
    """Experts whose law has this limit behind a town sign."""

    def sign(arguments: dict[str, Any]) -> SignMeaning:
        return meaning(
            arguments["reading"],
            limit=LegalLimit(value=kmh, unit="km/h", mps=kmh * KMH),
            confidence=confidence,
        )

    return Played({**EXPERTS, "interpret_sign": sign})


def rural(ask: Played) -> Drive:
    drive = Drive(ask, RURAL_MPS, road="rural")
    drive.ticks(3)
    return drive


def test_the_limit_behind_a_town_sign_is_announced_before_it_with_what_says_so() -> None:
    drive = rural(told(50.0))
    drive.tick(town(125.0))
    drive.tick(town(122.0))
    fused = drive.history[-1][2].fused
    assert (fused.topic, fused.directive) == ("ahead", "50 ahead")
    assert fused.ahead_mps == pytest.approx(50.0 * KMH)
    assert any(reason.source == "rules" and reason.citations for reason in fused.reasons)
    drive.tick(town(55.0))
    drive.tick(town(52.0))
    assert 50.0 * KMH < drive.target_mps < 80.0 * KMH, "coasting down to it"


def test_it_is_asked_once() -> None:
    drive = rural(told(50.0))
    for metres in range(55, 25, -3):
        drive.tick(town(float(metres)))
    assert [call.tool for call in drive.ask.calls].count("interpret_sign") == 1


def test_where_nobody_answers_the_sign_itself_counts_once_it_is_passed() -> None:
    drive = rural(Played({tool: each for tool, each in EXPERTS.items() if tool != "interpret_sign"}))
    drive.tick(town(30.0))
    assert "ahead" not in {t.fused.topic for _, _, t in drive.history}
    drive.tick(town(0.0, passed=True))
    drive.ticks(2)
    assert drive.target_mps <= 50.0 * KMH


@pytest.mark.parametrize(
    "sign",
    [town(40.0, believed=False, confidence=0.5), town(40.0, lane_id="offset:1")],
    ids=["doubted", "of another lane"],
)
def test_a_sign_that_is_not_ours_to_follow_announces_nothing(sign: Fact) -> None:
    drive = rural(told(50.0))
    drive.tick(sign)
    drive.ticks(2)
    assert "50 ahead" not in drive.spoken()
    assert "place_ahead" not in {event.kind for _, _, t in drive.history for event in t.events}


@FEW
@given(kmh=st.floats(-100.0, 400.0), confidence=st.floats(0.0, 1.0), distance_m=st.floats(1.0, 150.0))
def test_whatever_the_rules_say_of_a_place_the_target_only_falls(
    kmh: float, confidence: float, distance_m: float
) -> None:
    without, with_law = rural(Played()), rural(told(kmh, confidence))
    for drive in (without, with_law):
        drive.tick(town(distance_m))
        drive.tick(town(max(0.5, distance_m - 2.7)))
    assert with_law.target_mps <= without.target_mps + 1e-9


@FEW
@given(kmh=st.floats(5.0, 130.0), posted=st.sampled_from([30, 50, 70, 100]))
def test_a_limit_on_a_sign_nearby_is_not_lost_beside_a_place(kmh: float, posted: int) -> None:
    drive = rural(told(kmh))
    both = (town(20.0), limit_sign(f"limit:{posted}", track_id=9, passed=False, distance_m=20.0))
    drive.tick(*both)
    drive.tick(*both)
    alone = rural(told(kmh))
    alone.tick(both[1])
    alone.tick(both[1])
    assert drive.target_mps <= alone.target_mps + 1e-9
