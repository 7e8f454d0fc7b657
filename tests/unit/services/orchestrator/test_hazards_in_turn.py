"""One hazard, or one that stands, silences no other: tick and arbiter together."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.decision import ArbitrationRequest, Decision
from proto.vehicle import Degradation
from services.arbiter.assessment.reading import Pedals, Reading
from services.arbiter.decide import Inputs, decide, request_view
from services.arbiter.state import fresh
from tests.unit.services.orchestrator.judge import PROFILE
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    FEW,
    Drive,
    Played,
    actor,
    fact,
    health,
    limit_sign,
    locally,
    replace,
)

RED_FROM = 16


def arbiter() -> Callable[[ArbitrationRequest], Decision]:
    """The real one, without a grant, with its memory; it sees what it is asked about."""
    state = fresh(PROFILE)

    def judge(request: ArbitrationRequest) -> Decision:
        nonlocal state
        pedals = Pedals(brake=0.0, accelerator=0.2, steering_rad=0.0)
        reading = Reading(view=request_view(request), pedals=pedals, tracks_age_s=0.05, ego_age_s=0.02)
        verdict = decide(request, Inputs(reading=reading, state=state, now_ns=request.stamp_ns), PROFILE)
        state = verdict.state
        return verdict.decision

    return judge


def said(drive: Drive, since: int, beginning: str) -> list[int]:
    """The ticks since then in which something was spoken that begins so."""
    spoken = ((at, ticked.advisory) for at, (_, _, ticked) in enumerate(drive.history[since:]))
    return [at for at, advisory in spoken if advisory.kind != "SILENT" and advisory.directive.startswith(beginning)]


@FEW
@given(st.sets(st.integers(1, 29)))
def test_a_lead_under_ever_new_track_ids_keeps_no_red_light_waiting(renumbered: set[int]) -> None:
    drive = Drive(Played(arbiter=arbiter()), speed_mps=13.0)
    drive.tick(limit_sign("limit:50"))
    drive.ticks(60)
    began, track_id = len(drive.history), 50
    for tick in range(30):
        track_id += tick in renumbered
        drive.tracks = (actor(30.0 - 0.6 * tick, closing_mps=6.0, track_id=track_id),)
        red = fact("light", "light:red", track_id=4, distance_m=45.0 - (tick - RED_FROM) * 1.3)
        drive.tick(*(red,) if tick >= RED_FROM else ())
    assert said(drive, began, "Brake: vehicle")
    assert said(drive, began, "Stop: red light")[0] <= RED_FROM + 1


@pytest.mark.parametrize("standing", [20, 37])
def test_a_fault_that_stands_keeps_a_first_notice_waiting_for_its_own_words_alone(standing: int) -> None:
    grave = health(0.9, warning_lamps=("oil",), safe_to_drive="stop_now", advice="Stop: oil pressure.")
    drive = Drive(Played({**EXPERTS, "vehicle_health": lambda a: grave}, arbiter=arbiter()), speed_mps=13.0)
    drive.tick(limit_sign("limit:50"))
    drive.ticks(60)
    drive.car = Degradation(h=0.6, brake_envelope=1.0, warning_lamps=("oil",))
    drive.ticks(standing)
    assert said(drive, 60, "Stop safely now")
    began = len(drive.history)
    drive.comes_to(22.0)
    drive.ticks(50)
    assert 28 <= said(drive, began, "Slow down: 50")[0] <= 33 + 20
    assert said(drive, began, "Stop safely now"), "and the fault is said again in its time"


def test_what_the_arbiter_told_by_itself_keeps_nothing_else_waiting() -> None:
    drive = Drive(Played(arbiter=arbiter()), speed_mps=13.0)
    warned = replace(locally(drive.ask.requests[-1]), kind="SPEAK", hazard="closing_lead")
    drive.ask.decide = lambda request: replace(warned, tick=request.tick)
    drive.tick()
    assert drive.spoken()[-1] == "Brake: vehicle ahead"
    drive.tracks = (actor(12.0, closing_mps=6.0),)
    drive.tick(fact("light", "light:red", track_id=4, distance_m=30.0))
    assert drive.history[-1][2].fused.hazard == "red_light"
