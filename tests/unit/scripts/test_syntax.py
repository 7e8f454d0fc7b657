"""Source as a tree, whatever else the process parses meanwhile."""

from __future__ import annotations

import ast
import gc

import pytest

from scripts.syntax import parsed

MODULE = "\n".join(f"def f{n}(a, b): return [a, (b, {n})]" for n in range(200))


class ParsesWhenCollected:
    """Garbage in a cycle whose finaliser parses, as another thread may that runs during a collection."""

    def __init__(self) -> None:
        self.itself = self

    def __del__(self) -> None:
        ast.parse("x = [1, (2, 3)]")


def test_a_collection_meanwhile_changes_nothing() -> None:
    limits = gc.get_threshold()
    try:
        gc.set_threshold(1)
        for _ in range(20):
            ParsesWhenCollected()
            assert len(parsed(MODULE).body) == 200
    finally:
        gc.set_threshold(*limits)
    assert gc.isenabled()


def test_garbage_is_collected_again_after_source_that_is_wrong() -> None:
    with pytest.raises(SyntaxError):
        parsed("def")
    assert gc.isenabled()
