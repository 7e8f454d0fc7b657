"""Lines fitted to measures and to yes and no, both held towards nothing where the data says nothing."""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
STEPS = 40
ROBUST_STEPS = 5
SPREADS = 4.0
SHORTEST_S, LONGEST_S = 0.02, 5.0


def logistic(x: Floats, y: Floats, ridge: Floats) -> Floats:
    """Weights (K,) of log-odds for rows `x` (N, K) and `y` (N,) of 0 and 1, by Newton's steps; `ridge` (K,) pulls them to 0."""
    pull = np.diag(ridge)
    weights: Floats = np.zeros(x.shape[1])
    for _ in range(STEPS):
        p = 1.0 / (1.0 + np.exp(-np.clip(x @ weights, -30, 30)))
        slope = x.T @ (y - p) - pull @ weights
        step = np.linalg.solve(x.T @ (x * (p * (1 - p))[:, None]) + pull, slope)
        weights += np.clip(step, -3.0, 3.0)
        if float(np.abs(step).max()) < 1e-7:
            break
    return weights


def linear(x: Floats, y: Floats, ridge: Floats) -> tuple[Floats, float]:
    """Weights (K,) and the spread of what is left, a normal one's from its middle half: single boxes on something else
    do not count. Each step draws in what lies more than three spreads off the last."""
    aim: Floats = y
    spread = 0.0
    weights: Floats = np.zeros(x.shape[1])
    for _ in range(ROBUST_STEPS):
        weights = np.asarray(np.linalg.solve(x.T @ x + np.diag(ridge), x.T @ aim), np.float64)
        rest = y - x @ weights
        spread = float(np.quantile(rest, 0.75) - np.quantile(rest, 0.25)) / 1.349 if len(y) else 0.0
        aim = np.asarray(x @ weights + np.clip(rest, -3 * spread, 3 * spread), np.float64)
    return weights, spread


def memory_s(chains: Iterable[tuple[Floats, Floats, Floats]]) -> float:
    """In which time something forgets, from (times, what is left, its spread) of each thing: the correlation of what is
    left between neighbouring pictures, by the mean time between them."""
    both, alone, apart, count = 0.0, 0.0, 0.0, 0
    for times, left, spreads in chains:
        rest = np.clip(left / np.maximum(spreads, 1e-6), -SPREADS, SPREADS)
        near = np.diff(times) < 0.5
        both += float((rest[1:] * rest[:-1])[near].sum())
        alone += float(((rest[1:] ** 2 + rest[:-1] ** 2) / 2)[near].sum())
        apart, count = apart + float(np.diff(times)[near].sum()), count + int(near.sum())
    if not count or both <= 0.0:
        return SHORTEST_S
    rho = min(max(both / max(alone, 1e-9), 1e-6), 0.999)
    return min(max(-(apart / count) / math.log(rho), SHORTEST_S), LONGEST_S)
