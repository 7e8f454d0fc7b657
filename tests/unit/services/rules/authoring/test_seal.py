"""Sealing, for whoever edits a pack; the command is tested in `authoring/test_commands.py`."""

from collections.abc import Callable
from pathlib import Path

import pytest

from services.rules.authoring.seal import seal
from services.rules.errors import PackError
from services.rules.packs.loading import content_hash, load


def test_after_an_edit_seal_finds_the_offsets_again(copy_pack: Callable[[str], Path]) -> None:
    folder = copy_pack("DEU-v1")
    path = folder / "sources" / "stvo-geschwindigkeit.en.md"
    text = path.read_text(encoding="utf-8").replace("# Speed\n", "# Speed on the road\n")
    path.write_text(text.replace("is 50 km/h.", "is fifty km/h."), encoding="utf-8")
    with pytest.raises(PackError, match="drivemcp rulepack seal"):
        load(folder)
    assert seal(folder) == content_hash(folder)
    excerpt = load(folder).provisions["deu-speed-urban"].sources[1].excerpt
    assert excerpt.endswith("is fifty km/h.")


def test_a_shipped_pack_is_sealed_already(copy_pack: Callable[[str], Path]) -> None:
    folder = copy_pack("GBR-v1")
    before = (folder / "manifest.json").read_bytes()
    assert seal(folder) == content_hash(folder)
    assert (folder / "manifest.json").read_bytes() == before


def test_a_heading_that_is_gone_is_named(copy_pack: Callable[[str], Path]) -> None:
    folder = copy_pack("GBR-v1")
    path = folder / "sources" / "motorways.en.md"
    path.write_text(path.read_text(encoding="utf-8").replace("[gbr-sign-redx]", ""), encoding="utf-8")
    with pytest.raises(PackError, match=r"motorways\.en\.md: no heading ends in \[gbr-sign-redx\]"):
        seal(folder)
