"""NOTICE holds every attribution that rulepacks and model cards ask for."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from training.photographs.sets import SETS

ROOT = Path(__file__).parents[3]
PACKS = sorted(path.parent.name for path in (ROOT / "rulepacks").glob("*/manifest.json"))
ASKS = re.compile(r"©|licensed under|\bLicence v\d", re.IGNORECASE)


def plain(text: str) -> str:
    """One line, links written out."""
    return " ".join(re.sub(r"\[([^]]*)\]\(([^)]*)\)", r"\1 (\2)", text).split())


NOTICE = plain((ROOT / "NOTICE").read_text(encoding="utf-8"))


def attributions() -> Iterator[str]:
    """The paragraphs of packs that state a licence of their sources."""
    for pack in PACKS:
        text = (ROOT / "rulepacks" / pack / "README.md").read_text(encoding="utf-8")
        yield from (plain(paragraph) for paragraph in text.split("\n\n") if ASKS.search(paragraph))


def photographs(card: Any) -> Iterator[dict[str, str]]:
    """The sets of photographs anywhere in a card."""
    if isinstance(card, dict):
        if "used" in card and "left_out" in card:
            yield from card["used"]
        for value in card.values():
            yield from photographs(value)
    elif isinstance(card, list):
        for value in card:
            yield from photographs(value)


CARDS = {
    path.name: list(photographs(json.loads(path.read_bytes()))) for path in sorted((ROOT / "models").glob("*.json"))
}


def test_each_attribution_that_a_pack_states_stands_in_it() -> None:
    asked = list(attributions())
    assert any("Open Government Licence" in text for text in asked)
    assert [text for text in asked if text not in NOTICE] == []


@pytest.mark.parametrize("pack", PACKS)
def test_each_pack_is_named(pack: str) -> None:
    assert re.search(rf"\b{re.escape(pack)}(?![\w-])", NOTICE)


@pytest.mark.parametrize("card", [name for name, used in CARDS.items() if used])
def test_each_set_of_photographs_that_a_card_names_stands_in_it(card: str) -> None:
    assert f"models/{card}" in NOTICE
    for each in CARDS[card]:
        publisher = each["publisher"].replace("not named", "Publisher: not named")
        assert f"{each['set']}. {publisher}. Licence: {each['licence']}" in NOTICE


def test_the_cards_name_the_sets_that_training_knows() -> None:
    named = {each["set"] for used in CARDS.values() for each in used}
    assert named == {each.title for each in SETS}


def test_each_network_that_was_trained_on_photographs_is_named() -> None:
    for card in (name for name, used in CARDS.items() if used):
        networks = [path.name for path in (ROOT / "models").glob(f"{card.removesuffix('.json')}*.onnx")]
        assert networks
        assert all(f"models/{name}" in NOTICE for name in networks)
