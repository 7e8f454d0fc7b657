"""The corruption of a drive as its log tells it."""

from pathlib import Path

import msgspec

from proto import topics
from proto.truth import Corrupted
from services.logger.format.reader import messages


def logged_records(log: Path) -> tuple[Corrupted, ...]:
    """The records in one file of a drive's log, in the order in which they were logged. Raises UserError, OSError."""
    start = topics.CORRUPTED.name.removesuffix("<id>")
    said = (each.data for each in messages(log) if each.name.startswith(start))
    return tuple(msgspec.json.decode(data, type=Corrupted) for data in said)
