"""What verification of a log comes to."""

import msgspec

from services.logger.format import chain
from services.logger.verification.difference import What
from services.logger.writing.log_file import Origin


class Place(msgspec.Struct, frozen=True, kw_only=True):
    """The first bad record. Where it has no name (framing, summary), the byte alone says where."""

    what: What
    detail: str
    offset: int
    """Byte in the file: of the chunk that holds the record, or of the first bytes that are wrong."""
    topic: str = ""
    sequence: int | None = None
    log_time_ns: int | None = None

    def __str__(self) -> str:
        name = f" {self.topic}" if self.topic else ""
        if self.sequence is not None:
            name += f" sequence {self.sequence}"
        if self.log_time_ns is not None:
            name += f" log time {self.log_time_ns} ns"
        return f"{self.what}:{name} at byte {self.offset}: {self.detail}"


UNSEALED = Place(what="unsealed", offset=0, detail="no chain record stands in it, so nothing verifies")
"""An empty file, or one that was cut before its first flush was whole."""


class Report(msgspec.Struct, frozen=True, kw_only=True):
    """What verification came to."""

    file: str
    size: int
    messages: int = 0
    """Messages that verify, chain records not counted."""
    chained: int = 0
    """Chain records that verify."""
    head: str = chain.ZERO
    origin: Origin | None = None
    key_id: str = ""
    closed: bool = False
    tail_bytes: int = 0
    """Bytes behind the last chain record of an unclosed file: a flush that was cut, vouched for by nothing."""
    first_bad: Place | None = None
    expected_head_missing: bool = False

    @property
    def intact(self) -> bool:
        """Whether something verifies, all before the tail is as it was written, and nothing expected is missing."""
        return self.first_bad is None and not self.expected_head_missing
