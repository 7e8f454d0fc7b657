"""`python -m studies default_limits`: every rulepack against the world's default limits; 1 unless all differences are explained."""

import argparse
import os
import sys
from collections import Counter
from pathlib import Path

from drivemcp.errors import UserError
from studies.default_limits.comparison import Compared, Result, compare, read_explained
from studies.default_limits.table import Table, read_table
from studies.law.situations import every_book
from studies.output import Sheet, add_json, show

VARIABLE = "DRIVEMCP_DEFAULT_LIMITS"
USUAL = Path("out/legal_default_speeds.json")
FETCH = (
    "fetch output/legal_default_speeds.json of github.com/westnordost/osm-legal-default-speeds (CC BY-SA 2.0, from the OpenStreetMap wiki) "
    f"to {USUAL}, or name its place in {VARIABLE}; it is not shipped"
)


def place_of_table() -> Path:
    """Where the table lies, if it was fetched."""
    return Path(os.environ.get(VARIABLE) or USUAL)


def main(arguments: list[str] | None = None) -> int:
    """Show per pack how many cells agree, and every difference that is not as explained."""
    parser = argparse.ArgumentParser(prog="python -m studies default_limits", description=f"{__doc__} {FETCH}.")
    parser.add_argument("table", metavar="TABLE", nargs="?", type=Path, help=f"the table; usually {USUAL}")
    add_json(parser)
    flags = parser.parse_args(arguments)
    path = flags.table or place_of_table()
    try:
        if not path.is_file():
            raise UserError(f"{path} is not there: {FETCH}")
        table = read_table(path)
        found = compare(every_book(), table, read_explained())
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    show([sheet(found, table)], as_json=flags.json)
    return 1 if found.unexplained or found.outdated else 0


def sheet(compared: Compared, table: Table) -> Sheet:
    """A row a pack, their sum, and what is not as explained."""
    counts = compared.counts()
    counts["together"] = sum(counts.values(), Counter[Result]())
    rows = [(name, each.total(), each["agree"], each["below"], each["above"]) for name, each in counts.items()]
    notes = (
        [f"table: revision {table.meta.revision_id} of {table.meta.timestamp[:10]}"] if table.meta.revision_id else []
    )
    notes += [f"not explained: {text}" for text in compared.unexplained]
    notes += [f"no longer so: {text}" for text in compared.outdated]
    return Sheet(("pack", "cells", "agree", "below the table", "above the table"), rows, notes)


if __name__ == "__main__":
    sys.exit(main())
