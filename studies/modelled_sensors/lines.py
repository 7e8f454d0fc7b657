"""Lines fitted to what recorded pictures showed of things."""

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from evaluation.modelled_sensors.card import Line
from evaluation.modelled_sensors.looks import row_of
from studies.modelled_sensors.pairing import Look
from training.regression import Floats, linear, logistic, memory_s

RIDGE = np.array([1e-3, 1.0, 1.0, 1.0, 1.0, 1.0, 20.0, 20.0, 20.0])
"""How many pictures pull a weight to nothing: the weathers of a few runs tell little."""
SHAPE_RIDGE = np.array([1e-3, 1.0, 1.0, 1.0, 1.0, 1.0, 1e6, 1e6, 1e6])
"""Where boxes lie depends on no weather."""


def rows_of(looks: Sequence[Look]) -> Floats:
    """One row for each look."""
    return np.array([row_of(each.thing, each.air) for each in looks])


def measure(looks: Sequence[Look], x: Floats, y: Floats) -> Line:
    """Of a measure, with the spread and the memory of what the line leaves."""
    weights, sigma = linear(x, y, SHAPE_RIDGE)
    spreads = np.full(len(y), max(sigma, 1e-6))
    memory = memory_s(chains(looks, y - x @ weights, spreads))
    return Line(weights=rounded(weights), sigma=round(sigma, 5), memory_s=round(memory, 4))


def odds(looks: Sequence[Look], x: Floats, y: Floats) -> Line:
    """Of the log-odds of yes and no, with how long it stays what it is."""
    weights = logistic(x, y, RIDGE)
    shares = shares_of(x, weights)
    memory = memory_s(chains(looks, y - shares, np.sqrt(np.maximum(shares * (1 - shares), 0.03))))
    return Line(weights=rounded(weights), memory_s=round(memory, 4))


def shares_of(x: Floats, weights: Floats) -> Floats:
    """How likely yes is."""
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(x @ weights, -30, 30))), np.float64)


def chains(looks: Sequence[Look], left: Floats, spreads: Floats) -> Iterable[tuple[Floats, Floats, Floats]]:
    """(times, what is left, its spread) of each thing in each camera."""
    told: dict[tuple[str, str], list[tuple[float, float, float]]] = defaultdict(list)
    for each, rest, spread in zip(looks, left.tolist(), spreads.tolist(), strict=True):
        told[each.camera, each.thing.key].append((each.stamp_ns / 1e9, rest, spread))
    for chain in told.values():
        times, rests, scales = np.array(chain).T
        yield times, rests, scales


def rounded(weights: Floats) -> tuple[float, ...]:
    """Five places."""
    return tuple(round(float(weight), 5) for weight in weights)
