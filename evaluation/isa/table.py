"""The table: accuracy by distance and by event, delays, warning tests, and what the driver listens to."""

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from statistics import median

import msgspec

from evaluation.campaign.pages import csv_text
from evaluation.isa import logs as logged
from evaluation.isa import sheet
from evaluation.isa.accuracy import Accuracy
from evaluation.isa.capabilities import capabilities
from evaluation.isa.logs import Told
from evaluation.isa.warnings import Warned, WarningTest, test_of, verdict
from evaluation.metrics.metrics import Metrics


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """What came of a run."""

    accuracy: Accuracy
    metrics: Metrics
    warned: Warned
    understood: bool = False
    """Of a drive past a special limit: whether the right one was shown behind it."""


Routes = Mapping[str, Outcome]
Tests = Mapping[WarningTest, Outcome]
Limits = Mapping[str, Outcome]
"""Drives past special limits, by their names."""
Row = tuple[str, str, str]
"""What, the value, the goal or the rule."""


WARNS, LIMITS = "isa/warning/", "isa/limit/"
"""How the names of such runs begin."""


def parts(found: Mapping[str, Outcome]) -> tuple[Routes, Tests, Limits]:
    """Routes, warning tests, and drives past special limits."""
    tests = {test_of(name.removeprefix(WARNS)): each for name, each in found.items() if name.startswith(WARNS)}
    limits = {name.removeprefix(LIMITS): each for name, each in found.items() if name.startswith(LIMITS)}
    return {name: each for name, each in found.items() if not name.startswith((WARNS, LIMITS))}, tests, limits


def rows(routes: Routes, tests: Tests, limits: Limits) -> list[Row]:
    """All rows; a value without anything to measure is a dash."""
    found = list(routes.values())
    return (
        [*_accuracy(found), *_warnings(tests), *_load(found), *_sheet(found, tests, limits)] if found or tests else []
    )


def judged(row: Row) -> str:
    """`holds` or `missed`, by the row's goal; empty where it has none, or nothing was measured."""
    what, value, goal = row
    if goal == "yes":
        return "holds" if value == goal else "missed"
    if goal == "all":
        part, _, whole = value.partition(" of ")
        return "" if whole == "0" else "holds" if part == whole else "missed"
    found, bound = (re.search(r"\d+(\.\d+)?", text) for text in (value, goal))
    if found is None or bound is None:
        return ""
    at_most = goal.startswith("at most") or what.startswith("delay")
    holds = float(found[0]) <= float(bound[0]) if at_most else float(found[0]) >= float(bound[0])
    return "holds" if holds else "missed"


def _sheet(found: list[Outcome], tests: Tests, limits: Limits) -> Iterator[Row]:
    understood = capabilities({name: each.understood for name, each in limits.items()})
    for name, whether in understood.items():
        yield f"understood: {name}", "yes" if whether else "no", "yes"
    right, metres = (
        sum(getattr(each.accuracy, name).get("all", 0.0) for each in found) for name in ("right_m", "metres")
    )
    changes, seen = (sum(getattr(each.accuracy, name) for each in found) for name in ("changes", "changes_right"))
    passed = bool(tests) and all(verdict(*pair) == "passed" for pair in _warned(tests))
    yield from sheet.rows(sheet.lines(_share(right, metres), _share(seen, changes), passed, understood))


def _share(part: float, whole: float) -> float:
    return part / whole if whole else 0.0


def _accuracy(found: list[Outcome]) -> Iterator[Row]:
    names = dict.fromkeys(name for each in found for name in each.accuracy.metres)
    for name in names:
        metres = sum(each.accuracy.metres.get(name, 0.0) for each in found)
        right = sum(each.accuracy.right_m.get(name, 0.0) for each in found)
        rule = "99 (rule: 90)" if name == "all" else "rule: 80" if "km/h" in name else ""
        yield f"right limit shown, by distance, {name}, {metres / 1000.0:.1f} km", _percent(right, metres), rule
    changes, right = (sum(getattr(each.accuracy, name) for each in found) for name in ("changes", "changes_right"))
    yield f"right limit 2 s after a change, of {changes}", _percent(right, changes), "98"
    delays = [delay for each in found for delay in each.accuracy.delays_s]
    yield "delay after a change, median, s", f"{median(delays):.1f}" if delays else "-", "2.0"


def _warnings(tests: Tests) -> Iterator[Row]:
    for where, accelerates in (("at constant speed", False), ("in acceleration", True)):
        passed = [
            verdict(*pair) == "passed" for pair in _warned(tests) if bool(pair[0].accelerates_mps2) == accelerates
        ]
        yield f"warning tests passed, {where}", f"{sum(passed)} of {len(passed)}", "all"


def _warned(tests: Tests) -> Iterator[tuple[WarningTest, Warned]]:
    for test, each in sorted(tests.items()):
        yield test, each.warned


