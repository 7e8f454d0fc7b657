"""What a release is refused for, and what it tells of itself: version, commit, notes."""

import re
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path


def version_of(root: Path) -> str:
    """The version, by pyproject.toml: no other file states it."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return str(project["version"])


def notes(changelog: str, version: str) -> str:
    """The changelog's section of a version, without its heading; empty for a version without one."""
    heading = rf"^## \[{re.escape(version)}\][^\n]*\n"
    found = re.search(rf"{heading}(.*?)(?=^## \[|\Z)", changelog, re.MULTILINE | re.DOTALL)
    return found[1].strip() if found else ""


def refusals(root: Path) -> Iterator[str]:
    """Why this tree cannot be released now; nothing where it can."""
    version = version_of(root)
    if not notes((root / "CHANGELOG.md").read_text(encoding="utf-8"), version):
        yield f"CHANGELOG.md has no section [{version}], or an empty one"
    if changed := git(root, "status", "--porcelain"):
        yield f"the tree differs from the commit: {', '.join(line[3:] for line in changed.splitlines()[:5])}"
    tagged = git(root, "rev-list", "-n", "1", f"refs/tags/v{version}", missing="")
    if tagged and tagged != git(root, "rev-parse", "HEAD"):
        yield f"the tag v{version} is at {tagged[:12]}, and not here"


def may_be_emptied(out: Path, root: Path, sums: str) -> bool:
    """Whether a release may delete what lies here: nothing, the default folder, or the files of a release."""
    return (
        out == root / "dist"
        or not out.exists()
        or (out.is_dir() and ((out / sums).is_file() or not any(out.iterdir())))
    )


def git(root: Path, *arguments: str, missing: str | None = None) -> str:
    """What git prints; `missing` where git fails and `missing` is given, else raises CalledProcessError."""
    ran = subprocess.run(["git", "-C", root, *arguments], capture_output=True, text=True, check=missing is None)
    return (ran.stdout if ran.returncode == 0 else missing or "").rstrip()
