"""The event table: each kind is raised by what it is about, above its threshold only."""

from collections.abc import Callable

import pytest

from proto.sensors import StopLine
from proto.vehicle import Degradation
from services.orchestrator.events import ETA, MOVED, TABLE, out_of_bounds
from tests.unit.services.orchestrator.support import TICK, Drive, actor, conditions, doubted, fact, limit_sign


def kinds(drive: Drive) -> set[str]:
    return {event.kind for event in drive.history[-1][2].events}


KINDS = (
    "foreign_sign", "jurisdiction_change", "dynamic_limit_update", "speed_limit_change", "uncertain_sign",
    "stop_required", "low_friction", "vehicle_fault", "closing_lead", "vulnerable_road_user", "overspeed",
    "stale_fact", "driver_query", "place_ahead",
)  # fmt: skip
"""Those of the design, and `place_ahead`."""


def test_the_table_holds_every_kind_once() -> None:
    assert sorted(row.kind for row in TABLE) == sorted(KINDS)


def _foreign(d: Drive) -> None:
    d.tick(limit_sign("limit:30", passed=False, plates=("plate:when_wet:de",), scope="when_wet"))


def _border(d: Drive) -> None:
    d.tick(fact("jurisdiction", "GBR"))


def _gantry(d: Drive) -> None:
    d.tick(limit_sign("led:60"))


def _limit(d: Drive) -> None:
    d.tick(limit_sign("limit:30"))


def _unsure(d: Drive) -> None:
    d.tick(doubted("limit:60", ("limit:80", 0.4)))


def _town(d: Drive) -> None:
    d.tick(fact("sign", "town_entry", track_id=8, distance_m=50.0))


def _stop(d: Drive) -> None:
    d.lines = (StopLine(distance_m=30.0, kind="light"),)
    d.tick(fact("light", "light:red", track_id=4, distance_m=30.0))


def _slippery(d: Drive) -> None:
    d.weather = conditions(mu=0.35, factor=0.7)
    d.tick()


def _fault(d: Drive) -> None:
    d.car = Degradation(h=0.3, brake_envelope=0.8, dtcs=("C0035",))
    d.tick()


def _closing(d: Drive) -> None:
    d.tracks, d.lead = (actor(20.0, 8.0),), 5
    d.tick()


def _person(d: Drive) -> None:
    d.tracks = (actor(30.0, 12.0, kind="pedestrian"),)
    d.tick()


def _fast(d: Drive) -> None:
    d.comes_to(17.0)
    d.tick()


def _stale(d: Drive) -> None:
    d.weather = None
    d.ticks(60)


def _query(d: Drive) -> None:
    d.tick(query="Why?")


CAUSES: dict[str, Callable[[Drive], None]] = {
    "foreign_sign": _foreign, "jurisdiction_change": _border, "dynamic_limit_update": _gantry,
    "speed_limit_change": _limit, "uncertain_sign": _unsure, "stop_required": _stop, "low_friction": _slippery,
    "vehicle_fault": _fault, "closing_lead": _closing, "vulnerable_road_user": _person, "overspeed": _fast,
    "stale_fact": _stale, "driver_query": _query, "place_ahead": _town,
}  # fmt: skip


@pytest.mark.parametrize("kind", list(CAUSES))
def test_each_kind_is_raised_by_its_cause_and_not_before(kind: str) -> None:
    drive = Drive()
    drive.ticks(3)
    assert kind not in kinds(drive)
    count = len(drive.history)
    CAUSES[kind](drive)
    assert any(event.kind == kind for _, _, ticked in drive.history[count:] for event in ticked.events)


def test_an_event_keeps_its_beginning_while_it_lasts() -> None:
    drive = Drive()
    drive.ticks(2)
    _closing(drive)
    began = drive.now_ns
    for tick in range(1, 6):
        drive.tracks = (actor(20.0 - 0.8 * tick, 8.0),)
        drive.tick()
    event = next(e for e in drive.history[-1][2].events if e.kind == "closing_lead")
    assert event.since_ns == began
    drive.tracks = ()
    drive.ticks(15)
    _closing(drive)
    assert next(e for e in drive.history[-1][2].events if e.kind == "closing_lead").since_ns == drive.now_ns
    assert drive.now_ns - began > 15 * TICK


