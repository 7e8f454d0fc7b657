"""What was said stands in one memory, whether the arbiter answers or not."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.decision import ArbitrationRequest, Decision
from proto.speech import Memory, Warned
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.support import FEW, Drive, Played, actor, limit_sign, replace

answers = st.lists(st.booleans(), min_size=20, max_size=60)
"""Whether the arbiter answers, tick by tick."""


def failing(answered: list[bool]) -> Played:
    """The real arbiter, which answers in some ticks alone; its memory is its own."""
    judge, left = arbiter(), iter(answered)

    def decide(request: ArbitrationRequest) -> Decision | None:
        return judge(request) if next(left, True) else None

    return Played(arbiter=decide)


@FEW
@given(answers)
def test_a_limit_is_told_once_however_often_the_arbiter_is_away(answered: list[bool]) -> None:
    drive = Drive(failing(answered), speed_mps=9.5)
    drive.ticks(3)
    drive.tick(limit_sign("limit:30"))
    drive.ticks(80)
    assert drive.spoken().count("Limit 30") == 1


@FEW
@given(answers)
def test_the_arbiter_hears_what_was_said_without_it(answered: list[bool]) -> None:
    drive = Drive(failing(answered))
    drive.tick(limit_sign("limit:50"))
    drive.ticks(len(answered))
    for (_, _, before), (_, _, ticked) in zip(drive.history, drive.history[1:], strict=False):
        told = before.decision.memory is None
        assert (ticked.request.heard is not None) is told
        if told:
            assert ticked.request.heard == before.state.memory
        if ticked.decision.memory is not None:
            assert ticked.state.memory == ticked.decision.memory


FAR_NS = 9 * 10**18


@pytest.mark.parametrize("away", [True, False])
def test_a_memory_stamped_in_the_future_silences_no_hazard(away: bool) -> None:
    absurd = Memory(
        spoken_ns=FAR_NS, urgency="alarm", hazards=(Warned(hazard="closing_lead", stamp_ns=FAR_NS, alarm=True),)
    )
    judge = arbiter()
    drive = Drive(Played(arbiter=lambda request: replace(judge(request), memory=absurd)))
    drive.ticks(60)
    drive.ask.decide = (lambda request: None) if away else judge
    drive.state = replace(drive.state, unheard=True, memory=drive.state.memory if away else absurd)
    drive.tracks = (actor(8.0, closing_mps=8.0),)
    drive.ticks(10)
    assert "Brake! Vehicle" in drive.spoken()


def test_a_memory_of_another_form_is_no_decision() -> None:
    with pytest.raises(msgspec.ValidationError):
        msgspec.convert({"urgency": "urgent"}, Memory)
