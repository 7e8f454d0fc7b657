"""Intervals against published and hand-worked values."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.statistics import (
    CHANCE,
    binomial_ci,
    chance_of,
    mean_sd_ci,
    paired,
    poisson_ci,
    ratio_ci,
)


def test_mean_spread_and_t_interval_of_a_small_sample() -> None:
    # 2, 4, 4, 6: mean 4, sd sqrt(8/3) = 1.63299, t(0.975, 3) = 3.18245, half 3.18245 * 1.63299 / 2 = 2.59846
    found = mean_sd_ci([2.0, 4.0, 4.0, 6.0])
    assert (found.n, found.mean) == (4, 4.0)
    assert found.sd == pytest.approx(1.63299, abs=1e-5)
    assert (found.low, found.high) == pytest.approx((4 - 2.59846, 4 + 2.59846), abs=1e-4)


def test_too_few_values_have_no_interval() -> None:
    assert mean_sd_ci([]).mean is None
    assert (mean_sd_ci([3.0]).mean, mean_sd_ci([3.0]).low) == (3.0, None)


@pytest.mark.parametrize("values", [[1.0, 1.0], [0.0, 0.0, 0.0], [0.1 + 0.2, 0.3]])
def test_values_that_never_varied_have_no_interval(values: list[float]) -> None:
    found = mean_sd_ci(values)
    assert found.mean == pytest.approx(values[0])
    assert found.sd == pytest.approx(0.0)
    assert (found.low, found.high) == (None, None), "one of no width would call them certain"


@pytest.mark.parametrize(
    ("count", "low", "high"),
    # the table of exact 95 % limits for a Poisson count (Garwood 1936)
    [(0, 0.0, 3.6889), (1, 0.0253, 5.5716), (5, 1.6235, 11.6683), (10, 4.7954, 18.3904)],
)
def test_rates_have_garwoods_interval(count: int, low: float, high: float) -> None:
    found = poisson_ci(count, 20_000.0, per=10_000.0)
    assert found.value == pytest.approx(count / 2)
    assert (found.low, found.high) == pytest.approx((low / 2, high / 2), abs=1e-4)


def test_a_rate_over_nothing_is_none() -> None:
    assert poisson_ci(0, 0.0).value is None


@given(st.integers(0, 60), st.floats(0.5, 1e5))
def test_a_rate_lies_within_its_interval_and_more_exposure_narrows_it(count: int, exposure: float) -> None:
    one, ten = poisson_ci(count, exposure), poisson_ci(10 * count, 10 * exposure)
    assert one.low is not None
    assert one.high is not None
    assert one.value is not None
    assert one.low <= one.value < one.high
    assert ten.high is not None
    assert ten.high < one.high


def test_shares_have_clopper_and_pearsons_interval() -> None:
    # 0 of 10: upper 1 - 0.025^(1/10) = 0.30850; 8 of 10: 0.44390 to 0.97479
    assert binomial_ci(0, 10).high == pytest.approx(0.30850, abs=1e-5)
    some = binomial_ci(8, 10)
    assert (some.low, some.high) == pytest.approx((0.44390, 0.97479), abs=1e-5)
    assert binomial_ci(0, 0).value is None
    with pytest.raises(ValueError, match="11 of 10"):
        binomial_ci(11, 10)


def test_pairs_leave_out_what_seeds_have_in_common() -> None:
    # differences 1, 1, 2: mean 4/3, sd 0.57735, half 4.30265 * 0.57735 / sqrt(3) = 1.43422
    found = paired([11.0, 21.0, 32.0], [10.0, 20.0, 30.0])
    assert found.mean == pytest.approx(4 / 3)
    assert found.high == pytest.approx(4 / 3 + 1.43422, abs=1e-4)
    with pytest.raises(ValueError, match="longer"):
        paired([1.0], [1.0, 2.0])


def test_chance_deals_each_pair_either_way() -> None:
    """By hand: of 2^n ways to deal the signs, two give a mean as far from zero if all differences are alike."""
    assert chance_of([3.0] * 8, [1.0] * 8) == pytest.approx(2 / 2**8)
    assert chance_of([1.0, 2.0, 4.0], [0.0, 0.0, 0.0]) == pytest.approx(2 / 2**3)
    assert chance_of([1.0, 2.0, 0.0], [0.0, 0.0, 4.0]) == pytest.approx(1.0), "|1 + 2 - 4| is the least of all"
    assert chance_of([1.0], [0.0]) == 1.0
    assert chance_of([1.0, 2.0], [1.0, 2.0]) == 1.0
    assert chance_of([], []) is None
    assert chance_of([0.1 + 0.2] * 8, [0.3] * 8) == 1.0, "the last bits of equal numbers are no difference"
    assert paired([0.1 + 0.2, 0.5], [0.3, 0.5]).mean == 0.0
    with pytest.raises(ValueError, match="zip"):
        chance_of([1.0], [1.0, 2.0])


def test_what_is_too_small_to_matter_decides_no_tie() -> None:
    """Three events that two rows have more of come out the same way round in a quarter of cases, however long the other runs are."""
    ours, theirs = [4.0] * 3 + [0.001 * n for n in range(1, 11)], [0.0] * 13
    assert chance_of(ours, theirs, 0.02) == pytest.approx(2 / 2**3, abs=0.02)
    assert (chance_of(ours, theirs) or 1.0) < CHANCE


def test_it_takes_eight_pairs_to_tell_apart() -> None:
    found = [chance_of([1.0] * n, [0.0] * n) or 1.0 for n in (*range(1, 15), 40)]
    assert next(n for n, chance in enumerate(found, 1) if chance < CHANCE) == 8
    assert all(chance < CHANCE for chance in found[7:])


@settings(deadline=None, max_examples=50)
@given(st.lists(st.tuples(st.integers(-20, 20), st.integers(-20, 20)), min_size=1, max_size=16))
def test_chance_is_a_share_the_same_for_both_directions_and_scales(pairs: list[tuple[int, int]]) -> None:
    ours, theirs = [float(one) for one, _ in pairs], [float(other) for _, other in pairs]
    found = chance_of(ours, theirs)
    assert found is not None
    assert 0.0 < found <= 1.0
    assert chance_of(theirs, ours) == pytest.approx(found, abs=0.02)
    assert chance_of([3.0 * one for one in ours], [3.0 * other for other in theirs]) == pytest.approx(found)


def test_without_a_difference_two_rows_are_told_apart_as_rarely_as_it_says() -> None:
    chance = np.random.default_rng(1)
    found = [chance_of(*chance.poisson(0.5, (2, 10)).astype(float).tolist()) or 1.0 for _ in range(200)]
    assert sum(each < CHANCE for each in found) <= 2 + 3 * 1.5


def test_a_ratio_weighs_long_runs_as_the_sums_do() -> None:
    # 1 of 10 and 5 of 20: 6/30 = 0.2; off by -1 and +1, error sqrt(2/1 * 2)/30, t(0.975, 1) = 12.7062
    found = ratio_ci([1.0, 5.0], [10.0, 20.0])
    assert found.mean == pytest.approx(0.2)
    assert (found.low, found.high) == pytest.approx((0.2 - 12.7062 / 15, 0.2 + 12.7062 / 15), abs=1e-4)
    even = ratio_ci([1.0, 2.0, 6.0], [10.0, 20.0, 60.0])
    assert even.mean == pytest.approx(0.1)
    assert even.low is even.high is None, "they never varied"
    assert ratio_ci([], []).mean is ratio_ci([0.0], [0.0]).mean is None
    assert ratio_ci([3.0], [2.0]).mean == 1.5


@given(st.lists(st.tuples(st.floats(0.0, 1e4), st.floats(1.0, 1e4)), min_size=2, max_size=20))
def test_a_ratio_lies_within_its_interval_and_is_a_mean_where_all_are_as_long(runs: list[tuple[float, float]]) -> None:
    parts, wholes = zip(*runs, strict=True)
    found = ratio_ci(parts, wholes)
    assert found.mean == pytest.approx(sum(parts) / sum(wholes))
    if found.low is not None and found.high is not None and found.mean is not None:
        assert found.low <= found.mean <= found.high
    equal, mean = ratio_ci(parts, [2.0] * len(parts)), mean_sd_ci([part / 2.0 for part in parts])
    assert equal.mean == pytest.approx(mean.mean)
    if equal.low is not None and mean.low is not None:
        assert equal.low == pytest.approx(mean.low, rel=1e-6, abs=1e-6)
