"""A vehicle that changes from the next lane into ours, by tracker and lead alone: how soon it leads."""

import math
from collections.abc import Iterator

import numpy as np
import pytest

from proto.sensors import LanePath, MapView
from services.perception.lanes.lead_vehicle import EGO_WIDTH_M, MARGIN_M, lead_of, place
from services.perception.lanes.model import lane_model
from services.perception.range.sizes import CAR
from services.perception.track.kalman import Fix
from services.perception.track.road_user import EgoState, Sighting
from services.perception.track.tracker import Tracker

STEP_S, LANE_M = 0.1, 3.5
STRIP_M = (EGO_WIDTH_M + CAR.width_m) / 2 + MARGIN_M
"""Between the middles of ego and car where the car's body enters the strip that the ego needs."""
ROAD = MapView(
    segment_id="s",
    lanes=tuple(
        LanePath(lane_id=name, points=((-10.0, y), (150.0, y)), width_m=LANE_M, is_ego=y == 0.0)
        for name, y in (("ego", 0.0), ("next", LANE_M))
    ),
)


def lateral_m(at_s: float, lasts_s: float) -> float:
    """A lane change that begins at 2 s, along a cosine."""
    share = min(max((at_s - 2.0) / lasts_s, 0.0), 1.0)
    return LANE_M * (1 + math.cos(math.pi * share)) / 2


def sightings(at_s: float, gap_m: float, lasts_s: float, chance: np.random.Generator) -> list[Sighting]:
    """The car that cuts in, and one that has led all along, 30 m before it."""
    noise = chance.normal(0, (0.15, 0.15), (2, 2))
    places = np.array([(gap_m, lateral_m(at_s, lasts_s)), (gap_m + 30.0, 0.0)]) + noise
    return [Sighting(kind="vehicle", fix=Fix(xy, np.diag([0.2**2, 0.25**2])), score=0.6, body=CAR) for xy in places]


def drive(gap_m: float, lasts_s: float, seed: int) -> Iterator[tuple[float, int | None, list[int]]]:
    """Time, who leads, and whose the sightings are."""
    tracker, model, chance = Tracker(), lane_model(ROAD), np.random.default_rng(seed)
    for k in range(1, 60):
        at_s = k * STEP_S
        seen = sightings(at_s, gap_m, lasts_s, chance)
        owners = tracker.step(round(at_s * 1e9), seen, EgoState(25.0, 0.0))
        yield at_s, lead_of([place(track, model) for track in tracker.published()]), owners


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("lasts_s", [1.5, 2.5, 4.0])
@pytest.mark.parametrize("gap_m", [8.0, 20.0, 40.0])
def test_who_cuts_in_leads_within_three_tenths_of_a_second_and_keeps_its_id(
    gap_m: float, lasts_s: float, seed: int
) -> None:
    looks = list(drive(gap_m, lasts_s, seed))
    enters_s = next(at_s for at_s, *_ in looks if lateral_m(at_s, lasts_s) <= STRIP_M)
    leads_s = next(at_s for at_s, lead, owners in looks if at_s > 1.0 and lead == owners[0])
    assert leads_s <= enters_s + 0.3
    assert len({tuple(owners) for *_, owners in looks}) == 1


def test_before_the_change_begins_the_one_ahead_leads() -> None:
    before = [(lead, owners) for at_s, lead, owners in drive(20.0, 2.5, 0) if 1.0 < at_s < 2.0]
    assert all(lead == owners[1] for lead, owners in before)
