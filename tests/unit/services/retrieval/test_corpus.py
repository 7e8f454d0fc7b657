"""Passages come from the packs with offsets that hold."""

import json
import shutil
from pathlib import Path

import pytest

from drivemcp.paths import data
from services.retrieval.corpus import CorpusError, digest, read_pack
from services.retrieval.service import RetrievalConfig
from services.rules.authoring.validate import validated
from services.rules.packs.loading import load
from tests.unit.services.retrieval.support import seal

PACKS = ("DEU-v1", "DEU-v1-VSL", "GBR-v1")


@pytest.mark.parametrize("name", PACKS)
def test_every_passage_is_the_documents_text_between_its_offsets(name: str) -> None:
    texts = read_pack(data(f"rulepacks/{name}"))
    assert {text.corpus for text in texts} == {"statutes", "signs"}
    for text in texts:
        document = data(f"rulepacks/{text.document}").read_text(encoding="utf-8")
        assert document[text.start : text.end] == text.excerpt


def test_everyday_words_are_searched_and_not_cited() -> None:
    text = next(t for t in read_pack(data("rulepacks/GBR-v1")) if t.name == "gbr-zebra")
    assert "crosswalk" in text.indexed
    assert "crosswalk" not in text.excerpt


@pytest.mark.parametrize("file", ["manifest.json", "provisions.json", "signs.json", "cases.json"])
def test_a_broken_pack_is_refused_by_the_name_of_the_file(tmp_path: Path, file: str) -> None:
    folder = Path(shutil.copytree(data("rulepacks/GBR-v1"), tmp_path / "GBR-v1"))
    (folder / file).write_text("[1, 2", encoding="utf-8")
    with pytest.raises(CorpusError, match=file.replace(".", r"\.")):
        read_pack(folder)


