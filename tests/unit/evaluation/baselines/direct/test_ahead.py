"""The Direct methods with the reader of the front end: what is ahead is asked about before it is passed, people before cars."""

from typing import Any

import msgspec
import pytest

from evaluation.baselines.direct.answer_sources import Extractive
from evaluation.baselines.direct.context import MOST_CHARS, as_json, summary
from evaluation.baselines.direct.memory import recalled
from evaluation.baselines.direct.prompt_answer import PromptAnswer
from evaluation.baselines.direct.template import Asked, load
from evaluation.baselines.direct.whole_prompts import answered
from proto.observed import Observed
from proto.tools import Outcome
from proto.world import Environment, SeenSign, WorldState
from services.orchestrator.experts.routing import Call
from services.orchestrator.observations.inputs import Method
from services.orchestrator.tick import redecide, trace_of
from tests.unit.services.orchestrator.support import KMH, Drive, Played, actor, doubted, fact, limit_sign

TEMPLATE = load()


class Reader(Played):
    """Prompts go to the extractive reader."""

    def experts(self, calls: tuple[Call, ...]) -> tuple[Outcome, ...]:
        self.calls += calls
        return tuple(_read(call) for call in calls)


def _read(call: Call) -> Outcome:
    asked = Asked(call.arguments["context"], call.arguments["query"], tuple(call.arguments["passages"]))
    answer: PromptAnswer = answered(asked, TEMPLATE, Extractive("embedded"))
    return Outcome(tool=call.tool, status="ok", result=msgspec.to_builtins(answer), arguments=call.arguments)


def drive(speed_mps: float = 20.0, **fields: Any) -> Drive:
    return Drive(Reader(), speed_mps=speed_mps, method=Method(name="direct", **fields))


def ahead(reading: str = "limit:50", distance_m: float = 80.0, **fields: Any) -> Any:
    return limit_sign(reading, passed=False, **{"distance_m": distance_m, **fields})


def pause(on: Drive) -> None:
    """Long enough for the next advice to be spoken."""
    on.ticks(51)


def test_a_lower_limit_is_announced_before_its_sign_and_holds_from_it_on() -> None:
    on = drive()
    on.tick(limit_sign("limit:70", track_id=2))
    pause(on)
    told = on.tick(ahead(distance_m=40.0)).advisory
    assert (told.kind, told.topic, told.directive) == ("SPEAK", "ahead", "50 km/h ahead")
    assert told.ahead_mps == pytest.approx(50 * KMH)
    assert told.legal_limit is not None
    assert told.legal_limit.value == 70
    assert told.target_mps == pytest.approx(70 * KMH)
    assert on.ticks(10).advisory.legal_limit == told.legal_limit
    passed = on.tick(limit_sign("limit:50")).advisory
    assert passed.ahead_mps is None
    assert passed.legal_limit is not None
    assert passed.legal_limit.value == 50


def test_a_limit_so_soon_after_another_message_waits_for_its_turn() -> None:
    on = drive(speed_mps=12.0)
    on.tick(limit_sign("limit:70", track_id=2))
    told = [on.tick(ahead(distance_m=95.0)).advisory, *(on.tick().advisory for _ in range(60))]
    assert [each.directive for each in told if each.kind == "SPEAK"] == ["50 km/h ahead"]
    told = [on.tick(limit_sign("limit:50")).advisory, *(on.tick().advisory for _ in range(120))]
    spoken: list[Any] = [(each.directive, each.told_limit_mps) for each in told if each.kind == "SPEAK"]
    assert spoken == [("Limit 50 km/h", pytest.approx(50 * KMH))]


def test_what_waited_until_its_sign_was_passed_is_not_announced_any_more() -> None:
    on = drive()
    on.tick(limit_sign("limit:70", track_id=2))
    told = [on.tick(ahead(distance_m=20.0)).advisory, *(on.tick().advisory for _ in range(60))]
    assert [each.directive for each in told if each.kind == "SPEAK"] == []


def test_before_any_limit_is_told_the_speed_says_whether_one_ahead_is_lower() -> None:
    assert drive(speed_mps=20.0).tick(ahead()).advisory.ahead_mps == pytest.approx(50 * KMH)
    assert drive(speed_mps=10.0).tick(ahead()).advisory.kind == "SILENT"


def test_a_limit_ahead_that_is_higher_is_not_told_before_its_sign() -> None:
    on = drive(speed_mps=13.0)
    on.tick(limit_sign("limit:50", track_id=2))
    pause(on)
    assert on.tick(ahead("limit:70")).advisory.kind == "SILENT"
    assert on.tick(limit_sign("limit:70")).advisory.directive == "Limit 70 km/h"


def test_each_sign_ahead_is_asked_about_once_whatever_is_doubted_of_it_for_a_moment() -> None:
    on = drive()
    on.tick(ahead())
    on.tick(doubted("limit:50", ("limit:60", 0.4), track_id=3, distance_m=70.0))
    on.tick(ahead(distance_m=60.0))
    queries = [call.arguments["query"] for call in on.ask.calls]
    assert queries.count("Which speed limit begins ahead?") == 1
    on.tick(ahead("limit:30", track_id=4))
    assert [call.arguments["query"] for call in on.ask.calls][len(queries) :] == ["Which speed limit begins ahead?"]


