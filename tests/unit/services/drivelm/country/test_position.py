"""A position on earth tells the country, and is overcome by signs."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.testing import bus
from proto import topics
from proto.sensors import GnssFix
from services.drivelm.country.country_belief import CountryBelief, cues_of, oncoming_cue
from services.drivelm.country.position import Journey, Placing, place_of
from services.drivelm.country.surroundings import surroundings
from services.drivelm.service import SERVICE, DrivelmConfig
from services.drivelm.vocabulary.jurisdictions import JURISDICTIONS

PLACES = {
    "DEU": (50.11, 8.68), "AUT": (47.07, 15.44), "FRA": (47.32, 5.04), "NLD": (52.09, 5.12), "POL": (52.23, 21.01),
    "GBR": (52.48, -1.90), "CHE": (46.95, 7.45), "USA": (37.40, -122.08), "BEL": (50.46, 4.86), "IRL": (53.42, -7.94),
    "ITA": (43.77, 11.25), "ESP": (40.42, -3.70),
}  # fmt: skip


def test_each_country_is_told_by_a_position_inside_it_whatever_the_home() -> None:
    assert set(PLACES) == set(JURISDICTIONS)
    for country, (latitude, longitude) in PLACES.items():
        place = place_of(latitude, longitude)
        assert place is not None
        for home in ("", *JURISDICTIONS):
            where = CountryBelief.at_home(home).at_position(place.country)
            assert (where.believed, where.assumed) == (country, False)


def test_a_position_at_a_border_or_at_sea_tells_nothing() -> None:
    assert place_of(47.66, 9.175) is None, "between Konstanz and Kreuzlingen"
    assert place_of(40.0, -30.0) is None
    assert place_of(float("nan"), 8.0) is None


def test_in_a_country_without_known_signs_no_country_is_believed() -> None:
    place = place_of(39.4, -8.2)
    assert place is not None
    where = CountryBelief.at_home("DEU").at_position(place.country)
    facts = surroundings(where, None, 0)
    assert where.believed is None
    assert [(fact.kind, fact.reading, fact.believed) for fact in facts] == [("jurisdiction", "PRT", True)]


@given(
    st.sampled_from(sorted(PLACES)), st.sampled_from(("town_entry:yellow", "national", "general:50", "info:units_mph"))
)
def test_signs_overcome_a_position_that_is_wrong(country: str, code: str) -> None:
    where = CountryBelief.at_home("").at_position(country)
    for track_id in range(8):
        where = where.with_cue(("front", track_id), cues_of(code), code)
    assert where.believed is None or cues_of(code).get(where.believed, 0.0) > 0.0


@given(st.lists(st.sampled_from(("oncoming_left", "limit_board:50", "school", "national")), max_size=20))
def test_in_a_country_without_known_signs_no_cue_tells_another(codes: list[str]) -> None:
    where = CountryBelief.at_home("DEU").at_position("PRT")
    for track_id, code in enumerate(codes):
        cues = oncoming_cue(-3.0) if code == "oncoming_left" else cues_of(code)
        where = where.with_cue((code, track_id), cues, code)
    assert where.believed is None


@pytest.mark.parametrize(
    ("country", "units", "side"),
    [("BEL", "km/h", "right"), ("IRL", "km/h", "left"), ("ITA", "km/h", "right"), ("ESP", "km/h", "right")],
)
def test_a_country_that_signs_do_not_tell_is_told_by_a_position_with_its_unit_and_side(
    country: str, units: str, side: str
) -> None:
    where = CountryBelief.at_home("FRA").at_position(country)
    told = {fact.kind: fact.reading for fact in surroundings(where, None, 0) if fact.believed}
    assert told == {"jurisdiction": country, "units": units, "traffic_side": side}


@given(st.lists(st.sampled_from(("keep_left", "all_end", "national", "diamond:yellow", "limit:80")), max_size=20))
def test_irish_signs_keep_ireland(codes: list[str]) -> None:
    where = CountryBelief.at_home("").at_position("IRL")
    for track_id, code in enumerate(codes):
        where = where.with_cue((code, track_id), cues_of(code), code)
    assert where.believed == "IRL"


@given(st.lists(st.sampled_from(("keep_left", "town_entry:white", "plate:when_wet:nl", "all_end", "national"))))
def test_signs_alone_never_tell_a_country_that_they_do_not_tell(codes: list[str]) -> None:
    where = CountryBelief.at_home("")
    for track_id, code in enumerate(codes):
        where = where.with_cue((code, track_id), cues_of(code), code)
        assert where.believed not in ("BEL", "IRL", "ITA", "ESP")


def fix(country: str) -> GnssFix:
    """A fix in a country."""
    latitude, longitude = PLACES[country]
    return GnssFix(x_m=0.0, y_m=0.0, heading_rad=0.0, sigma_m=5.0, latitude_deg=latitude, longitude_deg=longitude)


def test_a_single_fix_elsewhere_tells_no_country() -> None:
    placing = Placing()
    told = []
    for tenth in range(100):
        placing = placing.after(fix("GBR" if tenth == 50 else "DEU"), tenth * 100_000_000)
        told.append(placing.told)
    assert set(told) == {"", "DEU"}
    assert told[49] == told[99] == "DEU"


def test_steady_fixes_overcome_a_misread_border_sign() -> None:
    where = CountryBelief.at_home("DEU").at_position("DEU").past_border(("front", 1), "CHE")
    assert where.believed == "CHE"
    assert where.at_position("DEU").believed == "DEU"


def test_fixes_on_the_bus_end_the_home_setting() -> None:
    with bus() as b:
        facts = b.collect(topics.FACTS)
        b.start(SERVICE, DrivelmConfig(home="DEU"))
        start_ns = b.probe.clock.now_ns()
        for tenth in range(40):
            b.probe.publish(topics.GNSS, fix("USA"), stamp_ns=start_ns + tenth * 100_000_000)
        told = facts.wait(
            lambda m: any(f.kind == "jurisdiction" and f.reading == "USA" and f.believed for f in m.facts)
        )
        units = [fact.reading for fact in told.facts if fact.kind == "units"]
        assert units == ["mph"]


def leaps(places: list[tuple[float, float]], period_s: float = 0.5) -> int:
    """How often such fixes, so long apart, say that the car is elsewhere."""
    journey, found = Journey(), 0
    for k, (x_m, y_m) in enumerate(places):
        fix = GnssFix(x_m=x_m, y_m=y_m, heading_rad=0.0, sigma_m=2.0)
        journey = journey.after(fix, round((k + 1) * period_s * 1e9))
        found += journey.elsewhere
    return found


def test_a_car_that_goes_on_elsewhere_is_told_once_and_a_jump_of_the_receiver_never() -> None:
    there, here = [(4_000.0 + 10.0 * k, 0.0) for k in range(10)], [(5.0 * k, 0.0) for k in range(20)]
    assert leaps([*there, *here]) == 1
    assert leaps([*there, *here, *there]) == 2
    assert leaps([*there[:5], *here[:4], *there[5:], *there]) == 0, "back after two seconds"
    assert leaps([*there, (0.0, 0.0), *there, (float("nan"), 0.0), *there]) == 0


@given(st.lists(st.tuples(st.floats(-30.0, 30.0), st.floats(-30.0, 30.0)), max_size=60))
def test_driving_is_no_leap(steps: list[tuple[float, float]]) -> None:
    x_m, y_m, places = 0.0, 0.0, []
    for dx_m, dy_m in steps:
        x_m, y_m = x_m + dx_m, y_m + dy_m
        places.append((x_m, y_m))
    assert leaps(places) == 0


def test_another_drive_does_not_begin_in_the_country_of_the_last() -> None:
    with bus() as b:
        facts = b.collect(topics.FACTS)
        b.start(SERVICE, DrivelmConfig(home="DEU"))
        start_ns = b.probe.clock.now_ns()

        def drive(at: GnssFix, from_s: float) -> None:
            for tenth in range(40):
                b.probe.publish(topics.GNSS, at, stamp_ns=start_ns + round((from_s + tenth / 10) * 1e9))

        drive(msgspec.structs.replace(fix("GBR"), x_m=5_000.0), 0.0)
        facts.wait(lambda m: any(f.kind == "units" and f.reading == "mph" for f in m.facts))
        drive(GnssFix(x_m=0.0, y_m=0.0, heading_rad=0.0, sigma_m=5.0), 4.0)
        facts.wait(lambda m: any(f.kind == "units" and f.reading == "km/h" for f in m.facts))
