"""`python -m scripts.reference` writes the pages; with `--check` it names those that are not as the code is, and ends with 1."""

import sys
from pathlib import Path

from scripts.reference.pages import GENERATED, maker

FOLDER = Path(__file__).parents[2] / "docs" / "reference"


def stale() -> dict[Path, str]:
    """Pages whose text is not what the code gives, with what they should be."""
    pages = {FOLDER / f"{name}.md": maker(path)() for name, path in GENERATED.items()}
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
