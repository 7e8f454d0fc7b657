"""Pythons that are found, and what a command that fails tells."""

import sys
from pathlib import Path

import pytest

from scripts.release.__main__ import main, sums
from scripts.release.environments import VERSIONS, interpreter, run

PYPROJECT = (Path(__file__).parents[4] / "pyproject.toml").read_text(encoding="utf-8")


def test_the_versions_that_are_tried_are_those_of_the_classifiers() -> None:
    assert [version for version in VERSIONS if f'"Programming Language :: Python :: {version}"' in PYPROJECT] == [
        *VERSIONS
    ]
    assert PYPROJECT.count("Programming Language :: Python ::") == len(VERSIONS)
    assert f'requires-python = ">={VERSIONS[0]}"' in PYPROJECT


def test_a_shim_without_its_python_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shim = tmp_path / "python9.9"
    shim.write_text("#!/bin/sh\necho 'python9.9: command not found' >&2\nexit 127\n")
    shim.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("PYENV_ROOT", str(tmp_path))
    assert interpreter("9.9") is None
    there = tmp_path / "versions" / "9.9.1" / "bin" / "python"
    there.parent.mkdir(parents=True)
    there.write_text("#!/bin/sh\necho 9.9\n")
    there.chmod(0o755)
    assert interpreter("9.9") == there


def test_this_python_is_found() -> None:
    assert interpreter(f"{sys.version_info[0]}.{sys.version_info[1]}") == Path(sys.executable)


def test_a_command_that_fails_tells_its_output_and_sees_nothing_of_the_repository(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", "somewhere")
    asked = "import os; print(os.environ.get('PYTHONPATH'))"
    assert run([sys.executable, "-c", asked], tmp_path) == "None\n"
    with pytest.raises(RuntimeError, match="ended with 3:\nbroken"):
        run(["sh", "-c", "echo broken; exit 3"], tmp_path)


def test_the_checksums_name_every_file_but_their_own(tmp_path: Path) -> None:
    for name in ("b", "a", "SHA256SUMS"):
        (tmp_path / name).write_text(name)
    assert [line.split()[1] for line in sums(tmp_path)] == ["a", "b"]


def test_a_refused_release_makes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scripts.release.checks.refusals", lambda root: iter(["a reason"]))
    out = tmp_path / "dist"
    assert main(["--out", str(out)]) == 1
    assert not out.exists()
