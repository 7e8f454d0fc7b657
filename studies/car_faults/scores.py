"""Shares right, the confusion of classes, and how long it took."""

import statistics
from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import msgspec

from evaluation.tables.columns import Column
from studies.car_faults.hearing import Heard
from studies.car_faults.verdicts import Class, right, right_kind, truth
from studies.output import Sheet, percent

CLASSES: tuple[Class, ...] = ("sound", "sensor", "vehicle")


class Share(msgspec.Struct, frozen=True, kw_only=True):
    """How many of a group were right."""

    name: str
    right: int
    all: int
    median_s: float | None
    """Median time from the onset to the first right verdict, of those that came to one."""

    @property
    def share(self) -> float:
        """In [0, 1]."""
        return self.right / self.all if self.all else 0.0


class Miss(msgspec.Struct, frozen=True, kw_only=True):
    """One drive that was judged wrongly."""

    seed: int
    label: str
    severity: float | None
    road: str
    said: str
    once_right: bool
    """Whether it was judged rightly at some time before its end."""


class Scores(msgspec.Struct, frozen=True, kw_only=True):
    """All that is measured."""

    seeds: str
    overall: Share
    by_class: tuple[Share, ...]
    by_sensor_kind: tuple[Share, ...]
    by_sensor: tuple[Share, ...]
    by_preset: tuple[Share, ...]
    false_alarms: float
    """Share of sound drives with any alarm at any time."""
    kinds_named: float
    """Share of sensor faults whose kind was named as well."""
    confusion: dict[str, dict[str, int]]
    misses: tuple[Miss, ...]


def score(seeds: str, heard: Sequence[Heard]) -> Scores:
    """The scores of a set."""
    sensors = [each for each in heard if each.case.sensor]
    cars = [each for each in heard if truth(each.case) == "vehicle"]
    sound = [each for each in heard if each.case.onset is None]
    return Scores(
        seeds=seeds,
        overall=_share("all", heard),
        by_class=_shares(heard, lambda each: truth(each.case)),
        by_sensor_kind=_shares(sensors, lambda each: each.case.kind),
        by_sensor=_shares(sensors, lambda each: each.case.sensor),
        by_preset=_shares(cars, lambda each: each.case.label),
        false_alarms=sum(each.said.says != "sound" for each in sound) / max(1, len(sound)),
        kinds_named=sum(right_kind(each.case, each.said) for each in sensors) / max(1, len(sensors)),
        confusion=_confusion(heard),
        misses=tuple(_miss(each) for each in heard if not right(each.case, each.said)),
    )


def _shares(heard: Iterable[Heard], group: Callable[[Heard], str]) -> tuple[Share, ...]:
    groups: dict[str, list[Heard]] = {}
    for each in heard:
        groups.setdefault(group(each), []).append(each)
    return tuple(_share(name, members) for name, members in groups.items())


def _share(name: str, heard: Sequence[Heard]) -> Share:
    times = [each.after_s for each in heard if each.after_s is not None]
    return Share(
        name=name,
        right=sum(right(each.case, each.said) for each in heard),
        all=len(heard),
        median_s=statistics.median(times) if times else None,
    )


def _confusion(heard: Iterable[Heard]) -> dict[str, dict[str, int]]:
    counts = Counter((truth(each.case), each.said.says) for each in heard)
    return {true: {said: counts[true, said] for said in CLASSES} for true in CLASSES}


def _miss(heard: Heard) -> Miss:
    case = heard.case
    return Miss(
        seed=case.seed,
        label=case.label,
        severity=round(case.onset.severity, 2) if case.onset is not None else None,
        road=case.course.road,
        said=heard.said.words,
        once_right=heard.after_s is not None,
    )


def sheets(scores: Scores) -> list[Sheet]:
    """Shares by group, the confusion of classes, and what was judged wrongly."""
    rates = [
        f"false alarms in sound drives: {scores.false_alarms:.1%}",
        f"sensor faults with their kind named: {scores.kinds_named:.1%}",
    ]
    return [
        _shares_sheet("", (scores.overall, *scores.by_class), rates),
        _shares_sheet("by kind of sensor fault", scores.by_sensor_kind),
        _shares_sheet("by sensor", scores.by_sensor),
        _shares_sheet("by fault of the car", scores.by_preset),
        Sheet(("is", *CLASSES), [(true, *(row[said] for said in CLASSES)) for true, row in scores.confusion.items()]),
        Sheet(
            ("seed", "road", "wrong", "severity", "said", "right before the end"),
            [
                (each.seed, each.road, each.label, each.severity, each.said, "yes" if each.once_right else "no")
                for each in scores.misses
            ],
        ),
    ]


def _shares_sheet(title: str, shares: Sequence[Share], notes: Sequence[str] = ()) -> Sheet:
    rows = [(each.name, each.right, each.all, each.share, each.median_s) for each in shares]
    columns = ("", "right", "of", percent("share"), Column(title="median time to it", unit="s", places=1))
    return Sheet(columns, rows, notes, title)
