"""Recorded drives to decide again: every tick's inputs, what was answered, and the truth beside them."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec

from app.replay.again import traces
from drivemcp.errors import MALFORMED, UserError
from evaluation.campaign.store import LOG, SPEC
from evaluation.metrics import Record, from_log
from evaluation.run.recorded import fault_of
from evaluation.run.spec import RunSpec
from proto.decision import ArbitrationRequest
from proto.tools import Outcome
from services.arbiter.decide import Inputs
from services.logger.format import chain, container
from services.orchestrator.law import rules_question
from services.orchestrator.observations.inputs import Observations

LOCAL = "local"
"""The profile of a decision that the orchestrator took itself, the arbiter being away."""


class Step(NamedTuple):
    """One tick: what was observed, and what the arbiter saw with its own eyes; None: it was not asked."""

    time_s: float
    seen: Observations
    own: Inputs | None
    request: ArbitrationRequest | None


class Recording(NamedTuple):
    """A drive from its first tick to its last."""

    name: str
    steps: tuple[Step, ...]
    answers: Mapping[tuple[str, str], tuple[tuple[int, Outcome], ...]]
    """(tool, question) -> (tick, answer)."""
    record: Record
    sensors: str = "unknown"
    """With which it was driven, by the spec beside it."""

    @property
    def km(self) -> float:
        """Driven."""
        return self.record.truths[-1].distance_m / 1e3


def find(places: Iterable[str | Path]) -> tuple[Path, ...]:
    """The logs that files and folders name. Raises UserError where a folder has no log."""
    found: list[Path] = []
    for place in map(Path, places):
        logs = [place] if place.is_file() else sorted(place.rglob(LOG))
        if not logs:
            raise UserError(f"--from {place}: there is no {LOG} in it; name a log, a run's folder or a folder of runs")
        found += logs
    return tuple(dict.fromkeys(found))


def load(log: Path) -> Recording:
    """A drive from its log and the truth beside it. Raises UserError where one of them is not whole, or cannot be used."""
    _check_whole(log)
    record = from_log(log)
    if not record.truths:
        raise UserError(
            f"{log}: no truth lies beside it, so nothing tells what was right; logs of `drivemcp evaluate` have it"
        )
    times = {each.message.tick: each.time_s for each in record.advisories}
    steps: list[Step] = []
    answers: dict[tuple[str, str], list[tuple[int, Outcome]]] = {}
    for number, trace in enumerate(traces([log]), start=1):
        if trace.tick != number:
            raise UserError(f"{log}: tick {number} is missing, so what follows cannot be decided again")
        try:
            seen = msgspec.convert(trace.inputs, Observations)
            asked = trace.request is not None and trace.decision.profile != LOCAL
            own = msgspec.convert(trace.decision.own, Inputs) if asked else None
        except msgspec.ValidationError as error:
            raise UserError(f"{log}: tick {number} does not fit this version: {error}") from None
        steps.append(Step(times.get(trace.tick, number / 10), seen, own, trace.request))
        for call in trace.calls:
            answers.setdefault((call.tool, rules_question.key(call.arguments)), []).append((trace.tick, call))
    spec = spec_of(log)
    return Recording(
        f"{spec.scenario} seed {spec.seed}" if spec is not None else str(log),
        tuple(steps),
        {key: tuple(rows) for key, rows in answers.items()},
        record,
        spec.sensors if spec is not None else "unknown",
    )


def _check_whole(log: Path) -> None:
    """What reads a log ends without a word where it was cut. A car's may be by another writer, which `recorded.record_of` refuses."""
    if (fault := fault_of(log)) and not _foreign(log):
        raise UserError(
            f"{log} was cut, never closed or changed ({fault}); leave it out of --from, "
            "or, if it was simulated, delete its folder and drive it again"
        )


def _foreign(log: Path) -> bool:
    """Whether a writer that signs nothing wrote it, and came to its end."""
    data = log.read_bytes()
    return data[len(container.MAGIC) :].endswith(container.MAGIC) and chain.TOPIC.encode() not in data


def spec_of(log: Path) -> RunSpec | None:
    """The spec that lies beside a log; `None` without a spec that this version reads."""
    try:
        return msgspec.json.decode((log.parent / SPEC).read_bytes(), type=RunSpec)
    except (OSError, *MALFORMED):
        return None


def kilometres(recordings: Sequence[Recording]) -> float:
    """All of them."""
    return sum(each.km for each in recordings)
