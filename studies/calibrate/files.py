"""What a calibration leaves behind: the profile as the arbiter loads it, with its provenance, and a plot of each constant."""

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from drivemcp.errors import UserError
from evaluation.report.plots import svg_of
from services.arbiter.profiles.profile import FOLDER, parse, read_file
from studies.calibrate.constants import BY_NAME, Candidate, Row
from studies.calibrate.score import PARTS
from studies.calibrate.search import Trial
from studies.calibrate.usable import CALIBRATION
from studies.calibrate.verdict import Closed

OURS, FAINT, REFUSED = "#1f5fa8", "#9aa5b1", "#b42318"
COLUMNS = 4


class Provenance(msgspec.Struct, frozen=True, kw_only=True):
    """How a profile came about."""

    made: str
    """When, ISO 8601."""
    code: str
    """The commit, or the digest of the sources where there is no repository."""
    command: str
    machine: str
    places: tuple[str, ...]
    """The drives that were decided again."""
    drives: str = CALIBRATION
    """What they are."""
    km: float
    sensors: str
    optimiser: str
    seed: int
    trials: int
    objective: str
    before: Trial
    after: Trial
    closed_before: Closed | None = None
    closed_after: Closed | None = None
    verdict: str
    """Whether the fitted constants were taken, and why."""


def formula() -> str:
    """The objective in words."""
    return " + ".join(f"{part.weight:g} {part.name} [{part.unit}]" for part in PARTS)


def profile_text(name: str, candidate: Candidate, base: str, provenance: Provenance | None = None) -> str:
    """A profile file: the base's constants, those that moved with their new source; provenance in its head.

    Raises ProfileError where the arbiter would refuse it.
    """
    file = read_file((FOLDER / f"{base}.toml").read_bytes(), base)
    head = [f"# {key}: {value}" for key, value in _told(provenance, candidate).items()] if provenance else []
    moved = {key: value for key, value in candidate.constants.items() if value != file.constants[key].value}
    lines = [*head, *([""] if head else []), f'name = "{name}"', f"about = {_quoted(_about(moved, provenance))}"]
    lines += [f'ttc = "{file.ttc}"', f'rss = "{file.rss}"']
    for key, row in file.constants.items():
        value = moved.get(key, row.value)
        source = "ours, fitted by drivemcp calibrate" if key in moved else row.source
        reason = (
            f"fitted within [{BY_NAME[key].low:g}, {BY_NAME[key].high:g}], was {row.value:g}: {row.reason}"
            if key in moved
            else row.reason
        )
        lines += ["", f"[constants.{key}]", f"symbol = {_quoted(row.symbol)}", f"value = {value!r}"]
        lines += [f"unit = {_quoted(row.unit)}", f"source = {_quoted(source)}", f"reason = {_quoted(reason)}"]
    text = "\n".join(lines) + "\n"
    parse(text.encode(), name)
    return text


def _about(moved: Mapping[str, float], provenance: Provenance | None) -> str:
    if provenance is None:
        return "A candidate of drivemcp calibrate."
    if not moved:
        return f"The shipped constants as they are. {provenance.verdict}"
    return f"Fitted on {provenance.km:.1f} km of {provenance.drives}: {', '.join(sorted(moved))}. {provenance.verdict}"


def _told(provenance: Provenance, candidate: Candidate) -> dict[str, str]:
    """Provenance, one line a field."""
    told = {
        "made": provenance.made, "code": provenance.code, "command": provenance.command, "machine": provenance.machine,
        "places": ", ".join(provenance.places), "km": f"{provenance.km:.2f} of {provenance.drives}, {provenance.sensors} sensors",
        "optimiser": f"{provenance.optimiser}, seed {provenance.seed}, {provenance.trials} trials",
        "objective": provenance.objective,
        "before": f"{provenance.before.objective:.3f} ({_parts(provenance.before)})",
        "after": f"{provenance.after.objective:.3f} ({_parts(provenance.after)})",
    }  # fmt: skip
    for name, closed in (
        ("closed loop before", provenance.closed_before),
        ("closed loop after", provenance.closed_after),
    ):
        if closed is not None:
            told[name] = ", ".join(f"{key} {value}" for key, value in msgspec.structs.asdict(closed).items())
    told["event thresholds"] = ", ".join(f"{kind} {value:g}" for kind, value in sorted(candidate.thresholds.items()))
    told["verdict"] = provenance.verdict
    return {key: " ".join(value.split()) for key, value in told.items()}


def _parts(trial: Trial) -> str:
    return ", ".join(f"{name} {value:.3g}" for name, value in trial.parts.items())


def _quoted(text: str) -> str:
    """As a TOML string, which JSON's are for text without control characters."""
    return msgspec.json.encode(text).decode()


Curve = Sequence[tuple[float, Trial]]


def sensitivity_svg(curves: Mapping[str, Curve], shipped: Candidate, fitted: Candidate) -> str:
    """For each constant over its bounds, the others as fitted: how much the objective and its weighted parts are above where they
    are as fitted. All on one scale; values that the design refuses are crosses.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise UserError("matplotlib is missing; install the extra: pip install 'drivemcp[calibrate]'") from error
    rows = -(-len(curves) // COLUMNS)
    figure = Figure(figsize=(3.4 * COLUMNS, 2.1 * rows + 0.6), layout="constrained")
    axes = figure.subplots(rows, COLUMNS, squeeze=False, sharey=True)
    for axis, (name, curve) in zip(axes.flat, curves.items(), strict=False):
        _draw(axis, BY_NAME[name], curve, shipped, fitted)
    for axis in list(axes.flat)[len(curves) :]:
        axis.set_axis_off()
    handles, names = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=6, fontsize=7)
    return svg_of(figure)


def _draw(axis: Any, row: Row, curve: Curve, shipped: Candidate, fitted: Candidate) -> None:
    tried = [each for each in curve if not each[1].refused]
    at = [value for value, _ in tried]
    here = next((trial for _, trial in tried if trial.candidate == fitted), None)
    if here is not None:
        for part in PARTS:
            change = [part.weight * (trial.parts[part.name] - here.parts[part.name]) for _, trial in tried]
            axis.plot(at, change, linewidth=1.2, label=part.name)
        objective = [trial.objective - here.objective for _, trial in tried]
        axis.plot(at, objective, color="#222", marker="o", markersize=3, linewidth=1.0, label="objective")
    refused = [value for value, trial in curve if trial.refused]
    axis.plot(refused, [0.0] * len(refused), "x", color=REFUSED, label="refused")
    axis.axvline(fitted.values[row.name], color=OURS, linewidth=1.2, label="fitted")
    axis.axvline(shipped.values[row.name], color=FAINT, linewidth=1.2, linestyle="--", label="shipped")
    axis.set_title(f"{row.name}, {row.unit}", fontsize=8)
    axis.set_xlim(row.low, row.high)
    axis.tick_params(labelsize=6)
    axis.spines[["top", "right"]].set_visible(False)
