"""Speed, limit and target over the drive, as SVG: lines end where a value is unknown, and begin again where it is known."""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import msgspec

from app.report.ticks import Tick
from domain.hearing import Hearing

WIDTH, HEIGHT = 960, 260
LEFT, RIGHT, TOP, BOTTOM = 44, 8, 26, 34
MOST_POINTS = 1200
GAP_S = 1.0
FACTORS = {"km/h": 3.6, "mph": 2.236936}
STEPS = (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200)
MOST_LABELS = 12


class Line(msgspec.Struct, frozen=True, kw_only=True):
    """One line of the plot: its name, its class in the style sheet, and its SVG path."""

    name: str
    style: str
    path: str


class Mark(msgspec.Struct, frozen=True, kw_only=True):
    """A message on the plot; `row` keeps neighbours from covering each other."""

    number: int
    x: float
    y: float
    style: str
    tick: int


class Label(msgspec.Struct, frozen=True, kw_only=True):
    """A number at an axis, with the place of its line."""

    at: float
    text: str


class Timeline(msgspec.Struct, frozen=True, kw_only=True):
    """All parts of the plot, in pixels of `WIDTH` by `HEIGHT`."""

    unit: str
    lines: tuple[Line, ...]
    marks: tuple[Mark, ...]
    degraded: tuple[tuple[float, float], ...]
    """Left edge and width of each time in which advice was degraded."""
    across: tuple[Label, ...]
    up: tuple[Label, ...]


class _Scale(NamedTuple):
    begin_ns: int
    seconds: float
    top: float

    def x(self, stamp_ns: int) -> float:
        share = (stamp_ns - self.begin_ns) / 1e9 / self.seconds if self.seconds > 0 else 0.0
        return round(LEFT + share * (WIDTH - LEFT - RIGHT), 1)

    def y(self, value: float) -> float:
        return round(HEIGHT - BOTTOM - value / self.top * (HEIGHT - TOP - BOTTOM), 1)


Curve = tuple[str, str, Callable[[Tick], float | None]]


def timeline(ticks: Sequence[Tick], unit: str) -> Timeline | None:
    """The plot in that unit; None where there are no two ticks."""
    if len(ticks) < 2:
        return None
    factor = FACTORS.get(unit, 3.6)
    thin = ticks[:: max(1, len(ticks) // MOST_POINTS)]
    curves: list[Curve] = [
        ("limit in force", "limit", lambda each: _limit(each, assumed=False, factor=factor)),
        ("limit assumed", "limit assumed", lambda each: _limit(each, assumed=True, factor=factor)),
        ("target", "target", lambda each: _scaled(each.advisory.target_mps, factor)),
        ("speed", "speed", lambda each: _scaled(each.speed_mps, factor)),
    ]
    values = [value for _, _, of in curves for each in thin if (value := of(each)) is not None]
    step = 20 if factor < 3 else 50
    top = step * max(1, -(-int(max(values, default=1.0) * 1.05) // step))
    scale = _Scale(ticks[0].stamp_ns, (ticks[-1].stamp_ns - ticks[0].stamp_ns) / 1e9, float(top))
    return Timeline(
        unit=unit,
        lines=tuple(line for line in _lines(thin, curves, scale) if line.path),
        marks=tuple(_marks(ticks, scale)),
        degraded=tuple(_degraded(thin, scale)),
        across=tuple(_seconds(scale)),
        up=tuple(Label(at=scale.y(v), text=f"{v}") for v in range(0, top + 1, step)),
    )


def _scaled(mps: float | None, factor: float) -> float | None:
    return mps * factor if mps is not None and 0.0 <= mps < 200.0 else None


def _limit(tick: Tick, *, assumed: bool, factor: float) -> float | None:
    limit = tick.advisory.legal_limit
    return None if limit is None or limit.assumed != assumed else _scaled(limit.mps, factor)


def _lines(ticks: Sequence[Tick], curves: Iterable[Curve], scale: _Scale) -> Iterable[Line]:
    for name, style, of in curves:
        yield Line(name=name, style=style, path=_path(ticks, of, scale, steps=style.startswith("limit")))


def _path(ticks: Iterable[Tick], of: Callable[[Tick], float | None], scale: _Scale, *, steps: bool) -> str:
    """`steps`: the value leaps from tick to tick, as limits do."""
    parts: list[str] = []
    last_ns: int | None = None
    for tick in ticks:
        value = of(tick)
        if value is None:
            last_ns = None
            continue
        goes_on = last_ns is not None and (tick.stamp_ns - last_ns) / 1e9 <= max(GAP_S, scale.seconds / 200)
        x, y = scale.x(tick.stamp_ns), scale.y(value)
        parts.append((f"H{x}V{y}" if steps else f"L{x} {y}") if goes_on else f"M{x} {y}")
        last_ns = tick.stamp_ns
    return "".join(parts)


def _marks(ticks: Iterable[Tick], scale: _Scale) -> Iterable[Mark]:
    ends = [0.0, 0.0]
    notes = Hearing().notes
    told = (each for each in ticks if notes(each.advisory, each.stamp_ns))
    for number, tick in enumerate(told, start=1):
        x = scale.x(tick.stamp_ns)
        row = next((k for k, end in enumerate(ends) if x >= end), 0)
        ends[row] = x + 14.0
        urgent = tick.advisory.urgency in ("warning", "alarm") or tick.advisory.kind == "ACT"
        yield Mark(number=number, x=x, y=8.0 + 11.0 * row, style="urgent" if urgent else "calm", tick=tick.tick)


def _degraded(ticks: Sequence[Tick], scale: _Scale) -> Iterable[tuple[float, float]]:
    begin: float | None = None
    for tick in ticks:
        if tick.advisory.degraded and begin is None:
            begin = scale.x(tick.stamp_ns)
        elif not tick.advisory.degraded and begin is not None:
            yield begin, round(max(1.0, scale.x(tick.stamp_ns) - begin), 1)
            begin = None
    if begin is not None:
        yield begin, round(max(1.0, WIDTH - RIGHT - begin), 1)


def _seconds(scale: _Scale) -> Iterable[Label]:
    step = next((each for each in STEPS if scale.seconds / each <= MOST_LABELS), STEPS[-1])
    for second in range(0, int(scale.seconds) + 1, step):
        text = f"{second // 60}:{second % 60:02}" if scale.seconds >= 120 else f"{second} s"
        yield Label(at=scale.x(scale.begin_ns + second * 1_000_000_000), text=text)
