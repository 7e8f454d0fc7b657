"""A filter of the table is asked of a road's tags."""

import pytest

from studies.default_limits.filters import FilterError, Test, compiled


def unnamed(name: str) -> Test:
    raise AssertionError(name)


def holds(text: str, **tags: str) -> bool:
    return compiled(text, unnamed)(tags)


@pytest.mark.parametrize(
    ("text", "tags", "expected"),
    [
        ("ref", {"ref": "N 1"}, True),
        ("!ref", {"ref": "N 1"}, False),
        ("lit=yes", {"lit": "yes"}, True),
        ("lit=yes", {}, False),
        ("lit!=no", {}, True),
        ("lit!=no", {"lit": "no"}, False),
        ("highway~trunk|trunk_link", {"highway": "trunk_link"}, True),
        ("highway~trunk|trunk_link", {"highway": "trunk_links"}, False),
        ("highway!~trunk|trunk_link", {}, True),
        ('ref~"(N|R).*"', {"ref": "R 12"}, True),
        ("lanes>=2", {"lanes": "2"}, True),
        ("lanes<2", {"lanes": "2"}, False),
        ("lanes>=2", {"lanes": "many"}, False),
        ("lanes>=2", {}, False),
        ("ref and lit=yes or lanes>2", {"lanes": "3"}, True),
        ("ref and (lit=yes or lanes>2)", {"lanes": "3"}, False),
        ("!(ref or lit=yes)", {"lit": "no"}, True),
    ],
)
def test_a_filter_holds_of_tags(text: str, tags: dict[str, str], expected: bool) -> None:
    assert holds(text, **tags) is expected


def test_a_named_filter_stands_for_its_tests() -> None:
    named = {"town": compiled("zone=urban", unnamed)}
    test = compiled("!{town} and lanes=1", named.__getitem__)
    assert test({"lanes": "1"})
    assert not test({"lanes": "1", "zone": "urban"})


@pytest.mark.parametrize("text", ["ref and", "(ref", "ref)", "or ref", "ref ref", "ref ? yes", 'ref~"("', ""])
def test_what_is_no_filter_is_refused(text: str) -> None:
    with pytest.raises(FilterError):
        compiled(text, unnamed)
