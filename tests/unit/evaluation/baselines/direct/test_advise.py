"""The Direct methods: a prompt per event, its parsed answer as advice; never an act."""

from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.baselines.direct.memory import recalled
from evaluation.baselines.direct.prompt_answer import PromptAnswer
from proto.decision import ArbitrationRequest, Decision
from proto.tools import Outcome
from services.orchestrator.experts.routing import Call
from services.orchestrator.observations.inputs import Method
from services.orchestrator.tick import redecide, trace_of
from tests.unit.services.orchestrator.support import Drive, Played, actor, limit_sign

LIMIT = PromptAnswer(
    text="The traffic sign is a speed limit sign of 50 km/h.", score=0.4, method="extractive", backend="embedded",
    prompt_sha256="", action="limit", value=50.0, unit="km/h",
)  # fmt: skip


class Reader(Played):
    """Answers prompts with what it is given, and must never be asked for a decision."""

    def __init__(self, *answers: PromptAnswer) -> None:
        super().__init__()
        self.answers = list(answers)

    def experts(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        self.calls += calls
        return tuple(self._answer(call) for call in calls)

    def _answer(self, call: Call) -> Outcome:
        if call.tool == "retrieve":
            passage = {
                "passage_id": "p", "document": "d", "start": 0, "end": 1, "excerpt": "In towns 50.", "section": "1",
                "kind": "statute", "score": 1.0, "bm25": 1.0, "cosine": None, "rulepack_version": "v",
            }  # fmt: skip
            result: dict[str, object] = {"passages": [passage], "encoder": "none", "lambda_": 0.0}
            return Outcome(tool="retrieve", status="ok", result=result, arguments=call.arguments, elapsed_ms=6.0)
        answer = self.answers.pop(0) if self.answers else msgspec.structs.replace(LIMIT, text="", action="none")
        return Outcome(
            tool=call.tool, status="ok", result=msgspec.to_builtins(answer), arguments=call.arguments,
            elapsed_ms=4.0,
        )  # fmt: skip

    def arbiter(self, request: ArbitrationRequest) -> Decision | None:
        raise AssertionError("the Direct methods do not ask the arbiter")


def drive(reader: Reader, **fields: Any) -> Drive:
    return Drive(reader, method=Method(name="direct", settings=fields))


SIGN = limit_sign("limit:50")


def test_a_new_limit_is_asked_about_once_and_told_as_advice() -> None:
    reader = Reader(LIMIT)
    on = drive(reader)
    first = on.tick(SIGN).advisory
    assert [call.tool for call in reader.calls] == ["answer_prompt"]
    assert "speed limit sign of 50 km/h" in reader.calls[0].arguments["context"]
    assert (first.kind, first.directive) == ("SPEAK", "Limit 50 km/h")
    assert first.target_mps == pytest.approx(50 / 3.6)
    assert first.justification == LIMIT.text
    last = on.ticks(5).advisory
    assert on.spoken() == ["Limit 50 km/h"]
    assert (last.kind, last.legal_limit) == ("SILENT", first.legal_limit)
    assert len(reader.calls) == 1


def test_what_cannot_be_parsed_advises_nothing() -> None:
    on = drive(Reader())
    assert on.tick(SIGN).advisory.target_mps is None
    assert on.spoken() == []


def test_passages_stand_in_the_prompt_of_the_method_with_retrieval() -> None:
    reader = Reader(LIMIT)
    drive(reader, passages=3).tick(SIGN)
    retrieve, prompt = reader.calls
    assert (retrieve.tool, retrieve.arguments["k"]) == ("retrieve", 3)
    assert prompt.arguments["passages"] == ["In towns 50."]


def test_the_context_can_be_json_without_what_only_experts_know() -> None:
    reader = Reader(LIMIT)
    drive(reader, context="json").tick(SIGN)
    world = msgspec.json.decode(reader.calls[0].arguments["context"])
    assert world["environment"]["posted_limit"]["value"]["value"] == 50
    assert world["environment"]["conditions"] is None
    assert world["ego"]["degradation_h"] is None


def test_an_answer_that_takes_its_time_is_told_when_it_is_there() -> None:
    on = drive(Reader(msgspec.structs.replace(LIMIT, took_ms=250.0)))
    kinds = [on.tick(*facts).decision.kind for facts in ((SIGN,), (), (), (), ())]
    assert kinds == ["SILENT", "SILENT", "SILENT", "SPEAK", "SILENT"], "asked in the first, there 246 ms later"
    assert [heard.latency_ms for _, _, t in on.history if (heard := recalled(t.state).heard)] == [250.0]


def test_a_car_that_is_closed_in_on_is_asked_about_and_warned_of() -> None:
    near = PromptAnswer(text="A vehicle is 12 m ahead in the path and comes nearer.", score=0.5, method="", backend="",
                        prompt_sha256="", action="hazard", hazard="closing_lead")  # fmt: skip
    reader = Reader(near)
    on = drive(reader)
    on.tracks, on.lead = (actor(gap_m=12.0, closing_mps=8.0),), 5
    advisory = on.tick().advisory
    assert near.text in reader.calls[0].arguments["context"]
    assert (advisory.kind, advisory.hazard, advisory.urgency) == ("SPEAK", "closing_lead", "warning")


@given(
    action=st.sampled_from(["stop", "hazard", "give_way", "limit", "slow", "none"]),
    value=st.none() | st.floats(0, 1e6),
    hazard=st.sampled_from(["", "closing_lead", "pedestrian", "meteor"]),
    text=st.text(max_size=50),
)
def test_it_never_acts_and_replays_bit_for_bit(action: Any, value: float | None, hazard: str, text: str) -> None:
    on = drive(Reader(msgspec.structs.replace(LIMIT, action=action, value=value, hazard=hazard, text=text)))
    on.tracks, on.lead = (actor(gap_m=12.0, closing_mps=8.0),), 5
    on.tick(SIGN)
    for before, seen, ticked in on.history:
        assert ticked.decision.kind in ("SILENT", "SPEAK")
        again = redecide(before, trace_of(ticked, seen, {}, ticked.advisory, whole=True))
        assert again.differences == ()


def test_the_silent_method_observes_and_asks_but_tells_and_brakes_nothing() -> None:
    ask = Played(arbiter=lambda request: pytest.fail("the arbiter is asked"))
    on = Drive(ask, method=Method(name="silent"))
    on.tracks, on.lead = (actor(gap_m=6.0, closing_mps=9.0),), 5
    last = on.ticks(3)
    assert ask.calls
    assert last.fused.hazard == "closing_lead"
    assert on.spoken() == []
