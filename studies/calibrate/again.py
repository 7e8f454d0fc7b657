"""A recorded drive decided again by other constants: the whole tick, so that what was said is remembered as it would have been.

Open loop: road, traffic and driver stay as they were. Tools answer what they answered to the same question anywhere in the
drive; another question stays unanswered, which only makes advice more careful. The arbiter has the grant that the
evaluation gives, whether the recorded drive had one or not.
"""

import dataclasses

import msgspec

from evaluation.metrics import Record
from evaluation.metrics.record import At, Tick
from evaluation.run.grant import GRANT
from proto.decision import Advisory, ArbitrationRequest, Decision
from proto.tools import Outcome
from services.arbiter.braking.act import Permission
from services.arbiter.decide import decide
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import ArbiterState, fresh
from services.orchestrator.experts.routing import Call
from services.orchestrator.law import rules_question
from services.orchestrator.observations.inputs import Observations
from services.orchestrator.state import State
from services.orchestrator.tick import tick
from studies.calibrate.constants import Candidate
from studies.calibrate.recordings import Recording, Step

GRANTED = Permission(
    grant_id=GRANT.grant_id,
    max_deceleration_mps2=GRANT.max_deceleration_mps2,
    max_duration_s=GRANT.max_duration_s,
    refused="",
)


class _Ask:
    """Answers out of the drive, and decides by a profile."""

    def __init__(self, recording: Recording, profile: Profile) -> None:
        self._answers, self._profile = recording.answers, profile
        self._state: ArbiterState = fresh(profile)
        self.step = recording.steps[0]
        self.number = 0

    def experts(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        """The answer to the same question that lies nearest in time."""
        return tuple(self._answer(call) for call in calls)

    def arbiter(self, request: ArbitrationRequest) -> Decision | None:
        """By the profile, on the arbiter's own recorded reading."""
        if self.step.own is None:
            return None
        inputs = msgspec.structs.replace(
            self.step.own, state=self._state, permission=GRANTED, delta=self._profile.delta, filter="full"
        )
        verdict = decide(request, inputs, self._profile)
        self._state = verdict.state
        return verdict.decision

    def _answer(self, call: Call) -> Outcome:
        rows = self._answers.get((call.tool, rules_question.key(call.arguments)), ())
        if not rows:
            return Outcome(tool=call.tool, status="unavailable", error="not in the log", arguments=call.arguments)
        return min(rows, key=lambda row: abs(row[0] - self.number))[1]


def again(recording: Recording, candidate: Candidate, base: Profile) -> Record:
    """What the drive would have left behind."""
    ask, state = _Ask(recording, candidate.profile(base)), State()
    thresholds = candidate.thresholds
    advisories: list[At[Advisory]] = []
    decisions: list[At[Decision]] = []
    ticks: list[At[Tick]] = []
    for number, step in enumerate(recording.steps, start=1):
        ask.step, ask.number = step, number
        ticked = tick(state, _seen(step, thresholds), ask)
        state = ticked.state
        advisories.append(At(step.time_s, ticked.advisory))
        decisions.append(At(step.time_s, ticked.decision))
        ticks.append(At(step.time_s, Tick(tick=number, events=ticked.events, calls=())))
    return dataclasses.replace(
        recording.record, advisories=tuple(advisories), decisions=tuple(decisions), traces=tuple(ticks)
    )


def _seen(step: Step, thresholds: dict[str, float]) -> Observations:
    return msgspec.structs.replace(step.seen, thresholds=thresholds)
