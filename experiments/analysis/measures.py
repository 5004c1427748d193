"""What weights, activations and movements are like: the measures of the paper's Sec. IV-C."""

from __future__ import annotations

import math

import numpy as np

from experiments.analysis import spectrum
from physics import DT

__all__ = [
    "DIVERGED",
    "activation_measures",
    "command_measures",
    "gait_measures",
    "term_shares",
    "weight_measures",
]

_SATURATED = 0.9  # an activation beyond it, of at most 1, counts as saturated
DIVERGED = 10.0  # a weight so many times the median one has diverged
_SWITCHING = 0.05  # least share of time at either end of a neuron that switches between them
_VIBRATION = 4.0  # [Hz]; the springs' own frequency is about 8 Hz, gaits of the paper 0.5 to 0.7


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


def activation_measures(activations: np.ndarray, step: float = DT) -> dict[str, float | None]:
    """How saturated, how busy and how regular the neurons of a layer are.

    Args:
        activations: shape (T, neurons), one row per control step.
        step: length of a control step [s].

    Returns:
        low, high: shares of the activations below -0.9 and above 0.9; saturated: their sum;
        middle: share within +-0.1, next to none if the layer is bimodal; switching: share of the
        neurons that are at either end at least 5 % of the time each (one that stays at one end
        tells the body nothing); changes: of sign, per neuron and second; period and regularity:
        see `spectrum`.
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
        "changes": float(changes.mean()) / step if len(changes) else None,
        "period": spectrum.period_of(activations, step),
        "regularity": spectrum.regularity_of(activations),
    }


def gait_measures(areas: np.ndarray, step: float = DT) -> dict[str, float | None]:
    """How a body moves.

    Args:
        areas: The areas of the voxels over those at rest, shape (T, V), one row per control step.
        step: length of a control step [s].

    Returns:
        gait_period [s], gait_frequency [Hz] and gait_regularity: see `spectrum`; vibration: the
        share of the areas' variance above 4 Hz.
    """
    return {
        "gait_period": spectrum.period_of(areas, step),
        "gait_frequency": spectrum.frequency_of(areas, step),
        "gait_regularity": spectrum.regularity_of(areas),
        "vibration": spectrum.power_above(areas, _VIBRATION, step),
    }


def command_measures(actuation: np.ndarray) -> dict[str, float]:
    """What a body is told to do.

    Args:
        actuation: of the voxels, shape (T, V), one row per control step.

    Returns:
        saturated: share of it beyond 0.9; alternating: share of the steps in one of the two
        commonest postures, each a choice of voxels that contract while the others expand.
    """
    _, counts = np.unique(actuation > 0, axis=0, return_counts=True)
    return {
        "saturated": float((np.abs(actuation) > _SATURATED).mean()),
        "alternating": float(np.sort(counts)[-2:].sum() / len(actuation)),
    }


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
