"""The page's own words, language by language."""

import re
from pathlib import Path
from typing import get_args

import pytest

from proto.decision import Language
from services import cockpit

PAGE = Path(cockpit.__file__).parent / "page"
LANGUAGES = get_args(Language)


def words() -> dict[str, dict[str, str]]:
    text = (PAGE / "words.js").read_text(encoding="utf-8")
    tables = re.findall(r"^  (\w\w): \{\n(.*?)^  \},", text, re.S | re.M)
    return {language: dict(re.findall(r'(\w+): "([^"]*)"', body)) for language, body in tables}


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_language_has_every_word_with_the_same_values(language: str) -> None:
    first, other = words()["en"], words()[language]
    assert other.keys() == first.keys()
    held = re.compile(r"\{\w+\}")
    assert [
        name for name, text in first.items() if sorted(held.findall(text)) != sorted(held.findall(other[name]))
    ] == []


def test_every_language_can_be_chosen() -> None:
    page = (PAGE / "index.html").read_text(encoding="utf-8")
    chosen = re.search(r'<select id="language">(.*?)</select>', page, re.S)
    assert chosen is not None
    assert tuple(re.findall(r'value="(\w+)"', chosen[1])) == LANGUAGES
