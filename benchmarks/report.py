"""A report that is printed, and kept where asked, section by section: one that fails takes no other with it."""

import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from evaluation.campaign.replacing import write_whole, writing

REMEDIES: Mapping[type[Exception], str] = {
    subprocess.CalledProcessError: "a package index has to be in reach",
    subprocess.TimeoutExpired: "try it on an idle machine",
}
"""What to do about an error, where it does not say so itself."""


def report(command: str, head: str, sections: Mapping[str, Callable[[], str]], out: Path | None) -> int:
    """Each section in turn. Exit status: 0; 1 where one failed, which the report says in its place.

    Raises UserError where `out` cannot be written: before the first begins, if that shows.
    """
    parts, status = [head], 0
    _tell(parts, out)
    for name, section in sections.items():
        sys.stderr.write(f"{name}:\n")
        try:
            parts.append(section())
        except Exception as error:  # noqa: BLE001 whatever it is, the other sections are of use
            sys.stderr.write(f"{error}\n")
            parts.append(_failed(command, name, error))
            status = 1
        _tell(parts, out)
    return status


def _tell(parts: list[str], out: Path | None) -> None:
    sys.stdout.write("\n" * (len(parts) > 1) + parts[-1] + "\n")
    sys.stdout.flush()
    if out is not None:
        with writing("--out", out):
            write_whole(out, ("\n\n".join(parts) + "\n").encode())


def _failed(command: str, name: str, error: Exception) -> str:
    """One line: which, why, and what to do."""
    lines = [line for line in f"{type(error).__name__}: {error}".splitlines() if line.strip()]
    why = " ... ".join(dict.fromkeys((lines[0], lines[-1]))).rstrip(".: ")
    remedy = REMEDIES.get(type(error), "mend that")
    return f"**{name} failed**: {why}; {remedy}, then `{command} {name}`"
