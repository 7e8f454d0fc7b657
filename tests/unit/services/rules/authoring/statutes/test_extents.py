"""Text of a British Act that counts for a part of the country, or is repealed for some cases, stays, is marked and told."""

from pathlib import Path

import pytest

from services.rules.authoring.statutes.drafts import read_statute
from services.rules.authoring.statutes.statute import Statute

CLML = (
    '<Legislation xmlns="http://www.legislation.gov.uk/namespaces/legislation" xmlns:dc="http://purl.org/dc/elements/1.1/">'
    "<Metadata><dc:title>Road Act</dc:title></Metadata><Primary><Body>{body}</Body></Primary></Legislation>"
)
TOLD = "of a part of the country or of some cases only, drafted all the same: "


def read(tmp_path: Path, text: str, attributes: str = "") -> Statute:
    body = f'<P1 id="section-1" {attributes}><Pnumber>1</Pnumber><P1para><Text>{text}</Text></P1para></P1>'
    (tmp_path / "act.xml").write_text(CLML.format(body=body), encoding="utf-8")
    return read_statute(tmp_path / "act.xml")


@pytest.mark.parametrize("value", ["true", "1"])
def test_a_repeal_that_retains_its_text_stays_and_is_told_with_its_place(value: str, tmp_path: Path) -> None:
    statute = read(tmp_path, f'Drive no <Repeal RetainText="{value}">faster than 40</Repeal> here.')
    assert [each.text for each in statute.sections] == ["Drive no faster than 40 (repealed for some cases) here."]
    assert statute.left == (f"{TOLD}section-1 (repealed for some cases)",)


def test_a_retained_repeal_and_what_is_put_in_its_place_stand_apart(tmp_path: Path) -> None:
    statute = read(tmp_path, 'At <Repeal RetainText="true">40</Repeal><Substitution>30</Substitution> mph.')
    assert [each.text for each in statute.sections] == ["At 40 (repealed for some cases) 30 mph."]


@pytest.mark.parametrize("attributes", ["", 'RetainText="false"', 'Extent="S"'])
def test_a_repeal_without_retained_text_is_left_out(attributes: str, tmp_path: Path) -> None:
    statute = read(tmp_path, f"Drive<Repeal {attributes}> fast</Repeal>.")
    assert [each.text for each in statute.sections] == ["Drive."]
    assert statute.left == ()


@pytest.mark.parametrize(
    ("written", "read_as", "told"),
    [
        ('<Substitution Extent="E+W">30</Substitution><Substitution Extent="S">20</Substitution> mph', "30 (E+W) 20 (S) mph",
         "section-1 (E+W), section-1 (S)"),
        ('At <Repeal RetainText="true" Extent="S">40</Repeal> mph', "At 40 (repealed: S) mph", "section-1 (repealed: S)"),
        ('Stop<Addition Extent="S"> at dusk</Addition>.', "Stop at dusk (S).", "section-1 (S)"),
        ('<Substitution Extent="E+W">30</Substitution>mph', "30 (E+W) mph", "section-1 (E+W)"),
    ],
)  # fmt: skip
def test_a_change_for_a_part_of_the_country_is_marked_and_told(
    written: str, read_as: str, told: str, tmp_path: Path
) -> None:
    statute = read(tmp_path, written)
    assert [each.text for each in statute.sections] == [read_as]
    assert statute.left == (TOLD + told,)


def test_an_extent_that_is_its_provisions_own_is_not_repeated(tmp_path: Path) -> None:
    statute = read(tmp_path, 'At <Substitution Extent="E+W">30</Substitution> mph', 'RestrictExtent="E+W"')
    assert [each.text for each in statute.sections] == ["At 30 mph"]
    assert statute.left == ()


def test_a_number_that_is_repealed_in_part_stays_a_number(tmp_path: Path) -> None:
    repealed = '<Repeal RetainText="true" Extent="S">{}</Repeal>'
    inside = f"<P2 id='section-1-2'><Pnumber>{repealed.format(2)}</Pnumber><P2para><Text>{repealed.format('Stop.')}</Text></P2para></P2>"
    (tmp_path / "act.xml").write_text(
        CLML.format(body=f'<P1 id="section-1"><Pnumber>1</Pnumber><P1para>{inside}</P1para></P1>'), encoding="utf-8"
    )
    statute = read_statute(tmp_path / "act.xml")
    assert {each.cited: each.text for each in statute.sections} == {"Road Act s. 1(2)": "Stop. (repealed: S)"}
    assert statute.left == (f"{TOLD}section-1-2 (repealed: S)",)


def test_repealed_words_of_a_heading_are_left_out(tmp_path: Path) -> None:
    one = '<P1 id="section-1"><Pnumber>1</Pnumber><P1para><Text>Stop.</Text></P1para></P1>'
    body = f"<P1group><Title>Cars<Repeal> and carts</Repeal></Title>{one}</P1group>"
    (tmp_path / "act.xml").write_text(CLML.format(body=body), encoding="utf-8")
    assert [each.heading for each in read_statute(tmp_path / "act.xml").sections] == ["Cars"]
