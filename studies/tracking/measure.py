"""One drive's figures, and several drives' as a table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from services.perception.detect.detector import Detector
from studies.output import Sheet
from studies.tracking.drop_outs import Kept, drop_outs
from studies.tracking.errors import Errors, errors
from studies.tracking.faces import Faces, faces
from studies.tracking.leads import Leads, leads
from studies.tracking.pairing import scene
from studies.tracking.recording import DriveName, recording
from studies.tracking.scores import Scores, scores
from studies.tracking.seeing import Noting, glances, views

CUT_IN_S = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """All figures of a drive."""

    drive: DriveName
    pictures: int
    scores: Scores
    errors: Errors
    leads: Leads
    drop_outs: Kept
    faces: Faces
    ms_per_picture: float


def measure(name: DriveName, detector: Detector, keep: Path | None = None) -> Measured:
    """Drive (or take the kept drive), see, and score."""
    steps, noting = recording(name, keep), Noting(detector)
    seen = list(glances(steps, noting))
    front = views(seen)
    scenes = [scene(view) for view in front]
    return Measured(
        drive=name,
        pictures=len(front),
        scores=scores(scenes),
        errors=errors(scenes),
        leads=leads(front, scenes),
        drop_outs=drop_outs(steps, noting.found, scenes, name.seed),
        faces=faces(seen),
        ms_per_picture=1e3 * sum(each.spent_s for each in seen) / max(len(seen), 1),
    )


ROWS: tuple[tuple[str, str, Callable[[Measured], str]], ...] = (
    ("IDF1", "0.85", lambda m: f"{m.scores.idf1:.2f}"),
    ("HOTA", "", lambda m: f"{m.scores.hota:.2f}"),
    ("MOTA", "", lambda m: f"{m.scores.mota:.2f}"),
    ("found, right", "", lambda m: f"{m.scores.recall:.0%}, {m.scores.precision:.0%}"),
    ("identity switches, and vehicles", "", lambda m: f"{m.scores.identity_switches} of {m.scores.vehicles}"),
    ("gap error, median", "2 % or 0.3 m", lambda m: f"{m.errors.gap_m:.2f} m, {m.errors.gap_share:.1%}"),
    ("gap error, nine in ten", "", lambda m: f"{m.errors.gap_p90_m:.2f} m"),
    ("closing speed error, root mean square", "0.5 m/s", lambda m: f"{m.errors.closing_rms_mps:.2f} m/s"),
    (
        "the same, median and nine in ten",
        "",
        lambda m: f"{m.errors.closing_median_mps:.2f}, {m.errors.closing_p90_mps:.2f}",
    ),
    ("the right lead, where there is one", "", lambda m: f"{m.leads.right:.1%} of {m.leads.pictures}"),
    ("a lead, where there is none", "", lambda m: f"{m.leads.false:.1%} of {m.leads.free_pictures}"),
    ("id kept through half a second unseen", "all", lambda m: f"{m.drop_outs.kept} of {m.drop_outs.tried}"),
    ("cut-ins that lead within 0.3 s", "all", lambda m: _cut_ins(m.leads)),
    ("sign and panel faces found at least once", "", lambda m: f"{m.faces.found} of {m.faces.faces}"),
    (
        "pictures of them with a box, tracks a face",
        "",
        lambda m: f"{m.faces.pictures_found:.0%}, {m.faces.tracks_each:.1f}",
    ),
    ("perception, a picture", "", lambda m: f"{m.ms_per_picture:.0f} ms"),
)
"""What a figure is called, what is asked of it, and how it is written."""


def _cut_ins(leads: Leads) -> str:
    soon = sum(delay <= CUT_IN_S for delay in leads.cut_in_delays_s)
    return f"{soon} of {leads.cut_ins}" if leads.cut_ins else "none"


def sheet(drives: Sequence[Measured]) -> Sheet:
    """One column for each drive."""
    names = (f"{each.drive.scenario}{', cut-ins' * each.drive.cut_ins}, {each.drive.seed}" for each in drives)
    rows = [(name, target, *(told(each) for each in drives)) for name, target, told in ROWS]
    return Sheet(("", "target", *names), rows)
