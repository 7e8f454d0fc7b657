"""Phrases, units, preferences and the limit on feedback."""

import re
import string
import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from domain.languages import LANGUAGES
from domain.units import in_unit, limit_text, shown, told_target
from drivemcp.files.place_names import installed
from proto.decision import Preferences
from proto.rules import LegalLimit, PlaceName
from proto.scene import COUNTRIES
from services.orchestrator.driver.wishes import MOST, Given, admit, changed, remembered
from services.orchestrator.speech.wording import FOLDER, decimal, place_name, reading_words, say, toned
from services.orchestrator.state import Held, State, ToldPlace
from services.orchestrator.text import plain
from tests.unit.services.orchestrator.scenes import scenes
from tests.unit.services.orchestrator.support import Drive, limit_sign, preferences

SECOND = 1_000_000_000


def table(language: str) -> dict[str, dict[str, str]]:
    return tomllib.loads((FOLDER / f"{language}.toml").read_text(encoding="utf-8"))


def test_every_language_has_every_phrase_with_the_same_values() -> None:
    first = table(LANGUAGES[0])
    for language in LANGUAGES[1:]:
        other = table(language)
        assert other.keys() == first.keys(), language
        for section, phrases in first.items():
            assert sorted(other[section]) == sorted(phrases), (language, section)
            for name, text in phrases.items():
                fields = {field for _, field, _, _ in string.Formatter().parse(text) if field}
                theirs = {field for _, field, _, _ in string.Formatter().parse(other[section][name]) if field}
                assert fields == theirs, (language, section, name)


VALUES = {
    "country": "X", "rules": "50", "limit": "50", "target": "50", "plate": "P", "meaning": "M", "side": "left",
}  # fmt: skip


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_directive_is_at_most_six_words_and_an_alarm_at_most_three(language: str) -> None:
    for name, template in table(language)["directive"].items():
        said = len(re.findall(r"\w[\w'’-]*", template.format_map(VALUES)))
        assert said <= (3 if name.endswith("_alarm") else 6), (language, name)


def speaking(language: str) -> State:
    return State(preferences=preferences(language=language))


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_country_has_its_name_and_its_forms(language: str) -> None:
    for code in COUNTRIES:
        named = installed()[code][language]
        assert named.name
        assert named.inside.lower() != named.name.lower()
        assert named.out_of not in ("", named.inside)


def test_a_country_is_named_as_a_person_says_it() -> None:
    german, polish, french = (speaking(each) for each in ("de", "pl", "fr"))
    assert place_name(german, "CHE").inside == "in der Schweiz"
    assert (place_name(polish, "FRA").inside, place_name(polish, "CHE").out_of) == ("we Francji", "ze Szwajcarii")
    assert (place_name(french, "NLD").inside, place_name(french, "DEU").out_of) == ("aux Pays-Bas", "d'Allemagne")


@pytest.mark.parametrize("language", LANGUAGES)
def test_no_code_stands_in_for_the_name_of_a_country_that_no_pack_names(language: str) -> None:
    unnamed = place_name(speaking(language), "QQQ")
    for words in (
        unnamed.name,
        unnamed.inside,
        unnamed.out_of,
        unnamed.in_a_sentence,
        reading_words(speaking(language), "border:QQQ"),
    ):
        assert words
        assert "QQQ" not in words


def test_a_border_is_read_as_its_country_and_a_limit_as_its_number() -> None:
    assert [reading_words(speaking("de"), each) for each in ("border:NLD", "limit:80")] == ["Niederlande", "80"]


def test_what_the_rules_call_a_country_goes_before_what_the_installed_packs_do() -> None:
    told = ToldPlace(code="BEL", language="de", name=PlaceName(name="Atlantis", inside="auf Atlantis"))
    state = State(preferences=preferences(language="de"), held=Held(places=(told,)))
    assert (place_name(state, "BEL").inside, place_name(state, "NLD").name) == ("auf Atlantis", "Niederlande")
    assert place_name(state, "BEL").out_of == "aus einem anderen Land"
    assert place_name(State(preferences=preferences(language="fr"), held=state.held), "BEL").name == "Belgique"


