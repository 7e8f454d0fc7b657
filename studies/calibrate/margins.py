"""What the margin Delta buys and what it costs: scripted approaches with a driver who does nothing, and drives decided again.

In closed loop a warned driver hardly ever leaves the arbiter anything to brake for, so a table of driven runs tells little
of Delta. Here the arbiter decides alone. In the approaches (`bench`) the driver does not brake, and drives in which the driver
was told nothing (the method `silent`) are decided again as if the arbiter had been asked.
"""

from collections.abc import Iterable, Sequence
from itertools import chain
from statistics import median
from typing import NamedTuple, TypeVar

import msgspec

from evaluation.metrics.conflicts import interventions, is_false, nearest_ttc_at
from evaluation.statistics import poisson_ci
from evaluation.tables.columns import Column
from proto import topics
from proto.topics import Topic
from services.arbiter.assessment.reading import Latest, read
from services.arbiter.decide import Inputs
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import fresh
from services.orchestrator.observations.inputs import Method, Observations, Stamped
from studies.calibrate.again import again
from studies.calibrate.bench import APPROACHES, meet
from studies.calibrate.constants import shipped
from studies.calibrate.recordings import Recording, Step
from studies.output import Sheet

M = TypeVar("M", bound=msgspec.Struct)


class Approached(NamedTuple):
    """The scripted approaches at one Delta."""

    delta: float
    braked: int
    """In so many of them."""
    ttc_s: float | None
    """Median as braking began."""
    impact_mps: float
    """Mean over all of them."""


class Decided(NamedTuple):
    """Recorded drives at one Delta; the road and the driver are the recording's whatever is decided."""

    km: float = 0.0
    interventions: int = 0
    false: int = 0
    ttcs_s: tuple[float, ...] = ()
    """Times to collision as interventions began, of those with a road user met within `conflicts.CONFLICT_WITHIN_S`."""

    def cells(self) -> tuple[str, str, str]:
        """Interventions per 10 km with the exact 95 % interval, how many were false, median time to collision."""
        rate = poisson_ci(self.interventions, self.km, 10.0)
        told = f"{rate.value or 0.0:.2f} [{rate.low or 0.0:.2f}, {rate.high or 0.0:.2f}]"
        return told, f"{self.false} of {self.interventions}", f"{median(self.ttcs_s):.2f}" if self.ttcs_s else "-"


def approached(profile: Profile, delta: float) -> Approached:
    """Every approach with this Delta."""
    met = [meet(each, msgspec.structs.replace(profile, delta=delta)) for each in APPROACHES]
    began = [each.braked_ttc_s for each in met if each.braked_ttc_s is not None]
    return Approached(
        delta, len(began), median(began) if began else None, sum(each.impact_mps for each in met) / len(met)
    )


def decided(recording: Recording, base: Profile, delta: float) -> Decided:
    """One drive with this Delta."""
    profile = msgspec.structs.replace(base, delta=delta)
    record = again(recording, shipped(profile), profile)
    braked = interventions(record)
    times = (nearest_ttc_at(record, each.from_s) for each in braked)
    return Decided(
        recording.km, len(braked), sum(is_false(record, each) for each in braked),
        tuple(each for each in times if each is not None),
    )  # fmt: skip


def pooled(rows: Iterable[Decided]) -> Decided:
    """Several drives with the same Delta as one."""
    km, interventions, false, ttcs_s = zip(*rows, strict=True)
    return Decided(sum(km), sum(interventions), sum(false), tuple(chain.from_iterable(ttcs_s)))


def as_if_asked(recording: Recording, profile: Profile) -> Recording:
    """A drive in which the driver was told nothing, as if the arbiter had been asked in every tick; another drive as it is.

    The arbiter's own reading is made of the messages that the tick had, which are of the topics that the arbiter subscribes to.
    """
    return recording._replace(steps=tuple(_asked(step, profile) for step in recording.steps))


def _asked(step: Step, profile: Profile) -> Step:
    seen = step.seen
    if seen.method.name != "silent":
        return step
    reading = read(_latest(seen), seen.now_ns, profile.act_reading_age_s)
    own = Inputs(reading=reading, state=fresh(profile), now_ns=seen.now_ns)
    return step._replace(own=own, seen=msgspec.structs.replace(seen, method=Method()))


def _latest(seen: Observations) -> Latest:
    return Latest(
        tracks=_valid(topics.TRACKS, seen.tracks, seen),
        ego=_valid(topics.EGO, seen.ego, seen),
        conditions=_valid(topics.CONDITIONS, seen.conditions, seen),
        degradation=_valid(topics.DEGRADATION, seen.degradation, seen),
    )


def _valid(topic: Topic[M], stamped: Stamped[M] | None, seen: Observations) -> tuple[M, int] | None:
    """The message, unless the tick held its topic for missing, late or invalid: the arbiter does not read such a one."""
    if stamped is None or topic.name in seen.unhealthy:
        return None
    return stamped.message, stamped.stamp_ns


def sheet(found: Sequence[Approached], drives: Sequence[Decided], title: str = "") -> Sheet:
    """A row a Delta; without drives their columns are left out."""
    columns: list[str | Column] = [
        "Delta", "approaches braked in", Column(title="TTC as braking begins", unit="s"),
        Column(title="mean impact", unit="m/s", places=1),
    ]  # fmt: skip
    columns += ["interventions, /10 km", "false", "TTC at intervention, s"] if drives else []
    rows = [
        (
            f"{each.delta:g}",
            f"{each.braked} of {len(APPROACHES)}",
            each.ttc_s,
            each.impact_mps,
            *(drives[at].cells() if drives else ()),
        )
        for at, each in enumerate(found)
    ]
    return Sheet(columns, rows, title=title)
