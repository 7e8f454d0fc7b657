"""Shipped packs are known by their hashes; one that was changed, or from which something was taken, is told."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from app import doctor
from drivemcp import paths
from drivemcp.cli import run
from drivemcp.paths import data
from drivemcp.testing import bus
from proto.topics import HEALTH
from scripts.pins import of_packs
from services.rules.authoring.seal import seal
from services.rules.packs.pins import FILE, pins
from services.rules.service import SERVICE, RulesConfig

Copy = Callable[[str], Path]


def test_the_pins_are_in_step() -> None:
    assert FILE.read_bytes() == of_packs(), "run: python scripts/pins.py"


def _without_a_case(folder: Path) -> None:
    cases = json.loads((folder / "cases.json").read_text(encoding="utf-8"))
    (folder / "cases.json").write_text(json.dumps(cases[1:]), encoding="utf-8")


def _with_another_word(folder: Path) -> None:
    path = next((folder / "sources").glob("*.md"))
    text = path.read_text(encoding="utf-8")
    path.write_text(text.rstrip() + " Indeed.\n", encoding="utf-8")


@pytest.mark.parametrize("change", [_without_a_case, _with_another_word])
def test_a_shipped_pack_that_was_changed_and_sealed_again_is_told_in_the_health(
    copy_pack: Copy, change: Callable[[Path], None]
) -> None:
    folder = copy_pack("DEU-v1")
    change(folder)
    seal(folder)
    with bus() as b:
        b.start(SERVICE, RulesConfig(packs=(str(folder),), languages=()))
        health = b.wait_for(HEALTH, lambda health: "rulepacks" in health.detail, id="rules")
    assert health.detail["not_as_shipped"].startswith("DEU-v1 is not as it was shipped: content ")


def test_shipped_packs_as_they_are_and_packs_of_ones_own_are_not_told(copy_pack: Copy) -> None:
    with bus() as b:
        node = b.start(SERVICE, RulesConfig(packs=(str(copy_pack("DEU-v1")), "VIENNA-v1"), languages=()))
        assert "not_as_shipped" not in node.detail


def test_the_doctor_names_packs_that_were_changed_or_taken_away(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "_CHECKS", (doctor._rulepacks,))
    assert run(["doctor"]) == 0
    assert f"{len(pins())} rulepacks as they were shipped" in capsys.readouterr().out
    shutil.copytree(data("rulepacks"), tmp_path / "rulepacks")
    monkeypatch.setattr(paths, "_CHECKOUT", tmp_path)
    monkeypatch.setattr(paths, "_INSTALLED", tmp_path)
    shutil.rmtree(tmp_path / "rulepacks" / "POL-v1")
    _with_another_word(tmp_path / "rulepacks" / "FRA-v1")
    assert run(["doctor"]) == 0
    said = capsys.readouterr().out
    assert "rulepack POL-v1 was shipped and is not there" in said
    assert "FRA-v1" in said
    _with_another_word(tmp_path / "rulepacks" / "DEU-v1")
    seal(tmp_path / "rulepacks" / "DEU-v1")
    assert run(["doctor"]) == 0
    assert "rulepack DEU-v1 is not as it was shipped" in capsys.readouterr().out
