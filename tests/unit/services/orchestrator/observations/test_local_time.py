"""The time of day is known where satellites tell UTC steadily and the country has one zone; anything else is unknown, which is careful."""

from datetime import UTC, datetime

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.rules import Situation
from proto.scene import COUNTRIES
from services.orchestrator.law.rules_question import situation
from services.orchestrator.observations.local_time import KEPT_NS, LAST_S, STEADY_NS, ZONES, heard, local_time
from services.orchestrator.state import Utc
from services.rules.book import load_book
from services.rules.limits.limit_answer import applicable_limit
from tests.unit.services.orchestrator.support import EXPERTS, KMH, Drive, Played, fact, replace

NIGHT_S = datetime(2026, 7, 1, 20, 57, 30, tzinfo=UTC).timestamp()
S = 1_000_000_000


def driven(country: str = "DEU", seconds: float = 5.0, utc_s: float = NIGHT_S) -> Drive:
    drive = Drive()
    drive.tick(fact("jurisdiction", country))
    for k in range(round(10 * seconds)):
        drive.tick(utc_s=utc_s + k / 10)
    return drive


@pytest.mark.parametrize(
    ("country", "hour", "shown"),
    [("DEU", 22.9167, "2026-07-01T22:55+02:00"), ("GBR", 21.9167, "2026-07-01T21:55+01:00")],
)
def test_the_rules_are_asked_with_the_hour_and_day_of_the_country(country: str, hour: float, shown: str) -> None:
    drive = driven(country)
    asked, told = situation(drive.state), drive.state.world.environment.local_time
    assert (asked.time_of_day_h, asked.day) == (hour, "07-01")
    assert told is not None
    assert told.value == shown


@pytest.mark.parametrize(("utc_s", "kmh"), [(NIGHT_S, 130), (NIGHT_S - 12 * 3600.0, 100), (None, 100)])
def test_a_dutch_motorway_has_its_limit_by_day_and_by_night(utc_s: float | None, kmh: float) -> None:
    book = load_book((data("rulepacks/NLD-v1"),))[0]
    law = {"applicable_limit": lambda a: applicable_limit(book, msgspec.convert(a["situation"], Situation))}
    drive = Drive(Played({**EXPERTS, **law}), road="motorway", speed_mps=27.0)
    drive.tick(fact("jurisdiction", "NLD"))
    for k in range(120):
        drive.tick(utc_s=None if utc_s is None else utc_s + k / 10)
    assert drive.target_mps == pytest.approx(kmh * KMH)


def test_a_stretch_of_road_is_one_question() -> None:
    drive = driven(seconds=140.0)
    questions = {situation(before).time_of_day_h for before, _, _ in drive.history}
    assert questions == {None, 22.9167}


@pytest.mark.parametrize("country", ["ESP", "USA"])
def test_where_a_country_has_several_zones_no_hour_is_told(country: str) -> None:
    assert situation(driven(country).state).time_of_day_h is None


def test_an_assumed_country_tells_no_zone() -> None:
    drive = driven()
    here = drive.state.signs.jurisdiction
    assert here is not None
    signs = replace(drive.state.signs, jurisdiction=replace(here, assumed=True))
    assert local_time(replace(drive.state, signs=signs)) is None


def test_our_clock_goes_on_in_a_tunnel_for_ten_minutes() -> None:
    drive = driven()
    drive.ticks(50)
    assert situation(drive.state).time_of_day_h is not None
    known = drive.state.utc
    assert known is not None
    assert heard(known, None, known.at_ns + KEPT_NS, stepped=False) is known
    assert heard(known, None, known.at_ns + KEPT_NS + 1, stepped=False) is None


TOLD = st.one_of(
    st.none(), st.floats(), st.floats(0.0, LAST_S), st.floats(-5.0, 5.0).map(lambda off_s: NIGHT_S + off_s)
)


@given(st.lists(st.tuples(TOLD, st.integers(-2 * S, 8 * S), st.booleans()), min_size=1, max_size=12))
def test_whatever_is_told_no_hour_is_known_before_utc_went_on_as_our_clock_for_three_seconds(
    ticks: list[tuple[float | None, int, bool]],
) -> None:
    """Each tick: what is told, how far our clock moved, and whether it was seen to leap."""
    drive, now_ns, steady_ns = driven(seconds=0.5), 1_000 * S, 0
    known: Utc | None = None
    for told_s, step_ns, stepped in ticks:
        now_ns += step_ns
        before, known = known, heard(known, told_s, now_ns, stepped=stepped)
        if known is not None and known.at_ns == now_ns and told_s is not None:
            steady_ns = (
                steady_ns + now_ns - before.at_ns
                if before is not None and goes_on(before, told_s, now_ns, stepped)
                else 0
            )
        if known is not None and local_time(replace(drive.state, utc=known, now_ns=now_ns)) is not None:
            assert steady_ns >= STEADY_NS
            assert 0 <= now_ns - known.at_ns <= KEPT_NS


def goes_on(before: Utc, told_s: float, now_ns: int, stepped: bool) -> bool:
    gone_ns = now_ns - before.at_ns
    return not stepped and 0 <= gone_ns <= KEPT_NS and abs(told_s - before.utc_s - gone_ns / S) <= 2.0


def test_each_pack_has_a_zone_or_several() -> None:
    several = {"ESP", "USA", "USA-FL", "USA-TX"}
    manifests = data("rulepacks").glob("*/manifest.json")
    places = {msgspec.json.decode(each.read_bytes())["jurisdiction"] for each in manifests} - {"XXX", "ZZZ"}
    assert places == {*ZONES} | several
    assert {*ZONES} & several == set()
    assert {each for each in COUNTRIES if each not in several} <= {*ZONES}