def test_of_several_limits_ahead_the_lowest_is_told() -> None:
    on = drive(speed_mps=30.0)
    told = on.tick(ahead("limit:80", 30.0), ahead("limit:60", 90.0, track_id=4)).advisory
    assert told.directive == "60 km/h ahead"


@pytest.mark.parametrize("reading", ["limit_end", "priority_road"])
def test_signs_that_set_no_limit_and_stop_nobody_are_not_asked_about(reading: str) -> None:
    on = drive()
    scope = "end" if reading == "limit_end" else "permanent"
    on.tick(fact("limit" if scope == "end" else "sign", reading, track_id=3, distance_m=80.0, scope=scope))
    assert on.ask.calls == []


@pytest.mark.parametrize("fields", [{"lane_id": "offset:1"}, {"plates": ("plate:lorries",)}])
def test_a_limit_of_another_lane_or_of_lorries_is_no_limit_ahead(fields: dict[str, Any]) -> None:
    on = drive()
    on.tick(ahead(**fields))
    assert on.ask.calls == []
    assert "50 km/h" not in summary(on.state)


@pytest.mark.parametrize(("reading", "topic"), [("stop", "stop"), ("yield", "give_way")])
def test_a_stop_or_give_way_sign_ahead_is_told_when_it_is_believed(reading: str, topic: str) -> None:
    on = drive(speed_mps=8.0)
    told = on.tick(fact("sign", reading, track_id=3, distance_m=90.0)).advisory
    assert (told.kind, told.topic) == ("SPEAK", topic)
    on.ticks(5)
    assert len(on.ask.calls) == 1


def test_what_was_asked_about_replays_bit_for_bit_and_is_forgotten_behind_the_sign() -> None:
    on = drive()
    on.tick(ahead(distance_m=4.0))
    assert recalled(on.state).asked != ()
    on.ticks(3)
    assert recalled(on.state).asked == ()
    for before, seen, ticked in on.history:
        again = redecide(before, trace_of(ticked, seen, {}, ticked.advisory, whole=True))
        assert again.differences == ()


def person(gap_m: float) -> Any:
    return actor(gap_m=gap_m, track_id=7, kind="pedestrian", closing_mps=12.0)


def test_a_person_nearer_than_a_vehicle_is_told() -> None:
    on = drive(speed_mps=12.0)
    on.tracks, on.lead = (actor(gap_m=40.0, closing_mps=1.0), person(25.0)), 5
    told = [on.tick().advisory for _ in range(8)]
    assert [each.hazard for each in told if each.kind == "SPEAK"][:1] == ["pedestrian"]
    heard = [each for _, _, ticked in on.history if (each := recalled(ticked.state).heard)]
    assert heard[0].kind == "vulnerable_road_user"


def test_a_vehicle_that_is_closed_in_on_is_told_right_after_a_person_farther_off() -> None:
    on = drive(speed_mps=12.0)
    on.tracks, on.lead = (actor(gap_m=12.0, closing_mps=8.0), person(60.0)), 5
    told = [on.tick().advisory for _ in range(3)]
    assert [each.hazard for each in told if each.kind == "SPEAK"] == ["pedestrian", "closing_lead"]
    assert len(on.ask.calls) == 2
    heard = [each for _, _, ticked in on.history if (each := recalled(ticked.state).heard)]
    assert [each.kind for each in heard] == ["vulnerable_road_user", "closing_lead"]


def test_a_limit_that_came_into_force_while_a_car_was_asked_about_is_asked_about_next() -> None:
    on = drive(speed_mps=20.0)
    on.tracks, on.lead = (actor(gap_m=12.0, closing_mps=8.0),), 5
    on.tick(limit_sign("limit:50"))
    assert on.tick().advisory.target_mps == pytest.approx(50 * KMH)


def test_road_users_are_listed_nearest_first() -> None:
    on = drive(speed_mps=12.0)
    on.tracks, on.lead = (actor(gap_m=40.0, closing_mps=1.0), person(25.0)), 5
    on.tick()
    said = summary(on.state)
    assert said.index("A pedestrian is 25 m ahead") < said.index("A vehicle is 40 m ahead")
    on.tracks = (actor(gap_m=20.0, closing_mps=8.0, kind="cyclist"),)
    on.tick()
    assert summary(on.state).count("A cyclist is") == 1


def observed(value: Any) -> Any:
    return Observed(value=value, confidence=1.0, source="perception", stamp_ns=0, valid_for_ns=1)


@pytest.mark.parametrize(("actors", "signs"), [(0, 0), (3, 2), (80, 2), (0, 60), (80, 60)])
def test_the_json_context_is_whole_however_much_is_seen_and_keeps_what_is_near(actors: int, signs: int) -> None:
    crowd = tuple(actor(gap_m=5.0 + each, track_id=each) for each in reversed(range(actors)))
    posts = tuple(
        observed(SeenSign(reading="stop", track_id=each, distance_m=float(each), text="x" * 100))
        for each in range(signs)
    )
    world = WorldState(stamp_ns=1, tick=1, actors=observed(crowd), environment=Environment(signs=posts))
    text = as_json(world)
    told = msgspec.json.decode(text, type=WorldState)
    assert len(text) <= MOST_CHARS
    kept = told.actors.value if told.actors is not None else ()
    assert kept == crowd[len(crowd) - len(kept) :], "the nearest, in their order"
    assert (len(kept), len(told.environment.signs)) == (actors, signs) or len(text) > MOST_CHARS - 600
