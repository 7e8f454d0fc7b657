"""What the system understood: its events and tools beside those that truth calls for."""

from collections.abc import Iterator, Mapping

import msgspec

from evaluation.metrics import truth_events
from evaluation.metrics.record import At, Record, Tick
from evaluation.metrics.spans import Span, spans
from evaluation.metrics.truth_events import TOLERANCES, TOOLS, Expected, Tolerance
from proto.truth import Truth
from services.orchestrator.experts.routing import TOOL_TABLE

GRACE_S = 1.0
"""From when an event must be on until its tools must have answered: ten ticks."""
OURS = frozenset(tool for tools in TOOLS.values() for tool in tools)
"""Tools of third parties are not judged."""


class Scores(msgspec.Struct, frozen=True, kw_only=True):
    """Detected events against those derived from truth."""

    hit: int = 0
    missed: int = 0
    false: int = 0

    @property
    def f1(self) -> float | None:
        """Harmonic mean of precision and recall; None where there was nothing to detect and nothing detected."""
        counted = 2 * self.hit + self.missed + self.false
        return 2 * self.hit / counted if counted else None


def detected(record: Record) -> dict[str, Scores]:
    """Scores by kind. A stretch of detection that touches an expected one, widened by the kind's tolerance, is right."""
    if not record.truths or not record.traces:
        return {}
    return {
        kind: _scores(_stretches(record, kind), rows, TOLERANCES[kind])
        for kind, rows in truth_events.expected(record).items()
    }


def tool_ticks(record: Record) -> tuple[int, int]:
    """(right, judged). A tick is right if each tool that a due event needs has answered lately, and none was called idly.

    Due is what must be on for a second and more. Lately is the time that the tool's answer serves. Idle is a call that no
    event which may be on calls for, no fact gone stale, and nothing that truth has no say in.
    """
    if not record.truths or not record.traces:
        return 0, 0
    rows, answered, right = truth_events.expected(record), dict[str, float](), 0
    for trace in record.traces:
        truth = record.truth_at(trace.time_s)
        answered.update({call.tool: trace.time_s for call in trace.message.calls if call.status == "ok"})
        if truth is not None:
            right += _has_needed(rows, answered, trace.time_s, truth) and _none_idle(rows, trace)
    return right, len(record.traces)


def _stretches(record: Record, kind: str) -> tuple[Span, ...]:
    seen = ((t.time_s, any(event.kind == kind for event in t.message.events)) for t in record.traces)
    return spans(seen, truth_events.PAUSE_S)


def _scores(found: tuple[Span, ...], rows: tuple[Expected, ...], tolerance: Tolerance) -> Scores:
    due = [row.span for row in rows if row.due is not None]
    hit = sum(any(span.overlaps(each, *tolerance) for each in found) for span in due)
    false = sum(not any(row.span.overlaps(each, *tolerance) for row in rows) for each in found)
    return Scores(hit=hit, missed=len(due) - hit, false=false)


def _has_needed(
    rows: Mapping[str, tuple[Expected, ...]], answered: Mapping[str, float], now_s: float, truth: Truth
) -> bool:
    return all(
        tool in answered and now_s - answered[tool] <= TOOL_TABLE[tool].serves_s + GRACE_S
        for kind in _due(rows, now_s)
        for tool in truth_events.tools_of(kind, truth)
    )


def _due(rows: Mapping[str, tuple[Expected, ...]], now_s: float) -> Iterator[str]:
    """Kinds that must be on: for a second, or as an instant for a second and until its tolerance is over."""
    for kind, expected in rows.items():
        lasts_s = TOLERANCES[kind].after_s
        for row in expected:
            if row.due is None:
                continue
            end_s = row.due.to_s if row.due.to_s > row.due.from_s else row.due.from_s + lasts_s
            if row.due.from_s + max(GRACE_S, _late(kind)) <= now_s <= end_s:
                yield kind


def _late(kind: str) -> float:
    """What is watched before it is believed is due only then."""
    return TOLERANCES[kind].after_s if kind in ("vehicle_fault", "low_friction") else 0.0


def _none_idle(rows: Mapping[str, tuple[Expected, ...]], trace: At[Tick]) -> bool:
    now = Span(trace.time_s, trace.time_s)
    own = {event.kind for event in trace.message.events} - set(truth_events.KINDS)
    on = {kind for kind, expected in rows.items() if any(row.span.overlaps(now, *TOLERANCES[kind]) for row in expected)}
    untold = set(truth_events.KINDS) - set(rows)
    allowed = {tool for kind in on | own | untold for tool in TOOLS[kind]}
    return all(call.tool in allowed or call.tool not in OURS for call in trace.message.calls)
