"""The generator of the Java platform, java.util.Random, as its public documentation specifies it.

A linear congruential generator; normal numbers by the polar method.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

__all__ = ["JavaRandom", "java_gaussian_pairs"]

_MULTIPLIER, _INCREMENT, _MASK = 0x5DEECE66D, 0xB, (1 << 48) - 1


@lru_cache(maxsize=8)
def _jumps(n: int) -> tuple[np.ndarray, np.ndarray]:
    """(m_k, c_k), k = 1..n, such that the k-th state after s is m_k s + c_k (mod 2^48).

    uint64 wraps around modulo 2^64, which keeps the low 48 bits right.
    """
    multipliers = np.cumprod(np.full(n, _MULTIPLIER, dtype=np.uint64))
    sums = np.cumsum(np.concatenate((np.ones(1, np.uint64), multipliers[:-1])))
    return multipliers, sums * np.uint64(_INCREMENT)


def java_gaussian_pairs(
    seeds: Sequence[int], attempts: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Successive pairs of ``java.util.Random(seed).nextGaussian()``.

    Args:
        seeds: S seeds of generators, integers >= 0, of which the low 48 bits count.
        attempts: trials of the polar method, of which pi/4 on average give a pair.

    Returns:
        The first and the second of each pair, (S, attempts), and how many pairs of each seed there
        are, (S,); what lies behind them has no meaning.
    """
    multipliers, increments = _jumps(4 * attempts)
    first = np.array([(seed ^ _MULTIPLIER) & _MASK for seed in seeds], dtype=np.uint64)
    states = (multipliers * first[:, None] + increments) & np.uint64(_MASK)
    # nextDouble: 26 bits of one state and 27 of the next.
    high, low = states[:, 0::2] >> np.uint64(22), states[:, 1::2] >> np.uint64(21)
    doubles = ((high << np.uint64(27)) + low).astype(np.float64) * 2.0**-53
    pairs = (2.0 * doubles - 1.0).reshape(len(seeds), attempts, 2)
    square = (pairs * pairs).sum(2)
    rejected = (square >= 1.0) | (square == 0.0)
    square[rejected] = 1.0
    pairs *= np.sqrt(-2.0 * np.log(square) / square)[:, :, None]
    order = rejected.argsort(1, kind="stable")[:, :, None]
    pairs = np.take_along_axis(pairs, order, 1)
    return pairs[:, :, 0], pairs[:, :, 1], attempts - rejected.sum(1)


class JavaRandom:
    """The generator, one number at a time.

    Args:
        seed: an integer >= 0; its low 48 bits count.
    """

    def __init__(self, seed: int) -> None:
        self._state = (seed ^ _MULTIPLIER) & _MASK

    def bits(self, count: int) -> int:
        """The first ``count`` bits, at most 32, of the next state."""
        self._state = (self._state * _MULTIPLIER + _INCREMENT) & _MASK
        return self._state >> (48 - count)

    def uniform(self) -> float:
        """In [0, 1)."""
        high = self.bits(26)
        return ((high << 27) + self.bits(27)) * 2.0**-53

    def below(self, bound: int) -> int:
        """An integer in [0, bound), for a bound that is no power of two."""
        while True:
            number = self.bits(31)
            rest = number % bound
            if number - rest + bound - 1 < 2**31:
                return rest
