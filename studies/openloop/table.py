"""`python -m studies openloop.answers LOG...`: every method on the snapshots of the same runs, as a table.

Event F1 and the correct-tool rate are those of `evaluation.metrics`, from the truth that lies beside each log; latency is
measured here, from the observations to the advisory. Nothing that is advised changes what comes next.
"""

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import msgspec

from app.drive.summary import percentile
from drivemcp.errors import UserError
from evaluation.campaign.machine import machine
from evaluation.metrics import At, Record, Scores, measure
from evaluation.metrics.record import Call, Tick
from evaluation.run.methods import METHODS, Method
from evaluation.run.recorded import record_of
from evaluation.tables.columns import F1, TOOLS, Column
from proto.decision import Event
from studies.openloop.answers import Answered, answers
from studies.output import Sheet, add_json, show


class OpenRow(msgspec.Struct, frozen=True, kw_only=True):
    """A method over all logs; None: nothing to measure."""

    label: str
    ticks: int
    event_f1: float | None
    tools_right: float | None
    """Share of ticks with the right tools."""
    spoken: int
    """Ticks in which something was said."""
    asked_p50_ms: float | None
    """Of ticks that asked a tool, from the observations to the advisory."""
    asked_p99_ms: float | None
    tick_p50_ms: float | None
    """Of all ticks."""


OPEN: tuple[Method, ...] = tuple(
    method
    for method in METHODS.values()
    if not method.stand_ins and method.settings != METHODS["No-assistant"].settings
)
"""The Oracle needs drives of its own, and a method that says nothing has nothing to be timed."""


def rows(logs: Sequence[Path], methods: Iterable[Method] = OPEN) -> Iterator[OpenRow]:
    """A row a method, as they come. Raises UserError where a log or the truth beside it is missing or not as it was written."""
    truths = {log: record_of(log) for log in logs}
    for method in methods:
        yield _row(method, truths)


def _row(method: Method, truths: Mapping[Path, Record]) -> OpenRow:
    events, right, judged, all_of_them = list[Scores](), 0, 0, list[Answered]()
    for log, record in truths.items():
        answered = list(answers(log, method))
        found = measure(_as_answered(record, answered))
        events += found.events.values()
        right, judged = right + found.tool_ticks_right, judged + found.tool_ticks
        all_of_them += answered
    total = Scores(
        hit=sum(each.hit for each in events), missed=sum(each.missed for each in events), false=sum(each.false for each in events)
    )  # fmt: skip
    asked = [each.latency_ms for each in all_of_them if each.tools]
    return OpenRow(
        label=method.label,
        ticks=len(all_of_them),
        event_f1=total.f1,
        tools_right=right / judged if judged else None,
        spoken=sum(each.kind != "SILENT" for each in all_of_them),
        asked_p50_ms=_percentile(asked, 0.5),
        asked_p99_ms=_percentile(asked, 0.99),
        tick_p50_ms=_percentile([each.latency_ms for each in all_of_them], 0.5),
    )


def _as_answered(record: Record, answered: Sequence[Answered]) -> Record:
    """The run's truth with what the method noticed and asked in each tick in place of what the log has."""
    at_s = {at.message.tick: at.time_s for at in record.traces}
    ticks = tuple(At(at_s[each.tick], _tick(each)) for each in answered if each.tick in at_s)
    return Record(truths=record.truths, traces=ticks, conditions=record.conditions)


def _tick(answered: Answered) -> Tick:
    events = tuple(Event(kind=kind, g=1.0, eta=1.0) for kind in answered.events)
    calls = tuple(
        Call(tool=tool, status="ok" if tool in answered.answered else "unavailable") for tool in answered.tools
    )
    return Tick(tick=answered.tick, events=events, calls=calls)


def _percentile(values: Sequence[float], share: float) -> float | None:
    return percentile(values, share) if values else None


COLUMNS = (
    "method", "ticks", F1, TOOLS, "ticks spoken in", Column(title="p50, tools asked", unit="ms", places=1),
    Column(title="p99, tools asked", unit="ms", places=1), Column(title="p50, all ticks", unit="ms"),
)  # fmt: skip


def sheet(found: Iterable[OpenRow]) -> Sheet:
    """A row a method."""
    return Sheet(COLUMNS, [msgspec.structs.astuple(row) for row in found])


def main(arguments: list[str] | None = None) -> int:
    """Print the table; 2 where a log cannot be used."""
    parser = argparse.ArgumentParser(prog="python -m studies openloop.answers", description=__doc__)
    parser.add_argument(
        "logs", nargs="+", type=Path, metavar="LOG", help="RUN/log.mcap of `drivemcp evaluate`, truth beside it"
    )
    add_json(parser)
    flags, found = parser.parse_args(arguments), list[OpenRow]()
    try:
        for row in rows(flags.logs):
            sys.stderr.write(f"{row.label}: {row.ticks} ticks\n")
            found.append(row)
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    told = msgspec.structs.replace(sheet(found), title=f"{len(flags.logs)} logs; {machine()}")
    show([told], as_json=flags.json)
    return 0
