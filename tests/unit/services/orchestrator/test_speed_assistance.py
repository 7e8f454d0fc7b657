"""The speed assistance against the table of Regulation (EU) 2021/1958, Annex I."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.units import legal_limit
from proto.decision import Preferences
from proto.rules import LegalLimit
from proto.vehicle import Ego
from services.orchestrator.speed_assistance import MOST_SOUND_S, SOUNDED_AFTER_S, step, warning_of
from services.orchestrator.state import Overspeed
from tests.unit.services.orchestrator.support import (
    KMH,
    SECOND,
    START,
    TICK,
    Drive,
    Played,
    conditions,
    limit_sign,
    preferences,
)

DRIVES = Ego(accelerator_pedal=0.3, brake_pedal=0.0)
LIMIT = legal_limit(50, "km/h")


class Assisted:
    """An overspeed, tick by tick."""

    def __init__(self, chosen: Preferences | None = None) -> None:
        self.overspeed, self.now_ns, self.chosen = Overspeed(), START, chosen or Preferences()
        self.shown: list[tuple[float, str]] = []

    def drive(self, seconds: float, kmh: float, limit: LegalLimit | None = LIMIT, ego: Ego | None = DRIVES) -> None:
        for _ in range(round(seconds * 10)):
            self.now_ns += TICK
            self.overspeed = step(self.overspeed, limit, kmh * KMH, ego, self.chosen, self.now_ns)
            self.shown.append(((self.now_ns - START) / SECOND, warning_of(self.overspeed, self.now_ns)))

    def times(self, kind: str) -> list[float]:
        return [time_s for time_s, shown in self.shown if shown == kind]

    def sounds(self) -> list[float]:
        """When each sound began."""
        pairs = pairwise([(0.0, "none"), *self.shown])
        return [now[0] for before, now in pairs if now[1] == "sounded" != before[1]]


@pytest.mark.parametrize(("kmh", "after_s"), [(66.0, 3.0), (60.1, 4.0), (55.1, 5.0), (52.6, 6.0)])
def test_an_overspeed_is_shown_at_once_and_sounded_by_the_table_of_times(kmh: float, after_s: float) -> None:
    assisted = Assisted()
    assisted.drive(20.0, kmh)
    assert assisted.times("shown")[0] <= 1.5
    assert assisted.sounds() == [pytest.approx(after_s + 0.1)]
    assert len(assisted.times("sounded")) * 0.1 <= MOST_SOUND_S
    assert assisted.shown[-1][1] == "shown", "what is shown stays for as long as the overspeed does"


@given(st.floats(0.0, 52.4))
def test_within_the_tolerance_nothing_is_sounded(kmh: float) -> None:
    assisted = Assisted()
    assisted.drive(30.0, kmh)
    assert not assisted.times("sounded")
    assert kmh > 50.0 or not assisted.times("shown")


@given(st.floats(0.0, 10.0), st.floats(0.0, 200.0))
def test_the_drivers_tolerance_only_delays_a_sound(tolerance: float, kmh: float) -> None:
    plain, tolerant = Assisted(), Assisted(Preferences(tolerance_low=tolerance))
    for each in (plain, tolerant):
        each.drive(15.0, kmh)
    assert plain.sounds()[:1] <= tolerant.sounds()[:1] or not tolerant.sounds()
    assert plain.times("shown")[:1] == tolerant.times("shown")[:1], "what is shown is the law's"


@pytest.mark.parametrize(
    "answer", [Ego(accelerator_pedal=0.0), Ego(brake_pedal=0.2, accelerator_pedal=0.3), "at the limit", "a touch"]
)
def test_the_sound_ends_at_once_when_the_driver_answers_it(answer: Ego | str) -> None:
    assisted = Assisted()
    assisted.drive(6.5, 53.0)
    assert assisted.shown[-1][1] == "sounded"
    if answer == "a touch":
        drive = Drive(speed_mps=53.0 * KMH)
        drive.ticks(75)
        assert warning_of(drive.state.overspeed, drive.now_ns) == "sounded"
        drive.tick(acknowledged=True)
        assert warning_of(drive.state.overspeed, drive.now_ns) == "shown"
        return
    if isinstance(answer, Ego):
        assisted.drive(0.1, 53.0, ego=answer)
    else:
        assisted.drive(0.1, 50.0)
    assert assisted.shown[-1][1] != "sounded"


def test_it_comes_again_only_after_the_limit_was_kept_or_fell() -> None:
    assisted = Assisted()
    assisted.drive(60.0, 54.0)
    assert len(assisted.sounds()) == 1
    assisted.drive(1.0, 49.0)
    assisted.drive(10.0, 54.0)
    assert len(assisted.sounds()) == 2
    assisted.drive(10.0, 54.0, legal_limit(30, "km/h"))
    assert len(assisted.sounds()) == 3


@given(
    st.lists(
        st.tuples(
            st.floats(0.1, 8.0),
            st.floats(0.0, 250.0),
            st.sampled_from([None, *(legal_limit(each, "km/h") for each in (10, 30, 50, 100, 130))]),
            st.sampled_from([None, DRIVES, Ego(), Ego(accelerator_pedal=0.0), Ego(brake_pedal=1.0)]),
        ),
        max_size=12,
    ),
    st.integers(-5, 5),
)
def test_no_sound_lasts_longer_than_the_rule_allows_whatever_comes(
    parts: list[tuple[float, float, LegalLimit | None, Ego | None]], steps_back: int
) -> None:
    assisted = Assisted()
    for seconds, kmh, limit, ego in parts:
        assisted.drive(seconds, kmh, limit, ego)
        assisted.now_ns += steps_back * SECOND  # a clock that is set
    longest = run = 0
    for _, shown in assisted.shown:
        run = run + 1 if shown == "sounded" else 0
        longest = max(longest, run)
    assert longest * 0.1 <= MOST_SOUND_S + 0.1 + 5.0 * (steps_back < 0)


@given(st.sampled_from([None, legal_limit(130, "km/h", advisory=True)]), st.floats(0.0, 300.0))
def test_without_a_limit_that_binds_nothing_is_warned_of(limit: LegalLimit | None, kmh: float) -> None:
    assisted = Assisted()
    assisted.drive(12.0, kmh, limit)
    assert {shown for _, shown in assisted.shown} == {"none"}


def test_mute_silences_it_and_what_is_shown_stays() -> None:
    assisted = Assisted(Preferences(muted=True))
    assisted.drive(12.0, 70.0)
    assert not assisted.times("sounded")
    assert assisted.shown[-1][1] == "shown"


def test_the_table_asks_for_less_patience_the_faster_one_drives() -> None:
    assert list(SOUNDED_AFTER_S) == sorted(SOUNDED_AFTER_S, reverse=True)
    assert [after for _, after in SOUNDED_AFTER_S] == sorted(after for _, after in SOUNDED_AFTER_S)


def test_a_limit_is_shown_within_two_seconds_of_its_sign_and_with_its_plate() -> None:
    drive = Drive(speed_mps=60 * KMH, road="rural")
    drive.weather = conditions(mu=0.6, wet=True)
    drive.ticks(30)
    drive.tick(limit_sign("limit:70", scope="when_wet", plates=("plate:when_wet:de",)))
    drive.ticks(19)
    shown = drive.history[-1][2].assistance
    assert shown.limit is not None
    assert (shown.limit.value, shown.plate, shown.known) == (70, "when wet", "known")


def test_without_a_limit_it_is_shown_as_unknown_and_without_a_service_as_a_fault() -> None:
    drive = Drive(Played({}), road="")
    assert drive.tick().assistance.known == "unknown"
    assert drive.ticks(25, absent=("rules",)).assistance.fault == "rules"


def test_what_the_driver_chose_is_heard_in_the_next_tick() -> None:
    drive = Drive(speed_mps=57 * KMH)
    drive.tick(preferences=preferences(tolerance_low=8.0))
    drive.ticks(100)
    assert not any(text.startswith("Slow down") for text in drive.spoken())
    drive.tick(preferences=preferences(tolerance_low=0.0))
    drive.ticks(60)
    assert any(text.startswith("Slow down") for text in drive.spoken())


@given(st.floats(-1e9, -0.03) | st.floats(1.03, 1e9))
def test_a_pedal_beyond_its_way_ends_no_sound(absurd: float) -> None:
    for ego in (
        Ego(accelerator_pedal=min(absurd, -0.03), brake_pedal=0.0),
        Ego(accelerator_pedal=0.3, brake_pedal=absurd),
    ):
        assisted = Assisted()
        assisted.drive(12.0, 66.0, ego=ego)
        assert assisted.sounds() == [pytest.approx(3.1)]


def flickering(known_s: float, unknown_s: float, seconds: float, kmh: float = 66.0) -> list[tuple[str, str]]:
    """Warning and fault of each tick of an overspeed whose speed the car tells now and then."""
    drive = Drive(speed_mps=kmh * KMH)
    shown: list[tuple[str, str]] = []
    while len(shown) < seconds * 10:
        for drive.speed_mps, lasts_s in ((kmh * KMH, known_s), (None, unknown_s)):
            told = (drive.tick().assistance for _ in range(round(lasts_s * 10)))
            shown += [(each.warning, each.fault) for each in told]
    return shown


@given(st.integers(1, 15), st.integers(1, 19))
def test_a_speed_that_is_missing_now_and_then_keeps_no_warning_back(known: int, unknown: int) -> None:
    told = flickering(known / 10, unknown / 10, 6.0)
    warnings = [warning for warning, _ in told]
    assert warnings.index("shown") <= 15
    assert "sounded" in warnings[:50]
    assert "none" not in warnings[15:]
    assert {fault for _, fault in told} == {""}


def test_a_speed_that_is_missing_for_longer_ends_the_overspeed_and_is_a_fault() -> None:
    told = flickering(2.0, 10.0, 12.0)
    assert told[15] == ("shown", "")
    assert set(told[45:]) == {("none", "can")}