@pytest.mark.parametrize("language", LANGUAGES)
def test_decimals_are_written_as_the_language_does(language: str) -> None:
    assert decimal(preferences(language=language), 1.25, 2) == ("1.25" if language == "en" else "1,25")


def test_a_value_with_braces_is_only_a_value() -> None:
    assert say(Preferences(), "directive", "foreign", meaning="{limit} {0}") == "Sign: {limit} {0}"


@given(st.text())
def test_plain_text_is_one_short_printable_line(text: str) -> None:
    line = plain(text)
    assert len(line) <= 160
    assert line.isprintable()
    assert plain(line) == line


@given(st.floats(0.0, 60.0), st.sampled_from(("km/h", "mph")))
def test_what_is_told_is_never_more_than_what_is_meant(mps: float, unit: str) -> None:
    per = {"km/h": 1 / 3.6, "mph": 0.44704}[unit]
    assert told_target(mps, unit) <= shown(mps, unit)  # type: ignore[arg-type]
    assert shown(mps, unit) * per <= mps + 1e-5  # type: ignore[arg-type]


def test_a_posted_limit_is_told_as_posted_and_in_the_drivers_unit() -> None:
    limit = LegalLimit(value=30, unit="mph", mps=30 * 0.44704)
    assert limit_text(limit, "mph") == "30 mph"
    assert limit_text(limit, "km/h") == "30 mph (48 km/h)"
    assert limit_text(LegalLimit(value=50, unit="km/h", mps=50 / 3.6), "mph") == "50 (31 mph)"


METRIC = re.compile(r"(?<![\w.,])\d+([.,]\d+)?[ \u00a0]?(km/h|km|m|metres?|Metern?)(?![\w/])")
QUANTITIES = st.builds("{} {}".format, st.integers(0, 999), st.sampled_from(("km/h", "m", "km", "Meter")))


@given(st.lists(st.one_of(st.text(max_size=8), QUANTITIES)))
def test_no_metric_quantity_is_left_in_a_text_for_a_driver_with_miles(parts: list[str]) -> None:
    assert not METRIC.search(in_unit(" ".join(parts), "mph"))
    assert in_unit(" ".join(parts), "km/h") == " ".join(parts)


def test_quantities_are_told_in_miles_and_feet_and_never_as_more() -> None:
    told = in_unit("Max. 100 km/h; 37 m ahead; 2,5 km; Zeichen 274-60; 3 mm", "mph")
    assert told == "Max. 62 mph; 121 ft ahead; 1.6 mi; Zeichen 274-60; 3 mm"


@settings(max_examples=60)
@given(scenes(), st.sampled_from(LANGUAGES))
def test_a_driver_with_miles_hears_and_reads_no_metres_and_no_km_h(drive: Drive, language: str) -> None:
    drive.tick(limit_sign("limit:50"), preferences=preferences(unit="mph", language=language, verbosity="full"))
    for _ in range(3):
        advisory = drive.tick(limit_sign("limit:30", track_id=8, passed=False, distance_m=40.0)).advisory
        assert not METRIC.search(f"{advisory.directive} {advisory.justification}")


def test_politeness_only_where_there_is_time() -> None:
    friendly = Preferences(tone="friendly")
    assert toned(friendly, "Limit 50 km/h", "info") == "Limit 50 km/h, please"
    assert toned(friendly, "Brake", "alarm") == "Brake"


def test_only_what_is_given_changes() -> None:
    assert changed(Preferences(unit="mph"), language="de", unit=None) == Preferences(unit="mph", language="de")


@pytest.mark.parametrize(
    "result", [None, {}, {"entries": []}, {"entries": [3]}, {"entries": [{"value": {"unit": "x"}}]}]
)
def test_damaged_memories_are_none(result: dict[str, object] | None) -> None:
    assert remembered(result) is None


def test_kept_preferences_come_back_and_mute_does_not() -> None:
    kept = {"language": "de", "muted": True, "part": "USA-TX"}
    assert remembered({"entries": [{"value": kept}]}) == Preferences(language="de")


def test_feedback_counts_now_and_then_only() -> None:
    given_ = Given()
    counted = 0
    for second in range(600):
        given_, refused = admit(given_, second * SECOND)
        counted += not refused
    assert counted == MOST
