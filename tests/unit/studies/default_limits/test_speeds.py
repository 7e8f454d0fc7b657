"""A row's tags give the lowest speed that binds a vehicle."""

import pytest

from studies.default_limits.speeds import Moment, Speed, Vehicle, limit_of, parse_speed

CAR = Vehicle(amounts={"maxweightrating": 2.0})
TOWING = Vehicle(facts=frozenset({"trailer"}), amounts={"maxweightrating": 2.0})
LORRY = Vehicle(modes=("hgv", "goods"), amounts={"maxweightrating": 18.0})
TRAIN = Vehicle(modes=("hgv",), facts=frozenset({"trailer"}), amounts={"maxweightrating": 18.0})
COACH = Vehicle(modes=("coach", "bus"), amounts={"maxweightrating": 18.0})
DRY, WET = Moment(), Moment(wet=True)


@pytest.mark.parametrize(
    ("text", "expected"),
    [("50", Speed(50)), ("30 mph", Speed(30, "mph")), ("walk", Speed(7)), ("none", None), ("80|50", None), ("", None)],
)
def test_a_speed_is_read(text: str, expected: Speed | None) -> None:
    assert parse_speed(text) == expected


def limit(vehicle: Vehicle, moment: Moment = DRY, **tags: str) -> float | None:
    found = limit_of({key.replace("__", ":"): value for key, value in tags.items()}, vehicle, moment)
    return found.value if found is not None else None


def test_the_road_s_limit_binds_a_vehicle_without_one_of_its_own() -> None:
    assert limit(CAR, maxspeed="100", maxspeed__hgv="80") == 100
    assert limit(LORRY, maxspeed="100", maxspeed__hgv="80") == 80


def test_a_vehicle_s_own_limit_does_not_raise_the_road_s() -> None:
    assert limit(LORRY, maxspeed="50", maxspeed__hgv="70") == 50


def test_the_closest_word_for_a_vehicle_counts() -> None:
    assert limit(COACH, maxspeed="130", maxspeed__bus="80", maxspeed__coach="100") == 100
    assert limit(COACH, maxspeed="130", maxspeed__bus="80") == 80


def test_conditions_lower_the_limit_where_they_hold() -> None:
    tags = {"maxspeed": "130", "maxspeed__conditional": "110 @ (wet); 90 @ (maxweightrating>3.5)"}
    assert [limit(CAR, DRY, **tags), limit(CAR, WET, **tags), limit(LORRY, DRY, **tags)] == [130, 110, 90]


def test_joined_conditions_hold_together() -> None:
    tags = {"maxspeed": "100", "maxspeed__conditional": "60 @ (trailer AND maxweightrating>12)"}
    assert [limit(TOWING, DRY, **tags), limit(TRAIN, DRY, **tags)] == [100, 60]


def test_hours_bound_a_condition_past_midnight_too() -> None:
    tags = {"maxspeed": "130", "maxspeed__conditional": "100 @ (06:00-19:00)"}
    assert [limit(CAR, Moment(hour=hour), **tags) for hour in (5.9, 6.0, 18.9, 19.0)] == [130, 100, 100, 130]
    tags = {"maxspeed": "130", "maxspeed__conditional": "110 @ (22:00-05:00)"}
    assert [limit(CAR, Moment(hour=hour), **tags) for hour in (21.9, 22.0, 4.9, 5.0)] == [130, 110, 110, 130]


def test_a_class_s_own_limit_stands_in_place_of_every_heavy_vehicle_s() -> None:
    assert limit(COACH, maxspeed="100", maxspeed__bus="80", maxspeed__conditional="70 @ (maxweightrating>3.5)") == 80


def test_a_condition_on_trailers_binds_a_class_that_has_none_of_its_own() -> None:
    general = "60 @ (trailer AND maxweightrating>12)"
    assert limit(TRAIN, maxspeed__hgv="90", maxspeed__conditional=general) == 60
    assert (
        limit(TRAIN, maxspeed__hgv="90", maxspeed__hgv__conditional="70 @ (trailer)", maxspeed__conditional=general)
        == 70
    )


def test_a_recommended_speed_is_no_limit() -> None:
    assert limit(CAR, maxspeed__advisory="130") is None
