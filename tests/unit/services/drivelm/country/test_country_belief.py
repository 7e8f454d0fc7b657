"""The country is told by signs; a change of mind needs clear evidence, a border sign is clear."""

from hypothesis import given
from hypothesis import strategies as st

from proto.scene import COUNTRIES, Fact
from services.drivelm.country.country_belief import CountryBelief, cues_of, oncoming_cue
from services.drivelm.country.surroundings import surroundings
from services.drivelm.vocabulary.jurisdictions import JURISDICTIONS


def _after(*readings: str, home: str = "DEU") -> CountryBelief:
    where = CountryBelief.at_home(home)
    for number, reading in enumerate(readings):
        where = where.with_cue(("tele", number), cues_of(reading))
    return where


def test_home_is_assumed_weakly_and_nothing_is_known_without_it() -> None:
    assert CountryBelief.at_home("DEU").believed == "DEU"
    assert CountryBelief.at_home("DEU").posterior("DEU") < 0.85
    assert CountryBelief.at_home("").believed is None


def test_a_home_is_said_to_be_assumed_until_something_was_seen() -> None:
    home = CountryBelief.at_home("DEU")
    (country, *_) = surroundings(home, None, 1)
    assert country.assumed
    (country, *_) = surroundings(home.with_cue(("front", 1), cues_of("town_entry:yellow")), None, 1)
    assert not country.assumed
    (country, *_) = surroundings(home.past_border(("front", 2), "GBR"), None, 1)
    assert (country.reading, country.assumed) == ("GBR", False)


def test_what_many_countries_share_leaves_the_home_setting_assumed() -> None:
    home = _after("all_end", "limit_end", "limit:50")
    for number in range(100):
        home = home.with_cue(("oncoming", number), oncoming_cue(3.5))
    (country, *_) = surroundings(home, None, 1)
    assert (country.reading, country.assumed) == ("DEU", True)
    assert not _after("limit_board:65", home="USA").assumed
    assert not CountryBelief.at_home("DEU").past_border(("tele", 1), "DEU").assumed
    assert not CountryBelief.at_home("DEU").at_position("DEU").assumed


def _unpassed(where: CountryBelief, *codes: str) -> CountryBelief:
    for number, code in enumerate(codes):
        where = where.with_cue(("front", number), cues_of(code), code, passed=False)
    return where


def test_signs_that_were_not_surely_passed_put_the_home_setting_in_doubt_and_tell_no_country() -> None:
    doubted = _unpassed(CountryBelief.at_home("DEU"), *["diamond:yellow"] * 5, "limit_board:65", "limit_board:65")
    assert doubted.believed is None
    country = _country(doubted)
    assert (country.reading, country.believed, country.assumed) == ("USA", False, False)
    assert country.sentence == "The signs speak against DEU; which country it is, is open."
    told = _after("town_entry:yellow")
    assert _unpassed(told, *["diamond:yellow"] * 5) == told, "what signs told is not put in doubt so"
    assert doubted.with_cue(("front", 99), cues_of("limit_board:55"), "limit_board:55").believed == "USA"


@given(st.lists(st.sampled_from(["keep_left", "national", "limit_board:65", "diamond:yellow", "town_entry:white"])))
def test_no_sign_that_was_not_passed_ever_tells_a_country(codes: list[str]) -> None:
    where = _unpassed(CountryBelief.at_home("DEU"), *codes)
    assert where.believed in ("DEU", None)
    assert where.posterior("DEU") <= CountryBelief.at_home("DEU").posterior("DEU")


def test_a_passed_border_changes_the_country_at_once() -> None:
    where = CountryBelief.at_home("DEU").past_border(("tele", 1), "GBR")
    assert where.believed == "GBR"
    assert where.of_unit("mph") > 0.95
    assert where.of_side("left") > 0.95


def test_one_contrary_cue_does_not_change_the_country_but_several_do() -> None:
    assert _after("keep_left").believed != "GBR"
    assert _after("keep_left", "national", "plate:when_wet:en").believed == "GBR"


