"""What the rules say, language by language."""

import string
import tomllib

import msgspec
import pytest

from domain.languages import LANGUAGES
from services.rules import citing
from services.rules.book import RuleBook
from services.rules.lookup.evidence import questions
from services.rules.words import FOLDER, country, say, text_in


def table(language: str) -> dict[str, dict[str, str]]:
    return tomllib.loads((FOLDER / f"{language}.toml").read_text(encoding="utf-8"))


def fields(text: str) -> set[str]:
    return {field for _, field, _, _ in string.Formatter().parse(text) if field}


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_language_has_every_sentence_with_the_same_values(language: str) -> None:
    first, other = table("en"), table(language)
    assert {name: part.keys() for name, part in other.items()} == {name: part.keys() for name, part in first.items()}
    assert [key for key, text in first["said"].items() if fields(text) - fields(other["said"][key])] == []
    assert len(questions(language)) == len(questions("en"))
    assert language == "en" or set(questions(language)).isdisjoint(questions("en"))


def test_a_sentence_is_told_in_the_drivers_language_and_in_english_where_it_is_not_spoken() -> None:
    assert say("default", "nl", limit="50 km/h") == "Algemene limiet hier 50 km/h."
    assert say("default", "it-CH", limit="50 km/h") == "Limite generale qui 50 km/h."
    assert say("default", "fi", limit="50 km/h") == "General limit 50 km/h here."


def test_a_country_is_named_in_the_drivers_language_by_its_pack_or_an_installed_one(book: RuleBook) -> None:
    assert [country(book, "DEU", each) for each in ("es-ES", "fr", "fi")] == ["Alemania", "Allemagne", "Germany"]
    assert "POL" not in {pack.manifest.jurisdiction for pack in book.packs.values()}
    assert country(book, "POL", "es") == "Polonia"
    assert country(book, "QQQ", "de") == "dieses Land"


@pytest.mark.parametrize(("language", "told"), [("nl", "n"), ("pl", "p"), ("it", "i"), ("es", "s"), ("de", "e")])
def test_a_text_of_a_pack_is_told_in_its_language_else_in_english_never_in_the_first(language: str, told: str) -> None:
    assert text_in({"fr": "f", "en": "e", "nl": "n", "pl": "p", "it": "i", "es": "s"}, language) == told


@pytest.mark.parametrize("language", ["nl", "pl", "it", "es"])
def test_a_provision_is_cited_in_the_drivers_language_else_in_english(book: RuleBook, language: str) -> None:
    pack = next(pack for pack in book.packs.values() if pack.manifest.jurisdiction == "DEU")
    provision = next(each for each in pack.provisions.values() if [s.language for s in each.sources] == ["de", "en"])
    english = citing.cite(pack, provision, "en")
    assert citing.cite(pack, provision, language) == english
    german, in_english = provision.sources
    renamed = msgspec.structs.replace(
        provision, sources=(in_english, msgspec.structs.replace(german, language=language))
    )
    assert citing.cite(pack, renamed, language) == citing.cite(pack, provision, "de")
