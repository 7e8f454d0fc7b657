"""Drives of the calibration split: recorded ones to search on, and closed-loop ones that the best has to stand up in."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from evaluation.campaign.one import run_one
from evaluation.campaign.plan import TEST_SEED
from evaluation.campaign.pool import Job, Pool
from evaluation.campaign.store import LOG, Store
from evaluation.run.methods import METHODS, applied
from evaluation.run.spec import RunSpec, Sensors
from evaluation.scenarios import FAMILIES
from evaluation.scenarios.names import Split
from services.arbiter.service import MOST_DELTA
from services.orchestrator.events import ETA
from studies.calibrate.constants import Candidate

NOBODY_BRAKES: Mapping[str, Any] = {"delta": MOST_DELTA}
"""Recorded drives have an arbiter that speaks and never acts: what it does must not hide what another would have had to do."""
FIRST_SEED = {"calibration": 1, "test": TEST_SEED}
"""Of the run with number 0."""


def specs(
    split: Split, numbers: Iterable[int], sensors: Sensors, seconds: float, settings: dict[str, dict[str, Any]]
) -> list[RunSpec]:
    """Each family's places with these numbers."""
    return [
        applied(
            METHODS["DriveMCP"],
            RunSpec(
                scenario=f"{family}/{split}/{number}",
                seed=FIRST_SEED[split] + number,
                sensors=sensors,
                seconds=seconds,
                settings=settings,
            ),
        )
        for number in numbers
        for family in FAMILIES
    ]


def settings_for(candidate: Candidate, profile: Path) -> dict[str, dict[str, Any]]:
    """How the services take a candidate, whose profile lies in that file."""
    return {"arbiter": {"profile": str(profile.resolve())}, "orchestrator": {"thresholds": other_thresholds(candidate)}}


def other_thresholds(candidate: Candidate) -> dict[str, float]:
    """Those that are not the table's."""
    return {kind: value for kind, value in candidate.thresholds.items() if value != ETA[kind]}


def whose(spec: RunSpec) -> str:
    """Whose constants a drive is driven with."""
    return "fitted" if "profile" in spec.settings.get("arbiter", {}) else "shipped"


def driven(
    store: Store, wanted: Sequence[RunSpec], jobs: int, progress: Callable[[int, int, str], None]
) -> dict[str, str]:
    """Drive what is not there; what went wrong, by the run's key."""
    keys = {store.key(spec): spec for spec in wanted}
    missing = [Job(key, spec) for key, spec in keys.items() if store.kept(key) is None]
    problems: dict[str, str] = {}
    for count, done in enumerate(Pool(str(store.folder.resolve()), jobs, run_one).done(missing), 1):
        store.note(done.key, done.problem)
        if done.problem:
            problems[done.key] = done.problem.strip().splitlines()[-1]
        progress(count, len(missing), keys[done.key].scenario)
    return problems


def logs(store: Store, wanted: Sequence[RunSpec]) -> list[Path]:
    """Of those that are there."""
    return [store.path(key) / LOG for spec in wanted if store.kept(key := store.key(spec)) is not None]