def test_the_same_sign_seen_again_counts_once() -> None:
    where = CountryBelief.at_home("DEU")
    for _ in range(10):
        where = where.with_cue(("tele", 4), cues_of("keep_left"))
    assert where == CountryBelief.at_home("DEU").with_cue(("tele", 4), cues_of("keep_left"))


def test_yellow_town_signs_confirm_germany_after_a_start_without_knowledge() -> None:
    assert _after("town_entry:yellow", "town_exit:yellow", home="").believed == "DEU"


def test_a_limit_that_a_country_does_not_have_speaks_against_it() -> None:
    assert cues_of("limit:80")["GBR"] < 0
    assert "DEU" not in cues_of("limit:80")


def test_oncoming_traffic_tells_the_side_only_when_clearly_aside() -> None:
    assert oncoming_cue(0.5) == {}
    assert oncoming_cue(3.5)["DEU"] > 0
    assert oncoming_cue(-3.5)["GBR"] > 0


def _country(where: CountryBelief) -> Fact:
    return surroundings(where, None, 1)[0]


def test_a_change_of_country_says_on_what_evidence_it_was_made() -> None:
    where = CountryBelief.at_home("DEU")
    for number, code in enumerate(["keep_left", "national", "limit:50", "plate:when_wet:en"]):
        where = where.with_cue(("tele", number), cues_of(code), code)
    changed = _country(where)
    assert changed.reading == "GBR"
    assert changed.text == "national 3.0, keep_left 2.5"
    assert changed.sentence == "The signs are of GBR, no longer of DEU; for it spoke: national 3.0, keep_left 2.5."
    later = where.with_cue(("tele", 9), cues_of("info:units_mph"), "info:units_mph")
    assert _country(later).text == changed.text, "what came after did not make the change"


def test_a_border_is_evidence_of_its_own() -> None:
    where = CountryBelief.at_home("DEU").with_cue(("tele", 1), cues_of("keep_left"), "keep_left")
    assert _country(where.past_border(("tele", 2), "GBR")).text == "border:GBR 6.0"


def test_what_speaks_for_both_countries_is_no_evidence_of_the_change() -> None:
    where = CountryBelief.at_home("GBR")
    for number, code in enumerate(["oncoming", "plate:when_wet:en", "limit_board:55", "limit_board:65", "school"]):
        cues = oncoming_cue(3.5) if code == "oncoming" else cues_of(code)
        where = where.with_cue(("tele", number), cues, code)
    changed = _country(where)
    assert changed.reading == "USA"
    assert "plate:when_wet:en" not in changed.text
    assert "limit_board:65 3.0" in changed.text


def test_a_home_that_signs_confirm_says_by_which() -> None:
    assert _country(CountryBelief.at_home("DEU")).text == ""
    assert "home setting" in _country(CountryBelief.at_home("DEU")).sentence
    where = CountryBelief.at_home("DEU").with_cue(("tele", 1), cues_of("town_entry:yellow"), "town_entry:yellow")
    assert _country(where).text == "town_entry:yellow 2.0"
    assert "no longer" not in _country(where).sentence


def test_a_country_given_up_before_is_named_as_the_former_one() -> None:
    where = CountryBelief.at_home("DEU")
    for number, code in enumerate(["keep_left", "town_entry:white", "limit:50", "national", "info:side_left"]):
        where = where.with_cue(("tele", number), cues_of(code), code)
    assert "GBR, no longer of DEU" in _country(where).sentence


def test_the_countries_are_those_that_everybody_knows() -> None:
    assert set(JURISDICTIONS) == COUNTRIES


@given(
    st.lists(st.sampled_from(["keep_left", "keep_right", "national", "all_end", "limit:100", "border"]), max_size=30)
)
def test_posteriors_stay_probabilities(readings: list[str]) -> None:
    where = _after(*readings)
    assert abs(sum(where.posterior(country) for country in JURISDICTIONS) - 1) < 1e-9


def test_a_hundred_oncoming_cars_do_not_wash_out_which_right_hand_country_it_is() -> None:
    where = CountryBelief.at_home("DEU")
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
