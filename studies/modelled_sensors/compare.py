"""Figures of what was said of a truth, so that rendered and modelled sensors can be laid side by side."""

import math
from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evaluation.corruption.truths import is_true, key_of, sign_of
from evaluation.modelled_sensors.sign_faces import CLASSES
from proto.perception import Track
from proto.truth import TrueActor, Truth
from services.drivelm.reading.facts import public_code
from studies.modelled_sensors.pairing import looks
from studies.modelled_sensors.recording import Recording
from studies.output import Sheet

BINS_PX = (5.0, 10.0, 15.0, 25.0, 40.0, 80.0, 400.0)
BANDS_M = (0.0, 15.0, 30.0, 45.0, 70.0)
NEAR = 2.5
MOST_HIDDEN = 0.5
SETTLED_S = 1.0
SPECIFIC = ("limit", "sign", "message")
SEEN_FROM_BEHIND = "light:off"
"""A head across the junction; truth tells the colour of the ego's own."""
RIGHTLY, FIRST = "signs passed that were believed rightly", "first believed from, m"


class Share(NamedTuple):
    """So many of so many."""

    hits: int
    of: int

    @property
    def interval(self) -> tuple[float, float]:
        """95 % (Wilson), as if independent."""
        if not self.of:
            return 0.0, 1.0
        p, n, z = self.hits / self.of, self.of, 1.96
        middle, half = p + z * z / (2 * n), z * math.sqrt(max(p * (1 - p), 0.0) / n + z * z / (4 * n * n))
        return (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)


Figures = dict[str, Share | list[float]]
"""Shares, and lists of measures, by name."""


def figures(recordings: Sequence[Recording]) -> Figures:
    """All of them, over recordings."""
    told: Figures = {}
    for recording in recordings:
        for name, value in (*_boxes(recording), *_tracks(recording), *_facts(recording)):
            before = told.get(name)
            if isinstance(value, Share):
                old = before if isinstance(before, Share) else Share(0, 0)
                told[name] = Share(old.hits + value.hits, old.of + value.of)
            else:
                told[name] = [*(before if isinstance(before, list) else []), *value]
    return told


def _boxes(recording: Recording) -> list[tuple[str, Share | list[float]]]:
    hits: dict[str, list[int]] = defaultdict(lambda: [0, 0])
    strays, pictures = 0, 0
    for found, stray in looks(recording):
        pictures, strays = pictures + 1, strays + len(stray)
        for look in found:
            if look.thing.hidden > MOST_HIDDEN:
                continue
            px = next(k for k, edge in enumerate(BINS_PX[1:]) if look.thing.height_px < edge or edge == BINS_PX[-1])
            row = hits[f"boxes {look.camera} {look.thing.kind} {BINS_PX[px]:.0f}-{BINS_PX[px + 1]:.0f} px"]
            row[0], row[1] = row[0] + (look.box is not None), row[1] + 1
    return [
        *((name, Share(*row)) for name, row in sorted(hits.items())),
        ("boxes of nothing a picture", Share(strays, pictures)),
    ]


def _tracks(recording: Recording) -> list[tuple[str, Share | list[float]]]:
    truths = dict(recording.truths)
    hits: dict[str, list[int]] = defaultdict(lambda: [0, 0])
    gaps: list[float] = []
    speeds: list[float] = []
    false, pictures, ids = 0, 0, defaultdict[int, set[int]](set)
    for stamp_ns, tracks in recording.tracks:
        truth = truths.get(stamp_ns)
        if truth is None:
            continue
        pictures += 1
        left = list(tracks.tracks)
        for actor in sorted(truth.actors, key=lambda each: math.hypot(each.x_m, each.y_m)):
            if not _counts(actor):
                continue
            best = min(left, key=lambda each: _apart(each, actor), default=None)
            found = best is not None and _apart(best, actor) <= 1.0
            band = next(k for k, edge in enumerate(BANDS_M[1:]) if actor.x_m <= edge)
            row = hits[f"tracks {actor.kind} {BANDS_M[band]:.0f}-{BANDS_M[band + 1]:.0f} m"]
            row[0], row[1] = row[0] + found, row[1] + 1
            if found and best is not None:
                left.remove(best)
                ids[actor.actor_id].add(best.track_id)
                gaps.append(abs(best.x_m - actor.x_m) / max(actor.x_m, 5.0))
                if best.age_s >= SETTLED_S:
                    speeds.append(abs(best.vx_mps - actor.vx_mps))
        false += sum(0 < each.x_m < BANDS_M[-1] and not _anyone(each, truth) for each in left)
    return [
        *((name, Share(*row)) for name, row in sorted(hits.items())),
        ("tracks of no road user a picture", Share(false, pictures)),
        ("gap error, share", gaps),
        ("closing speed error, m/s", speeds),
        ("track numbers an actor", [float(len(each)) for each in ids.values()]),
    ]


