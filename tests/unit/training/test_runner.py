"""`python -m studies NAME` and `python -m training NAME`: what there is, and what there is not."""

import pytest

import studies
import training
from training.runner import run


def test_without_a_name_the_studies_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(studies, ["--help"]) == 0
    listed = capsys.readouterr().out
    assert "\n  tracking.crossings " in listed
    assert "\n  law " in listed
    assert "runner" not in listed


def test_an_unknown_name_is_told_with_the_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(training, ["detector.trian"]) == 2
    told = capsys.readouterr().err
    assert "there is no 'detector.trian'" in told
    assert "detector.train " in told


def test_a_module_runs_with_what_follows_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        run(studies, ["trends", "--help"])
    assert ended.value.code == 0
    assert "usage: python -m studies trends" in capsys.readouterr().out
