"""The true limit along the route, from the signs that stand there."""

import pytest

from services.simulator.scenario.law import KMH, MPH, Law, build_law
from tests.unit.services.simulator._scenes import scenario


def law(*signs: str, country: str = "DEU", road_class: str = "rural") -> Law:
    """Signs every 100 m; each text is the list of a post's codes."""
    rest = "".join(f"[[signs]]\nat_m = {100 * (i + 1)}\ncodes = [{codes}]\n" for i, codes in enumerate(signs))
    return build_law(scenario(rest=rest, country=country, road_class=road_class))


def limits(road: Law, *places_m: float, wet: bool = False) -> list[float | None]:
    """Limits in m/s at places."""
    return [road.at(place, {}).limit_mps(wet) for place in places_m]


def test_without_signs_the_statutory_limit_holds() -> None:
    assert limits(law(), 50) == [pytest.approx(100 * KMH)]
    assert limits(law(country="GBR"), 50) == [pytest.approx(60 * MPH)]
    assert limits(law(road_class="motorway"), 50) == [None]


def test_a_limit_holds_from_its_sign_until_its_end() -> None:
    road = law('"limit:70"', '"limit_end:70"')
    assert limits(road, 99, 100, 199, 200) == pytest.approx([100 * KMH, 70 * KMH, 70 * KMH, 100 * KMH])


def test_a_when_wet_plate_makes_it_conditional() -> None:
    road = law('"limit:80", "plate:when_wet:de"')
    assert limits(road, 150) == pytest.approx([100 * KMH])
    assert limits(road, 150, wet=True) == pytest.approx([80 * KMH])


def test_in_britain_a_plate_about_rain_only_warns() -> None:
    road = law('"limit:50", "plate:when_wet:en"', country="GBR")
    assert limits(road, 150) == limits(road, 150, wet=True) == pytest.approx([50 * MPH])


def test_a_plate_for_lorries_does_not_bind_cars() -> None:
    assert limits(law('"limit:60", "plate:lorries"'), 150) == pytest.approx([100 * KMH])


def test_a_town_sign_and_its_end_and_a_zone_inside() -> None:
    road = law('"town_entry"', '"zone:30"', '"zone_end:30"', '"town_exit"')
    assert limits(road, 150, 250, 350, 450) == pytest.approx([50 * KMH, 30 * KMH, 50 * KMH, 100 * KMH])


def test_a_border_ends_what_held_and_numbers_are_miles_behind_it() -> None:
    road = law('"limit:50"', '"border:GBR"', '"limit:40"', '"national"')
    assert limits(road, 150, 250, 350, 450) == pytest.approx([50 * KMH, 60 * MPH, 40 * MPH, 60 * MPH])
    assert road.at(250, {}).country == "GBR"


def test_a_gantry_counts_by_what_it_showed_when_passed_and_the_wet_limit_stays() -> None:
    rest = (
        '[[signs]]\nat_m = 80\ncodes = ["limit:80", "plate:when_wet:de"]\n'
        '[[gantries]]\nat_m = 100\nsteps = [{ at_s = 0, code = "led:120" }]\n'
    )
    road = build_law(scenario(rest=rest, road_class="motorway", lanes=3, road="median_m = 4"))
    assert road.at(150, {0: "led:100"}).limit_mps(False) == pytest.approx(100 * KMH)
    assert road.at(150, {0: "led:100"}).limit_mps(True) == pytest.approx(80 * KMH)
    assert road.at(150, {0: "led:end"}).limit_mps(False) is None
