"""Where the car tells no speed nothing is passed: no limit rises, no gantry goes dark, no border is crossed by it."""

from collections.abc import Sequence

from hypothesis import given, settings
from hypothesis import strategies as st

from proto.perception import ObjectClass
from proto.rules import PostedLimit
from proto.scene import Fact
from services.drivelm.front_end import FrontEnd
from services.drivelm.vocabulary.classes import LIGHTS, OTHER, SENTENCES
from services.orchestrator.observations.validity import Motion
from services.orchestrator.signs.limits import enters_a_slower_town, in_force
from services.orchestrator.signs.signs import update
from services.orchestrator.state import Believed, InForce, Signs
from tests.unit.services.drivelm.approach import NS, Scripted, box_at, says, sighting

READINGS = sorted(set(SENTENCES) - {OTHER, *LIGHTS})
STEP_NS = NS // 10


def _seen(reading: str, kind: ObjectClass = "sign") -> tuple[FrontEnd, list[Fact], int]:
    """A front end that believes what it reads 30 m ahead, what it said, and when."""
    end = FrontEnd(Scripted(lambda q, n: says(reading)), home="DEU")
    facts: list[Fact] = []
    for step in range(6):
        facts += end.see(sighting(NS + step * STEP_NS, box_at(30, 0.0, kind)))
    return end, facts, NS + 6 * STEP_NS


def _settled(end: FrontEnd, from_ns: int, speeds: Sequence[float | None]) -> list[Fact]:
    return [fact for step, speed in enumerate(speeds) for fact in end.settle(from_ns + step * STEP_NS, speed)]


def _in_force(kmh: float, scope: str) -> InForce:
    limit = PostedLimit(value=kmh, unit="km/h", scope=scope, confidence=0.99)  # type: ignore[arg-type]
    return InForce(posted=limit, since_ns=1, track_id=3)


def _least_kmh(signs: Signs) -> float:
    return min(each.kmh for each in in_force(signs))


@given(st.sampled_from(READINGS), st.sets(st.integers(0, 90)))
@settings(max_examples=60, deadline=None)
def test_a_car_that_stands_passes_nothing_at_whatever_instants_its_speed_is_unknown(
    reading: str, unknown: set[int]
) -> None:
    end, _, now_ns = _seen(reading)
    said = _settled(end, now_ns, [None if step in unknown else 0.0 for step in range(90)])
    assert not [fact.reading for fact in said if fact.passed]


@given(st.sampled_from(READINGS), st.sampled_from([(10.0, "zone"), (60.0, "permanent"), (60.0, "gantry")]))
@settings(max_examples=120, deadline=None)
def test_with_an_unknown_speed_no_reading_lifts_a_limit_or_changes_the_country(
    reading: str, held: tuple[float, str]
) -> None:
    signs = Signs(**{held[1]: _in_force(*held)}, road_type=Believed(value="rural", confidence=0.9, since_ns=1))  # type: ignore[arg-type]
    before = _least_kmh(signs)
    end, facts, now_ns = _seen(reading, "panel" if reading.startswith("led:") else "sign")
    facts += _settled(end, now_ns, [None] * 400)
    for step in range(400):
        slower_town = any(enters_a_slower_town(signs, sign) for sign in signs.ahead)
        signs = update(signs, tuple(facts), Motion(), now_ns + step * STEP_NS)
        facts = []
        assert slower_town or _least_kmh(signs) <= before
        if slower_town and not in_force(signs):
            break
    assert signs.road_type is not None
    assert signs.road_type.value in ("rural", "urban")
    assert signs.jurisdiction is None
    assert end.country_belief.believed in ("DEU", None), "the home setting may be given up, for no other country"
    assert end.road_type is None
