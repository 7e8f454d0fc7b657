"""The traces of a log, in their order."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import msgspec

from drivemcp.errors import MALFORMED, UserError
from proto import topics
from proto.decision import TraceRecord
from services.logger.format.reader import messages


def traces(paths: Iterable[Path]) -> Iterator[TraceRecord]:
    """Every trace of the files, which are read one after the other. Raises UserError where one cannot be used."""
    decoder = msgspec.json.Decoder(TraceRecord)
    for path in paths:
        for logged in messages(path):
            if logged.name == topics.TRACE.name:
                try:
                    yield decoder.decode(logged.data)
                except MALFORMED as error:
                    raise UserError(
                        f"{path}: trace {logged.sequence} does not fit this version's TraceRecord: {error}"
                    ) from None
