"""A profile from a description: what was clear is filled in, what was not is listed, and both are marked as guesses."""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from drivemcp.files.encodings import toml_text
from services.can.authoring.signal_matching import HINTS, Candidate, candidates, clear, words
from services.can.profiles.curated import FIELDS
from services.can.profiles.profile import FieldRule, transform
from services.can.profiles.units import canonical
from services.can.signals.message_guard import declared

SHOWN = 4
SILENT_CYCLES = 5
"""A message that stays away for so many of its cycles is silent."""
COUNTERS = {"counter", "cnt", "alive", "bz", "rolling", "seq"}
CHECKSUMS = {"checksum", "crc", "chksum", "chk", "cs"}
_VALUES: dict[str, tuple[tuple[str, float], ...]] = {
    "wiper_stage": (("off aus", 0), ("int* auto", 1), ("slow low stufe1", 2), ("fast high stufe2", 3)),
    "headlamps": (("off aus", 0), ("pos* park*", 1), ("low on abblend*", 2), ("high fern*", 3)),
    "gear": (("r reverse", -1), ("n p neutral park", 0), ("d s drive sport", 1)),
    "indicator_left": (("left links", 1), ("right rechts off none idle", 0)),
    "indicator_right": (("right rechts", 1), ("left links off none idle", 0)),
}
_FLAG = (
    ("off no inactive normal none ok idle released", 0.0),
    ("on yes active fault* applied engaged pressed low", 1.0),
)


class Found(NamedTuple):
    """What the description has for one field: the clear choice if there is one, and what else looks like it."""

    field: str
    chosen: Candidate | None
    others: tuple[Candidate, ...]


def search(messages: Iterable[Any]) -> list[Found]:
    """Every curated field that there are hints for, with its candidates."""
    listed, found = list(messages), []
    for field in HINTS:
        every = candidates(field, listed)
        best = clear(every)
        found.append(Found(field, best, tuple(each for each in every if each is not best)[:SHOWN]))
    return found


def render(name: str, bus: str, description: Path, folder: Path, found: list[Found]) -> str:
    """The text of the profile."""
    listed = [each for each in found if each.chosen or each.others]
    missing = [each.field for each in found if not (each.chosen or each.others)]
    return "\n".join(
        (
            f"# Scaffolded from {description.name}. EVERY line under [fields] is a guess by name, unit and width: check each one against",
            "# the car (drivemcp can profile check profile.toml --log DRIVE), its sign above all: left, forward and pressing are positive.",
            f"name = {toml_text(name)}",
            "",
            f"[buses.{bus}]",
            f"description = {toml_text(os.path.relpath(description.resolve(), folder.resolve()))}",
            "",
            "[vehicle]",
            "tyre_nominal_bar = [2.4, 2.4, 2.4, 2.4]  # guess: take the label in the door frame (FL FR RL RR, cold)",
            "",
            "[fields]",
            *(line for each in listed for line in _lines(each)),
            "",
            *(f"# missing: {field} ({FIELDS[field].purpose})" for field in missing),
            "",
        )
    )


def _lines(found: Found) -> list[str]:
    others = ", ".join(f"{each.place} ({each.score:g})" for each in found.others)
    if found.chosen is not None:
        also = f"; also {others}" if others else ""
        return [f"{_rule(found.field, found.chosen)}  # guess ({found.chosen.score:g}){also}"]
    return [f"# unsure, choose one: {others}", f"# {_rule(found.field, found.others[0])}"]


def _rule(field: str, candidate: Candidate) -> str:
    """One line of TOML."""
    message, signal = candidate.message, candidate.signal
    hint, meant = HINTS[field], FIELDS[field]
    keys = [
        f"message = {toml_text(message.name)}",
        f"signal = {toml_text(signal.name)}",
        f"vss = {toml_text(meant.vss)}",
    ]
    if meant.unit:
        keys.append(f"unit = {toml_text(meant.unit)}")
        if canonical(signal.unit or "") is None:
            keys.append(f"dbc_unit = {toml_text(meant.unit)}")
    if field == "steering_angle_rad":
        keys.append("factor = 0.0666666667")
    if not meant.unit and signal.choices:
        keys.append(f"values = {{ {_values(field, signal)} }}")
    low, high = plausible(field, signal)
    keys += [f"minimum = {low:g}", f"maximum = {high:g}"]
    if hint.max_step_per_s is not None:
        keys.append(f"max_step_per_s = {hint.max_step_per_s:g}")
    cycle_s = (message.cycle_time or 0) / 1000
    keys.append(f"max_age_s = {max(hint.max_age_s, SILENT_CYCLES * cycle_s):g}")
    counters = [each.name for each in message.signals if COUNTERS & set(words(each.name)) and each is not signal]
    if len(counters) == 1 and not declared(message)[0]:
        keys.append(f"counter = {toml_text(counters[0])}")
    return f"{field} = {{ {', '.join(keys)} }}"


def plausible(field: str, signal: Any) -> tuple[float, float]:
    """What is plausible for the field and within what the description says of the signal."""
    hint, meant = HINTS[field], FIELDS[field]
    if not meant.unit or signal.minimum is None or signal.maximum is None or signal.minimum >= signal.maximum:
        return hint.minimum, hint.maximum
    rule = FieldRule(signal=signal.name, unit=meant.unit, dbc_unit="" if canonical(signal.unit or "") else meant.unit)
    scale, offset = transform(signal.unit or "", rule)
    low, high = sorted((signal.minimum * scale + offset, signal.maximum * scale + offset))
    if field.endswith("_rad"):  # the description means the steering wheel, or has an amount without its sign
        return hint.minimum, hint.maximum
    low, high = max(low, hint.minimum), min(high, hint.maximum)
    return (round(low, 3), round(high, 3)) if low < high else (hint.minimum, hint.maximum)


def _values(field: str, signal: Any) -> str:
    """Named values whose words are understood; the others are left out, and a sample of them is not believed."""
    known = _VALUES.get(field, _FLAG)
    pairs = []
    for raw, label in sorted(signal.choices.items()):
        parts = words(str(label))
        if field == "gear" and len(parts) == 1 and parts[0].isdigit():
            pairs.append(f"{raw} = {parts[0]}")
            continue
        hits = [value for alternatives, value in known if any(_same(part, alternatives) for part in parts)]
        if len(hits) == 1:
            pairs.append(f"{raw} = {hits[0]:g}")
    return ", ".join(pairs) or "0 = 0, 1 = 1"


def _same(part: str, alternatives: str) -> bool:
    return any(part.startswith(each[:-1]) if each.endswith("*") else part == each for each in alternatives.split())


def guards(message: Any) -> tuple[str, ...]:
    """Signals of a message that look like checksums and of which the description does not tell the kind."""
    if declared(message)[1] is not None:
        return ()
    return tuple(each.name for each in message.signals if CHECKSUMS & set(words(each.name)))
