"""Passages come from the packs with offsets that hold."""

import json
import shutil
from pathlib import Path

import pytest

from drivemcp.paths import data
from services.retrieval.corpus import CorpusError, digest, read_pack
from services.retrieval.service import RetrievalConfig
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
