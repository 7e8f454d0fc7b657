"""Uncertainty: mean, standard deviation and 95 % interval; exact Poisson for rates; pairs of the same seed."""

import math
from collections.abc import Sequence
from statistics import fmean, stdev

import msgspec
import numpy as np
from scipy import stats

LEVEL = 0.95
CHANCE = 0.01
"""Two rows differ where chance alone would part them as far in less than this share of comparisons."""
FLIPS = 9999
"""Up to as many ways to deal the signs all are tried (13 pairs), beyond as many are drawn."""
ROUNDING = 1e-9
"""Values that differ by less than this share of them are equal but for how they were summed."""


class Spread(msgspec.Struct, frozen=True, kw_only=True):
    """Of how many, their mean (or another number of them), standard deviation and 95 % interval. None: too few, or no spread."""

    n: int
    mean: float | None
    sd: float | None = None
    low: float | None = None
    high: float | None = None


class Rate(msgspec.Struct, frozen=True, kw_only=True):
    """Events over an exposure, their ratio and its exact 95 % interval. None: no exposure."""

    count: int
    exposure: float
    value: float | None = None
    low: float | None = None
    high: float | None = None


class Share(msgspec.Struct, frozen=True, kw_only=True):
    """So many of so many, and the exact 95 % interval of their ratio. None: of none."""

    count: int
    of: int
    value: float | None = None
    low: float | None = None
    high: float | None = None


def mean_sd_ci(values: Sequence[float]) -> Spread:
    """Mean and standard deviation (n - 1), with Student's t interval for the mean. One value has a mean only.

    The t interval takes the runs' means for normal. Equal values have no interval: that of no width would call a few runs
    certain, which never showed how they vary.
    """
    n = len(values)
    if n < 2:
        return Spread(n=n, mean=values[0] if values else None)
    mean, sd = fmean(values), stdev(values)
    if max(values) - min(values) <= ROUNDING * max(map(abs, values)):
        return Spread(n=n, mean=mean, sd=sd)
    half = float(stats.t.ppf(0.5 + LEVEL / 2.0, n - 1)) * sd / math.sqrt(n)
    return Spread(n=n, mean=mean, sd=sd, low=mean - half, high=mean + half)


def ratio_ci(parts: Sequence[float], wholes: Sequence[float]) -> Spread:
    """The ratio of the sums, and Student's t interval about it from how far each part is from its share of the whole.

    Long runs count for more, in the number and in its interval (Cochran 1977, Sampling Techniques, chapter 6). There is no interval
    for fewer than two runs, or for runs that all have the same ratio. Wholes whose sum is not positive have no ratio either, whatever
    the lengths. Raises ValueError on unequal lengths where the sum of the wholes is positive.
    """
    n, whole = len(wholes), sum(wholes)
    if whole <= 0.0:
        return Spread(n=n, mean=None)
    ratio = sum(parts) / whole
    off = [part - ratio * each for part, each in zip(parts, wholes, strict=True)]
    if n < 2 or max(map(abs, off)) <= ROUNDING * max(map(abs, parts), default=0.0):
        return Spread(n=n, mean=ratio)
    error = math.sqrt(n / (n - 1) * sum(each * each for each in off)) / whole
    half = float(stats.t.ppf(0.5 + LEVEL / 2.0, n - 1)) * error
    return Spread(n=n, mean=ratio, low=ratio - half, high=ratio + half)


def poisson_ci(count: int, exposure: float, per: float = 1.0) -> Rate:
    """Rate with Garwood's exact interval (1936, Biometrika 28), told for `per` of the exposure.

    It takes the events for independent. With no event at all its upper end is 3.69 over the exposure.
    """
    if exposure <= 0.0:
        return Rate(count=count, exposure=exposure)
    tail, scale = (1.0 - LEVEL) / 2.0, per / exposure
    low = float(stats.chi2.ppf(tail, 2 * count)) / 2.0 if count else 0.0
    high = float(stats.chi2.ppf(1.0 - tail, 2 * count + 2)) / 2.0
    return Rate(count=count, exposure=exposure, value=count * scale, low=low * scale, high=high * scale)


def binomial_ci(count: int, of: int) -> Share:
    """Share with the exact interval of Clopper and Pearson (1934, Biometrika 26). Raises ValueError where count > of."""
    if not 0 <= count <= of:
        raise ValueError(f"{count} of {of} is no share")
    if of == 0:
        return Share(count=count, of=of)
    tail = (1.0 - LEVEL) / 2.0
    low = float(stats.beta.ppf(tail, count, of - count + 1)) if count else 0.0
    high = float(stats.beta.ppf(1.0 - tail, count + 1, of - count)) if count < of else 1.0
    return Share(count=count, of=of, value=count / of, low=low, high=high)


def paired(ours: Sequence[float], theirs: Sequence[float]) -> Spread:
    """Differences ours minus theirs of runs with the same seed, in the same order. Raises ValueError on unequal lengths.

    What the seeds have in common falls out, so that the interval is narrower than that of two separate means.
    """
    return mean_sd_ci(_apart(ours, theirs))


def _apart(ours: Sequence[float], theirs: Sequence[float]) -> list[float]:
    """The pairs' differences; a difference in their last bits alone is 0."""
    pairs = zip(ours, theirs, strict=True)
    return [0.0 if abs(a - b) <= ROUNDING * max(abs(a), abs(b)) else a - b for a, b in pairs]


def chance_of(ours: Sequence[float], theirs: Sequence[float], least: float = 0.0) -> float | None:
    """How often chance alone parts the pairs' means as far, in either direction: Fisher's randomisation test (1935, The Design of
    Experiments, section 21).

    Were there no difference, each pair could as well stand the other way round. That takes nothing for normal and no event
    for independent of another in its run; it needs eight pairs to come below `CHANCE`. A pair less than `least` apart counts
    as equal: what is too small to matter must not decide between ties of what does. None without a pair.
    Raises ValueError on unequal lengths.
    """
    apart = np.array([each if abs(each) >= least else 0.0 for each in _apart(ours, theirs)], dtype=float)
    if not len(apart):
        return None
    if len(apart) == 1 or not apart.any():
        return 1.0
    test = stats.permutation_test(
        (apart, np.zeros_like(apart)),
        lambda one, other, axis: np.mean(one - other, axis=axis),
        permutation_type="samples",
        n_resamples=FLIPS,
        rng=np.random.default_rng(0),
    )
    return float(test.pvalue)
