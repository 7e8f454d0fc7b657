"""`python -m evaluation.tables.agree RENDERED MODELLED`: whether both kinds of sensors come to the same numbers on the same runs.

Both are folders of `drivemcp evaluate`; runs of the same row, place, seed, length, latencies and settings are compared pair by pair.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import fmean
from typing import Any

import msgspec

from drivemcp.errors import MALFORMED, UserError
from evaluation.campaign.names import TABLES, TableName
from evaluation.statistics import Spread, paired
from evaluation.tables.columns import Column, columns_of
from evaluation.tables.tables import per_run

Metrics = Mapping[str, Any]
Scene = tuple[str, str, int, int, float, str]
"""Row, family, place, seed, seconds asked, and what else the run was made of (`_asked`)."""


class Compared(msgspec.Struct, frozen=True, kw_only=True):
    """One column over the pairs of a family that have a number both times. `less`: modelled less rendered."""

    family: str
    column: Column
    rendered: float
    modelled: float
    less: Spread

    @property
    def agree(self) -> bool | None:
        """Whether the difference's 95 % interval holds 0; None: one pair has no interval.

        Pairs that all differ by the same have none either: they agree if that is 0, to the places that are shown.
        """
        if self.less.low is None or self.less.high is None:
            return None if self.less.sd is None else round(self.less.mean or 0.0, self.column.places) == 0.0
        return self.less.low <= 0.0 <= self.less.high


def runs_in(folder: Path, table: TableName) -> dict[Scene, Metrics]:
    """What finished runs of a table came to. Raises UserError where the folder has none that can be read."""
    file = folder / f"{table}.json"
    found: dict[Scene, Metrics] = {}
    try:
        for each in msgspec.json.decode(file.read_bytes())["table"]["rows"]:
            row, asked = each["row"], _asked(each)
            for run in each["runs"]:
                if run["kept"] is not None:
                    scene = (row["key"], row["family"], run["number"], run["seed"], run["seconds"], asked)
                    found[scene] = run["kept"]["metrics"]
    except (OSError, *MALFORMED, KeyError, TypeError) as error:
        raise UserError(f"{file}: no table of `drivemcp evaluate`: {error!r}") from error
    return found


def _asked(row: Mapping[str, Any]) -> str:
    """A row's latencies and settings, but for the sensors and what is logged: runs with others are no pair."""
    spec = dict(row["row"]["spec"])
    spec["settings"] = {service: each for service, each in spec["settings"].items() if service != "logger"}
    return msgspec.json.encode({**spec, "sensors": ""}, order="deterministic").decode()


def compared(table: TableName, rendered: Mapping[Scene, Metrics], modelled: Mapping[Scene, Metrics]) -> list[Compared]:
    """Each column by family, then over all families."""
    scenes = [scene for scene in rendered if scene in modelled]
    families = list(dict.fromkeys(family for _, family, *_ in scenes))
    return [
        found
        for family in (*families, "all")
        for column in columns_of(table)
        for found in _compared(family, column, [s for s in scenes if family in (s[1], "all")], rendered, modelled)
    ]


def _compared(
    family: str,
    column: Column,
    scenes: Sequence[Scene],
    rendered: Mapping[Scene, Metrics],
    modelled: Mapping[Scene, Metrics],
) -> Iterator[Compared]:
    told = [(per_run(column, rendered[scene]), per_run(column, modelled[scene])) for scene in scenes]
    pairs = [(one, other) for one, other in told if one is not None and other is not None]
    if pairs:
        one, other = zip(*pairs, strict=True)
        yield Compared(
            family=family, column=column, rendered=fmean(one), modelled=fmean(other), less=paired(other, one)
        )


def page(found: Sequence[Compared]) -> str:
    """A Markdown table, and how many agree."""
    lines = ["| | number | pairs | rendered | modelled | modelled less rendered | agree |", "| --- " * 7 + "|"]
    lines += [_line(each) for each in found]
    judged = [each for each in found if each.agree is not None]
    ranging = [each for each in judged if each.less.low is not None]
    lines += [
        "",
        f"{_agreeing(judged)} of {len(judged)} numbers agree. {len(ranging)} have an interval, and {_agreeing(ranging)} intervals "
        f"contain 0; by chance {0.05 * len(ranging):.0f} would not. A number without an interval has the same difference in all pairs, and "
        "agrees if that is 0.",
    ]
    return "\n".join(lines) + "\n"


def _agreeing(found: Sequence[Compared]) -> int:
    return sum(bool(each.agree) for each in found)


def _line(each: Compared) -> str:
    places = each.column.places
    less = "-" if each.less.mean is None else f"{each.less.mean:+.{places}f}"
    if each.less.low is not None and each.less.high is not None:
        less += f" [{each.less.low:.{places}f}, {each.less.high:.{places}f}]"
    agree = {None: "-", True: "yes", False: "**no**"}[each.agree]
    name = f"{each.column.title}, {each.column.unit}"
    numbers = f"{each.rendered:.{places}f} | {each.modelled:.{places}f}"
    return f"| {each.family} | {name} | {each.less.n} | {numbers} | {less} | {agree} |"


def main() -> int:
    """Compare and print; 2 where there is nothing to compare."""
    parser = argparse.ArgumentParser(prog="python -m evaluation.tables.agree", description=__doc__)
    parser.add_argument("rendered", type=Path, metavar="RENDERED", help="--out of rendered runs")
    parser.add_argument("modelled", type=Path, metavar="MODELLED", help="--out of modelled ones")
    parser.add_argument("--table", choices=TABLES, default="results")
    flags = parser.parse_args()
    try:
        found = compared(flags.table, *(runs_in(folder, flags.table) for folder in (flags.rendered, flags.modelled)))
        if not found:
            raise UserError("no run of the same row, place, seed, length, latencies and settings in both folders")
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write(page(found))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
