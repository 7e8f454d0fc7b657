"""`python -m studies law`: answers every situation with all rulepacks loaded; 1 unless all are right."""

import argparse
import sys

from studies.law.scores import Measured, measure
from studies.law.situations import every_book, own_cases, situations
from studies.output import Sheet, add_json, show


def main() -> int:
    """Show how many are right, and what was answered wrongly."""
    parser = argparse.ArgumentParser(prog="python -m studies law", description=__doc__)
    add_json(parser)
    flags, book = parser.parse_args(), every_book()
    found = [measure("the packs' own cases", book, own_cases(book)), measure("from the law", book, situations())]
    show(map(sheet, found), as_json=flags.json)
    return 0 if all(each.all_right for each in found) else 1


def sheet(measured: Measured) -> Sheet:
    """A row a pack, then their sum, then what was answered wrongly."""
    scores = [*measured.by_pack.items(), ("together", measured.total)]
    rows = [(name, score.asked, score.right, score.above) for name, score in scores]
    wrong = [f"wrong: {text}" for text in measured.wrong]
    return Sheet((measured.name, "asked", "right", "limit above"), rows, wrong)


if __name__ == "__main__":
    sys.exit(main())
