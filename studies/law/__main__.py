"""`python -m studies law`: answers every situation with all rulepacks loaded; 1 unless all are right."""

import sys

from studies.law.scores import measure
from studies.law.situations import every_book, own_cases, situations
from studies.law.table import table


def main() -> int:
    """Print the tables and what was answered wrongly."""
    book = every_book()
    rows = [measure("the packs' own cases", book, own_cases(book)), measure("from the law", book, situations())]
    for row in rows:
        sys.stdout.write(table(row))
    return 0 if all(row.all_right for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
