"""The proposer: tools are asked as ever, a model's parsed answer is the advice; what the arbiter behind it holds back, and what not."""

from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.errors import ConfigError
from evaluation.baselines.direct.parsed_advice import advice_of
from evaluation.baselines.direct.prompt_answer import PromptAnswer
from evaluation.baselines.proposer.told import told
from proto.decision import ArbitrationRequest, Decision, Fused
from proto.tools import Outcome
from services.arbiter.decide import decide
from services.drivelm.vocabulary.jurisdictions import allowed_limits
from services.orchestrator.experts.routing import Call
from services.orchestrator.observations.inputs import Method
from services.orchestrator.tick import redecide, trace_of
from tests.unit.services.arbiter.support import CALIBRATED, mirror, request
from tests.unit.services.orchestrator.support import EXPERTS, FEW, KMH, Drive, Played, actor, conditions, limit_sign

SIGN = limit_sign("limit:50")
FORMS = st.sampled_from(
    ("Drive at most 120 km/h.", "Drive at most 20 mph.", "Slow down.", "Stop.", "Give way.", "A pedestrian is ahead in the path.",
     "A vehicle is ahead in the path.", "The speed limit ahead is 30 km/h.", "I do not know.", "Drive at most 250 km/h.")
)  # fmt: skip
SAID = st.one_of(st.text(max_size=120), st.lists(FORMS, max_size=3).map(" ".join))


class Worded(Played):
    """The experts as ever, and a model that says what it is given to say."""

    def __init__(self, text: str, *, took_ms: float = 0.0, score: float = 0.9) -> None:
        super().__init__({**EXPERTS, "answer_prompt": self._answer}, self._decide)
        self.text, self.took_ms, self.score, self.verdict = text, took_ms, score, ""

    def _answer(self, arguments: dict[str, Any]) -> PromptAnswer:
        advice = advice_of(self.text)
        return PromptAnswer(
            text=self.text[:400], score=self.score, method="m", backend="b", prompt_sha256="", action=advice.action, value=advice.value,
            unit=advice.unit, hazard=advice.hazard, took_ms=self.took_ms,
        )  # fmt: skip

    def _decide(self, asked: ArbitrationRequest) -> Decision:
        decision = decide(asked, mirror(asked, now_ns=asked.stamp_ns), CALIBRATED).decision
        return msgspec.structs.replace(decision, tick=asked.tick)

    @property
    def prompts(self) -> list[Call]:
        """The prompts so far."""
        return [call for call in self.calls if call.tool == "answer_prompt"]


def drive(model: Worded) -> Drive:
    return Drive(model, method=Method(name="proposer", settings={}))


def test_tools_are_asked_first_and_their_answers_stand_in_the_prompt() -> None:
    model = Worded("Drive at most 50 km/h.")
    on = drive(model)
    on.tick(SIGN)
    assert [call.tool for call in model.calls][-2:] == ["applicable_limit", "answer_prompt"]
    (prompt,) = model.prompts
    assert "The speed limit is 50 km/h." in prompt.arguments["tools"]
    assert "It is set by § 3 StVO." in prompt.arguments["tools"]
    assert on.history[-1][2].fused.justification == "Drive at most 50 km/h."


def test_what_the_model_decides_replaces_fusion_and_the_arbiter_does_not_know_the_law() -> None:
    """A target above the law's limit passes the arbiter, which judges braking and speech: that is what our fusion is for."""
    on = drive(Worded("Drive at most 120 km/h."))
    told = on.tick(SIGN)
    assert told.decision.profile == "calibrated"
    assert told.advisory.target_mps == pytest.approx(120 * KMH)


def test_what_takes_long_is_told_when_it_is_there() -> None:
    on = drive(Worded("Drive at most 50 km/h.", took_ms=450.0))
    assert on.tick(SIGN).advisory.kind == "SILENT"
    assert on.ticks(3).advisory.kind == "SILENT"
    on.ticks(2)
    assert on.spoken() == ["Limit 50 km/h"]


def test_what_the_model_is_hardly_sure_of_the_arbiter_does_not_speak() -> None:
    on = drive(Worded("Drive at most 50 km/h.", score=0.05))
    on.tick(SIGN)
    on.ticks(10)
    assert on.spoken() == []


@FEW
@given(said=SAID)
def test_whatever_the_model_says_advice_is_parsed_or_nothing(said: str) -> None:
    on = drive(Worded(said))
    on.tick(SIGN)
    on.tracks = (actor(20.0),)
    on.ticks(6)
    for _, _, ticked in on.history:
        target = ticked.advisory.target_mps
        assert target is None or any(abs(target - each * KMH) < 0.01 for each in _limits_kmh())
        assert ticked.decision.brake_mps2 == 0.0 or ticked.decision.metrics.rss_viol_high_mu


@FEW
@given(said=SAID, score=st.floats(0.0, 1.0))
def test_the_arbiter_behind_it_brakes_for_no_road_user_that_is_not_there(said: str, score: float) -> None:
    on = drive(Worded(said, score=score))
    on.tick(SIGN)
    on.ticks(6)
    assert {ticked.decision.kind for _, _, ticked in on.history} <= {"SILENT", "SPEAK"}


def test_without_the_arbiter_a_made_up_hazard_is_spoken_and_braked_for_where_somebody_is_there_to_be_met() -> None:
    on = drive(Worded("A pedestrian is ahead in the path."))
    warned = on.tick(SIGN).request
    assert warned.fused.hazard == "pedestrian"
    alone = request(None, fused=warned.fused)
    verdict = decide(alone, mirror(alone, filter="none"), CALIBRATED)
    assert (verdict.decision.kind, verdict.command) == ("SPEAK", None)


@given(said=SAID)
@FEW
def test_a_logged_tick_is_decided_again(said: str) -> None:
    on = drive(Worded(said))
    on.tick(SIGN)
    before, seen, ticked = on.history[-1]
    trace = trace_of(ticked, seen, {}, ticked.advisory, whole=False)
    assert redecide(before, trace).differences == ()


def test_what_experts_alone_tell_of_is_asked_about_too() -> None:
    model = Worded("Slow down.")
    on = drive(model)
    on.weather = conditions(mu=0.3, factor=0.7, wet=True)
    on.ticks(3)
    asked = {call.arguments["query"] for call in model.prompts}
    assert "Is the grip of the road low?" in asked
    sentences = told(on.state)
    assert "The road is wet." in sentences
    assert "Grip and sight call for 70 % of the usual speed." in sentences


def test_it_takes_the_settings_of_the_direct_methods_and_no_others() -> None:
    with pytest.raises(ConfigError, match="method_settings of 'proposer'"):
        Drive(Worded(""), method=Method(name="proposer", settings={"pictures": True}))


def _limits_kmh() -> set[float]:
    return {float(each) for each in allowed_limits(None, "km/h")} | {
        each * 1.609344 for each in allowed_limits(None, "mph")
    }


def test_fused_advice_is_the_models_alone() -> None:
    ticked = drive(Worded("")).tick(SIGN)
    fused: Fused = ticked.fused
    assert (fused.target_mps, fused.directive, fused.reasons) == (None, "", ())
    outcome: Outcome = ticked.outcomes[-1]
    assert outcome.tool == "answer_prompt"
