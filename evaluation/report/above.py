"""A moment of a run without pictures: seen from above as truth has it, and how speed and messages went about it."""

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from evaluation.campaign.moments import Moment
from evaluation.metrics import At, Record
from evaluation.metrics.conflicts import EGO_LENGTH_M, EGO_WIDTH_M
from evaluation.report.plots import FAINT, OURS, PAPER, figure_of, svg_of
from proto.decision import Advisory
from proto.truth import Truth

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Rectangle

BEHIND_M, AHEAD_M, ASIDE_M = 20.0, 70.0, 15.0
BEFORE_S, AFTER_S = 10.0, 5.0
WORDS = 5
"""Messages that have room."""
MOVES_MPS = 0.5
"""A slower road user stands: truth does not tell its heading, and it is drawn along our way."""


def seen_from_above(record: Record, moment: Moment) -> str:
    """The moment as SVG. Raises UserError where matplotlib is missing."""
    truth = record.truth_at(moment.time_s)
    if truth is None:
        return ""
    near = record.truths_between(truth.time_s - BEFORE_S, truth.time_s + AFTER_S)
    figure, (place, course, words) = figure_of((3, 1), (4.6, 4.4), ratios=(2.0, 1.8, 1.0))
    _place(place, near, truth)
    _course(course, near, truth)
    told = [each for each in record.spoken if near[0].time_s <= each.time_s <= near[-1].time_s]
    _words(words, course, told[-WORDS:])
    return svg_of(figure)


def _place(axes: "Axes", near: tuple[Truth, ...], truth: Truth) -> None:
    axes.plot(*zip(*_way(near, truth), strict=True), color=FAINT, linewidth=0.8, linestyle="--")
    axes.add_patch(_body(0.0, 0.0, EGO_LENGTH_M, EGO_WIDTH_M, 0.0, OURS))
    for actor in truth.actors:
        along_mps, across_mps = actor.vx_mps + truth.speed_mps, actor.vy_mps
        moves = math.hypot(along_mps, across_mps) > MOVES_MPS
        person = actor.kind == "pedestrian"
        length_m, width_m = (1.0, 1.0) if person else (actor.length_m, actor.width_m)
        yaw_rad = math.atan2(across_mps, along_mps) if moves else 0.0
        axes.add_patch(_body(actor.x_m, actor.y_m, length_m, width_m, yaw_rad, PAPER if person else "#5a6570"))
        if moves:
            axes.annotate(
                "", (actor.x_m + along_mps, actor.y_m + across_mps), (actor.x_m, actor.y_m),
                arrowprops={"arrowstyle": "->", "linewidth": 0.6}, annotation_clip=True,
            )  # fmt: skip
    for sign in truth.signs:
        axes.plot(float(sign["x_m"]), float(sign["y_m"]), "^", color=PAPER, markersize=3)
    axes.set_xlim(-BEHIND_M, AHEAD_M)
    axes.set_ylim(-ASIDE_M, ASIDE_M)
    axes.set_aspect("equal")
    axes.set_xlabel("m ahead; arrows: a second's way", fontsize=7)


def _body(x_m: float, y_m: float, length_m: float, width_m: float, yaw_rad: float, color: str) -> "Rectangle":
    from matplotlib.patches import Rectangle

    corner = (x_m - length_m / 2.0, y_m - width_m / 2.0)
    return Rectangle(
        corner, length_m, width_m, angle=math.degrees(yaw_rad), rotation_point="center", color=color, linewidth=0
    )


def _way(near: tuple[Truth, ...], truth: Truth) -> Iterator[tuple[float, float]]:
    """Where the ego was and will be, as seen from where it is."""
    at = next(k for k, each in enumerate(near) if each.time_s >= truth.time_s - 1e-6)
    yield from reversed([*_gone(near[at::-1], truth)])
    yield from _gone(near[at:], truth)


def _gone(truths: tuple[Truth, ...], here: Truth) -> Iterator[tuple[float, float]]:
    x_m = y_m = 0.0
    yield x_m, y_m
    for one, other in itertools.pairwise(truths):
        way_m = other.distance_m - one.distance_m
        turned_rad = math.remainder((other.heading_rad or 0.0) - (here.heading_rad or 0.0), math.tau)
        x_m, y_m = x_m + way_m * math.cos(turned_rad), y_m + way_m * math.sin(turned_rad)
        yield x_m, y_m


def _course(axes: "Axes", near: tuple[Truth, ...], truth: Truth) -> None:
    times_s = [each.time_s for each in near]
    axes.plot(times_s, [each.speed_mps * 3.6 for each in near], color=OURS, label="speed")
    limits = [math.nan if each.law_limit_mps is None else each.law_limit_mps * 3.6 for each in near]
    axes.step(times_s, limits, color=PAPER, linewidth=1, where="post", label="limit")
    axes.axvline(truth.time_s, color=FAINT, linewidth=0.8)
    axes.set_xlim(times_s[0], times_s[-1])
    axes.set_ylim(bottom=0)
    axes.legend(fontsize=6, loc="lower left", frameon=False)
    axes.set_ylabel("km/h", fontsize=7)


def _words(axes: "Axes", course: "Axes", told: Sequence[At[Advisory]]) -> None:
    """The messages, numbered as they are on the course of the speed."""
    axes.set_axis_off()
    for number, (time_s, said) in enumerate(told, 1):
        course.axvline(time_s, color=FAINT, linewidth=0.5, linestyle=":")
        course.annotate(
            str(number), (time_s, 1.0), xycoords=("data", "axes fraction"), ha="center", va="bottom", fontsize=6
        )
        line = f"{number}  {time_s:.1f} s  {said.directive}"
        at = 1.0 - (number - 1) / WORDS
        axes.text(0.0, at, line, fontsize=7, va="top", transform=axes.transAxes, parse_math=False)
    if not told:
        axes.text(0.0, 1.0, "Nothing was said.", fontsize=7, va="top", transform=axes.transAxes)
