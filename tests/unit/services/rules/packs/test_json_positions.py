"""The line of a field."""

import json

from hypothesis import given
from hypothesis import strategies as st

from services.rules.packs.json_positions import line_of, parsed, written

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4),
    max_leaves=20,
)


def test_a_member_is_found_by_its_name_and_an_absent_one_by_what_is_there_of_its_path() -> None:
    text = '[\n {"a": 1},\n {"a":\n   {"b, :": [1,\n     2]}}\n]'
    assert line_of(text, (1, "a", "b, :", 1)) == 5
    assert line_of(text, (0, "a")) == 2
    assert line_of(text, (1, "a", "absent")) == 3
    assert line_of(text, (7,)) == 1


def test_paths_are_read_and_written() -> None:
    assert parsed("$[3].sources[0].start") == (3, "sources", 0, "start")
    assert parsed("$.plausible_limits[...]") == ("plausible_limits",)
    assert written((3, "sources", 0)) == "[3].sources[0]"
    assert written(("extends", "id")) == "extends.id"


@given(JSON)
def test_every_value_of_any_json_is_found_where_it_stands(value: object) -> None:
    text = json.dumps(value, indent=1)
    lines = text.splitlines()

    def look(inner: object, path: tuple[str | int, ...]) -> None:
        line = lines[line_of(text, path) - 1]
        if isinstance(inner, dict):
            for name, below in inner.items():
                at = (*path, name)
                assert json.dumps(name) in lines[line_of(text, at) - 1] or json.dumps(name) != f'"{name}"'
                if json.dumps(name) == f'"{name}"':
                    look(below, at)
        elif isinstance(inner, list):
            for index, below in enumerate(inner):
                look(below, (*path, index))
        else:
            assert json.dumps(inner) in line

    look(value, ())


@given(st.text(max_size=200))
def test_no_text_is_too_broken_to_be_searched(text: str) -> None:
    assert line_of(text, (1, "a")) >= 1