def test_a_lead_that_does_not_come_nearer_though_it_claims_to_is_none() -> None:
    drive = Drive()
    drive.ticks(2)
    _closing(drive)
    drive.ticks(5)
    assert "closing_lead" not in {event.kind for event in drive.history[-1][2].events}


@pytest.mark.parametrize(
    ("confidence", "raised"), [(0.5, [False, False, True]), (0.69, [False, False, True]), (0.7, [True] * 3)]
)
def test_a_doubted_person_is_an_event_once_it_is_seen_in_three_ticks(confidence: float, raised: list[bool]) -> None:
    drive = Drive()
    drive.ticks(2)
    found = []
    for tick in range(3):
        drive.tracks = (actor(30.0 - 1.2 * tick, 12.0, kind="pedestrian", confidence=confidence),)
        drive.tick()
        found.append("vulnerable_road_user" in kinds(drive))
    assert found == raised


@pytest.mark.parametrize(("age_s", "raised"), [(0.4, False), (0.99, False), (1.0, True)])
def test_a_doubted_vehicle_is_an_event_once_it_is_known(age_s: float, *, raised: bool) -> None:
    drive = Drive()
    drive.ticks(2)
    drive.tracks, drive.lead = (actor(20.0, 8.0, confidence=0.6, age_s=age_s),), 5
    drive.tick()
    assert ("closing_lead" in kinds(drive)) is raised


def test_an_unknown_speed_raises_no_overspeed() -> None:
    drive = Drive()
    drive.comes_to(None)
    drive.ticks(3)
    assert "overspeed" not in kinds(drive)
    assert drive.history[-1][2].world.ego.speed_mps is None


def test_another_threshold_raises_an_event_sooner_or_later_and_stands_in_it() -> None:
    drive = Drive()
    drive.ticks(2)
    drive.comes_to(14.4)  # 3.7 % above 50 km/h; the table's threshold is 5 %
    drive.tick()
    assert "overspeed" not in kinds(drive)
    drive.tick(thresholds={"overspeed": 0.03})
    assert next(e for e in drive.history[-1][2].events if e.kind == "overspeed").eta == 0.03
    drive.comes_to(15.0)
    drive.tick(thresholds={"overspeed": 0.075})
    assert kinds(drive) >= {"overspeed"}


@pytest.mark.parametrize("kind", sorted(ETA))
def test_a_threshold_moves_by_half_of_the_tables_at_most(kind: str) -> None:
    assert [out_of_bounds({kind: ETA[kind] * share}) for share in (*MOVED, 1.0)] == ["", "", ""]
    assert kind in out_of_bounds({kind: ETA[kind] * 1.6})
    assert kind in out_of_bounds({kind: ETA[kind] * 0.4})
    assert kind in out_of_bounds({kind: float("nan")})
    assert "no event" in out_of_bounds({kind + "_": ETA[kind]})


@pytest.mark.parametrize(
    ("speed_mps", "sigma_mps", "raised"), [(12.0, 0.3, True), (0.1, 0.3, False), (12.0, 2.5, False), (None, 0.3, True)]
)
def test_closing_lead_takes_a_car_that_moves_and_a_speed_that_is_sure(
    speed_mps: float | None, sigma_mps: float, *, raised: bool
) -> None:
    drive = Drive()
    drive.ticks(2)
    drive.comes_to(speed_mps)
    for tick in range(5):
        drive.tracks = (actor(12.0 - 0.5 * tick, 5.0, sigma_vx_mps=sigma_mps),)
        drive.tick()
    assert ("closing_lead" in {event.kind for event in drive.history[-1][2].events}) is raised
