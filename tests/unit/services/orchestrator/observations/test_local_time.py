"""The time of day is known where satellites tell UTC steadily and the country has one zone; anything else is unknown, which is careful."""

from collections.abc import Callable
from copy import copy
from datetime import UTC, datetime

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.rules import Situation
from proto.scene import COUNTRIES
from services.orchestrator.law.rules_question import situation
from services.orchestrator.observations.local_time import (
    KEPT_NS,
    LAST_S,
    STEADY_NS,
    ZONES,
    heard,
    local_time,
    told_now_s,
)
from services.orchestrator.state import Utc
from services.rules.book import load_book
from services.rules.limits.limit_answer import applicable_limit
from tests.unit.services.orchestrator.support import EXPERTS, KMH, Drive, Played, fact, limit_sign, replace

NIGHT_S = datetime(2026, 7, 1, 20, 57, 30, tzinfo=UTC).timestamp()
S = 1_000_000_000


def driven(country: str = "DEU", seconds: float = 12.0, utc_s: float = NIGHT_S) -> Drive:
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
    drive = dutch()
    for k in range(150):
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


def test_our_clock_goes_on_in_a_tunnel_for_ten_minutes_and_the_next_fix_is_compared_with_it() -> None:
    drive = driven()
    drive.ticks(5990)
    assert situation(drive.state).time_of_day_h is not None
    drive.ticks(20)
    assert situation(drive.state).time_of_day_h is None
    other = copy(drive)
    drive.tick(utc_s=NIGHT_S + (120 + 6010) / 10)
    assert situation(drive.state).time_of_day_h is not None
    other.tick(utc_s=NIGHT_S)
    assert situation(other.state).time_of_day_h is None


def by_law(pack: str, road: str = "urban", speed_mps: float = 12.0) -> Drive:
    """A drive whose rules are a shipped pack's."""
    book = load_book((data(f"rulepacks/{pack}"),))[0]
    law = {"applicable_limit": lambda a: applicable_limit(book, msgspec.convert(a["situation"], Situation))}
    return Drive(Played({**EXPERTS, **law}), road=road, speed_mps=speed_mps)


def dutch() -> Drive:
    """A Dutch motorway, where 100 km/h hold from 6 to 19 h and 130 by night."""
    drive = by_law("NLD-v1", "motorway", 27.0)
    drive.tick(fact("jurisdiction", "NLD"))
    return drive


NOON_S = NIGHT_S - 9 * 3600.0


@pytest.mark.parametrize(
    "told_s",
    [
        lambda at_s: NIGHT_S,  # it stands
        lambda at_s: NIGHT_S - 600.0 + 2.0 * at_s,  # it runs too fast
        lambda at_s: (NOON_S if at_s % 20.0 < 15.0 else NIGHT_S) + at_s,  # it leaps to and fro
        lambda at_s: (NOON_S if at_s < 15.0 else NIGHT_S) + at_s,  # it contradicts what was believed
        lambda at_s: LAST_S - 1.0,
    ],
)
def test_a_clock_that_does_not_go_on_as_ours_never_raises_the_target(told_s: Callable[[float], float]) -> None:
    drive = dutch()
    for k in range(400):
        drive.tick(utc_s=told_s(k / 10))
        assert drive.target_mps <= 100 * KMH + 1e-6


@pytest.mark.parametrize(
    ("age_s", "told"), [(0.0, True), (1.9, True), (2.1, False), (-0.1, True), (-2.0, False), (8 * 3600.0, False)]
)
def test_a_fix_that_is_late_or_yet_to_come_tells_no_time(age_s: float, told: bool) -> None:
    now_ns = 1_000_000 * S
    told_s = told_now_s(NIGHT_S, now_ns - round(age_s * S), now_ns)
    assert told_s == (pytest.approx(NIGHT_S + age_s) if told else None)


def test_a_clock_set_back_ends_what_is_known_of_the_time() -> None:
    drive = driven()
    drive.now_ns -= 300 * S
    drive.tick()
    assert situation(drive.state).time_of_day_h is None


