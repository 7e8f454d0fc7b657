"""The ledger of what really happens."""

from typing import Any

from services.simulator.truth.ledger import Crossed, Ledger, LedgerEntry

DT = 0.05


def keep(ledger: Ledger, step: int, **what: Any) -> LedgerEntry:
    given: dict[str, Any] = {
        "speed_mps": 10.0,
        "limit_mps": 13.9,
        "country": "DEU",
        "lead": None,
        "hazards": (),
        "stop": None,
        "crossed": None,
        "collision": False,
    }
    return ledger.keep(time_s=step * DT, dt=DT, **{**given, **what})


def test_speeding_is_one_event_after_a_second_beyond_the_tolerance() -> None:
    ledger = Ledger()
    events = [keep(ledger, step, speed_mps=15.0).infraction for step in range(100)]
    assert events.count("speeding") == 1
    assert events.index("speeding") == 19


def test_within_the_tolerance_nothing_is_entered_but_time_above_the_limit_counts() -> None:
    ledger = Ledger()
    facts = [keep(ledger, step, speed_mps=14.5) for step in range(100)]
    assert facts[-1].infractions == 0
    assert abs(facts[-1].speeding_s - 5.0) < 0.01


def test_an_episode_ends_below_the_limit_and_the_next_one_counts_again() -> None:
    ledger = Ledger()
    speeds = [16.0] * 40 + [13.0] * 10 + [16.0] * 40
    assert [keep(ledger, step, speed_mps=speed).infraction for step, speed in enumerate(speeds)].count("speeding") == 2


def test_where_there_is_no_limit_nobody_speeds() -> None:
    ledger = Ledger()
    assert all(not keep(ledger, step, speed_mps=60.0, limit_mps=None).infraction for step in range(60))


def test_running_a_line_is_named_by_its_kind() -> None:
    ledger = Ledger()
    assert keep(ledger, 1, crossed=Crossed(kind="light", must_have_stopped=True)).infraction == "red_light"
    assert keep(ledger, 2, crossed=Crossed(kind="stop_line", must_have_stopped=True)).infraction == "no_stop"
    assert keep(ledger, 3, crossed=Crossed(kind="yield", must_have_stopped=True)).infraction == "wrong_yield"
    assert keep(ledger, 4, crossed=Crossed(kind="light", must_have_stopped=False)).infraction == ""


def test_a_collision_is_not_forgotten() -> None:
    ledger = Ledger()
    keep(ledger, 1, collision=True)
    assert keep(ledger, 2).collision
