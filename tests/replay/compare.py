"""Today's outcomes beside the locked ones: the first tick and field that differ, both sides in words."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from app.replay.differences import differences
from tests.replay.files import DRIVES, LOGS, Lock, Parts, digest, digests, read_lines, write_lines
from tests.replay.rendered import EXACT, RENDERED, outline, processor, published
from tests.replay.ticks import LoggedTick, decided_again

SHOWN = 4
"""Fields of the first tick that differs."""
TOLD = (
    "decision.kind",
    "decision.hazard",
    "decision.reason",
    "advisory.directive",
    "advisory.justification",
    "advisory.target_mps",
)
"""Fields that say most, told before others."""


def names() -> list[str]:
    """The logs that are here."""
    return sorted(each.parent.name for each in LOGS.glob("*/inputs.jsonl.gz"))


def decided(name: str) -> list[Parts]:
    """One log, decided again by today's code."""
    return list(decided_again(read_lines(LOGS / name / "inputs.jsonl.gz", LoggedTick)))


def outcomes(name: str) -> list[Parts]:
    """What one log came to when it was locked."""
    return read_lines(LOGS / name / "outcomes.jsonl.gz", dict[str, Any])


def of_log(name: str, lock: Lock, ours: Sequence[Parts]) -> str:
    """How a log comes out otherwise than locked; empty: it does not."""
    rows = lock.logs.get(name, ())
    if len(rows) != len(ours):
        return f"{name}: {len(ours)} ticks, {len(rows)} are locked"
    differing = [at for at, (row, parts) in enumerate(zip(rows, ours, strict=True)) if row != digests(parts)]
    if not differing:
        return ""
    tick = differing[0]
    told = f"{len(differing)} of {len(rows)} ticks differ, the first is tick {tick + 1}"
    return f"{name}: {told}: {_told(outcomes(name)[tick], ours[tick])}"


def of_drive(name: str, lock: Lock, ours: Mapping[str, list[Any]]) -> str:
    """The same of a rendered drive; on another processor only what does not hang on pixels, and what was seen at all."""
    rows, here = lock.drives.get(name, {}), processor() == lock.processor
    locked = read_lines(DRIVES / f"{name}.jsonl.gz", dict[str, Any])[0]
    for topic, messages in ours.items():
        if not here and topic not in EXACT:
            continue
        told = _first_message(topic, rows.get(topic, ()), locked["messages"][topic], messages)
        if told:
            return f"{name} (rendered): {told}"
    if not here and outline(ours) != locked["outline"]:
        return f"{name} (rendered, on another processor than the lock's): {_told(locked['outline'], outline(ours))}"
    return ""


def _first_message(topic: str, rows: Sequence[str], locked: list[Any], ours: list[Any]) -> str:
    if len(rows) != len(ours):
        return f"{len(ours)} messages on {topic}, {len(rows)} are locked"
    for at, (row, message) in enumerate(zip(rows, ours, strict=True)):
        if digest(message) != row:
            return f"message {at + 1} on {topic}: {_told({topic: locked[at]}, {topic: message})}"
    return ""


def _told(locked: Mapping[str, Any], ours: Mapping[str, Any]) -> str:
    found = [one for part in {**locked, **ours} for one in differences(part, locked.get(part), ours.get(part))]
    weight = {field: at for at, field in enumerate(TOLD)}
    first = sorted(found, key=lambda one: weight.get(one.field, len(TOLD)))[:SHOWN]
    rest = f" (and {len(found) - SHOWN} more fields)" if len(found) > SHOWN else ""
    return "; ".join(f"{one.field}: locked {one.logged}, now {one.again}" for one in first) + rest


def complaints(lock: Lock) -> Iterator[str]:
    """All logs, then all drives."""
    for name in sorted({*names(), *lock.logs}):
        yield of_log(name, lock, decided(name) if name in names() else [])
    for name in sorted({*RENDERED, *lock.drives}):
        yield of_drive(name, lock, published(name))


def updated(lock: Lock, *, drives: bool) -> Lock:
    """Today's outcomes, locked; drives are driven again where asked for."""
    logs = {}
    for name in names():
        ours = decided(name)
        logs[name] = tuple(map(digests, ours))
        if logs[name] != lock.logs.get(name):
            write_lines(LOGS / name / "outcomes.jsonl.gz", ours)
    if not drives:
        return Lock(logs=logs, drives=lock.drives, processor=lock.processor)
    found = {}
    for name in RENDERED:
        messages = published(name)
        found[name] = {topic: tuple(map(digest, each)) for topic, each in messages.items()}
        if found[name] != lock.drives.get(name) or processor() != lock.processor:
            write_lines(DRIVES / f"{name}.jsonl.gz", [{"messages": messages, "outline": outline(messages)}])
    return Lock(logs=logs, drives=found, processor=processor())