@pytest.mark.parametrize("step_ns", [0, S, 2 * S, 30 * S, 8 * 3600 * S, -S // 100, -300 * S])
@pytest.mark.parametrize("at", [150, 160])
def test_a_leap_of_our_clock_lets_no_contradiction_be_forgotten(step_ns: int, at: int) -> None:
    """At noon, satellites tell night from the 150th tick on; our clock leaps in that very tick, or a second later."""
    drive = dutch()
    for k in range(400):
        drive.now_ns += step_ns if k == at else 0
        drive.tick(utc_s=(NOON_S if k < 150 else NIGHT_S) + k / 10)
        assert drive.target_mps <= 100 * KMH + 1e-6


def test_a_tick_that_is_late_takes_no_nights_limit_away() -> None:
    drive = dutch()
    for k in range(300):
        late = k >= 200
        drive.now_ns += 12 * S // 10 if k == 200 else 0
        drive.tick(utc_s=NIGHT_S + k / 10 + 1.2 * late)
        assert k < 150 or k == 200 or drive.target_mps == pytest.approx(130 * KMH)


@pytest.mark.parametrize("told", [True, False])
def test_a_nights_limit_ends_with_the_night_though_the_rules_are_silent(told: bool) -> None:
    drive = dutch()
    before_six_s = datetime(2026, 7, 2, 3, 59, 40, tzinfo=UTC).timestamp()
    for k in range(190):
        drive.tick(utc_s=before_six_s + k / 10)
    assert drive.target_mps == pytest.approx(130 * KMH)
    drive.ask.table = {name: call for name, call in drive.ask.table.items() if name != "applicable_limit"}
    for k in range(190, 240):
        drive.tick(utc_s=before_six_s + k / 10 if told else None)
    assert drive.target_mps < 100 * KMH


def test_the_target_is_steady_from_one_five_minutes_to_the_next() -> None:
    drive = dutch()
    for k in range(3300):
        drive.tick(utc_s=NIGHT_S + k / 10)
        assert k < 150 or drive.target_mps == pytest.approx(130 * KMH)


@pytest.mark.parametrize("confidence", [0.95, 0.5, 0.35])
def test_a_limit_under_hours_counts_whatever_the_time(confidence: float) -> None:
    drive = by_law("DEU-v1")
    for k in range(120):
        drive.tick(utc_s=NOON_S + k / 10)
    drive.tick(limit_sign("limit:30", plates=("plate:time:22-6 h",), confidence=confidence), utc_s=NOON_S + 12.0)
    for k in range(121, 150):
        drive.tick(utc_s=NOON_S + k / 10)
    assert drive.target_mps == pytest.approx(30 * KMH)


@pytest.mark.parametrize(("sign", "road", "kmh"), [("limit:70", "urban", 70), ("limit:120", "motorway", 120)])
def test_a_sign_in_force_holds_while_the_rules_are_silent_from_one_hour_to_the_next(
    sign: str, road: str, kmh: int
) -> None:
    drive = by_law("DEU-v1", road, 15.0)
    drive.tick(limit_sign(sign), utc_s=NOON_S)
    for k in range(1, 130):
        drive.tick(utc_s=NOON_S + k / 10)
    drive.ask.table = {name: call for name, call in drive.ask.table.items() if name != "applicable_limit"}
    for k in range(130, 3200):
        drive.tick(utc_s=NOON_S + k / 10)
        assert drive.target_mps == pytest.approx(kmh * KMH)


TOLD = st.one_of(
    st.none(), st.floats(), st.floats(0.0, LAST_S), st.floats(-5.0, 5.0).map(lambda off_s: NIGHT_S + off_s)
)


@given(st.lists(st.tuples(TOLD, st.integers(0, 8 * S), st.booleans()), min_size=1, max_size=12))
def test_whatever_is_told_no_hour_is_known_before_utc_went_on_as_our_clock_for_ten_seconds(
    ticks: list[tuple[float | None, int, bool]],
) -> None:
    """Each tick: what is told, how far our clock moved, and whether it was seen to leap."""
    drive, now_ns = driven(seconds=0.5), 1_000 * S
    known: Utc | None = None
    heard_at: list[tuple[int, float]] = []
    for told_s, step_ns, stepped in ticks:
        now_ns += step_ns
        known = heard(known, told_s, now_ns, step_ns=step_ns if stepped else 0)
        if told_s is not None and known is not None and known.at_ns == now_ns:
            heard_at.append((now_ns, told_s))
        if known is not None and local_time(replace(drive.state, utc=known, now_ns=now_ns)) is not None:
            since = [(at_ns, each_s) for at_ns, each_s in heard_at if known.since_ns <= at_ns <= known.at_ns]
            parted_s = [each_s - at_ns / S for at_ns, each_s in since[-2:]]
            assert known.at_ns - known.since_ns >= STEADY_NS
            assert 0 <= now_ns - known.at_ns <= KEPT_NS
            assert max(parted_s) - min(parted_s) <= 2.1


def test_each_pack_has_a_zone_or_several() -> None:
    several = {"ESP", "USA", "USA-FL", "USA-TX"}
    manifests = data("rulepacks").glob("*/manifest.json")
    places = {msgspec.json.decode(each.read_bytes())["jurisdiction"] for each in manifests} - {"XXX", "ZZZ"}
    assert places == {*ZONES} | several
    assert {*ZONES} & several == set()
    assert {each for each in COUNTRIES if each not in several} <= {*ZONES}
