"""The tool for whoever edits a pack."""

from collections.abc import Callable
from pathlib import Path

import pytest

from services.rules.packs import load
from services.rules.seal import command


def test_after_an_edit_seal_finds_the_offsets_again(copy_pack: Callable[[str], Path]) -> None:
    folder = copy_pack("DEU-v1")
    path = folder / "sources" / "stvo-geschwindigkeit.en.md"
    text = path.read_text(encoding="utf-8").replace("# Speed\n", "# Speed on the road\n")
    path.write_text(text.replace("is 50 km/h.", "is fifty km/h."), encoding="utf-8")
    assert command(["check", str(folder)]) == 1
    assert command(["seal", str(folder)]) == 0
    excerpt = load(folder).provisions["deu-speed-urban"].sources[1].excerpt
    assert excerpt.endswith("is fifty km/h.")


def test_a_shipped_pack_is_sealed_already(copy_pack: Callable[[str], Path], capsys: pytest.CaptureFixture[str]) -> None:
    folder = copy_pack("GBR-v1")
    before = (folder / "manifest.json").read_bytes()
    assert command(["seal", str(folder)]) == 0
    assert (folder / "manifest.json").read_bytes() == before
    assert command(["hash", str(folder)]) == 0
    assert len(set(capsys.readouterr().out.split())) == 1


def test_a_heading_that_is_gone_is_named(copy_pack: Callable[[str], Path], capsys: pytest.CaptureFixture[str]) -> None:
    folder = copy_pack("GBR-v1")
    path = folder / "sources" / "motorways.en.md"
    path.write_text(path.read_text(encoding="utf-8").replace("[gbr-sign-redx]", ""), encoding="utf-8")
    assert command(["seal", str(folder)]) == 1
    assert "motorways.en.md: no heading ends in [gbr-sign-redx]" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [[], ["seal"], ["burn", "x"]])
def test_wrong_usage_is_told(arguments: list[str]) -> None:
    assert command(arguments) == 2