def _load(found: list[Outcome]) -> Iterator[Row]:
    hours = sum(each.metrics.seconds for each in found) / 3600.0
    messages = sum(each.metrics.messages for each in found)
    listening_s = sum(each.metrics.listening_s or 0.0 for each in found)
    cut = sum(each.metrics.cut_off or 0 for each in found)
    km = sum(each.metrics.distance_m or 0.0 for each in found) / 1000.0
    false = sum(each.metrics.false_warnings or 0 for each in found)
    hazards, answered, untold = (sum(getattr(each.metrics, name) or 0 for each in found) for name in HAZARDS)
    yield "messages an hour", f"{messages / hours:.0f}" if hours else "-", "at most 120"
    yield "time in which the driver listens", _percent(listening_s, hours * 3600.0), "at most 6"
    yield "messages that the next one cuts off", _percent(cut, messages), "at most 2"
    yield "false warnings per 10 km", f"{false / km * 10.0:.2f}" if km else "-", "at most 0.5"
    yield f"hazards answered, of {hazards}", _percent(answered, hazards), "98"
    yield "hazards answered, or met well without a word", _percent(answered + untold, hazards), ""
    yield from _precision(found)


def _precision(found: list[Outcome]) -> Iterator[Row]:
    """Of each topic, the most frequent first."""
    said, judged, true, needed = (_summed(found, name) for name in BY_TOPIC)
    for topic, count in said.most_common():
        part = (_percent(each[topic], judged[topic]) for each in (true, needed))
        yield f"messages on {topic}, {count}: true, needed", ", ".join(part) if judged[topic] else "not judged", PRECISE
    if not said:
        yield "messages: true, needed", "-", PRECISE


def _summed(found: list[Outcome], name: str) -> Counter[str]:
    total = Counter[str]()
    for each in found:
        total.update(getattr(each.metrics, name))
    return total


BY_TOPIC = ("messages_by_topic", "messages_judged_by_topic", "messages_true_by_topic", "messages_needed_by_topic")
PRECISE = "at least 70 true"
"""Below it drivers stop using a warning (FHWA-HRT-15-007, as quoted second-hand)."""


HAZARDS = ("hazards", "hazards_answered", "hazards_met_untold")


def _percent(part: float, whole: float) -> str:
    return f"{100.0 * part / whole:.1f} %" if whole > 0.0 else "-"


def test_rows(tests: Tests) -> list[tuple[str, ...]]:
    """Speed and acceleration, when it was shown, due and sounded, for how long, and the verdict."""
    return [
        (f"{test.speed_kmh:g}", f"{test.accelerates_mps2:g}", *warned_cells(each), verdict(test, each))
        for test, each in sorted(_warned(tests), key=lambda pair: (pair[0].accelerates_mps2, pair[0].speed_kmh))
    ]


def warned_cells(each: Warned) -> tuple[str, ...]:
    """When it was shown, due and sounded, and for how long."""
    return _s(each.shown_s), _s(each.due_s), _s(each.sounded_s), _s(each.sound_s or None)


def _s(value: float | None) -> str:
    return "-" if value is None or math.isnan(value) else f"{value:.1f}"


def told(found: Mapping[str, Outcome]) -> str:
    """One line: accuracy by distance and event, warning tests, messages an hour."""
    lines = {name: value for name, value, _ in rows(*parts(found))}
    wanted = (
        "right limit shown, by distance, all",
        "right limit 2 s",
        "warning tests passed",
        "messages an hour",
        "Euro NCAP, speed",
    )
    return "; ".join(f"{name}: {value}" for name, value in lines.items() if name.startswith(wanted))


def log_rows(logs: Sequence[Told]) -> list[Row]:
    """Of logs: what all tell, and what those with truth beside them do."""
    with_truth = [
        Outcome(accuracy=each.accuracy, metrics=each.metrics, warned=Warned())
        for each in logs
        if each.accuracy is not None
    ]
    hours, messages, listening_s = (sum(float(getattr(each.metrics, name) or 0.0) for each in logs) for name in HEARD)
    return [
        *logged.rows(logs),
        ("messages an hour", f"{messages / hours * 3600.0:.0f}" if hours else "-", "at most 120"),
        ("time in which the driver listens", _percent(listening_s, hours), "at most 6"),
        *(
            row
            for row in (*_accuracy(with_truth), *_load(with_truth))
            if with_truth and not row[0].startswith(LOAD_OF_ALL)
        ),
    ]


HEARD = ("seconds", "messages", "listening_s")
LOAD_OF_ALL = ("messages an hour", "time in which")


def over_rows(logs: Mapping[str, Told]) -> list[tuple[str, ...]]:
    """Each overspeed: log, when, limit, the most, when it was shown, due and sounded, for how long, and the verdict."""
    return [
        (
            name,
            f"{over.at_s:.1f}",
            f"{over.limit_kmh:.0f}",
            f"{over.most_kmh:.0f}",
            *warned_cells(over.warned),
            over.verdict,
        )
        for name, each in logs.items()
        for over in each.overs
    ]


def as_csv(found: Sequence[Row]) -> str:
    """These rows."""
    return csv_text({"what": what, "value": value, "goal": goal} for what, value, goal in found)
