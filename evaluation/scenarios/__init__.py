"""Scenario families: routes, signs, hazards and weather drawn from a seed."""

from evaluation.scenarios.generate import generate
from evaluation.scenarios.names import FAMILIES, SPLITS, Family, Place, Split, read_place

__all__ = ["FAMILIES", "SPLITS", "Family", "Place", "Split", "generate", "read_place"]
