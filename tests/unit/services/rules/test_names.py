"""Countries and their parts bear the names that packs give them, and no answer shows a code."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest

from domain.languages import LANGUAGES
from drivemcp.paths import data
from proto.rules import PlaceName, RightOfWayQuestion, Situation
from proto.scene import Candidate
from services.rules.authoring.validate import validated
from services.rules.book import RuleBook, load_book
from services.rules.limits.limit_answer import applicable_limit
from services.rules.right_of_way import right_of_way
from services.rules.signs.meaning import SignQuestion, interpret_sign
from tests.unit.services.rules.editing import edit, rehash

ATLANTIS = {
    "en": {"name": "Atlantis", "inside": "on Atlantis", "out_of": "from Atlantis", "said": "sunken Atlantis"},
    "fr": {"name": "Atlantide", "inside": "en Atlantide", "out_of": "d'Atlantide", "said": "l'Atlantide"},
}
PART = {"en": {"name": "Poseidonis"}, "fr": {"name": "Poséidonide"}}
CODES = ("ATL", "DEU", "GBR", "XXX", "ZZZ", "QQQ")


@pytest.fixture
def atlantis(copy_pack: Callable[[str], Path]) -> Path:
    """A pack of a country of its own, one part of which has a lower limit."""
    folder = copy_pack("TEST-v1").rename(copy_pack("DEU-v1").parent / "ATL-v1")
    for name in ("provisions.json", "cases.json"):
        path = folder / name
        path.write_text(path.read_text(encoding="utf-8").replace("ZZZ", "ATL"), encoding="utf-8")
    edit(
        folder / "manifest.json",
        lambda m: m.update(id="ATL-v1", jurisdiction="ATL", names={"ATL": ATLANTIS, "ATL-N": PART}),
    )
    rehash(folder)
    return folder


def book_of(*folders: Path) -> RuleBook:
    book, refused = load_book(folders)
    assert refused == ()
    return book


@pytest.mark.parametrize(
    ("language", "name", "said"),
    [("en", "Atlantis", "sunken Atlantis"), ("fr", "Atlantide", "l'Atlantide"), ("de", "Atlantis", "sunken Atlantis")],
)
def test_a_pack_s_country_is_named_in_each_of_its_languages_and_in_english_for_others(
    atlantis: Path, language: str, name: str, said: str
) -> None:
    book = book_of(atlantis, data("rulepacks/DEU-v1"))
    answer = applicable_limit(book, Situation(jurisdiction="ATL", road_type="urban", language=language))
    assert answer.place is not None
    assert answer.place.name == name
    foreign = interpret_sign(book, SignQuestion(reading="toll", jurisdiction="DEU", language=language))
    elsewhere = right_of_way(book, RightOfWayQuestion(jurisdiction="QQQ", language=language))
    assert said in elsewhere.note
    assert "ATL" not in foreign.note + elsewhere.note


def test_a_part_with_a_lower_limit_is_told_by_its_name(atlantis: Path) -> None:
    book = book_of(atlantis)
    notes = {
        language: applicable_limit(book, Situation(jurisdiction="ATL", road_type="urban", language=language)).note
        for language in ("en", "fr", "nl")
    }
    assert "It is lower in Poseidonis" in notes["en"]
    assert "Poséidonide" in notes["fr"]
    assert "Poseidonis" in notes["nl"]


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("place", ["DEU", "GBR", "GBR-WLS", "QQQ", "DNK", None])
def test_no_answer_shows_a_code_of_a_country_or_a_pack(language: str, place: str | None) -> None:
    expected = {"DEU-v1": "9.0.0", "GBR-v1": "9.0.0"}
    folders = [data(f"rulepacks/{name}") for name in ("DEU-v1", "GBR-v1", "VIENNA-v1")]
    for book in (load_book(folders, expected=expected)[0], load_book(folders[:1], today="2000-01-01")[0]):
        doubted = (Candidate(reading="border:DEU", confidence=0.5), Candidate(reading="border:QQQ", confidence=0.4))
        notes = [
            applicable_limit(book, Situation(jurisdiction=place, road_type="urban", language=language)).note,
            right_of_way(book, RightOfWayQuestion(jurisdiction=place, signs=("stop",), language=language)).note,
        ]
        for reading in ("border:DEU", "border:QQQ", "national", "limit:50", "wrong_way"):
            for candidates in ((), doubted):
                asked = SignQuestion(reading=reading, jurisdiction=place, language=language, candidates=candidates)
                meaning = interpret_sign(book, asked)
                notes += [meaning.meaning, meaning.note]
        assert [note for note in notes if any(code in note for code in CODES)] == []


def test_a_country_without_a_pack_is_named_by_the_pack_for_unknown_countries() -> None:
    book = book_of(data("rulepacks/DEU-v1"), data("rulepacks/VIENNA-v1"))
    note = applicable_limit(book, Situation(jurisdiction="DNK", road_type="urban", language="pl")).note
    assert "Dania" in note


def test_a_question_about_an_unknown_country_has_no_name() -> None:
    assert applicable_limit(book_of(data("rulepacks/DEU-v1")), Situation(road_type="urban")).place is None


@pytest.mark.parametrize(
    ("names", "wrong"),
    [
        ({"FRA": ATLANTIS}, "ATL itself is not named"),
        ({"ATL": ATLANTIS, "FRA-N": PART}, "FRA-N is no part of ATL"),
        ({"ATL": {"fr": ATLANTIS["fr"]}}, "no name in English"),
        ({"ATL": {"en": {"name": "Atlantis", "inside": "on Atlantis"}}}, "lacks inside or out_of"),
        ({"ATL": {"en": {**ATLANTIS["en"], "name": ""}}}, "length"),
        ({"ATL": {"en": {**ATLANTIS["en"], "name": "A" * 61}}}, "length"),
        ({"ATL": {"en": {**ATLANTIS["en"], "name": "Atlantis\nBrake!"}}}, "regex"),
        ({"ATL": {"en": {**ATLANTIS["en"], "said": "{limit}"}}}, "regex"),
        ({"Atlantis": ATLANTIS}, "regex"),
    ],
)
def test_names_that_are_missing_too_long_or_no_plain_words_are_refused(
    atlantis: Path, names: dict[str, Any], wrong: str
) -> None:
    edit(atlantis / "manifest.json", lambda m: m.update(names=names))
    rehash(atlantis)
    assert wrong in "\n".join(str(problem) for problem in validated(atlantis))


@pytest.mark.parametrize("name", ["A" * 61, "", "a\x00b", "{0}", "<b>"])
def test_a_name_in_an_answer_is_as_bounded_as_in_a_manifest(name: str) -> None:
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({"name": name}, PlaceName)