def test_moved_text_is_noticed(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(data("rulepacks/GBR-v1"), tmp_path / "GBR-v1"))
    path = folder / "sources" / "motorways.en.md"
    path.write_text("!" + path.read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.raises(CorpusError, match=r"motorways\.en\.md: characters"):
        read_pack(folder)


def test_the_digest_follows_what_is_indexed(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(data("rulepacks/GBR-v1"), tmp_path / "GBR-v1"))
    before = digest(read_pack(folder))
    provisions = json.loads((folder / "provisions.json").read_text("utf-8"))
    provisions[0]["section"] += "!"
    (folder / "provisions.json").write_text(json.dumps(provisions), encoding="utf-8")
    seal(folder)
    assert digest(read_pack(folder)) != before


def test_a_pack_altered_in_provisions_and_source_is_refused_for_its_hash(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(data("rulepacks/DEU-v1"), tmp_path / "DEU-v1"))
    for path in (folder / "provisions.json", folder / "sources" / "stvo-geschwindigkeit.en.md"):
        text = path.read_text(encoding="utf-8")
        assert "motor vehicles is 50 km/h" in text
        path.write_text(text.replace("motor vehicles is 50 km/h", "motor vehicles is 90 km/h"), encoding="utf-8")
    with pytest.raises(CorpusError, match=r"manifest\.json: content_sha256"):
        read_pack(folder)


@pytest.mark.parametrize("name", RetrievalConfig().packs)
def test_both_services_read_the_same_version_of_a_pack(name: str) -> None:
    assert {text.rulepack_version for text in read_pack(data(f"rulepacks/{name}"))} == {
        load(data(f"rulepacks/{name}")).version
    }


def test_a_pack_with_a_draft_in_it_is_refused(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(data("rulepacks/GBR-v1"), tmp_path / "GBR-v1"))
    provisions = json.loads((folder / "provisions.json").read_text("utf-8"))
    provisions[0]["draft"] = True
    (folder / "provisions.json").write_text(json.dumps(provisions), encoding="utf-8")
    seal(folder)
    with pytest.raises(CorpusError, match=r"provisions\.json: .* is a draft"):
        read_pack(folder)


def asked_of(tmp_path: Path, asked: object) -> Path:
    """Germany's pack with other words of drivers; a text is written as it is."""
    folder = Path(shutil.copytree(data("rulepacks/DEU-v1"), tmp_path / "DEU-v1"))
    (folder / "asked.json").write_text(asked if isinstance(asked, str) else json.dumps(asked), encoding="utf-8")
    return folder


def test_the_words_of_drivers_are_searched_and_change_neither_the_texts_nor_the_seal(tmp_path: Path) -> None:
    told = {
        "deu-phone": {"de": ["darf ich am Steuer wischen"], "it": ["posso scrivere alla guida"]},
        "nothing": {"de": ["xy"]},
    }
    before = {text.passage_id: text for text in read_pack(data("rulepacks/DEU-v1"))}
    found = {text.passage_id: text for text in read_pack(asked_of(tmp_path, told))}
    assert found.keys() == before.keys()
    for key, text in found.items():
        assert (text.excerpt, text.rulepack_version) == (before[key].excerpt, before[key].rulepack_version)
    phone = {text.language: text.indexed for text in found.values() if text.name == "deu-phone"}
    assert "am Steuer wischen" in phone["de"]
    assert [language for language, words in phone.items() if "alla guida" in words] == ["de"]  # no text is Italian
    assert sum("am Steuer wischen" in text.indexed for text in found.values()) == 1


@pytest.mark.parametrize(
    "asked",
    [
        "[1, 2", "[]", {"deu-phone": ["x"]}, {"deu-phone": {"de": "x"}}, {"deu-phone": {"de": [1]}}, {"deu-phone": {"German": ["xy"]}},
        {"deu-phone": {"de": ["am\0Steuer"]}}, {"deu-phone": {"de": ["am Steuer"] * 41}}, {"deu-phone": {"de": ["Steuer" * 50]}},
    ],
)  # fmt: skip
def test_words_of_drivers_that_cannot_be_used_are_told_and_the_law_is_searched(
    tmp_path: Path, asked: object, caplog: pytest.LogCaptureFixture
) -> None:
    found = read_pack(asked_of(tmp_path, asked))
    assert len(found) == len(read_pack(data("rulepacks/DEU-v1")))
    assert not any(text.asked for text in found if text.corpus == "statutes")
    assert "asked.json is not searched: " in caplog.text


def test_a_byte_order_mark_hides_no_words_of_drivers(tmp_path: Path) -> None:
    folder = asked_of(tmp_path, "\ufeff" + json.dumps({"deu-phone": {"de": ["am Steuer wischen"]}}))
    assert any("am Steuer wischen" in text.indexed for text in read_pack(folder))


def test_words_of_drivers_behind_a_link_are_told_and_keep_neither_search_nor_law_from_the_pack(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = asked_of(tmp_path, {})
    (folder / "asked.json").rename(tmp_path / "elsewhere.json")
    (folder / "asked.json").symlink_to(tmp_path / "elsewhere.json")
    assert read_pack(folder)
    assert "is a link" in caplog.text
    assert load(folder).version == load(data("rulepacks/DEU-v1")).version
    assert any("is a link" in str(problem) for problem in validated(folder))


def test_what_a_law_alone_answers_is_not_answered_by_the_words_of_drivers() -> None:
    text = next(t for t in read_pack(data("rulepacks/GBR-v1")) if t.name == "gbr-police-stop")
    assert text.asked
    assert text.asked not in text.of_the_law


def test_signs_are_asked_for_by_their_looks_in_every_pack() -> None:
    for name, language in (("NLD-v1", "nl"), ("POL-v1", "pl"), ("DEU-v1", "de"), ("USA-v1", "en")):
        texts = [text for text in read_pack(data(f"rulepacks/{name}")) if text.corpus == "signs"]
        own = [text for text in texts if text.language == language]
        assert sum(bool(text.asked) for text in own) >= 0.95 * len(own)


def test_a_sign_is_asked_for_by_its_looks_in_the_languages_of_its_texts_alone() -> None:
    english = [
        text for text in read_pack(data("rulepacks/GBR-v1")) if text.name == "sign:stop" and text.language == "en"
    ]
    assert "ocho lados" not in english[0].asked
    assert "osiem" not in english[0].asked
    assert english[0].asked


@pytest.mark.parametrize("name", sorted(RetrievalConfig().packs))
def test_every_provision_of_a_pack_is_asked_for_in_the_words_of_drivers(name: str) -> None:
    texts = [text for text in read_pack(data(f"rulepacks/{name}")) if text.corpus == "statutes"]
    asked = {text.name for text in texts if len(text.asked.split()) >= 10}
    assert asked == {text.name for text in texts} or name in ("VIENNA-v1", "TEST-v1")
