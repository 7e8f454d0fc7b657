"""Two tracks of one sign: the plate that one camera reads holds for both; two signs stay two."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.rules import RulesAnswer
from proto.scene import Fact
from tests.unit.services.orchestrator.support import EXPERTS, KMH, Drive, Played, conditions, law_of, limit_sign

PLATED, PLAIN, DOUBTED = 8, 9, 10
LORRIES = {"plates": ("plate:lorries",)}


def of_a_car(arguments: dict[str, Any]) -> RulesAnswer:
    """The small law for one who drives no lorry."""
    situation = arguments["situation"]
    posted = [each for each in situation["posted"] if "plate:lorries" not in each["plates"]]
    return law_of({**arguments, "situation": {**situation, "posted": posted}})


def on_the_motorway(speed_mps: float = 30.0) -> Drive:
    return Drive(Played({**EXPERTS, "applicable_limit": of_a_car}), road="motorway", speed_mps=speed_mps)


def seen(track_id: int, distance_m: float, **fields: Any) -> Fact:
    return limit_sign("limit:80", track_id=track_id, passed=False, **{"distance_m": distance_m, **fields})


def driven(plated: dict[str, Any], apart_m: float, *, plain_first: bool = False) -> Drive:
    """Towards the sign at 30 m/s on a motorway, until both tracks of it are passed."""
    drive = on_the_motorway()
    for k in range(20):
        distance_m = 60.0 - 3.0 * k
        facts = [seen(PLATED, distance_m, **plated)] if distance_m >= 0.0 else []
        if (plain_first or distance_m < 30.0) and distance_m + apart_m >= 0.0:
            facts.append(seen(PLAIN, distance_m + apart_m))
        drive.tick(*(reversed(facts) if plain_first else facts))
    drive.ticks(10)
    return drive


@given(apart_m=st.floats(-7.0, 7.0), plain_first=st.booleans())
def test_a_plate_that_one_camera_reads_holds_for_the_other_ones_track(apart_m: float, plain_first: bool) -> None:
    assert driven(LORRIES, apart_m, plain_first=plain_first).target_mps == pytest.approx(130 * KMH)


@pytest.mark.parametrize("apart_m", [-20.0, 20.0])
def test_a_sign_that_stands_elsewhere_keeps_its_own(apart_m: float) -> None:
    assert driven(LORRIES, apart_m).target_mps == pytest.approx(80 * KMH)


def lost_from_afar(plated: dict[str, Any], speed_mps: float = 30.0) -> Drive:
    """A track without plates ends 60 m before the post that another shows, by its size 45 m behind it."""
    drive, step_m = on_the_motorway(speed_mps), speed_mps / 10.0
    drive.tick(seen(PLAIN, 105.0), seen(PLATED, 60.0))
    for k in range(1, round(57.0 / step_m) + 1):
        drive.tick(seen(PLATED, 60.0 - step_m * k, **plated))
    drive.tick(limit_sign("limit:80", track_id=PLATED, passed=True, **plated))
    drive.ticks(round(90.0 / step_m))
    return drive


@pytest.mark.parametrize("speed_mps", [9.0, 15.0, 30.0])
def test_a_track_that_was_lost_from_afar_is_of_the_post_that_was_passed_since(speed_mps: float) -> None:
    assert lost_from_afar(LORRIES, speed_mps).target_mps == pytest.approx(130 * KMH)


@pytest.mark.parametrize("apart_m", [-25.0, -12.0, 12.0, 25.0])
def test_a_track_that_was_lost_from_afar_takes_the_plates_of_the_one_that_began_since(apart_m: float) -> None:
    drive = on_the_motorway()
    drive.tick(seen(PLAIN, 105.0 + apart_m))
    drive.ticks(9)
    for k in range(10, 35):
        drive.tick(seen(PLATED, 105.0 - 3.0 * k, **LORRIES))
        assert drive.target_mps > 80 * KMH or k < 14, "its plate was read"
    drive.tick(limit_sign("limit:80", track_id=PLATED, passed=True, **LORRIES))
    drive.ticks(30)
    assert drive.target_mps == pytest.approx(130 * KMH)


@pytest.mark.parametrize("apart_m", [-25.0, -12.0, 0.0])
def test_a_track_keeps_the_plates_it_took_where_its_passing_is_reckoned(apart_m: float) -> None:
    """The front end tells the passing with the last picture that showed the sign."""
    drive = on_the_motorway()
    drive.tick(seen(PLAIN, 105.0 + apart_m))
    last_ns = drive.now_ns
    drive.ticks(9)
    for k in range(10, 35):
        drive.tick(seen(PLATED, 105.0 - 3.0 * k, **LORRIES))
        if k == int((105.0 + apart_m) / 3.0) - 1:
            drive.tick(limit_sign("limit:80", track_id=PLAIN, frame_stamp_ns=last_ns, distance_m=-1.0))
    drive.tick(limit_sign("limit:80", track_id=PLATED, passed=True, **LORRIES))
    drive.ticks(30)
    assert drive.target_mps == pytest.approx(130 * KMH)


@pytest.mark.parametrize("apart_m", [-40.0, 40.0])
@pytest.mark.parametrize("every", [1, 5])
@pytest.mark.parametrize("phase", range(5))
@pytest.mark.parametrize("plate_from", [0, 1])
def test_two_posts_in_plain_sight_stay_two_however_rarely_each_is_told(
    apart_m: float, every: int, phase: int, plate_from: int
) -> None:
    """The front end repeats what it goes on to see twice a second."""
    drive = on_the_motorway()
    for k in range(33):
        of_lorries = LORRIES if k // every >= plate_from else {}
        plated = [seen(PLATED, 100.0 + apart_m - 3.0 * k, **of_lorries)] if k % every == 0 else []
        plain = [seen(PLAIN, 100.0 - 3.0 * k)] if (k + phase) % every == 0 else []
        drive.tick(*plated, *plain)
    drive.tick(limit_sign("limit:80", track_id=PLAIN))
    drive.ticks(30)
    assert drive.target_mps == pytest.approx(80 * KMH)


@pytest.mark.parametrize("apart_m", [70.0, 90.0, 110.0, 140.0])
def test_a_doubted_post_borrows_no_belief_from_an_earlier_one(apart_m: float) -> None:
    drive = on_the_motorway()
    drive.tick(limit_sign("limit:80", track_id=PLATED, passed=True, **LORRIES))
    drive.ticks(round((apart_m - 60.0) / 3.0))
    drive.tick(seen(PLAIN, 60.0), seen(DOUBTED, 60.0, **LORRIES, confidence=0.5))
    for k in range(1, 20):
        drive.tick(seen(DOUBTED, 60.0 - 3.0 * k, **LORRIES, confidence=0.5))
    drive.tick(limit_sign("limit:80", track_id=DOUBTED, passed=True, **LORRIES, confidence=0.5))
    drive.ticks(30)
    assert drive.target_mps == pytest.approx(80 * KMH)


@pytest.mark.parametrize("doubt", [{"confidence": 0.5}, {"confidence": 0.5, "believed": False}])
def test_a_third_doubted_track_of_the_post_does_not_bring_back_a_limit_of_lorries(doubt: dict[str, Any]) -> None:
    drive = on_the_motorway()
    drive.tick(seen(PLAIN, 105.0), seen(DOUBTED, 90.0), seen(PLATED, 60.0))
    drive.tick(seen(DOUBTED, 87.0, **doubt), seen(PLATED, 57.0, **LORRIES))
    for k in range(2, 20):
        drive.tick(seen(PLATED, 60.0 - 3.0 * k, **LORRIES))
    drive.tick(limit_sign("limit:80", track_id=PLATED, passed=True, **LORRIES))
    drive.ticks(30)
    assert drive.target_mps == pytest.approx(130 * KMH)


def test_a_doubted_post_takes_no_limit_away() -> None:
    assert lost_from_afar(LORRIES | {"confidence": 0.5}).target_mps == pytest.approx(80 * KMH)


@pytest.mark.parametrize("doubt", [{"confidence": 0.5}, {"believed": False}])
def test_a_doubted_plate_is_shared_with_nobody(doubt: dict[str, Any]) -> None:
    assert driven(LORRIES | doubt, 3.0).target_mps == pytest.approx(80 * KMH)


@pytest.mark.parametrize("after", [{"plates": ()}, {**LORRIES, "confidence": 0.5}])
def test_a_plate_that_its_own_track_shows_no_more_is_shared_no_more(after: dict[str, Any]) -> None:
    drive = on_the_motorway()
    for k in range(11):
        distance_m = 30.0 - 3.0 * k
        drive.tick(seen(PLATED, distance_m, **(LORRIES if k < 5 else after)), seen(PLAIN, distance_m + 3.0))
    drive.tick(limit_sign("limit:80", track_id=PLAIN))
    drive.ticks(5)
    assert drive.target_mps == pytest.approx(80 * KMH)


def test_another_limit_at_the_same_post_has_no_part_in_it() -> None:
    drive = on_the_motorway()
    for k in range(11):
        facts = (seen(PLATED, 30.0 - 3.0 * k, **LORRIES), limit_sign("limit:100", track_id=PLAIN, passed=False))
        drive.tick(*facts)
    drive.tick(limit_sign("limit:100", track_id=PLAIN))
    drive.ticks(5)
    assert drive.target_mps == pytest.approx(100 * KMH)


@pytest.mark.parametrize(("wet", "limit_kmh"), [(False, 130), (True, 80), (None, 80)])
def test_what_holds_when_wet_does_so_by_either_track(wet: bool | None, limit_kmh: float) -> None:
    drive = Drive(road="motorway", speed_mps=30.0)
    drive.ask.table = {**drive.ask.table, "assess_weather": lambda a: drive.weather}
    drive.weather = conditions(wet=wet)
    for k in range(11):
        distance_m = 30.0 - 3.0 * k
        drive.tick(
            seen(PLATED, distance_m, scope="when_wet", plates=("plate:when_wet:de",)), seen(PLAIN, distance_m + 4.0)
        )
    drive.tick(limit_sign("limit:80", track_id=PLAIN))
    drive.ticks(10)
    assert drive.target_mps <= limit_kmh * KMH + 1e-9
    if wet is not None:
        assert drive.target_mps == pytest.approx(limit_kmh * KMH)
