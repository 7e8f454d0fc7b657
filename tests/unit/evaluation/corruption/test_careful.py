"""What corruption may do to the target, in a pure drive beside the clean one, tick by tick.

What is never seen cannot bind: a missed restriction, an actor who is gone for longer than the tick remembers him, and a gap
that shrinks in a frozen picture let the target rise, and no test can forbid it. What can hold: until a restriction was missed,
the target is never above the clean one; an actor who drops out bounds it for three seconds as when last seen; in a frozen
picture it is never above what that last showed, or is in the clean one.
"""

import math

from hypothesis import given
from hypothesis import strategies as st

from evaluation.corruption.corruptor import Corruptor
from evaluation.corruption.spec import CorruptionSpec
from evaluation.corruption.windows import window_at
from proto import topics
from proto.perception import Track, Tracks
from proto.scene import Fact, Facts
from tests.unit.services.orchestrator.support import FEW, START, Drive, actor, end_sign, limit_sign, replace

SEEDS = st.integers(0, 10**6)
SIGNS = st.lists(st.sampled_from(["limit:30", "limit:50", "limit:70", "limit:80", "limit_end"]), min_size=1, max_size=6)
SLACK = 1e-6
EVERY = 5
"""Ticks from sign to sign."""


def sign(reading: str, number: int) -> Fact:
    """A sign that is being passed."""
    passed = end_sign(reading) if reading == "limit_end" else limit_sign(reading)
    return replace(passed, track_id=100 + number, camera="tele")


def told(corruptor: Corruptor, facts: tuple[Fact, ...], at_ns: int) -> tuple[Fact, ...]:
    """What is left of facts."""
    left = corruptor.leave(topics.FACTS, Facts(facts=facts), "drivelm", at_ns).message
    return () if left is None else left.facts


def lowered(clean: Drive, before_mps: float) -> bool:
    """Whether this tick brought a restriction."""
    return clean.target_mps < before_mps - SLACK


@FEW
@given(SEEDS, SIGNS)
def test_missed_signs_never_raise_the_target_until_a_restriction_was_missed(seed: int, readings: list[str]) -> None:
    clean, blind = Drive(road="rural"), Drive(road="rural")
    corruptor = Corruptor(CorruptionSpec(seed=seed, sign_miss=0.5))
    for number, reading in enumerate(readings):
        before_mps, fact = (
            clean.target_mps,
            replace(sign(reading, number), frame_stamp_ns=START + number * EVERY * 10**8),
        )
        left = told(corruptor, (fact,), fact.frame_stamp_ns)
        clean.tick(fact)
        blind.tick(*left)
        if not left and lowered(clean, before_mps):
            return
        for _ in range(EVERY - 1):
            assert blind.target_mps <= clean.target_mps + SLACK
            clean.tick()
            blind.tick()


@FEW
@given(SEEDS, st.floats(8.0, 60.0), st.floats(-2.0, 15.0))
def test_a_known_actor_that_drops_out_bounds_the_target_as_when_last_seen(
    seed: int, gap_m: float, closing_mps: float
) -> None:
    clean, lossy, empty = (Drive(speed_mps=22.0, road="rural") for _ in range(3))
    corruptor, last_mps = Corruptor(CorruptionSpec(seed=seed, dropout=0.5)), math.inf
    for number in range(30):
        tracks = Tracks(camera="front", frame=number, tracks=(actor(gap_m, closing_mps),), lead_track_id=5)
        left: Tracks = corruptor.leave(topics.TRACKS, tracks, "perception", number * 10**8).message
        clean.tracks, clean.lead = tracks.tracks, 5
        lossy.tracks, lossy.lead = left.tracks, left.lead_track_id
        fact = (sign("limit:50", number),) if number == 10 else ()
        for drive in (clean, lossy, empty):
            drive.tick(*fact)
        assert lossy.target_mps <= empty.target_mps + SLACK
        if left.tracks:
            assert lossy.target_mps <= clean.target_mps + SLACK
            last_mps = lossy.target_mps
        assert lossy.target_mps <= last_mps + SLACK


