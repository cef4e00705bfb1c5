r"""Estimates of probabilities with confidence intervals.

- ``proportion``: k of n independent episodes, Clopper-Pearson: exact for every k.
- ``difference``: of two proportions of the same n episodes.  Only discordant episodes count, b of
  one kind and c of the other; their limits are squared and added (MOVER; Zou & Donner,
  Statistics in Medicine 27, 2008), with the Clopper-Pearson limits [L, U] of each and -r their
  multinomial correlation.  These limits are wide for small counts, where normal limits fail: the
  exact coverage, summed over all outcomes, exceeds the stated coverage.
- ``weighted``: the mean of independent y_k in [0, ceiling], by its standard error; the
  ceiling bounds the contribution of values that no sample shows.
- ``repeated``: the mean of a few independent, unbiased estimates, by their spread.

The limits of a difference:

    low  = b/n - c/n - sqrt(x^2 + y^2 + 2 r x y),   x = b/n - L_b,  y = U_c - c/n
    high = b/n - c/n + sqrt(x^2 + y^2 + 2 r x y),   x = U_b - b/n,  y = c/n - L_c
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

ENOUGH = 100.0
"""Effective samples from which the normal interval of a weighted mean is trusted: its relative
standard error is then below 10 % and its distribution close to normal."""


@dataclass(frozen=True)
class Estimate:
    """A probability with its Clopper-Pearson interval.

    ``hits`` of ``samples`` episodes show the event, ``value`` is the ratio, and [low, high] covers
    the true probability with the stated confidence.
    """

    hits: int
    samples: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """Proportion of episodes with the event."""
        return self.hits / self.samples

    @property
    def trusted(self) -> bool:
        """Whether the interval is reliable: always, it is exact."""
        return True


@dataclass(frozen=True)
class Interval:
    """A value with the limits of its confidence interval; nan without observations."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class RareEstimate:
    """A probability from weighted samples, with its confidence interval.

    Attributes
    ----------
    standard_error : estimated standard deviation of ``value``.
    effective_samples : number of equally weighted samples with the event of the same precision.
    trusted : whether the interval is reliable; if not, its upper limit is a proved bound.
    advice : why it is not reliable, and what to do; empty if it is.
    """

    value: float
    low: float
    high: float
    standard_error: float
    effective_samples: float
    trusted: bool
    advice: str = ""


@dataclass(frozen=True)
class RareRisk:
    """Crash probabilities of each agent, of each of ``game.encounters``, and of any.

    Attributes
    ----------
    samples : simulated episodes.
    between : for swept crashes, probabilities of the crashes between the time steps only.
    """

    agents: list[RareEstimate]
    encounters: list[RareEstimate]
    any: RareEstimate
    samples: int
    between: RareRisk | None = None


def proportion(hits: int, samples: int, confidence: float = 0.95) -> Estimate:
    """Return the exact (Clopper-Pearson) interval of a binomial proportion."""
    from scipy.special import betaincinv

    tail, misses = (1 - confidence) / 2, samples - hits
    low = betaincinv(hits, misses + 1, tail) if hits else 0.0
    high = betaincinv(hits + 1, misses, 1 - tail) if misses else 1.0
    return Estimate(hits, samples, float(low), float(high))


def difference(more: int, less: int, samples: int, confidence: float = 0.95) -> Interval:
    """Return the difference of two proportions of the same episodes, by the module's formula.

    ``more`` episodes have the first event only, ``less`` the second only.
    """
    b, c = (proportion(count, samples, confidence) for count in (more, less))
    odds = [e.value / max(1 - e.value, 1 / samples) for e in (b, c)]
    r = min(sqrt(odds[0] * odds[1]), 1.0)

    def reach(x: float, y: float) -> float:
        return sqrt(x**2 + y**2 + 2 * r * x * y)

    value = b.value - c.value
    low = value - reach(b.value - b.low, c.high - c.value)
    high = value + reach(b.high - b.value, c.value - c.low)
    return Interval(value, max(low, -1.0), min(high, 1.0))


