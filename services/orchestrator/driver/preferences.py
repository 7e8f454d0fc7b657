"""How the driver wants to be spoken to; changeable while driving."""

from typing import Any

import msgspec

from proto.decision import Preferences


def changed(before: Preferences, **fields: Any) -> Preferences:
    """The preferences with every field that is given, not None, replaced."""
    return msgspec.structs.replace(before, **{name: value for name, value in fields.items() if value is not None})


def remembered(result: dict[str, Any] | None) -> Preferences | None:
    """The newest preferences in an answer of `recall`; None where there are none or they are damaged."""
    entries = (result or {}).get("entries")
    if not isinstance(entries, list) or not entries or not isinstance(entries[0], dict):
        return None
    try:
        return msgspec.convert(entries[0].get("value"), Preferences)
    except msgspec.ValidationError:
        return None
