"""Who belongs to whom: the cheapest pairs first."""

from __future__ import annotations

from collections.abc import Iterable


def greedy(pairs: Iterable[tuple[float, int, int]]) -> list[tuple[int, int]]:
    """From (cost, left, right), pairs in the order of their cost, each left and each right at most once.

    Greedy rather than optimal: gates are tight here and crowds small, so that the two hardly ever differ.
    """
    taken_left: set[int] = set()
    taken_right: set[int] = set()
    chosen = []
    for _, left, right in sorted(pairs):
        if left not in taken_left and right not in taken_right:
            chosen.append((left, right))
            taken_left.add(left)
            taken_right.add(right)
    return chosen
