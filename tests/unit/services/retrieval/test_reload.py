"""An index that follows changed packs."""

import json
from pathlib import Path

import pytest

from services.retrieval.library import Library, Request
from services.retrieval.ranking.tuning import read_tuning
from tests.unit.services.retrieval.support import WordEncoder, seal

TEXT = "Nobody drives fast."


def write(folder: Path, text: str, version: str = "1.0.0") -> None:
    (folder / "sources").mkdir(parents=True, exist_ok=True)
    (folder / "sources" / "law.en.md").write_text(text, encoding="utf-8")
    source = {"language": "en", "document": "sources/law.en.md", "start": 0, "end": len(text), "excerpt": text}
    manifest = {"id": "A-v1", "version": version, "content_sha256": "0" * 64, "jurisdiction": "ZZZ"}
    (folder / "manifest.json").write_text(json.dumps(manifest), encoding="utf-8")
    entry = {"id": "a-law", "section": "Act 1", "kind": "statute", "sources": [source]}
    (folder / "provisions.json").write_text(json.dumps([entry]), encoding="utf-8")
    for name in ("signs.json", "cases.json"):
        (folder / name).write_text("[]", encoding="utf-8")
    seal(folder)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write(tmp_path, TEXT)
    return tmp_path


def test_changed_texts_are_found_by_words_and_by_meaning(folder: Path) -> None:
    library, encoder = Library((folder,), read_tuning(), status="bm25-only (loading)"), WordEncoder()
    library.use(encoder)
    assert library.search(Request(query="fog")).passages[:1] != ()
    write(folder, "In fog everybody drives slowly.", "1.1.0")
    assert library.reload((folder,)) == []
    found = library.search(Request(query="nebel"))
    assert found.encoder == encoder.name
    assert found.passages[0].rulepack_version.startswith("A-v1@1.1.0")
    assert found.passages[0].cosine == pytest.approx(1.0, abs=0.01)


def test_texts_that_stay_are_not_embedded_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = Library((folder,), read_tuning(), status="bm25-only (loading)")
    library.use(WordEncoder())
    monkeypatch.setattr(WordEncoder, "passages", lambda *_: pytest.fail("was embedded again"))
    write(folder, TEXT, "1.1.0")
    assert library.reload((folder,)) == []
    assert library.packs[folder][0].rulepack_version.startswith("A-v1@1.1.0")


def test_what_cannot_be_indexed_is_told_and_the_old_index_stays(folder: Path) -> None:
    library = Library((folder,), read_tuning(), status="bm25-only (switched off)")
    (folder / "provisions.json").write_text("nonsense", encoding="utf-8")
    (why,) = library.reload((folder,))
    assert "provisions.json" in why
    assert library.refused == [why]
    assert [text.excerpt for text in library.packs[folder]] == [TEXT]
    write(folder, TEXT, "1.2.0")
    assert library.reload((folder,)) == library.refused == []


def test_texts_that_were_altered_without_sealing_are_refused_and_the_old_index_stays(folder: Path) -> None:
    library = Library((folder,), read_tuning(), status="bm25-only (switched off)")
    for path in (folder / "provisions.json", folder / "sources" / "law.en.md"):
        path.write_text(path.read_text(encoding="utf-8").replace("fast", "late"), encoding="utf-8")
    (why,) = library.reload((folder,))
    assert "content_sha256" in why
    assert [text.excerpt for text in library.packs[folder]] == [TEXT]
    seal(folder)
    assert library.reload((folder,)) == library.refused == []
    assert [text.excerpt for text in library.packs[folder]] == ["Nobody drives late."]
