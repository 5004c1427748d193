"""What weights, activations and movements are like: the measures of the paper's Sec. IV-C."""

from __future__ import annotations

import math

import numpy as np

from physics.scene.material import DT

__all__ = [
    "DIVERGED",
    "activation_measures",
    "period_of",
    "regularity_of",
    "term_shares",
    "weight_measures",
]

_SATURATED = 0.9  # an activation beyond it, of at most 1, counts as saturated
DIVERGED = 10.0  # a weight so many times the median one has diverged
_SWITCHING = 0.05  # least share of time at either end of a neuron that switches between them
_LEAST_PERIOD = 0.15  # of a gait [s]
_PERIODIC = 0.3  # least autocorrelation of what repeats itself


def weight_measures(weights: np.ndarray) -> dict[str, float | None]:
    """How the weights of one network are distributed.

    Args:
        weights: all of them, shape (n,).

    Returns:
        median: of |w|; largest: of |w|; diverged: share of |w| beyond 10 medians; kurtosis: in
        excess of a normal distribution's, above 0 where a bell has extremes. None where the
        weights do not say, such as the kurtosis of equal ones.
    """
    weights = weights.astype(np.float64)
    sizes = np.abs(weights)
    median = float(np.median(sizes))
    return {
        "median": median,
        "largest": float(sizes.max()),
        "diverged": float((sizes > DIVERGED * median).mean()) if median > 0 else None,
        "kurtosis": _excess_kurtosis(weights),
    }


def activation_measures(activations: np.ndarray) -> dict[str, float | None]:
    """How saturated, how busy and how regular the neurons of a layer are.

    Args:
        activations: shape (T, neurons), one row per control step.

    Returns:
        low, high: shares of the activations below -0.9 and above 0.9; saturated: their sum;
        middle: share within +-0.1, next to none if the layer is bimodal; switching: share of the
        neurons that are at either end at least 5 % of the time each (one that stays at one end
        tells the body nothing); changes: of sign, per neuron and second; period and regularity:
        see `period_of` and `regularity_of`.
    """
    low, high = activations < -_SATURATED, activations > _SATURATED
    switching = (low.mean(axis=0) >= _SWITCHING) & (high.mean(axis=0) >= _SWITCHING)
    changes = np.diff(activations > 0, axis=0)
    return {
        "low": float(low.mean()),
        "high": float(high.mean()),
        "saturated": float((low | high).mean()),
        "middle": float((np.abs(activations) < 1 - _SATURATED).mean()),
        "switching": float(switching.mean()),
        "changes": float(changes.mean()) / DT if len(changes) else None,
        "period": period_of(activations),
        "regularity": regularity_of(activations),
    }


def period_of(signals: np.ndarray) -> float | None:
    """Period of a gait [s]: the first lag at which the voxels' states, or other signals, correlate
    about as well with themselves as at any other; None if they do not repeat themselves.

    Args:
        signals: shape (T, n), one row per control step; a period of up to T/2 is found.
    """
    peaks, heights = _peaks(signals)
    if not len(peaks) or heights.max() < _PERIODIC:
        return None
    return float(peaks[np.argmax(heights >= 0.9 * heights.max())]) * DT


def regularity_of(signals: np.ndarray) -> float | None:
    """How well signals repeat themselves: the highest peak of their autocorrelation, at most 1.

    Args:
        signals: as in `period_of`, which takes 0.3 and more for periodic. None without any peak.
    """
    _, heights = _peaks(signals)
    return float(heights.max()) if len(heights) else None


def term_shares(sizes: np.ndarray) -> dict[str, float | None]:
    """The share of each term of the rule in the change of the weights.

    Args:
        sizes: summed sizes of the four terms, shape (4,).

    Returns:
        Of A, B, C and D, adding up to 1; None if nothing changes.
    """
    total = float(sizes.sum())
    known = math.isfinite(total) and total > 0
    shares = (sizes / total).tolist() if known else [None] * len(sizes)
    return dict(zip("ABCD", shares, strict=True))


def _excess_kurtosis(values: np.ndarray) -> float | None:
    """Fourth central moment over the squared variance, less a normal distribution's 3."""
    squares = (values - values.mean()) ** 2
    variance = float(squares.mean())
    return float((squares**2).mean()) / variance**2 - 3 if variance > 0 else None


def _peaks(signals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lags [control steps] at which the autocorrelation has a peak, and its heights there."""
    deviations = signals.astype(np.float64)
    deviations = deviations - deviations.mean(axis=0)
    power = float((deviations**2).mean())
    if not (math.isfinite(power) and power > 0):
        return np.array([], dtype=int), np.array([])
    correlations = np.array(
        [
            (deviations[lag:] * deviations[:-lag]).mean() / power
            for lag in range(1, len(signals) // 2)
        ]
    )
    lags = np.arange(2, len(correlations))  # a peak needs a neighbour on either side
    here, before, after = (correlations[lags - 1 + shift] for shift in (0, -1, 1))
    peaks = lags[(here > before) & (here >= after) & (lags * DT >= _LEAST_PERIOD)]
    return peaks, correlations[peaks - 1]
