r"""Normalised scores, and their aggregates over games and trainings.

    score = 100 (straight - cost) / (straight - reference)

is 0 for straight flight and 100 for the reference player; better players have more.  Scores (R, G)
of R trainings in G games are aggregated by the interquartile mean, the mean of the middle half of
all R G scores.  Its limits are those of a bootstrap that is stratified by games: each game draws R
of its own scores with replacement (Agarwal et al., Deep reinforcement learning at the edge of the
statistical precipice, NeurIPS 2021).  They cover the randomness of training, for these games.
"""

from __future__ import annotations

import numpy as np

from ppg_env.support.statistics import Interval

RESAMPLES = 2000


def scores(costs: np.ndarray, straight: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return scores (R, G) of costs (R, G), with the costs (G,) of both ends of the scale."""
    return np.asarray(100 * (straight - costs) / (straight - reference))


def interquartile_mean(values: np.ndarray) -> np.ndarray:
    """Return the mean of the middle half of the last axis, by ``values`` between the quartiles.

    A quarter of the values, rounded down, is cut off at each end.
    """
    ordered, cut = np.sort(values, axis=-1), values.shape[-1] // 4
    return np.asarray(ordered[..., cut : values.shape[-1] - cut].mean(axis=-1))


def aggregate(values: np.ndarray, seed: int = 0, confidence: float = 0.95) -> Interval:
    """Return the interquartile mean of scores (R, G), with its limits; nan for one training."""
    runs, games = values.shape
    value = float(interquartile_mean(values.ravel()))
    if runs == 1:
        return Interval(value, float("nan"), float("nan"))
    random = np.random.default_rng(seed)
    rows = random.integers(runs, size=(RESAMPLES, runs, games))
    drawn = values[rows, np.arange(games)].reshape(RESAMPLES, -1)
    tail = (1 - confidence) / 2
    low, high = np.quantile(interquartile_mean(drawn), [tail, 1 - tail])
    return Interval(value, float(low), float(high))
