"""What a driver who knows the truth would say of a drive: the labels that feedback learns from."""

from collections.abc import Iterator
from typing import NamedTuple

from evaluation.metrics.conflicts import interventions, is_false
from evaluation.metrics.hazards import answers
from evaluation.metrics.record import Record
from evaluation.metrics.speech import nags

LATE_S = 1.0
"""Ours: a driver who waits longer for a word on a hazard calls the word late."""


class Label(NamedTuple):
    """What the driver says, and when in the drive."""

    time_s: float
    label: str


class Drive(NamedTuple):
    """The labels of one drive, and how long it took."""

    labels: tuple[Label, ...]
    seconds: float


def labelled(record: Record) -> Drive:
    """A drive with the labels of a driver who knows its truth; without truth it has no labels."""
    return Drive(tuple(_labels_of(record)), record.truths[-1].time_s) if record.truths else Drive((), 0.0)


def _labels_of(record: Record) -> Iterator[Label]:
    for braked in interventions(record):
        if is_false(record, braked):
            yield Label(braked.to_s, "false_positive")
    for told in answers(record):
        if told.at_s is None or told.at_s > told.episode.onset_s + LATE_S:
            yield Label(told.episode.over_s, "late_warning")
    for _ in range(min(1, nags(record))):  # one word on it a drive
        yield Label(record.truths[-1].time_s, "annoying")
