"""Rulepacks travel: from the repository into the image's build, from there into the wheel."""

import tomllib
from pathlib import Path
from typing import Any

import pytest

from services.retrieval.service import RetrievalConfig
from services.rules.service import RulesConfig

ROOT = Path(__file__).parents[3]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
WHEEL = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
DOCKERFILE = (ROOT / "docker/Dockerfile").read_text(encoding="utf-8")
IGNORED = (ROOT / ".dockerignore").read_text(encoding="utf-8")


@pytest.mark.parametrize("package", PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"])
def test_every_package_of_the_wheel_is_there_when_an_image_is_built(package: str) -> None:
    assert f"COPY {package} {package}\n" in DOCKERFILE
    assert f"!{package}\n" in IGNORED


@pytest.mark.parametrize("folder", sorted(WHEEL))
def test_what_the_wheel_takes_in_is_there_when_an_image_is_built(folder: str) -> None:
    assert f"COPY {folder} {folder}\n" in DOCKERFILE
    assert f"!{folder}\n" in IGNORED
    assert WHEEL[folder] == f"drivemcp/data/{folder}"


def test_every_pack_that_the_services_load_is_among_them() -> None:
    assert "rulepacks" in WHEEL
    for name in {*RulesConfig().packs, *RetrievalConfig().packs}:
        assert (ROOT / "rulepacks" / name / "manifest.json").is_file()
