"""The filters of the table: `{rural} and highway~trunk|trunk_link and lanes>=2`, asked of a road's tags."""

import re
from collections.abc import Callable, Mapping

from drivemcp.errors import UserError

Tags = Mapping[str, str]
Test = Callable[[Tags], bool]
_TOKEN = re.compile(
    r"\s*(?:(?P<named>!?\{[^{}]+\})|(?P<bracket>!?\(|\))|(?P<joint>(?:and|or)\b)"
    r'|(?P<test>!?[\w:]+(?:(?:!=|!~|<=|>=|[=~<>])(?:"[^"]*"|[^\s()]+))?))'
)
_TEST = re.compile(r'(?P<key>[\w:]+)(?:(?P<sign>!=|!~|<=|>=|[=~<>])"?(?P<value>[^"]*)"?)?$')


class FilterError(UserError):
    """A filter that is not of the table's language."""


def compiled(text: str, named: Callable[[str], Test]) -> Test:
    """A filter as a function of tags; `named` gives those in braces. Raises FilterError."""
    tokens = _tokens(text)
    test = _either(tokens, named)
    if tokens:
        raise FilterError(f"{text!r}: {tokens[0]!r} has no place there")
    return test


def _tokens(text: str) -> list[str]:
    found, at = list[str](), 0
    while text[at:].strip():
        match = _TOKEN.match(text, at)
        if match is None:
            raise FilterError(f"{text!r}: unreadable from {text[at:]!r}")
        found.append(match[0].strip())
        at = match.end()
    return found


def _either(tokens: list[str], named: Callable[[str], Test]) -> Test:
    tests = [_both(tokens, named)]
    while tokens[:1] == ["or"]:
        tokens.pop(0)
        tests.append(_both(tokens, named))
    return lambda tags: any(test(tags) for test in tests)


def _both(tokens: list[str], named: Callable[[str], Test]) -> Test:
    tests = [_one(tokens, named)]
    while tokens[:1] == ["and"]:
        tokens.pop(0)
        tests.append(_one(tokens, named))
    return lambda tags: all(test(tags) for test in tests)


def _one(tokens: list[str], named: Callable[[str], Test]) -> Test:
    if not tokens or tokens[0] in ("and", "or", ")"):
        raise FilterError(f"a condition is missing before {tokens[0] if tokens else 'the end'!r}")
    token = tokens.pop(0)
    plain = token.removeprefix("!")
    if plain == "(":
        test = _either(tokens, named)
        if not tokens or tokens.pop(0) != ")":
            raise FilterError("a bracket is not closed")
    else:
        test = named(plain[1:-1]) if plain.startswith("{") else _tag(plain)
    return (lambda tags: not test(tags)) if token != plain else test


def _tag(text: str) -> Test:
    match = _TEST.match(text)
    if match is None:
        raise FilterError(f"{text!r} is no test of a tag")
    key, sign, value = match["key"], match["sign"], match["value"] or ""
    if sign is None:
        return lambda tags: key in tags
    if sign in ("=", "!="):
        return lambda tags: (tags.get(key) == value) == (sign == "=")
    if sign in ("~", "!~"):
        try:
            pattern = re.compile(value)
        except re.error as error:
            raise FilterError(f"{text!r}: {error}") from None
        return lambda tags: (key in tags and pattern.fullmatch(tags[key]) is not None) == (sign == "~")
    return lambda tags: compared(tags.get(key, ""), sign, value)


def compared(found: str, sign: str, wanted: str) -> bool:
    """Whether one number is as much above or below the other as the sign says; what is no number is not."""
    try:
        left, right = float(found), float(wanted)
    except ValueError:
        return False
    return {">": left > right, ">=": left >= right, "<": left < right, "<=": left <= right}[sign]
