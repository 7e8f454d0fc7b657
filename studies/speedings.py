"""`python -m studies speedings LOG.mcap ...`: every speeding that counts as an infraction, and what it came from."""

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal, get_args

import msgspec

from domain.units import MPS_PER
from drivemcp.errors import UserError
from evaluation.metrics import At, Record
from evaluation.metrics.law import SAME_LIMIT_MPS
from evaluation.run.recorded import record_of
from evaluation.tables.columns import Column
from proto.decision import Advisory
from proto.truth import Truth
from services.simulator.truth.ledger import SPEEDING_AFTER_S, TOLERANCE_MPS
from studies.output import Cell, Sheet, add_json, show

Cause = Literal["told in time", "told late", "not told"]
BEFORE_S = 25.0
"""Ours: what was said longer before does not count."""
REACTS_S, SOFT_MPS2 = 1.25, 2.0
"""Ours: a driver brakes so long after a word at the earliest that counts, and for a limit not harder than that."""
OF_LIMITS = ("limit", "ahead", "border")


class Speeding(msgspec.Struct, frozen=True, kw_only=True):
    """An episode of `evaluation.metrics.law.speeding_episodes`, and the first word on its limit."""

    from_s: float
    """When the limit was first exceeded by more than the tolerance."""
    to_s: float
    limit_mps: float
    """The one in force at the beginning."""
    by_mps: float
    """The most."""
    told_s: float | None
    """When the driver first heard of that limit; None: not within 25 s before."""
    needs_mps2: float | None
    """The braking that would have obeyed from 1.25 s after the word on; infinite: no time was left."""

    @property
    def cause(self) -> Cause:
        """Told in time: 2 m/s² would have obeyed."""
        if self.needs_mps2 is None:
            return "not told"
        return "told in time" if self.needs_mps2 <= SOFT_MPS2 else "told late"


def speedings(record: Record) -> Iterator[Speeding]:
    """In the order of time; as many as `speeding_episodes` counts."""
    for over in _episodes(record.truths):
        begun, limit_mps = over[0], over[0].law_limit_mps or 0.0
        before = (each for each in record.spoken if begun.time_s - BEFORE_S < each.time_s < begun.time_s)
        told_s = next((each.time_s for each in before if _is_of(record, each, limit_mps)), None)
        yield Speeding(
            from_s=begun.time_s,
            to_s=over[-1].time_s,
            limit_mps=limit_mps,
            by_mps=max(_over_mps(truth) for truth in over),
            told_s=told_s,
            needs_mps2=None if told_s is None else _needs_mps2(record, told_s, begun),
        )


def _episodes(truths: Sequence[Truth]) -> Iterator[list[Truth]]:
    """Each from where the tolerance is left, for a second or more, to where the speed is back at the limit."""
    above: list[Truth] = []
    over_s, counts, before_s = 0.0, False, 0.0
    for truth in truths:
        beyond = _over_mps(truth) > TOLERANCE_MPS
        over_s = over_s + truth.time_s - before_s if beyond else 0.0
        before_s = truth.time_s
        if not (beyond or (counts and _over_mps(truth) > 0.0)):
            if counts:
                yield above
            above, counts = [], False
            continue
        above.append(truth)
        counts = counts or over_s >= SPEEDING_AFTER_S - 1e-6
    if counts:
        yield above


def _over_mps(truth: Truth) -> float:
    return 0.0 if truth.law_limit_mps is None else truth.speed_mps - truth.law_limit_mps


def _is_of(record: Record, said: At[Advisory], limit_mps: float) -> bool:
    """Whether a message announces the limit, tells that a sign means it, or asks for it, or less, where it is in force."""
    message, there = said.message, record.truth_at(said.time_s)
    if message.topic == "foreign":
        return f" {round(limit_mps / MPS_PER[message.unit])} {message.unit}" in f" {message.directive}"
    if message.topic not in OF_LIMITS:
        return False
    if message.ahead_mps is not None:
        return _same(message.ahead_mps, limit_mps)
    asked, law_mps = message.target_mps, there.law_limit_mps if there else None
    return (
        asked is not None and asked <= limit_mps + SAME_LIMIT_MPS and law_mps is not None and _same(law_mps, limit_mps)
    )


def _same(one_mps: float, other_mps: float) -> bool:
    return abs(one_mps - other_mps) <= SAME_LIMIT_MPS


def _needs_mps2(record: Record, told_s: float, begun: Truth) -> float:
    heard = record.truth_at(told_s)
    left_s = begun.time_s - told_s - REACTS_S
    if heard is None or begun.law_limit_mps is None or left_s <= 0.0:
        return float("inf")
    return max(heard.speed_mps - begun.law_limit_mps, 0.0) / left_s


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
    counted = Sheet(("cause", "speedings"), [(cause, causes[cause]) for cause in get_args(Cause)])
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
