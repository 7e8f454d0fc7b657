"""The study of speedings: what it refuses."""

import gzip
from pathlib import Path

import pytest

from studies.speedings import main


def test_a_run_whose_truth_is_cut_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "log.mcap").write_bytes(b"")
    (tmp_path / "truth.msgpack.gz").write_bytes(gzip.compress(b"truth" * 100)[:-20])
    assert main([str(tmp_path / "log.mcap")]) == 2
    assert "log.mcap: " in capsys.readouterr().err


def test_a_log_that_is_not_there_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path / "none.mcap")]) == 2
    assert "none.mcap" in capsys.readouterr().err
