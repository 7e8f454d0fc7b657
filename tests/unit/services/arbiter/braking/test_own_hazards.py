"""A road user whom the arbiter alone sees: warned of once it is confirmed."""

import msgspec
import pytest

from proto.perception import Track
from services.arbiter.assessment.assess import View
from services.arbiter.assessment.reading import Reading
from services.arbiter.braking.own_hazards import seen_hazards
from services.arbiter.decide import Inputs, decide
from services.arbiter.state import fresh
from tests.unit.services.arbiter.support import CALIBRATED, HANDS_OFF, fused, request, track

TICK = 100_000_000


def pictures(person: Track, count: int) -> list[str]:
    """The hazards that are spoken while the arbiter alone sees a person come nearer, picture by picture."""
    state, spoken = fresh(CALIBRATED), []
    for number in range(count):
        now_ns = (10 + number) * TICK
        seen = msgspec.structs.replace(
            person, x_m=person.x_m + person.vx_mps * 0.1 * number, age_s=person.age_s + 0.1 * number
        )
        view = View(ego_speed_mps=12.0, ego_acceleration_mps2=0.0, actors=(seen,), mu_low=0.7, mu_high=0.8, h=0.0)
        reading = Reading(view=view, pedals=HANDS_OFF, tracks_age_s=0.0, ego_age_s=0.0)
        asked = request(None, tick=number, stamp_ns=now_ns, fused=fused(new_information=False), ego_speed_mps=12.0)
        verdict = decide(asked, Inputs(reading=reading, state=state, now_ns=now_ns), CALIBRATED)
        state = verdict.state
        spoken.append(verdict.decision.hazard)
    return spoken


def person(**fields: float) -> Track:
    return track(**{"gap_m": 25.0, "closing_mps": 12.0, "length_m": 0.5, **fields}, kind="pedestrian")


def test_a_new_and_doubted_person_is_warned_of_at_the_third_picture() -> None:
    assert pictures(person(confidence=0.6, age_s=0.3), 3) == ["", "", "pedestrian"]


def test_a_known_walker_beside_the_path_is_no_hazard_for_one_picture_that_shows_a_step_into_it() -> None:
    assert pictures(person(confidence=0.6, age_s=5.0), 3) == ["", "", "pedestrian"]


@pytest.mark.parametrize(
    "surely", [{"confidence": 0.7, "age_s": 0.3}, {"confidence": 0.6, "age_s": 1.0, "gap_m": 20.0}]
)
def test_a_person_who_is_certain_or_known_and_met_within_two_seconds_is_warned_of_at_once(
    surely: dict[str, float],
) -> None:
    assert pictures(person(**surely), 1) == ["pedestrian"]


@pytest.mark.parametrize(("ego_mps", "gap_m"), [(4.0, 5.9), (12.0, 26.0)])
@pytest.mark.parametrize("oncoming", [False, True])
def test_a_vehicle_that_the_ego_passes_hides_none_that_is_in_the_way(
    ego_mps: float, gap_m: float, oncoming: bool
) -> None:
    beside = track(2.5, ego_mps + 6.0 * oncoming, y_m=-2.0, clearance_m=0.2, oncoming=oncoming, track_id=8)
    standing = track(gap_m, ego_mps, clearance_m=-1.0, age_s=1.5, steady_s=1.5)

    def told(*tracks: Track) -> tuple[str, ...]:
        view = View(ego_speed_mps=ego_mps, ego_acceleration_mps2=0.0, actors=tracks, mu_low=0.7, mu_high=0.8, h=0.0)
        return seen_hazards((view,), (), CALIBRATED)

    assert told(standing) == ("closing_lead",)
    assert told(beside) == ()
    assert told(beside, standing) == ("closing_lead",)
