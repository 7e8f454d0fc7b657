"""The country is told by signs; a change of mind needs clear evidence, a border sign is clear."""

from hypothesis import given
from hypothesis import strategies as st

from services.drivelm.cues import Whereabouts, cues_of, oncoming_cue
from services.drivelm.jurisdictions import JURISDICTIONS
from services.drivelm.surroundings import surroundings


def _after(*readings: str, home: str = "DEU") -> Whereabouts:
    where = Whereabouts.at_home(home)
    for number, reading in enumerate(readings):
        where = where.with_cue(("tele", number), cues_of(reading))
    return where


def test_home_is_assumed_weakly_and_nothing_is_known_without_it() -> None:
    assert Whereabouts.at_home("DEU").believed == "DEU"
    assert Whereabouts.at_home("DEU").posterior("DEU") < 0.85
    assert Whereabouts.at_home("").believed is None


def test_a_home_is_said_to_be_assumed_until_something_was_seen() -> None:
    home = Whereabouts.at_home("DEU")
    (country, *_) = surroundings(home, None, 1)
    assert country.assumed
    (country, *_) = surroundings(home.with_cue(("front", 1), cues_of("town_entry:yellow")), None, 1)
    assert not country.assumed
    (country, *_) = surroundings(home.past_border(("front", 2), "GBR"), None, 1)
    assert (country.reading, country.assumed) == ("GBR", False)


def test_a_passed_border_changes_the_country_at_once() -> None:
    where = Whereabouts.at_home("DEU").past_border(("tele", 1), "GBR")
    assert where.believed == "GBR"
    assert where.of_unit("mph") > 0.95
    assert where.of_side("left") > 0.95


def test_one_contrary_cue_does_not_change_the_country_but_several_do() -> None:
    assert _after("keep_left").believed != "GBR"
    assert _after("keep_left", "national", "plate:when_wet:en").believed == "GBR"


def test_the_same_sign_seen_again_counts_once() -> None:
    where = Whereabouts.at_home("DEU")
    for _ in range(10):
        where = where.with_cue(("tele", 4), cues_of("keep_left"))
    assert where == Whereabouts.at_home("DEU").with_cue(("tele", 4), cues_of("keep_left"))


def test_yellow_town_signs_confirm_germany_after_a_start_without_knowledge() -> None:
    assert _after("town_entry:yellow", "town_exit:yellow", home="").believed == "DEU"


def test_a_limit_that_a_country_does_not_have_speaks_against_it() -> None:
    assert cues_of("limit:80")["GBR"] < 0
    assert "DEU" not in cues_of("limit:80")


def test_oncoming_traffic_tells_the_side_only_when_clearly_aside() -> None:
    assert oncoming_cue(0.5) == {}
    assert oncoming_cue(3.5)["DEU"] > 0
    assert oncoming_cue(-3.5)["GBR"] > 0


@given(
    st.lists(st.sampled_from(["keep_left", "keep_right", "national", "all_end", "limit:100", "border"]), max_size=30)
)
def test_posteriors_stay_probabilities(readings: list[str]) -> None:
    where = _after(*readings)
    assert abs(sum(where.posterior(country) for country in JURISDICTIONS) - 1) < 1e-9


def test_a_hundred_oncoming_cars_do_not_wash_out_which_right_hand_country_it_is() -> None:
    where = Whereabouts.at_home("DEU")
    for number in range(100):
        where = where.with_cue(("oncoming", number), oncoming_cue(3.5))
    assert where.believed == "DEU"
    assert where.posterior("DEU") > 0.8
    assert where.of_side("right") > 0.99


def test_certainty_can_be_overcome_by_a_run_of_contrary_cues() -> None:
    sure = _after(*["town_entry:yellow"] * 20)
    for number, reading in enumerate(["keep_left", "national", "plate:when_wet:en", "info:units_mph"]):
        sure = sure.with_cue(("front", number), cues_of(reading))
    assert sure.believed == "GBR"
