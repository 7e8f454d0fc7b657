"""A bus description (DBC, ARXML, KCD, SYM) as cantools reads it, with what a strict reading would refuse."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import textparser
from cantools.database import load_file, load_string
from cantools.database.errors import Error as CantoolsError

from drivemcp.errors import UserError
from drivemcp.files.dbc_text import SHORT, mended, multiplexed
from drivemcp.files.encodings import encoding_of
from drivemcp.files.foreign import foreign

logger = logging.getLogger(__name__)
logging.getLogger("cantools.database.can.database").setLevel(logging.ERROR)
"""It says that the last of two messages of one id is taken, which is not so here."""
UNREADABLE = (OSError, CantoolsError, ValueError, KeyError, AttributeError, SyntaxError, TypeError)
TOLD = 5
"""Of the entries that are left out so many are named."""
Key = tuple[bool, int]
"""(extended, id): the same number with 11 and with 29 bits is two messages."""


def key_of(message: Any) -> Key:
    """The key of a described message."""
    return bool(message.is_extended_frame), int(message.frame_id)


def load_description(path: Path) -> Any:
    """The database, messages that are broken among it. Raises UserError naming the file."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise UserError(
            f"{path.name} cannot be read as a bus description: {error.strerror or 'the file cannot be opened'}"
        ) from error
    text = content.decode(encoding_of(content), errors="replace")
    try:
        database = load_file(str(path), strict=False, encoding=encoding_of(content))
    except UNREADABLE as error:
        why = foreign(content, "description", xml=True) or _why(error)
        database = _without_strays(path, text)
        if database is None:
            raise UserError(f"{path.name} cannot be read as a bus description: {why}") from error
    _mark_j1939(database)
    _mark_multiplexed(database, text)
    return database


def _without_strays(path: Path, text: str) -> Any:
    """The database of a DBC without entries of what it does not describe and messages of impossible ids, which are told; None
    where nothing is left out, or the rest cannot be read either.
    """
    rest, left_out = mended(text)
    if not left_out:
        return None
    try:
        database: Any = load_string(rest, "dbc", strict=False)
    except UNREADABLE:
        return None
    if not database.messages:
        return None
    more = f", and {len(left_out) - TOLD} more" if len(left_out) > TOLD else ""
    logger.warning("%s: left out since it fits nothing in the file: %s%s", path.name, ", ".join(left_out[:TOLD]), more)
    return database


def _mark_multiplexed(database: Any, text: str) -> None:
    """Keep of a DBC's signals that they are multiplexed also where no selector is said; cantools takes them for always there."""
    written = multiplexed(text)
    for message in database.messages if written else ():
        for signal in message.signals:
            value = written.get((key_of(message), signal.name[:SHORT]))
            if value is not None and not signal.multiplexer_signal:
                signal.multiplexer_ids = [value]


def selections(message: Any, signal: Any) -> Iterator[tuple[Any, Any]]:
    """(signal, its selector), and so on: a selector may itself be selected by another. Raises UserError where the description
    does not say by which signal, or names one that is absent or goes round in a circle.
    """
    names = {signal.name}
    while signal.multiplexer_ids or signal.multiplexer_signal:
        name, place = signal.multiplexer_signal, f"{message.name}.{signal.name}"
        if not name or not signal.multiplexer_ids:
            raise UserError(
                f"{place}: multiplexed, but by which signal is not said; mark one signal with M, or add SG_MUL_VAL_"
            )
        selector = next((each for each in message.signals if each.name == name), None)
        if selector is None:
            raise UserError(f"{place}: selected by {name!r}, which is not in the message")
        if name in names:
            raise UserError(f"{place}: selected by {name!r}, which it selects itself")
        names.add(name)
        yield signal, selector
        signal = selector


def _mark_j1939(database: Any) -> None:
    """Frames of 29 bits in a description of a J1939 bus are parameter groups, unless a frame's own format says otherwise."""
    if _attribute(database.dbc, "ProtocolType").upper() != "J1939":
        return
    for message in database.messages:
        if message.is_extended_frame and "VFrameFormat" not in getattr(message.dbc, "attributes", {}):
            message.protocol = "j1939"


def _attribute(described: Any, name: str) -> str:
    """The value of an attribute as text, where none is set its default; empty where it is not defined."""
    told = getattr(described, "attributes", {}).get(name)
    definition = getattr(described, "attribute_definitions", {}).get(name)
    value = definition.default_value if told is None and definition is not None else getattr(told, "value", None)
    choices = getattr(definition, "choices", None) or []
    if isinstance(value, int) and 0 <= value < len(choices):
        value = choices[value]
    return "" if value is None else str(value)


def _why(error: Exception) -> str:
    """cantools' own words where it says what is wrong; a bare error of Python's says nothing of the file."""
    below = [each for name, each in vars(error).items() if name.startswith("e_") and each is not None]
    if not isinstance(error, CantoolsError) or (
        below and not any(isinstance(each, CantoolsError | textparser.Error) for each in below)
    ):
        return "a number or a name in it is malformed, or the file is no DBC, ARXML, KCD or SYM"
    return " ".join(str(error).split())


def unsound(path: Path, database: Any) -> dict[Key, str]:
    """What a strict reading refuses: message -> why."""
    found = {}
    for message in database.messages:
        try:
            message.refresh(strict=True)
        except CantoolsError as error:
            found[key_of(message)] = f"{path.name}: {str(error).rstrip('.')}"
    return found
