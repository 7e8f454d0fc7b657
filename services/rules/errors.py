"""What can be wrong with a rulepack."""

from collections.abc import Sequence
from pathlib import Path

import msgspec

from drivemcp.errors import UserError


class Problem(msgspec.Struct, frozen=True, kw_only=True):
    """One thing that is wrong: where, what, and what to do."""

    file: Path
    line: int = 0
    """From 1; 0 where the file has no such place."""
    field: str = ""
    message: str
    remedy: str

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}" if self.line else f"{self.file}"
        return ": ".join(part for part in (place, self.field, f"{self.message}; {self.remedy}") if part)


class PackError(UserError):
    """A rulepack that cannot be used; the message names file, line and field."""


def refused(folder: Path, problems: Sequence[Problem]) -> PackError:
    """The error that says the first of several problems, and how to see the others."""
    more = f" (and {len(problems) - 1} more: drivemcp rulepack validate {folder})" if len(problems) > 1 else ""
    return PackError(f"{problems[0]}{more}")
