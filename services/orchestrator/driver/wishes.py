"""What the driver wants: how to be spoken to, changeable while driving, and labels, which change how soon the car acts."""

from typing import Any

import msgspec

from proto.decision import Preferences

PAUSE_S = 10.0
WINDOW_S = 600.0
MOST = 6


def changed(before: Preferences, **fields: Any) -> Preferences:
    """The preferences with every field that is given, not None, replaced."""
    return msgspec.structs.replace(before, **{name: value for name, value in fields.items() if value is not None})


def remembered(result: dict[str, Any] | None) -> Preferences | None:
    """The newest preferences in an answer of `recall`; None where they are missing or damaged.

    Mute ends with its drive: switched off, a warning is on again at the next start. So does the part of the country: the next drive may
    begin elsewhere.
    """
    try:
        kept = msgspec.convert((result or {})["entries"][0]["value"], Preferences)
    except (LookupError, TypeError, msgspec.ValidationError):
        return None
    return msgspec.structs.replace(kept, muted=False, part="")


class Given(msgspec.Struct, frozen=True, kw_only=True):
    """When labels were given in the last ten minutes."""

    stamps_ns: tuple[int, ...] = ()


def admit(given: Given, now_ns: int) -> tuple[Given, str]:
    """The record with this label in it, or as it was and why the label does not count."""
    recent = tuple(stamp for stamp in given.stamps_ns if now_ns - stamp < WINDOW_S * 1e9)
    if recent and now_ns - recent[-1] < PAUSE_S * 1e9:
        return Given(stamps_ns=recent), f"one label every {PAUSE_S:.0f} s counts"
    if len(recent) >= MOST:
        return Given(stamps_ns=recent), f"{MOST} labels in {WINDOW_S / 60:.0f} minutes count"
    return Given(stamps_ns=(*recent, now_ns)), ""
