"""The language of a statute has two letters, whichever code its publisher writes."""

from pathlib import Path

import pytest

from services.rules.authoring.statutes.drafts import read_statute
from services.rules.authoring.statutes.languages import OF_THREE, language_of
from services.rules.authoring.statutes.statute import Statute
from services.rules.authoring.vocabulary import LANGUAGES

AKN = (
    '<akomaNtoso xmlns="http://docs.oasis-open.org/legaldocml/ns/akn/3.0"><act><meta><identification><FRBRWork>'
    '<FRBRcountry value="{country}"/></FRBRWork><FRBRExpression><FRBRlanguage language="{language}"/></FRBRExpression>'
    "</identification></meta><body><section><num>1</num><content><p>Stop.</p></content></section></body></act></akomaNtoso>"
)
CLML = (
    '<Legislation xmlns="http://www.legislation.gov.uk/namespaces/legislation" xmlns:dc="http://purl.org/dc/elements/1.1/">'
    "<Metadata><dc:title>Road Act</dc:title><dc:language>{language}</dc:language></Metadata><Primary><Body><P1 id='section-1'>"
    "<Pnumber>1</Pnumber><P1para><Text>Stop.</Text></P1para></P1></Body></Primary></Legislation>"
)


def read(tmp_path: Path, law: str, language: str, country: str = "") -> Statute:
    (tmp_path / "act.xml").write_text(law.format(language=language, country=country), encoding="utf-8")
    return read_statute(tmp_path / "act.xml")


@pytest.mark.parametrize(
    ("written", "language"),
    [
        ("est", "et"), ("slk", "sk"), ("swe", "sv"), ("por", "pt"), ("jpn", "ja"), ("ces", "cs"), ("cze", "cs"), ("deu", "de"),
        ("ENG", "en"), ("sv-SE", "sv"), ("swe-FI", "sv"), ("el", "el"), ("", "en"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("law", [AKN, CLML])
def test_a_language_is_written_with_its_own_two_letters(law: str, written: str, language: str, tmp_path: Path) -> None:
    statute = read(tmp_path, law, written)
    assert (statute.language, statute.left) == (language, ())


@pytest.mark.parametrize("written", ["mul", "gsw", "zz", "Klingon"])
@pytest.mark.parametrize("law", [AKN, CLML])
def test_a_language_without_two_letters_is_told(law: str, written: str, tmp_path: Path) -> None:
    statute = read(tmp_path, law, written)
    assert statute.language == "en"
    (told,) = statute.left
    assert told.startswith(f"language {written!r} has no two letters of ISO 639-1, taken as English: mend languages in")


def test_every_code_of_three_letters_leads_to_a_language_that_packs_know() -> None:
    assert {len(code) for code in OF_THREE} == {3}
    assert set(OF_THREE.values()) <= set(LANGUAGES)
    assert all(language_of(code) == (two, ()) for code, two in OF_THREE.items())


@pytest.mark.parametrize(
    ("written", "jurisdiction"), [("est", "EST"), ("deu", "DEU"), ("de", "DEU"), ("gb-sct", "GBR"), ("za", "")]
)
def test_a_country_of_three_letters_is_not_cut_to_two(written: str, jurisdiction: str, tmp_path: Path) -> None:
    assert read(tmp_path, AKN, "eng", written).jurisdiction == jurisdiction
