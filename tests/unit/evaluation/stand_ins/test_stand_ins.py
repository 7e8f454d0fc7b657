"""What truth and a sound car are published as, through the services of production."""

from collections.abc import Callable
from typing import Any

import msgspec

from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import bus
from evaluation.stand_ins.facts import ENDS, TrueFacts
from evaluation.stand_ins.hosted import SOUND, stood_in
from evaluation.stand_ins.tracks import TrueTracks
from proto import topics
from proto.perception import Tracks
from proto.scene import Facts
from proto.truth import TrueActor, Truth
from proto.vehicle import Degradation

STEP_NS = 50_000_000
LEAD = TrueActor(
    actor_id=4, kind="vehicle", x_m=30.0, y_m=0.0, vx_mps=-5.0, vy_mps=0.0, length_m=4.5, width_m=1.8, in_ego_path=True
)
WALKER = TrueActor(
    actor_id=9, kind="pedestrian", x_m=20.0, y_m=-4.0, vx_mps=-10.0, vy_mps=1.0, length_m=0.5, width_m=0.5
)
TRUTH = Truth(
    time_s=0.0, distance_m=0.0, speed_mps=10.0, acceleration_mps2=0.0, law_limit_mps=50 / 3.6, jurisdiction="DEU", mu=0.8,
    gap_m=None, closing_mps=None, actors=(LEAD, WALKER),
    signs=(
        {"id": 1.0, "code": "limit:80+plate:when_wet:de", "country": "DEU", "x_m": 40.0, "y_m": -4.0, "faces_ego": 1.0},
        {"id": 2.0, "code": "limit:30", "country": "DEU", "x_m": 25.0, "y_m": 5.0, "faces_ego": 0.0},
    ),
)  # fmt: skip


def test_tracks_are_the_true_actors_at_the_pictures_stamp() -> None:
    true = TrueTracks()
    empty = Tracks(camera="front", frame=3, tracks=())
    assert true.instead(empty, 0) is None
    true.truth(TRUTH, 0)
    seen = true.instead(empty, 100_000_000)
    assert seen is not None
    lead, walker = seen.tracks
    assert (lead.x_m, lead.vx_mps, lead.confidence, seen.lead_track_id) == (29.5, -5.0, 1.0, lead.track_id)
    assert (walker.kind, walker.in_ego_path, seen.frame) == ("pedestrian", False, 3)


def test_who_will_cross_is_in_the_path_as_soon_as_perception_would_say_so() -> None:
    def told(y_m: float, vy_mps: float) -> bool:
        car = msgspec.structs.replace(LEAD, y_m=y_m, vx_mps=-10.0, vy_mps=vy_mps, in_ego_path=False)
        true = TrueTracks()
        true.truth(msgspec.structs.replace(TRUTH, actors=(car,)), 0)
        seen = true.instead(Tracks(camera="front", frame=3, tracks=()), 0)
        assert seen is not None
        return seen.tracks[0].in_ego_path

    assert told(18.0, -6.0), "there in 2.7 s"
    assert not told(18.0, -3.0)
    assert not told(18.0, 6.0), "it is through"


def test_the_limit_in_force_is_told_once_when_it_changes_and_signs_of_others_never() -> None:
    true = TrueFacts()
    first = true.truth(TRUTH, 0)
    assert first is not None
    passed = [fact.reading for fact in first.facts if fact.passed]
    assert passed == ["limit:50"]
    ahead = [(fact.reading, fact.scope, fact.distance_m) for fact in first.facts if fact.distance_m is not None]
    assert ahead == [("limit:80", "when_wet", 40.0)]
    later = true.truth(TRUTH, 10 * STEP_NS)
    assert later is not None
    assert not any(fact.passed for fact in later.facts)
    abroad = true.truth(msgspec.structs.replace(TRUTH, jurisdiction="GBR", law_limit_mps=60 * 0.44704), 11 * STEP_NS)
    assert abroad is not None
    limit = next(fact for fact in abroad.facts if fact.reading == "limit:60")
    assert (limit.unit, limit.passed) == ("mph", True)
    lower = true.truth(msgspec.structs.replace(TRUTH, jurisdiction="GBR", law_limit_mps=30 * 0.44704), 12 * STEP_NS)
    assert lower is not None
    assert [fact.reading for fact in lower.facts if fact.passed] == ["limit:30"], "nothing has to end for it"


def test_where_the_law_sets_no_limit_the_former_one_ends() -> None:
    true = TrueFacts()
    true.truth(TRUTH, 0)
    free = true.truth(msgspec.structs.replace(TRUTH, law_limit_mps=None, signs=()), STEP_NS)
    assert free is not None
    assert [fact.reading for fact in free.facts if fact.passed] == list(ENDS)


def _publisher(name: str, publish: Callable[[Node], Any]) -> Service[Any]:
    def build(config: ServiceConfig, node: Node) -> None:
        node.every(0.02, lambda: publish(node))

    return Service(name, ServiceConfig, build)


def test_only_the_service_that_is_stood_in_for_is_replaced_on_the_bus() -> None:
    ill = Degradation(h=0.7, brake_envelope=0.4)
    can = _publisher("can", lambda node: node.publish(topics.DEGRADATION, ill))
    with bus() as b:
        told = b.collect(topics.DEGRADATION)
        b.start(stood_in(can, ("sound_car",)))
        assert told.wait_count(1)[0] == SOUND
    assert stood_in(can, ("truth",)) is can


def test_the_front_end_says_the_truth_and_nothing_of_its_own() -> None:
    own = Facts(facts=(), backend="embedded")
    drivelm = _publisher("drivelm", lambda node: node.publish(topics.FACTS, own))
    with bus() as b:
        told = b.collect(topics.FACTS)
        b.start(stood_in(drivelm, ("truth",)))
        simulator = b.node("simulator")
        for _ in range(50):
            simulator.publish(topics.TRUTH, TRUTH)
            if told.messages:
                break
            simulator.publish(topics.TRUTH, msgspec.structs.replace(TRUTH, law_limit_mps=30 / 3.6))
        facts = told.wait_count(1)[0]
        assert facts.backend == "truth"
        assert {fact.kind for fact in facts.facts} >= {"jurisdiction", "units", "limit"}
