"""Statutes in the publishers' XML become drafts, and nothing in the XML reaches beyond its file."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.cli import run
from services.rules.authoring.statutes.drafts import read_statute
from services.rules.authoring.statutes.statute import Statute
from services.rules.errors import PackError
from services.rules.packs.loading import load

STATUTES = Path(__file__).parent


def cited(statute: Statute) -> dict[str, str]:
    return {section.cited: section.text for section in statute.sections}


def test_german_sections_are_split_at_their_numbered_paragraphs() -> None:
    statute = read_statute(STATUTES / "gii.xml")
    assert (statute.title, statute.language, statute.jurisdiction) == ("Erfundene Straßenverkehrsordnung", "de", "DEU")
    assert cited(statute) == {
        "ErfStVO § 1": "Alle nehmen Rücksicht.",
        "ErfStVO § 3a Abs. 1": "Gefahren wird mit Bedacht.",
        "ErfStVO § 3a Abs. 2": "Es gelten 1. innerorts 50 km/h, 2. außerorts 90 km/h. Das gilt auch bei Nacht.",
        "ErfStVO § 3a Abs. 3a": "(weggefallen) [leer]",
        "ErfStVO Anlage 2": "Zeichen 1 heißt Halt.",
    }


def test_british_subsections_are_read_without_repealed_and_quoted_text() -> None:
    statute = read_statute(STATUTES / "clml.xml")
    assert cited(statute) == {
        "Invented Roads Act 2024 s. 81(1)": "Nobody drives on a restricted road faster than 30 miles per hour.",
        "Invented Roads Act 2024 s. 81(2)": "An order may— (a) raise it, or (b) lower it.",
        "Invented Roads Act 2024 s. 82": "In the Other Act, after section 5 insert— (5A) (1) Quoted text.",
        "Invented Roads Act 2024 Sch. 2 para. 1": "Lorries drive at most 50 miles per hour.",
    }
    first = statute.sections[0]
    assert first.url == "https://www.legislation.gov.uk/ukpga/2024/999/section/81/1"
    assert first.heading == "Restricted roads"


def test_akoma_ntoso_articles_are_split_at_their_paragraphs() -> None:
    statute = read_statute(STATUTES / "akn.xml")
    assert (statute.language, statute.jurisdiction) == ("fr", "CHE")
    title = "Ordonnance inventée sur la circulation"
    assert cited(statute) == {
        f"{title} art. 4a(1)": "La vitesse maximale est de : a. 50 km/h dans les localités ; b. 80 km/h hors des localités.",
        f"{title} art. 4a(2)": "Les signaux l'emportent.",
        f"{title} art. 5": "Chacun est prudent.",
    }


@pytest.mark.parametrize("name", ["gii", "clml", "akn"])
def test_an_imported_pack_is_sealed_and_asks_for_effects_and_own_words(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "NEW-v1"
    assert run(["rulepack", "import", str(STATUTES / f"{name}.xml"), "--out", str(folder), "--prefix", "new-law"]) == 0
    provisions = json.loads((folder / "provisions.json").read_text(encoding="utf-8"))
    for entry in provisions:
        (source,) = entry["sources"]
        text = (folder / source["document"]).read_text(encoding="utf-8")
        assert text[source["start"] : source["end"]] == source["excerpt"] != ""
    assert run(["rulepack", "validate", str(folder)]) == 1
    said = capsys.readouterr().out
    assert said.count("in your own words, give it effects") == len(provisions)
    with pytest.raises(PackError, match="draft"):
        load(folder)


def test_a_draft_that_was_restated_and_given_effects_loads(tmp_path: Path) -> None:
    folder = tmp_path / "NEW-v1"
    assert run(["rulepack", "import", str(STATUTES / "gii.xml"), "--out", str(folder)]) == 0
    provisions = json.loads((folder / "provisions.json").read_text(encoding="utf-8"))
    for entry in provisions:
        del entry["draft"]
        entry["effects"] = [{"type": "condition", "what": "posted_limit"}]
    (folder / "provisions.json").write_text(json.dumps(provisions), encoding="utf-8")
    assert run(["rulepack", "seal", str(folder)]) == 0
    assert "deu-erfstvo-3a-2" in load(folder).provisions


def test_a_second_statute_joins_the_first_and_the_same_one_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "NEW-v1"
    arguments = ["--out", str(folder)]
    assert run(["rulepack", "import", str(STATUTES / "gii.xml"), *arguments]) == 0
    assert run(["rulepack", "import", str(STATUTES / "clml.xml"), *arguments]) == 0
    assert len(json.loads((folder / "provisions.json").read_text(encoding="utf-8"))) == 9
    before = (folder / "provisions.json").read_bytes()
    assert run(["rulepack", "import", str(STATUTES / "gii.xml"), *arguments]) == 1
    assert (folder / "provisions.json").read_bytes() == before


BOMB = "<!DOCTYPE dokumente [<!ENTITY a 'ha'><!ENTITY b '&a;&a;'>]><dokumente>&b;</dokumente>"
REMOTE = "<!DOCTYPE dokumente [<!ENTITY a SYSTEM 'file:///etc/hostname'>]><dokumente>&a;</dokumente>"
PARAMETER = "<!DOCTYPE dokumente [<!ENTITY % a SYSTEM 'http://127.0.0.1:1/x'> %a;]><dokumente/>"


@pytest.mark.parametrize("content", [BOMB, REMOTE, PARAMETER])
def test_entities_and_references_to_other_files_are_refused(content: str, tmp_path: Path) -> None:
    path = tmp_path / "law.xml"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(PackError, match="refused"):
        read_statute(path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"<dokumente>",
        b"<html/>",
        b"\xff\xfe\x00",
        b"<dokumente/>",
        b'<?xml version="1.0" encoding="x"?><dokumente/>',
    ],
)
def test_what_is_no_statute_is_told_with_its_file(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "law.xml"
    path.write_bytes(content)
    with pytest.raises(PackError, match=r"law\.xml"):
        read_statute(path)


def test_depth_is_no_matter(tmp_path: Path) -> None:
    deep = "<B>" * 50_000 + "tief" + "</B>" * 50_000
    path = tmp_path / "law.xml"
    path.write_text(
        "<dokumente><norm><metadaten><enbez>§ 1</enbez></metadaten><textdaten><text><Content><P>"
        f"{deep}</P></Content></text></textdaten></norm></dokumente>",
        encoding="utf-8",
    )
    assert [section.text for section in read_statute(path).sections] == ["tief"]


@given(st.text(alphabet="ab§(1) [\n]#&lt;", max_size=60))
def test_no_text_of_a_statute_breaks_out_of_its_paragraph(text: str) -> None:
    from tempfile import TemporaryDirectory
    from xml.sax.saxutils import escape

    with TemporaryDirectory() as name:
        path, folder = Path(name) / "law.xml", Path(name) / "NEW-v1"
        path.write_text(
            "<dokumente><norm><metadaten><enbez>§ 1</enbez></metadaten><textdaten><text><Content><P>start "
            f"{escape(text)}</P></Content></text></textdaten></norm></dokumente>",
            encoding="utf-8",
        )
        assert run(["rulepack", "import", str(path), "--out", str(folder)]) == 0
        (entry,) = json.loads((folder / "provisions.json").read_text(encoding="utf-8"))
        assert entry["sources"][0]["excerpt"].startswith("start")
