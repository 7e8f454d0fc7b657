"""The page's own commands, from a new pack to a signed one that the Rules service answers from."""

import re
from pathlib import Path

import msgspec
import pytest

from drivemcp.testing import bus
from proto.rules import RulesAnswer
from services.rules.service import SERVICE, RulesConfig
from tests.unit.docs.page_commands import blocks, page, run

PAGE = page("tutorial/your-first-rulepack.md")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the commands of steps 1 to 8 were run."""
    monkeypatch.chdir(tmp_path)
    told = run(blocks(PAGE, "sh"), tmp_path, 120)
    assert "is a draft" in told
    assert "6 of 6 cases hold" in told
    assert told.count("packs/XAV-v1: right") == 2
    return tmp_path


def test_the_page_leads_from_a_new_pack_to_one_that_answers_by_its_signature(folder: Path) -> None:
    key = (folder / "key.pub").read_text(encoding="ascii").strip()
    up, call = blocks(PAGE, "console").strip().replace('\\"$(cat key.pub)\\"', f'"{key}"').splitlines()
    settings = {name: msgspec.json.decode(value) for name, value in re.findall(r"rules\.(\w+)=(\[.*?\])", up)}
    assert settings == {"packs": ["packs/XAV-v1"], "pack_keys": [key]}
    tool, asked = re.findall(r"call (\w+) '(.*)'", call)[0]
    with bus() as b:
        b.start(SERVICE, msgspec.convert(settings, RulesConfig))
        answer = msgspec.convert(b.call(tool, msgspec.json.decode(asked)).result, RulesAnswer)
    assert answer.limit is not None
    assert (answer.limit.value, answer.limit.unit) == (50.0, "km/h")
    assert answer.citations[0].section == "Road Act § 4 (1)"
    assert "50 km/h, cited from Road Act § 4 (1)" in " ".join(PAGE.split())