def weighted(
    hits: int,
    samples: int,
    total: float,
    squares: float,
    unit: float,
    ceiling: float,
    confidence: float = 0.95,
) -> RareEstimate:
    """Return the mean of independent values in [0, ``ceiling``] with its normal interval.

    Parameters
    ----------
    hits : number of nonzero values.
    samples : number of values.
    total, squares : sums of the values and of their squares, in ``unit`` and its square.
    ceiling : largest possible value, observed or not.
    confidence : of the interval.

    Notes
    -----
    The interval is at least as wide as the Clopper-Pearson interval of the proportion of hits.  It
    is trusted if the hits, and the hits of the largest possible value with the same sum, amount to
    ``ENOUGH`` effective samples, or if all values must be zero.  Otherwise the upper limit is a
    proved bound: ``ceiling`` times the upper limit of the proportion.
    """
    from scipy.special import ndtri

    mean = total / samples
    variance = max(squares / samples - mean**2, 0.0) / max(samples - 1, 1)
    value, error = mean * unit, sqrt(variance) * unit
    effective = total**2 / squares if squares else 0.0
    half = float(ndtri(0.5 + confidence / 2)) * error
    share = proportion(hits, samples, confidence)
    worth = value / share.value if hits else 0.0  # of a hit, on average
    low, high = min(value - half, worth * share.low), max(value + half, worth * share.high)
    if not ceiling or (effective >= ENOUGH and total * unit >= ENOUGH * ceiling):
        high = max(high, float(np.finfo(float).tiny))  # the least normal number
        return RareEstimate(
            min(value, 1.0), min(max(low, 0.0), 1.0), min(high, 1.0), error, effective, True
        )
    most = max(high, min(ceiling * share.high, 1.0))
    advice = f"only {effective:.0f} effective samples of {samples:,}; ask for more episodes"
    return RareEstimate(value, 0.0, most, error, effective, False, advice)


def repeated(values: np.ndarray, plain: Estimate, confidence: float = 0.95) -> RareEstimate:
    """Return the mean of independent, unbiased ``values`` (R,) with Student's interval, cut at 0.

    It is trusted if its standard error is that of ``ENOUGH`` samples.  Otherwise the upper limit
    is at least that of ``plain``, an estimate by counting.
    """
    from scipy.special import stdtrit

    R = len(values)
    value, error = float(values.mean()), float(values.std(ddof=1) / sqrt(R))
    half = float(stdtrit(R - 1, 0.5 + confidence / 2)) * error
    effective = (value / error) ** 2 if error else 0.0
    low, high = max(value - half, 0.0), value + half
    if effective >= ENOUGH:
        return RareEstimate(value, low, high, error, effective, True)
    advice = f"{R} repetitions are worth only {effective:.0f} samples; ask for more episodes"
    return RareEstimate(value, low, max(high, plain.high), error, effective, False, advice)


def counted(plain: Estimate, advice: str = "") -> RareEstimate:
    """Return a proportion as a ``RareEstimate``, trusted unless there is ``advice``."""
    error = sqrt(plain.value * (1 - plain.value) / plain.samples)
    return RareEstimate(plain.value, plain.low, plain.high, error, plain.hits, not advice, advice)


def averaged(parts: Sequence[RareEstimate], confidence: float = 0.95) -> RareEstimate:
    """Return the mean of independent estimates of different probabilities.

    The parts are, for example, the estimates of several trainings.  The mean is trusted if its
    standard error is that of ``ENOUGH`` samples, and that of every part of a quarter as many;
    otherwise its upper limit is at least the mean of the upper limits of the parts.
    """
    from scipy.special import ndtri

    if len(parts) == 1:
        return parts[0]
    R = len(parts)
    value = sum(part.value for part in parts) / R
    error = sqrt(sum(part.standard_error**2 for part in parts)) / R
    half = float(ndtri(0.5 + confidence / 2)) * error
    effective = (value / error) ** 2 if error else 0.0
    low, high = max(value - half, 0.0), value + half
    least = min(parts, key=lambda part: part.effective_samples)
    if effective >= ENOUGH and least.effective_samples >= ENOUGH / 4:
        return RareEstimate(value, low, high, error, effective, True)
    most = max(high, sum(part.high for part in parts) / R)
    advice = least.advice or "the trainings scatter; ask for more episodes"
    return RareEstimate(value, low, most, error, effective, False, advice)
