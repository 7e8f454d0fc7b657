"""`python -m scripts.reference` writes the pages; with `--check` it names those that are not as the code is, and ends with 1."""

import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from scripts.reference import tables
from scripts.reference.commands import commands
from scripts.reference.settings import settings
from scripts.reference.tools import tools
from scripts.vocabulary import as_page, in_use

FOLDER = Path(__file__).parents[2] / "docs" / "reference"
PAGES: Mapping[str, Callable[[], str]] = {
    "topics": tables.topics,
    "services": tables.services,
    "tools": tools,
    "settings": settings,
    "events": tables.events,
    "message-kinds": tables.kinds,
    "arbiter-constants": tables.constants,
    "metrics": tables.metrics,
    "commands": commands,
    "rulepack-words": lambda: as_page(in_use()),
}


def stale() -> dict[Path, str]:
    """Pages whose text is not what the code gives, with what they should be."""
    pages = {FOLDER / f"{name}.md": made() for name, made in PAGES.items()}
    return {
        file: text for file, text in pages.items() if not file.is_file() or file.read_text(encoding="utf-8") != text
    }


def main(arguments: list[str]) -> int:
    """Write, or check."""
    found = stale()
    if arguments == ["--check"]:
        for file in found:
            sys.stderr.write(f"{file.relative_to(FOLDER.parents[1])} is stale; run: python -m scripts.reference\n")
        return 1 if found else 0
    for file, text in found.items():
        file.write_text(text, encoding="utf-8")
        sys.stdout.write(f"{file}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
