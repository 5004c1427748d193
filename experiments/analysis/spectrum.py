"""How often a gait repeats itself: the peak of its power spectrum, down to three control steps."""

from __future__ import annotations

import math

import numpy as np

from physics import DT

__all__ = ["frequency_of", "period_of", "power_above", "regularity_of"]

_LEAST_STEPS = 3  # of a period; faster ones cannot be told from their aliases
_MOST_SHARE = 0.5  # of the recording; a period must be seen twice
_PADDING = 8  # times the length: bins narrow enough for a parabola through three of them
_PERIODIC = 0.3  # least autocorrelation of what repeats itself


def frequency_of(signals: np.ndarray, step: float = DT) -> float | None:
    """Frequency of the highest peak in the power spectrum of several signals together [Hz].

    The spectrum is that of the whole recording under a Hann window, summed over the signals; the
    peak is found by a parabola through the logarithms of three bins.

    Args:
        signals: shape (T, n), one row per control step, such as the areas of n voxels.
        step: length of a control step [s].

    Returns:
        Between 2 / (T step) and 1 / (3 step); None for signals that do not repeat themselves,
        whose `regularity_of` is below 0.3.
    """
    regularity = regularity_of(signals)
    if regularity is None or regularity < _PERIODIC:
        return None
    frequencies, power = _spectrum(signals, step)
    low = 1 / (_MOST_SHARE * len(signals) * step)
    high = 1 / (_LEAST_STEPS * step)
    band = np.flatnonzero((frequencies >= low - 1e-9) & (frequencies <= high + 1e-9))
    k = int(band[np.argmax(power[band])])
    if not 0 < k < len(power) - 1 or power[k] <= 0:
        return None
    below, here, above = np.log(np.maximum(power[k - 1 : k + 2], np.finfo(float).tiny))
    curvature = below - 2 * here + above
    offset = 0.5 * (below - above) / curvature if curvature < 0 else 0.0
    return float(frequencies[k] + np.clip(offset, -0.5, 0.5) * frequencies[1])


def period_of(signals: np.ndarray, step: float = DT) -> float | None:
    """One over `frequency_of` [s]; None where there is none."""
    frequency = frequency_of(signals, step)
    return None if frequency is None else 1 / frequency


def power_above(signals: np.ndarray, frequency: float, step: float = DT) -> float | None:
    """Share of the signals' variance above a frequency, 0 to 1.

    Args:
        signals: as in `frequency_of`.
        frequency: The frequency above which power counts [Hz].
        step: length of a control step [s].

    Returns:
        None if the signals do not vary, or are sampled too rarely to show such frequencies.
    """
    if not _varies(signals) or frequency >= 1 / (2 * step):
        return None
    frequencies, power = _spectrum(signals, step)
    return float(power[frequencies > frequency].sum() / power.sum())


def regularity_of(signals: np.ndarray) -> float | None:
    """How well signals repeat themselves: the highest peak of their autocorrelation, at most 1.

    Args:
        signals: as in `frequency_of`.

    Returns:
        None without any peak at a lag of 3 control steps to half of the recording.
    """
    if not _varies(signals):
        return None
    deviations = signals.astype(np.float64) - signals.mean(axis=0, dtype=np.float64)
    power = (deviations**2).mean()
    correlations = np.array(
        [
            (deviations[lag:] * deviations[:-lag]).mean() / power
            for lag in range(1, int(_MOST_SHARE * len(signals)))
        ]
    )
    lags = np.arange(_LEAST_STEPS, len(correlations))  # a peak needs a neighbour on either side
    here, before, after = (correlations[lags - 1 + shift] for shift in (0, -1, 1))
    heights = here[(here > before) & (here >= after)]
    return float(heights.max()) if len(heights) else None


def _varies(signals: np.ndarray) -> bool:
    variance = float(signals.astype(np.float64).var(axis=0).mean()) if len(signals) else 0.0
    return math.isfinite(variance) and variance > 0


def _spectrum(signals: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz] and power, summed over the signals."""
    deviations = signals.astype(np.float64) - signals.mean(axis=0, dtype=np.float64)
    window = np.hanning(len(signals))[:, None]
    padded = _PADDING * len(signals)
    transform = np.fft.rfft(window * deviations, padded, axis=0)
    return np.fft.rfftfreq(padded, step), (np.abs(transform) ** 2).sum(axis=1)
