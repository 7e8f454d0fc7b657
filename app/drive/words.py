"""The live line and the summary in words."""

from app.drive.summary import Percentiles, Summary, Tally
from proto.decision import Advisory

_KMH = 3.6
_MPH = 2.236936


def live_line(tally: Tally, width: int = 120) -> str:
    """Speed, limit, target, last advice, tick latency; what is unknown is shown as such."""
    advisory, truth = tally.advisory, tally.truth
    unit, factor = ("mph", _MPH) if advisory is not None and advisory.unit == "mph" else ("km/h", _KMH)
    limit = advisory.legal_limit if advisory else None
    parts = [
        f"{tally.now_s:5.1f} s",
        f"{_speed(truth.speed_mps if truth else None, factor)} {unit}",
        f"limit {f'{limit.value:g}' if limit else ''}{'?' if limit is None or limit.assumed else ''}",
        f"target {_target(advisory, factor)}",
        f"{_milliseconds(tally.latency().p50)}",
    ]
    if advisory is not None and advisory.degraded:
        parts.append("degraded")
    return f"{' | '.join(parts)} | {_said(tally)}"[:width]


def _target(advisory: Advisory | None, factor: float) -> str:
    """The target speed, with a question mark where it rests on an assumed limit alone; on one that is not shown, no number."""
    limit = advisory.legal_limit if advisory is not None else None
    if advisory is None or (advisory.target_why == "law" and limit is None):
        return "?"
    guess = advisory.target_why == "law" and limit is not None and limit.assumed
    return _speed(advisory.target_mps, factor).strip() + ("?" if guess else "")


def spoken_line(time_s: float, advisory: Advisory) -> str:
    """One piece of advice with its reasons, for the record above the live line."""
    words = " ".join(f"{advisory.directive.rstrip('.')}. {advisory.justification}".split())
    return f"{time_s:5.1f} s   {advisory.kind} {advisory.urgency:8}{words}"


def end_line(tally: Tally, *, keep: bool) -> str:
    """That the drive is over, why, and what becomes of the stack."""
    state = tally.scenario
    why = "the drive is over"
    if state is not None and state.problem:
        why = f"the drive broke off: {state.problem}"
    elif state is not None and state.time_s < state.duration_s - 1.0:
        why = f"the route is over after {state.time_s:.0f} s; {state.duration_s:.0f} s were asked for"
    return f"{why}; the stack stays up until Ctrl-C" if keep else why


def _said(tally: Tally) -> str:
    if not tally.spoken:
        return "nothing said yet"
    said_s, advisory = tally.spoken[-1]
    age_s = tally.now_s - said_s
    return f"{advisory.kind} {advisory.directive}" + (f" ({age_s:.0f} s ago)" if age_s >= 1.0 else "")


def _speed(value_mps: float | None, factor: float) -> str:
    return "  ?" if value_mps is None else f"{value_mps * factor:3.0f}"


def _milliseconds(value: float | None) -> str:
    return "tick ? ms" if value is None else f"tick {value:.0f} ms"


def summary_lines(summary: Summary) -> list[str]:
    """The summary, a line each."""
    rows = [
        ("scenario", f"{summary.scenario or 'recording'}, seed {summary.seed}, {summary.seconds:.1f} s"),
        ("distance", _or_unknown(summary.distance_m, "{:.0f} m")),
        ("infractions", _counts(summary.infractions)),
        ("collisions", _or_unknown(summary.collisions, "{}")),
        ("overspeed", _or_unknown(summary.overspeed_pct, "{:.2f} % above the true limit, mean over time")),
        (
            "messages",
            f"{summary.messages} in {summary.ticks} ticks, silent share {_or_unknown(summary.silent_share, '{:.1%}')}",
        ),
        ("ACT", f"{summary.acts_done} done, {summary.acts_withheld} withheld"),
        ("hazard response", _hazards(summary)),
        ("TTC at first warning", _or_unknown(summary.ttc_first_warning_s, "{:.2f} s", "nothing was closing")),
        ("advisory latency", _latency(summary.advisory_latency_ms, "event to advisory")),
        ("sensor to advice", _latency(summary.sensor_to_advice_ms, "snapshot to advisory")),
        ("deadline misses", _misses(summary)),
        ("degraded ticks", f"{summary.degraded_ticks}"),
        ("late frames", f"{summary.late_frames}"),
        *_too_slow(summary),
        ("encoder", summary.encoder),
        ("detector", summary.detector),
    ]
    if summary.field_of_view:
        rows.append(("field of view", summary.field_of_view))
    if summary.restarts:
        rows.append(("restarts", _counts(summary.restarts)))
    rows.append(("log", f"{summary.log or 'none'}{_verified(summary.log_verified)}"))
    if summary.log_missed:
        rows.append(("not in the log", f"{summary.log_missed} messages did not reach the logger"))
    if summary.log_unstamped:
        rows.append(("not stamped", summary.log_unstamped))
    if summary.log_trouble:
        rows.append(("log is not whole", summary.log_trouble))
    return [f"{name:21} {text}" for name, text in rows]


DECISIONS_HZ, KEEPS_PACE, SETTLES_S = 10.0, 0.8, 10.0
"""So often the stack decides where it follows a simulated drive in real time, and the share of it below which it does not."""


def _too_slow(summary: Summary) -> list[tuple[str, str]]:
    """That the machine did not follow a simulated drive, and what to do; nothing where it did, or where the drive is no simulation."""
    if summary.infractions is None or summary.seconds < SETTLES_S or not summary.late_frames:
        return []
    rate_hz = summary.ticks / summary.seconds
    if rate_hz >= KEEPS_PACE * DECISIONS_HZ:
        return []
    told = f"{rate_hz:.1f} decisions a second in place of {DECISIONS_HZ:.0f}, so that warnings came late or not at all"
    return [("machine too slow", f"{told}: --lockstep lets the simulation wait")]


def _or_unknown(value: float | int | None, pattern: str, unknown: str = "unknown") -> str:
    return unknown if value is None else pattern.format(value)


def _counts(counts: dict[str, int] | None) -> str:
    if counts is None:
        return "unknown"
    return ", ".join(f"{count} {name}" for name, count in counts.items()) or "0"


def _hazards(summary: Summary) -> str:
    if summary.hazards is None:
        return "unknown"
    if not summary.hazards:
        return "no hazard came"
    times = ", ".join(f"{value:.2f} s" for value in summary.hazard_response_s) or "none warned of"
    return f"{times} ({len(summary.hazard_response_s)} of {summary.hazards} hazards)"


def _latency(value: Percentiles, what: str) -> str:
    if value.p50 is None:
        return "nothing measured"
    return f"p50 {value.p50:.1f} ms, p99 {value.p99:.1f} ms ({what}, {value.count} ticks)"


def _misses(summary: Summary) -> str:
    calls = sum(summary.tool_calls.values())
    return f"{_counts(summary.deadline_misses)} of {calls} calls"


def _verified(verified: bool | None) -> str:
    return {True: " (verified)", False: " (NOT verified)", None: ""}[verified]
