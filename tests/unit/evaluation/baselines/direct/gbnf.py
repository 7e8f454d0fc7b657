"""Sentences of a grammar in GBNF, drawn at random: of the part of the language that ours is written in."""

import re
from collections.abc import Mapping, Sequence

from hypothesis import strategies as st

_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[a-z]+|[()|?]')


def sentences(text: str) -> st.SearchStrategy[str]:
    """Whatever the rule `root` gives."""
    lines = (line.partition(" ::= ") for line in text.splitlines() if line)
    rules = {name: tuple(_TOKEN.findall(right)) for name, _, right in lines}
    return _choice(rules["root"], rules)


def _choice(tokens: Sequence[str], rules: Mapping[str, Sequence[str]]) -> st.SearchStrategy[str]:
    return st.one_of([_sequence(part, rules) for part in _split(tokens)])


def _split(tokens: Sequence[str]) -> list[list[str]]:
    parts, depth = [[]], 0  # type: ignore[var-annotated]
    for token in tokens:
        depth += {"(": 1, ")": -1}.get(token, 0)
        if token == "|" and depth == 0:
            parts.append([])
        else:
            parts[-1].append(token)
    return parts


def _sequence(tokens: Sequence[str], rules: Mapping[str, Sequence[str]]) -> st.SearchStrategy[str]:
    found: list[st.SearchStrategy[str]] = []
    at = 0
    while at < len(tokens):
        if tokens[at] == "?":
            found[-1] = st.one_of(st.just(""), found[-1])
        elif tokens[at] == "(":
            end = _closing(tokens, at)
            found.append(_choice(tokens[at + 1 : end], rules))
            at = end
        elif tokens[at].startswith('"'):
            found.append(st.just(tokens[at][1:-1].replace("\\n", "\n")))
        else:
            found.append(_choice(rules[tokens[at]], rules))
        at += 1
    return st.tuples(*found).map("".join)


def _closing(tokens: Sequence[str], at: int) -> int:
    depth = 0
    for place in range(at, len(tokens)):
        depth += {"(": 1, ")": -1}.get(tokens[place], 0)
        if depth == 0:
            return place
    raise AssertionError("a bracket that does not close")
