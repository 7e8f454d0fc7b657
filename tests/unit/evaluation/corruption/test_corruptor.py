"""The same seed and drive give the same corruption; nothing asked for changes nothing; truth is never touched."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.corruption.corruptor import Corruptor
from evaluation.corruption.spec import CorruptionSpec
from proto import topics
from proto.scene import Fact
from tests.unit.evaluation.corruption.worlds import (
    ORIGIN,
    SECOND,
    SOME,
    drive,
    encoded,
    facts_after,
    limit,
    post,
    truth,
)

ALL = CorruptionSpec(
    sign_miss=0.3, limit_misread=0.5, dropout=0.3, blackout=0.2, freeze=0.2, lidar_loss=0.3, jitter_ms=20.0
)


@SOME
@given(st.integers(0, 1000), st.integers(0, 10**15))
def test_a_drive_is_corrupted_alike_again_whenever_it_is_driven(seed: int, later_ns: int) -> None:
    spec = msgspec.structs.replace(ALL, seed=seed)
    once, again = drive(spec, 60), drive(spec, 60, ORIGIN + later_ns)
    assert encoded(once) == encoded(again, ORIGIN + later_ns)


def test_another_seed_corrupts_otherwise() -> None:
    assert encoded(drive(ALL, 60)) != encoded(drive(msgspec.structs.replace(ALL, seed=2), 60))


@SOME
@given(st.integers(0, 1000))
def test_a_rate_of_zero_leaves_every_byte_and_stamp_and_tells_nothing(seed: int) -> None:
    for number, row in enumerate(drive(CorruptionSpec(seed=seed), 30)):
        assert all(left.stamp_ns == ORIGIN + number * SECOND // 10 and not left.records for left in row)
        assert row[0].message.jpeg == b"picture %d" % number
    assert encoded(drive(CorruptionSpec(seed=seed), 30)) == encoded(drive(CorruptionSpec(seed=seed + 1), 30))


def test_a_topic_that_is_not_corrupted_is_the_same_object_and_truth_is_one() -> None:
    everything = CorruptionSpec(
        sign_miss=1, limit_misread=1, dropout=1, blackout=1, freeze=1, lidar_loss=1, jitter_ms=50
    )
    corruptor, shown = Corruptor(everything), truth(1.0)
    left = corruptor.leave(topics.TRUTH, shown, "simulator", ORIGIN)
    assert left.message is shown
    assert left.stamp_ns == ORIGIN


@SOME
@given(st.permutations(range(6)), st.integers(0, 100), st.booleans())
def test_the_order_in_which_facts_come_does_not_matter(order: list[int], seed: int, true: bool) -> None:
    spec = CorruptionSpec(seed=seed, sign_miss=0.4, limit_misread=0.4)
    signs = [limit(50 + 10 * i, track_id=i, distance_m=10.0 + 12.0 * i) for i in range(6)]
    posts = tuple(post(i, 10.0 + 12.0 * i, f"limit:{50 + 10 * i}") for i in range(6))

    def outcome(indexes: list[int]) -> dict[int, tuple[Fact, ...]]:
        corruptor = Corruptor(spec)
        if true:
            corruptor.truth(truth(signs=posts), ORIGIN)
        return {i: facts_after(corruptor, signs[i]) for i in indexes}

    assert outcome(order) == outcome(list(range(6)))


@pytest.mark.parametrize("name", ["blackout", "freeze", "lidar_loss", "dropout", "sign_miss"])
def test_each_rate_of_one_takes_all(name: str) -> None:
    rows = drive(CorruptionSpec(**{name: 1.0}), 50)  # type: ignore[arg-type]
    pictures = {row[0].message.jpeg for row in rows}
    expected = {
        "blackout": len(pictures) == 1 and b"picture 0" not in pictures,
        "freeze": pictures == {b"picture 0"} and [row[0].message.frame for row in rows] == list(range(50)),
        "lidar_loss": all(row[2].message is None for row in rows),
        "dropout": all(row[3].message.tracks == () and row[3].message.lead_track_id is None for row in rows),
        "sign_miss": all(left.message is None for row in rows for left in row[5:]) and any(row[5:] for row in rows),
    }
    assert expected[name]
