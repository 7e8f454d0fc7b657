"""Rows that adapt: each run begins with the Delta and c_min that labels on the runs before it have left. Labels are scripted,
from truth: what a driver who knows it would say of each drive (`evaluation.metrics.labels`).
"""

from collections.abc import Iterator, Sequence

import msgspec

from evaluation.campaign.plan import Run, with_settings
from evaluation.campaign.store import Store
from evaluation.metrics.labels import Drive
from evaluation.run.spec import RunSpec
from proto.decision import Feedback
from services.arbiter.memory.adapt import learn, relax
from services.arbiter.profiles.profile import Profile, load
from services.arbiter.state import Adapted
from services.orchestrator.driver.wishes import Given, admit

CALIBRATED = "calibrated"


def specs_of(runs: Sequence[Run], store: Store) -> dict[int, RunSpec]:
    """What is to be driven, by the run's `id`. Of a row that adapts only the runs whose predecessors are driven."""
    found = {id(run): run.spec for run in runs if not run.row.adapts}
    for key in dict.fromkeys((run.row.table, run.row.key) for run in runs if run.row.adapts):
        found.update(_in_turn([run for run in runs if (run.row.table, run.row.key) == key], store))
    return found


def _in_turn(runs: Sequence[Run], store: Store) -> Iterator[tuple[int, RunSpec]]:
    adapted: Adapted | None = None
    for run in sorted(runs, key=lambda each: each.number):
        learnt = None if adapted is None else [round(adapted.delta, 6), round(adapted.c_min, 6)]
        spec = run.spec if learnt is None else with_settings(run.spec, "arbiter", {"learnt": learnt})
        yield id(run), spec
        kept = store.kept(store.key(spec))
        if kept is None:
            return
        profile = _profile(spec)
        adapted, _ = after(adapted or Adapted(delta=profile.delta, c_min=profile.c_min), kept.labelled, profile)


def _profile(spec: RunSpec) -> Profile:
    """The run's, with the Delta that it was given, if any: there learning begins, and there it goes back to."""
    settings = spec.settings.get("arbiter", {})
    profile = load(settings.get("profile", CALIBRATED))
    return msgspec.structs.replace(profile, delta=settings.get("delta", profile.delta))


def after(adapted: Adapted, drive: Drive, profile: Profile) -> tuple[Adapted, int]:
    """What a drive's labels leave, and how many of them counted; as orchestrator and arbiter have it."""
    given, counted = Given(), 0
    adapted = relax(msgspec.structs.replace(adapted, updated_ns=None), 0, profile)
    for each in sorted(drive.labels):
        now_ns = round(each.time_s * 1e9)
        given, refused = admit(given, now_ns)
        if not refused:
            adapted = learn(relax(adapted, now_ns, profile), (Feedback(label=each.label),), profile)  # type: ignore[arg-type]
            counted += 1
    return relax(adapted, round(drive.seconds * 1e9), profile), counted
