"""Bins of confidence against hand-worked cases, and diagrams of them."""

from pathlib import Path

import numpy as np
import pytest

from drivemcp.errors import UserError
from training.bins import binned
from training.reliability import draw, save, table


def test_a_bin_tells_what_was_said_and_how_much_was_right() -> None:
    """Four told 0.9, three of them right; one told 0.35, wrong: the error is (4 * 0.15 + 1 * 0.35) / 5."""
    bins = binned(np.array([0.9, 0.9, 0.9, 0.9, 0.35]), np.array([True, True, True, False, False]))
    assert (bins.told[9], bins.right[9], bins.counts[9]) == pytest.approx((0.9, 0.75, 4))
    assert (bins.told[3], bins.right[3], bins.counts[3]) == pytest.approx((0.35, 0.0, 1))
    assert np.isnan(bins.right[0])
    assert bins.error == pytest.approx(0.19)


def test_certainty_falls_into_the_last_bin_and_nothing_at_all_has_no_error() -> None:
    assert binned(np.ones(3), np.ones(3, bool)).counts.tolist() == [0] * 9 + [3]
    assert np.isnan(binned(np.zeros(0), np.zeros(0, bool)).error)


@pytest.mark.parametrize("ending", ["svg", "png"])
def test_the_same_bins_give_the_same_picture(tmp_path: Path, ending: str) -> None:
    pytest.importorskip("matplotlib", reason="the extra `evaluation` is not installed")
    told = np.linspace(0.0, 1.0, 50)
    sets = {"clean": binned(told, told > 0.4), "none": binned(np.zeros(0), np.zeros(0, bool))}
    files = [tmp_path / f"{name}.{ending}" for name in "ab"]
    for file in files:
        save(draw("reader", sets), file)
    assert files[0].read_bytes() == files[1].read_bytes()
    if ending == "svg":
        assert "share right" in files[0].read_text(encoding="utf-8")


def test_another_ending_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="the extra `evaluation` is not installed")
    with pytest.raises(UserError, match=r"\.svg or \.png"):
        save(draw("reader", {"clean": binned(np.ones(1), np.ones(1, bool))}), tmp_path / "a.gif")


def test_the_figures_are_told_beside_the_picture() -> None:
    assert "| clean | 0.950 | 1.000 | 2 |" in table({"clean": binned(np.full(2, 0.95), np.ones(2, bool))})
