"""Which recorded drives may be calibrated on: none of the places that results are told of, and none in which an arbiter braked."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import msgspec

from drivemcp.errors import MALFORMED, UserError
from evaluation.run.methods import FULL
from evaluation.run.spec import RunSpec
from evaluation.scenarios import read_place
from evaluation.scenarios.names import Place
from proto import topics
from proto.truth import ScenarioState
from services.logger.format.reader import messages
from studies.calibrate.drives import NOBODY_BRAKES
from studies.calibrate.recordings import spec_of

CALIBRATION, RECORDED = "calibration drives", "recordings"


class Usable(NamedTuple):
    """Logs to calibrate on, how many were left out, and what the profile may say that they are."""

    logs: tuple[Path, ...]
    left_out: int
    kind: str


def usable(logs: Iterable[Path]) -> Usable:
    """Of these; drives in which the arbiter may have braked, or of another method, are left out: a calibration's own closed loop
    lies beside what it recorded.

    Raises UserError naming the file for a drive of the test or the development split, for a simulated one that no spec lies
    beside, and where none is left.
    """
    found = {log: _checked(log) for log in logs}
    kept = [log for log, (spec, _) in found.items() if spec is None or _nobody_brakes(spec)]
    if not kept:
        raise UserError(
            f"--from: in all {len(found)} drives the arbiter may have braked, or they are of another method; record drives by "
            "`drivemcp calibrate`"
        )
    ours = all(place is not None for log, (_, place) in found.items() if log in kept)
    return Usable(tuple(kept), len(found) - len(kept), CALIBRATION if ours else RECORDED)


def _checked(log: Path) -> tuple[RunSpec | None, Place | None]:
    """The spec beside a log and the place that was driven; a recorded drive of a real car has neither."""
    spec, told = spec_of(log), _scenario(log)
    place = (read_place(spec.scenario) if spec is not None else None) or read_place("/".join(told.rsplit("-", 2)))
    if place is not None and place.split != "calibration":
        raise UserError(
            f"{log} is a drive of {place}: what is fitted on the {place.split} split cannot be judged by it; name drives of the "
            "calibration split or recordings of a car"
        )
    if spec is None and told:
        raise UserError(
            f"{log} is a simulated drive of {told}, and no spec that this version reads lies beside it: how it was driven is unknown"
        )
    return spec, place


def _scenario(log: Path) -> str:
    """The scenario that the simulator said it drives; empty: the log does not tell it."""
    for logged in messages(log):
        if logged.name == topics.SCENARIO.name:
            try:
                return msgspec.json.decode(logged.data, type=ScenarioState).scenario
            except MALFORMED as error:
                raise UserError(f"{log}: {logged.name} does not fit this version: {error}") from None
    return ""


def _nobody_brakes(spec: RunSpec) -> bool:
    return spec.method == FULL.label and spec.settings.get("arbiter") == dict(NOBODY_BRAKES)