@FEW
@given(st.floats(8.0, 30.0))
def test_after_three_seconds_without_it_the_target_is_what_the_road_allows(gap_m: float) -> None:
    lossy, empty = (Drive(speed_mps=22.0, road="rural") for _ in range(2))
    lossy.tracks, lossy.lead = (actor(gap_m, 5.0),), 5
    lossy.tick()
    empty.tick()
    assert lossy.target_mps < empty.target_mps
    lossy.tracks, lossy.lead = (), 0
    for number in range(40):
        lossy.tick()
        empty.tick()
        assert number >= 30 or lossy.target_mps < empty.target_mps
    assert lossy.target_mps == empty.target_mps


@FEW
@given(SEEDS, SIGNS)
def test_a_dark_camera_never_raises_the_target_until_a_restriction_was_missed(seed: int, readings: list[str]) -> None:
    clean, dark = Drive(road="rural"), Drive(road="rural")
    spec = CorruptionSpec(seed=seed, blackout=0.5)
    for number in range(len(readings) * EVERY):
        facts = (sign(readings[number // EVERY], number),) if number % EVERY == 0 else ()
        is_dark = window_at(spec, "blackout", spec.blackout, "tele", number * 10**8) is not None
        before_mps = clean.target_mps
        clean.tick(*facts)
        dark.tick(*(() if is_dark else facts))
        if is_dark and facts and lowered(clean, before_mps):
            return
        assert dark.target_mps <= clean.target_mps + SLACK


@FEW
@given(st.floats(10.0, 60.0), st.floats(0.0, 8.0), st.integers(3, 25))
def test_a_frozen_picture_never_raises_the_target_above_what_it_last_showed_or_the_clean_one(
    gap_m: float, closing_mps: float, since: int
) -> None:
    clean, frozen = Drive(speed_mps=20.0, road="rural"), Drive(speed_mps=20.0, road="rural")
    shown_mps = frozen.target_mps
    for number in range(30):
        for drive, last in ((clean, number), (frozen, min(number, since - 1))):
            ahead = replace(limit_sign("limit:50", passed=False), distance_m=80.0 - 2.0 * last)
            drive.tracks, drive.lead = (actor(max(2.0, gap_m - closing_mps * last / 10), closing_mps),), 5
            drive.tick(*((ahead,) if number % EVERY == 0 else ()))
        shown_mps = frozen.target_mps if number < since else shown_mps
        assert frozen.target_mps <= max(clean.target_mps, shown_mps) + SLACK


@FEW
@given(SEEDS, st.floats(10.0, 60.0), st.floats(-2.0, 12.0), st.floats(1.0, 10.0))
def test_the_doubt_that_a_lost_lidar_leaves_never_raises_the_target(
    seed: int, gap_m: float, closing_mps: float, doubt: float
) -> None:
    clean, lossy = Drive(speed_mps=22.0, road="rural"), Drive(speed_mps=22.0, road="rural")
    spec = CorruptionSpec(seed=seed, lidar_loss=0.5)
    for number in range(30):
        sure = actor(gap_m, closing_mps)
        lost = window_at(spec, "lidar_loss", spec.lidar_loss, "top", number * 10**8) is not None
        clean.tracks, clean.lead = (sure,), 5
        lossy.tracks, lossy.lead = ((_doubted(sure, doubt) if lost else sure),), 5
        clean.tick()
        lossy.tick()
        assert lossy.target_mps <= clean.target_mps + SLACK


def _doubted(track: Track, factor: float) -> Track:
    """As perception tells of it by sight alone: the same place, less sure. That the place is off too is not tested here."""
    return replace(track, sigma_x_m=track.sigma_x_m * factor, sigma_vx_mps=track.sigma_vx_mps * factor)
