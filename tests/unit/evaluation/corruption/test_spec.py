"""A corruption is told in one line, and every mistake in it is named."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.errors import UserError
from evaluation.corruption.hosted import hosts
from evaluation.corruption.spec import PAPER, CorruptionSpec, read_spec
from tests.unit.evaluation.corruption.worlds import SOME

SHARES = st.floats(0.0, 1.0)


@SOME
@given(SHARES, SHARES, SHARES, st.integers(0, 99), st.booleans())
def test_what_is_written_is_read_again(miss: float, drop: float, dark: float, seed: int, order: bool) -> None:
    spec = CorruptionSpec(sign_miss=miss, dropout=drop, blackout=dark, seed=seed, jitter_keeps_order=order)
    assert read_spec(spec.text()) == spec


def test_a_line_a_file_and_a_row_of_the_papers_table_are_read(tmp_path: Path) -> None:
    file = tmp_path / "c.toml"
    file.write_text("sign_miss = 0.2\nlidar_loss = 1\n")
    assert (
        read_spec(str(file)) == read_spec("sign_miss=0.2,lidar_loss=1") == CorruptionSpec(sign_miss=0.2, lidar_loss=1)
    )
    assert read_spec("actor_dropout_30").dropout == 0.3
    assert read_spec("clean") == CorruptionSpec() == PAPER["clean"]


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("sign_mis=0.2", "sign_mis"), ("sign_miss=1.2", "sign_miss"), ("dropout=-0.1", "dropout"), ("jitter_ms=nan", "jitter_ms"),
        ("longest_s=0.1", "shortest_s"), ("seed=x", "seed=x"), ("blackout", "blackout"), ("dropout='a'", "dropout"),
        ("/nowhere/a.toml", "/nowhere/a.toml"),
    ],
)  # fmt: skip
def test_a_mistake_is_named(text: str, named: str) -> None:
    with pytest.raises(UserError, match=named):
        read_spec(text)


def test_only_services_whose_publications_are_corrupted_are_hosted() -> None:
    assert hosts(read_spec("clean")) == {}
    assert set(hosts(read_spec("sign_miss=0.1"))) == {"drivelm"}
    assert set(hosts(read_spec("dropout=0.1,lidar_loss=0.1"))) == {"perception", "simulator"}
