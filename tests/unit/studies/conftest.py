"""The drive whose log the evaluation's tests read."""

from tests.unit.evaluation.conftest import log

__all__ = ["log"]
