"""A text comes back from TOML as it was written."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.errors import UserError
from drivemcp.files.encodings import toml_text


@given(st.text(st.characters(codec="utf-8")))
def test_every_text_comes_back_from_toml(text: str) -> None:
    assert tomllib.loads(f"text = {toml_text(text)}") == {"text": text}


def test_bytes_that_are_no_text_are_refused_with_what_to_do() -> None:
    with pytest.raises(UserError, match="rename the file or its folder"):
        toml_text("car\udcff.dbc")
