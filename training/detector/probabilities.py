"""Turns a detector's scores into probabilities: a logistic curve for each class (Platt 1999)."""

from __future__ import annotations

import numpy as np

from training.bins import Floats
from training.detector.scores import Tally

THERE = 0.3
"""IoU from which a box counts as one of a real object of its class: a road user half missed is a road user."""
RIDGE = 1e-2
ROUNDS = 50


def logit(scores: Floats) -> Floats:
    """Log-odds of scores in 0..1."""
    safe = np.clip(scores, 1e-4, 1 - 1e-4)
    odds: Floats = np.log(safe / (1 - safe))
    return odds


def fit(tally: Tally) -> tuple[float, float]:
    """Slope and offset: probability = sigmoid(slope * logit(score) + offset). Without any box: the score itself."""
    if not len(tally.scores) or tally.right.all() or not tally.right.any():
        return 1.0, 0.0
    design = np.stack([logit(tally.scores), np.ones(len(tally.scores))], axis=1)
    weights = np.array([1.0, 0.0])
    for _ in range(ROUNDS):
        told = 1.0 / (1.0 + np.exp(-design @ weights))
        gradient = design.T @ (tally.right - told) - RIDGE * (weights - np.array([1.0, 0.0]))
        curvature = (design * (told * (1 - told))[:, None]).T @ design + RIDGE * np.eye(2)
        step = np.linalg.solve(curvature, gradient)
        weights = weights + step
        if np.abs(step).max() < 1e-8:
            break
    return float(weights[0]), float(weights[1])


def calibrated(scores: Floats, curve: tuple[float, float]) -> Floats:
    """Scores as probabilities."""
    probability: Floats = 1.0 / (1.0 + np.exp(-(curve[0] * logit(scores) + curve[1])))
    return probability


def score_at(probability: float, curve: tuple[float, float]) -> float:
    """The score that stands for a probability; 0 to 1."""
    odds = (float(logit(np.array([probability]))[0]) - curve[1]) / curve[0]
    return float(1.0 / (1.0 + np.exp(-odds)))
