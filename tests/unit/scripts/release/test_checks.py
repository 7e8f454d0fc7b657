"""What a release is refused for, tried on repositories of its own."""

import subprocess
import tomllib
from pathlib import Path

import pytest

from scripts.release.checks import may_be_emptied, notes, refusals, version_of

ROOT = Path(__file__).parents[4]
CHANGELOG = "# Changelog\n\n## [Unreleased]\n\n- later\n\n## [1.2.3] - 2026-01-31\n\n### Added\n\n- this\n\n## [1.2.30]\n\n- other\n"


def git(root: Path, *arguments: str) -> None:
    who = ["-c", "user.name=n", "-c", "user.email=n@example.org"]
    subprocess.run(["git", "-C", root, *who, *arguments], check=True, capture_output=True)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A repository that can be released."""
    (tmp_path / "pyproject.toml").write_text('[project]\nversion = "1.2.3"\n')
    (tmp_path / "CHANGELOG.md").write_text(CHANGELOG)
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "All")
    return tmp_path


def test_a_clean_tree_with_its_section_is_not_refused_nor_with_the_tag_here(tree: Path) -> None:
    assert list(refusals(tree)) == []
    git(tree, "tag", "v1.2.3")
    assert list(refusals(tree)) == []


def test_the_notes_are_the_versions_own_section() -> None:
    assert notes(CHANGELOG, "1.2.3") == "### Added\n\n- this"
    assert notes(CHANGELOG, "1.2.30") == "- other"
    assert notes(CHANGELOG, "1.2") == notes(CHANGELOG, "3.2.1") == ""


@pytest.mark.parametrize("section", ["", "## [1.2.3]\n\n## [1.2.2]\n\n- before\n"])
def test_without_a_section_or_with_an_empty_one_it_is_refused(tree: Path, section: str) -> None:
    (tree / "CHANGELOG.md").write_text(f"# Changelog\n\n{section}")
    git(tree, "commit", "-q", "-a", "-m", "Without")
    assert [reason for reason in refusals(tree) if "[1.2.3]" in reason]


def test_a_changed_or_foreign_file_is_named(tree: Path) -> None:
    (tree / "new.py").write_text("")
    (reason,) = refusals(tree)
    assert "new.py" in reason


def test_a_tag_elsewhere_is_refused(tree: Path) -> None:
    git(tree, "tag", "-a", "v1.2.3", "-m", "Before")
    git(tree, "commit", "-q", "--allow-empty", "-m", "After")
    (reason,) = refusals(tree)
    assert reason.startswith("the tag v1.2.3 is at ")


def test_no_other_file_states_the_version() -> None:
    version = version_of(ROOT)
    evaluation = tomllib.loads((ROOT / "evaluation/pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert set(evaluation["dynamic"]) == {"version", "dependencies"}
    assert not {"version", "dependencies"} & set(evaluation)
    stated = subprocess.run(
        ["git", "-C", ROOT, "grep", "-l", "-F", f'"{version}"', "--", "*.py", "*.toml", "*.yml", "docker", ":!tests"],
        capture_output=True, text=True, check=False,
    ).stdout.split()  # fmt: skip
    assert stated == ["pyproject.toml"]


def test_a_release_empties_no_folder_that_no_release_made(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert may_be_emptied(out, tmp_path, "SHA256SUMS")
    out.mkdir()
    assert may_be_emptied(out, tmp_path, "SHA256SUMS")
    (out / "thesis.tex").write_text("years of work")
    assert not may_be_emptied(out, tmp_path, "SHA256SUMS")
    (out / "SHA256SUMS").write_text("")
    assert may_be_emptied(out, tmp_path, "SHA256SUMS")
