"""The metrics of the evaluation, each defined once; docs/reference/metrics.md says what each is."""

from evaluation.metrics.metrics import RATES, Metrics, RateRow, measure
from evaluation.metrics.record import TRUTH_FILE, At, Record, Recorder, from_log, keep
from evaluation.metrics.understanding import Scores

__all__ = [
    "RATES",
    "TRUTH_FILE",
    "At",
    "Metrics",
    "RateRow",
    "Record",
    "Recorder",
    "Scores",
    "from_log",
    "keep",
    "measure",
]
