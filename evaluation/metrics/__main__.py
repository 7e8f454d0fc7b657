"""`python -m evaluation.metrics LOG.mcap`: the numbers of a run, with what was said and when hazards began."""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec

from drivemcp.errors import UserError
from evaluation.metrics import Record, from_log, hazards, measure


def main(arguments: list[str] | None = None) -> int:
    """Print; 2 where the log cannot be used."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.metrics", description=__doc__)
    parser.add_argument("log", type=Path, help="a run's MCAP file; the truth is looked for beside it")
    try:
        record = from_log(parser.parse_args(arguments).log)
    except (UserError, OSError) as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 2
    print("\n".join((*_told(record), *_numbers(record))))  # noqa: T201
    return 0


def _told(record: Record) -> Iterator[str]:
    """Hazards and messages in the order of time."""
    rows = [(each.onset_s, f"hazard {each.kind}, until {each.over_s:.2f}") for each in hazards.episodes(record)]
    for time_s, said in record.spoken:
        rows.append((time_s, f"{said.kind} {said.urgency} {said.topic} {said.hazard or '-'}: {said.directive}"))
    yield from (f"{time_s:8.2f} s  {what}" for time_s, what in sorted(rows))


def _numbers(record: Record) -> Iterator[str]:
    for name, value in msgspec.to_builtins(measure(record)).items():
        yield f"{name:24} {'not measured' if value is None else value}"


if __name__ == "__main__":
    sys.exit(main())
