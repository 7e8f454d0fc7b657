"""`python -m studies speedings LOG.mcap ...`: every speeding that counts as an infraction, and what it came from."""

import argparse
import sys
from collections import Counter
from pathlib import Path

from drivemcp.errors import UserError
from evaluation.metrics.told import CAUSES, Speeding, speedings
from evaluation.run.recorded import record_of
from evaluation.tables.columns import Column
from studies.output import Cell, Sheet, add_json, show


def main(arguments: list[str] | None = None) -> int:
    """Show them; 2 where a log cannot be used."""
    parser = argparse.ArgumentParser(prog="python -m studies speedings", description=__doc__)
    parser.add_argument("logs", nargs="+", type=Path, metavar="LOG", help="MCAP files of runs, their truth beside them")
    add_json(parser)
    flags, found = parser.parse_args(arguments), list[tuple[Path, Speeding]]()
    try:
        for log in flags.logs:
            found += [(log, each) for each in speedings(record_of(log))]
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    causes = Counter(each.cause for _, each in found)
    counted = Sheet(("cause", "speedings"), [(cause, causes[cause]) for cause in CAUSES])
    show([Sheet(COLUMNS, [_row(log, each) for log, each in found]), counted], as_json=flags.json)
    return 0


COLUMNS = (
    "log", Column(title="from", unit="s", places=1), Column(title="to", unit="s", places=1),
    Column(title="above the limit", unit="km/h", scale=3.6, places=0), Column(title="limit", unit="km/h", scale=3.6, places=0),
    "cause", Column(title="told before", unit="s", places=1), Column(title="to obey took", unit="m/s²", places=1),
)  # fmt: skip


def _row(log: Path, each: Speeding) -> tuple[Cell, ...]:
    told = (None, None) if each.told_s is None else (each.from_s - each.told_s, each.needs_mps2)
    return str(log), each.from_s, each.to_s, each.by_mps, each.limit_mps, each.cause, *told


if __name__ == "__main__":
    sys.exit(main())