def _counts(actor: TrueActor) -> bool:
    return 3.0 < actor.x_m <= BANDS_M[-1] and abs(actor.y_m) < 0.6 * actor.x_m


def _apart(track: Track, actor: TrueActor) -> float:
    other = (track.kind == "pedestrian") != (actor.kind == "pedestrian")
    return math.hypot((track.x_m - actor.x_m) / (NEAR + 0.1 * actor.x_m), (track.y_m - actor.y_m) / NEAR) + 2.0 * other


def _anyone(track: Track, truth: Truth) -> bool:
    return any(_apart(track, actor) <= 1.5 or _apart(track, actor) - 2.0 <= 1.5 for actor in truth.actors)


def _facts(recording: Recording) -> list[tuple[str, Share | list[float]]]:
    """By physical sign that was passed: believed rightly, first from how far, or believed wrongly; of lit lights, each fact."""
    truths = dict(recording.truths)
    there = _passed(recording)
    right: dict[str, float] = {}
    wrong: set[str] = set()
    lamps = [0, 0]
    for stamp_ns, facts in recording.facts:
        for fact in facts.facts:
            truth = truths.get(fact.frame_stamp_ns) or truths.get(stamp_ns)
            if truth is None or not fact.believed:
                continue
            if fact.kind == "light" and truth.light is not None and fact.reading != SEEN_FROM_BEHIND:
                lamps = [lamps[0] + (fact.reading.startswith(f"light:{truth.light}")), lamps[1] + 1]
            sign = sign_of(fact, truth.signs) if fact.kind in SPECIFIC and not fact.passed else None
            if sign is None or not is_true(key := key_of(sign)) or key not in there:
                continue
            if fact.reading in there[key]:
                right.setdefault(key, float(sign["x_m"]))
            else:
                wrong.add(key)
    return [
        (RIGHTLY, Share(len(right), len(there))),
        ("signs passed that were believed wrongly", Share(len(wrong), len(there))),
        (FIRST, sorted(right.values())),
        ("light facts that are right", Share(lamps[0], lamps[1])),
    ]


def _passed(recording: Recording) -> dict[str, frozenset[str]]:
    """The readable faces, as facts name them, of each post that came within 12 m."""
    told = {}
    for _, truth in recording.truths:
        for sign in truth.signs:
            if float(sign["x_m"]) < 12.0 and not str(sign["code"]).startswith("led:"):
                labels = (CLASSES.label(f"{sign['country']} {code}") for code in str(sign["code"]).split("+"))
                told[key_of(sign)] = frozenset(public_code(label) for label in labels if label != "other")
    return {key: codes for key, codes in told.items() if any(not code.startswith("plate") for code in codes)}


def sheet(rendered: Figures, modelled: Figures) -> Sheet:
    """Both beside each other, and in how many rows they agree within their 95 % intervals."""
    names = [name for name in rendered if name in modelled]
    fits = {name: _agree(rendered[name], modelled[name]) for name in names}
    rows = [(name, _words(rendered[name]), _words(modelled[name]), "yes" if fits[name] else "**no**") for name in names]
    note = f"{sum(fits.values())} of {len(names)} rows agree within their 95 % intervals"
    return Sheet(("", "rendered", "modelled", "agree"), rows, [note])


def _agree(a: Share | list[float], b: Share | list[float]) -> bool:
    (low_a, high_a), (low_b, high_b) = _interval(a), _interval(b)
    return low_a <= high_b and low_b <= high_a


def _interval(value: Share | list[float]) -> tuple[float, float]:
    if isinstance(value, Share):
        return value.interval if value.hits <= value.of else (value.hits / value.of, value.hits / value.of)
    if len(value) < 2:
        return -math.inf, math.inf
    rank = 1.96 * math.sqrt(len(value)) / 2
    ordered = sorted(value)
    low, high = (round(len(value) / 2 + sign * rank) for sign in (-1, 1))
    return ordered[max(low, 0)], ordered[min(high, len(value) - 1)]


def _words(value: Share | list[float]) -> str:
    if isinstance(value, Share):
        return f"{value.hits / max(value.of, 1):.3f} of {value.of}"
    return f"{float(np.median(value)):.3g} (90 %: {float(np.quantile(value, 0.9)):.3g})" if value else "none"
