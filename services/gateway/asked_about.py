"""What each tool changes, in words for the person that is asked, and which calls need no question."""

import json
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from proto.services import OWNERS
from proto.tools import ToolEntry

Arguments = Mapping[str, Any]


class Change(NamedTuple):
    """What is done, to what, for how long. `to` names the argument, `default` is said where it is left out."""

    what: str
    how_long: str
    to: str = ""
    default: str = "the vehicle"


CHANGES: Mapping[str, Change] = MappingProxyType(
    {
        "clear_dtcs": Change(
            "Clear the stored trouble codes", "for good; a code comes back when its fault does", "ecu", "every control unit"
        ),
        "uds_clear_dtcs": Change(
            "Clear the stored trouble codes of one control unit", "for good; a code comes back when its fault does",
            "request_id", "the engine's unit",
        ),
        "reset_ecu": Change("Restart a control unit", "once; it is away for some seconds", "ecu"),
        "activate_fault_scenario": Change(
            "Give the simulated car a fault, or end all", "until it is ended", "preset", "all faults, ended"
        ),
        "set_preferences": Change(
            "Change what the driver is warned of, as the exact call says", "for this drive, until changed again"
        ),
        "acknowledge": Change("End the sound of an overspeed", "until the speed was at the limit, or the limit falls"),
        "feedback": Change(
            "Move how soon the car warns, by a label on a warning", "for later warnings, within bounds", "label"
        ),
        "remember": Change("Keep an entry in long-term memory", "for later drives", "key"),
        "start_scenario": Change(
            "Start a drive; a running one ends", "for the seconds of the exact call, or to the end of the route", "scenario",
            "the configured scenario",
        ),
        "stop_scenario": Change("End the running drive", "for good", "", "the running scenario"),
    }
)  # fmt: skip
_UNLISTED = Change("Run a tool that changes something", "not known")
_WORDING = frozenset({"language", "unit", "verbosity", "tone", "converts", "muted"})


def _only_words(arguments: Arguments) -> bool:
    """Whether preferences change how things are said, and nothing falls silent by them."""
    return _WORDING.issuperset(arguments) and (arguments.get("muted") is None or arguments["muted"] is False)


UNASKED: Mapping[str, Callable[[Arguments], bool]] = MappingProxyType(
    {"set_preferences": _only_words, "step_recording": lambda _: True}
)
"""Calls of our own tools that need no question though they are no mere reading."""


def needs_answer(entry: ToolEntry, arguments: Arguments) -> bool:
    """Whether a person is asked: always before actuation, and before what does not only read unless the table lets it pass."""
    if entry.meta.capability == "actuation":
        return True
    if entry.annotations.get("readOnlyHint", False):
        return False
    passes = UNASKED.get(entry.name)
    return passes is None or OWNERS.get(entry.name) != entry.meta.server or not passes(arguments)


def described(entry: ToolEntry, arguments: Arguments) -> tuple[str, str, str]:
    """What will be done, to what, for how long. An argument is quoted as ASCII JSON."""
    change = CHANGES.get(entry.name, _UNLISTED)
    given = arguments.get(change.to) if change.to else None
    to = change.default if given is None else json.dumps(given, ensure_ascii=True)
    return change.what, to, change.how_long
