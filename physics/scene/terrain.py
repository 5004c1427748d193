"""Ground profiles: straight segments through (xs, ys), with walls at both ends.

Random profiles are drawn with the generator of the Java platform (the linear congruential
generator and polar normal method that its public documentation specifies), so that a terrain
of the reference simulator and ours of the same name are one and the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

__all__ = ["Terrain"]

_START, _END = 10.0, 1990.0  # the ground between the walls [m]
_WALL_WIDTH, _WALL_TOP = 10.0, 100.0  # [m]
_FLAT_HEIGHT = 5.0  # [m]
_DEPTH = 50.0  # of solid ground under the lowest point [m]
_STEP_RAMP = 0.5  # horizontal length of a step of "steppy" [m]
_UNEVEN_START = 30.0  # of "flatWithStart" [m]
_UNEVEN_HEIGHT, _UNEVEN_LENGTH = 0.5, 3.0  # its bumps [m]


@dataclass(frozen=True, eq=False)
class Terrain:
    """A ground profile. Build it with :meth:`from_name` or :meth:`from_profile`.

    Attributes:
        xs: abscissas of the points [m], shape (K,), float64, increasing, read-only.
        ys: heights of the points [m], shape (K,), float64, read-only.
        name: its name, for logs and messages.
    """

    xs: np.ndarray
    ys: np.ndarray
    name: str

    @classmethod
    def from_name(cls, name: str, seed: int | None = None) -> Terrain:
        """A terrain of the catalogue. Numbers may be decimal; the seed is an integer >= 0.

        =================  ===============================================================
        flat               level at 5 m
        hilly-h-w-seed     a random walk: steps of max(1, (0.25 g + 1) w) m across and g' h
                           up, g and g' standard normal
        steppy-h-w-seed    the same steps as level treads joined by ramps 0.5 m long
        uphill-a           a slope that rises by a degrees, from 5 m
        downhill-a         a slope that falls by a degrees, from 5 m
        flatWithStart-seed 30 m of small random bumps (0.5 m every 3 m), then level: each
                           seed makes the robot start in another pose
        =================  ===============================================================

        Args:
            name: One of these, or an open name without its seed ("hilly-3-30").
            seed: Completes an open name ("hilly-3-30" to "hilly-3-30-7"); a name that is complete,
                or has no seed, is the same whatever it is.

        Raises:
            ValueError: if the name is unknown, has another number of fields, or a field is not
                a number in range.
        """
        family, *fields = name.split("-") if isinstance(name, str) else ("",)
        if family not in _FAMILIES:
            raise ValueError(f"terrain: expected one of {', '.join(_FORMS)}, got {name!r}")
        form, build = _FAMILIES[family]
        expected = form.split("-")[1:]
        if seed is not None and expected[-1:] == ["seed"] and len(fields) == len(expected) - 1:
            name = f"{name}-{seed}"
            fields = [*fields, str(seed)]
        if len(fields) != len(expected):
            raise ValueError(
                f"terrain: expected {form} ({len(expected)} field(s)), got {name!r} "
                f"({len(fields)} field(s))"
            )
        values = [_parse(field, text, name) for field, text in zip(expected, fields, strict=True)]
        xs, ys = build(*values)
        return cls._of_arrays(xs, ys, name)

    @classmethod
    def from_profile(cls, xs: Any, ys: Any, name: str = "profile") -> Terrain:
        """A terrain through given points.

        Args:
            xs: abscissas [m], 1-D, at least two, increasing.
            ys: heights [m], as many.
            name: its name.

        Raises:
            ValueError: if the points are too few, not finite, not paired or not increasing in x.
        """
        xs, ys = np.array(xs, dtype=np.float64), np.array(ys, dtype=np.float64)
        if xs.ndim != 1 or xs.shape != ys.shape or len(xs) < 2:
            raise ValueError(
                "terrain: expected xs and ys 1-D, of one length >= 2, "
                f"got shapes {xs.shape} and {ys.shape}"
            )
        if not (np.isfinite(xs).all() and np.isfinite(ys).all()):
            raise ValueError("terrain: expected finite xs and ys, got NaN or infinity")
        falls = np.nonzero(np.diff(xs) <= 0)[0]
        if len(falls):
            at = int(falls[0])
            raise ValueError(
                f"terrain: expected increasing xs, got xs[{at}] = {xs[at]}, "
                f"xs[{at + 1}] = {xs[at + 1]}; sort the points and drop repeated ones"
            )
        return cls._of_arrays(xs, ys, name)

    @classmethod
    def _of_arrays(cls, xs: np.ndarray, ys: np.ndarray, name: str) -> Terrain:
        xs.setflags(write=False)
        ys.setflags(write=False)
        return cls(xs, ys, name)

    @property
    def bottom(self) -> float:
        """Height down to which the ground is solid [m]."""
        return float(self.ys.min()) - _DEPTH

    def height(self, x: Any) -> np.ndarray:
        """Height of the ground at x [m], same shape as x; level beyond the two ends."""
        return np.interp(x, self.xs, self.ys)

    def highest(self, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Greatest height of the ground between abscissas left and right [m], both (K,)."""
        peaks = np.maximum(self.height(left), self.height(right))
        first, last = np.searchsorted(self.xs, (left.min(), right.max()))
        for x, y in zip(self.xs[first:last], self.ys[first:last], strict=True):
            peaks = np.where((left <= x) & (x <= right), np.maximum(peaks, y), peaks)
        return peaks


def _parse(field: str, text: str, name: str) -> float | int:
    """The value of one field of a name; see _FAMILIES for what the letters stand for."""
    wanted, accept = _FIELDS[field]
    try:
        value = int(text) if field == "seed" else float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and accept(value)):
        raise ValueError(f"terrain: expected {field} = {wanted}, got {text!r} in {name!r}")
    return value


# --- profiles -----------------------------------------------------------------------------------

Profile = tuple[np.ndarray, np.ndarray]


def _walled(xs: np.ndarray, ys: np.ndarray, left: float, right: float) -> Profile:
    """The ground (xs, ys) between two walls, up to heights ``left`` and ``right`` [m]."""
    return (
        np.concatenate(([xs[0] - _WALL_WIDTH], xs, [xs[-1] + _WALL_WIDTH])),
        np.concatenate(([left], ys, [right])),
    )


def _slope(degrees: float) -> Profile:
    ends = np.array(
        [_FLAT_HEIGHT, _FLAT_HEIGHT + (_END - _START) * math.tan(math.radians(degrees))]
    )
    wall = _WALL_TOP - _FLAT_HEIGHT
    return _walled(np.array([_START, _END]), ends, ends[0] + wall, ends[1] + wall)


def _hilly(h: float, w: float, seed: int) -> Profile:
    xs, ys = _walk(h, w, seed, until=_END)
    return _walled(xs, ys, _WALL_TOP, _WALL_TOP)


def _steppy(h: float, w: float, seed: int) -> Profile:
    xs, ys = _walk(h, w, seed, until=_END)
    # A tread is level up to a ramp that ends where the next tread begins (treads are >= 1 m).
    xs = np.stack((xs[1:] - _STEP_RAMP, xs[1:]), axis=1).ravel()
    ys = np.stack((ys[:-1], ys[1:]), axis=1).ravel()
    xs, ys = np.concatenate(([_START], xs)), np.concatenate(([0.0], ys))
    return _walled(xs, ys, _WALL_TOP, _WALL_TOP)


def _flat_with_start(seed: int) -> Profile:
    xs, ys = _walk(_UNEVEN_HEIGHT, _UNEVEN_LENGTH, seed, until=_START + _UNEVEN_START)
    xs, ys = np.append(xs, _END), np.append(ys, ys[-1])
    return _walled(xs, ys, _WALL_TOP, _WALL_TOP)


def _walk(h: float, w: float, seed: int, until: float) -> Profile:
    """The random walk of "hilly" from (10, 0) to its first point at or beyond ``until``."""
    attempts = 32 + int(1.4 * (until - _START) / max(w, 1.0))  # mostly enough; never too few
    while True:
        across, up = java_gaussian_pairs(seed, attempts)
        xs = np.cumsum(np.concatenate(([_START], np.maximum(1.0, (across * 0.25 + 1.0) * w))))
        if xs[-1] >= until:
            points = int(np.searchsorted(xs, until)) + 1
            ys = np.cumsum(np.concatenate(([0.0], up[: points - 1] * h)))
            return xs[:points], ys
        attempts *= 2


# --- java.util.Random ---------------------------------------------------------------------------

_MULTIPLIER, _INCREMENT, _MASK = 0x5DEECE66D, 0xB, (1 << 48) - 1


@lru_cache(maxsize=8)
def _jumps(n: int) -> tuple[np.ndarray, np.ndarray]:
    """(m_k, c_k), k = 1..n, such that the k-th state after s is m_k s + c_k (mod 2^48).

    uint64 wraps around modulo 2^64, which keeps the low 48 bits right.
    """
    multipliers = np.cumprod(np.full(n, _MULTIPLIER, dtype=np.uint64))
    sums = np.cumsum(np.concatenate((np.ones(1, np.uint64), multipliers[:-1])))
    return multipliers, sums * np.uint64(_INCREMENT)


def java_gaussian_pairs(seed: int, attempts: int) -> tuple[np.ndarray, np.ndarray]:
    """Successive pairs of ``java.util.Random(seed).nextGaussian()``.

    Args:
        seed: the generator's seed, an integer >= 0; its low 48 bits count.
        attempts: trials of the polar method, of which pi/4 on average give a pair.

    Returns:
        The first and the second of each pair, two arrays of equal length <= attempts.
    """
    multipliers, increments = _jumps(4 * attempts)
    state = np.uint64((seed ^ _MULTIPLIER) & _MASK)
    states = (multipliers * state + increments) & np.uint64(_MASK)
    # nextDouble: 26 bits of one state and 27 of the next.
    high, low = states[0::2] >> np.uint64(22), states[1::2] >> np.uint64(21)
    doubles = ((high << np.uint64(27)) + low).astype(np.float64) * 2.0**-53
    v = 2.0 * doubles - 1.0
    v1, v2 = v[0::2], v[1::2]
    square = v1 * v1 + v2 * v2
    accepted = (square < 1.0) & (square != 0.0)
    v1, v2, square = v1[accepted], v2[accepted], square[accepted]
    scale = np.sqrt(-2.0 * np.log(square) / square)
    return v1 * scale, v2 * scale


_FIELDS: dict[str, tuple[str, Callable[[float], bool]]] = {
    "h": ("a height >= 0 [m]", lambda value: value >= 0),
    "w": ("a length > 0 [m]", lambda value: value > 0),
    "a": ("an angle in [0, 90) [degrees]", lambda value: 0 <= value < 90),
    "seed": ("an integer >= 0", lambda value: value >= 0),
}
_FAMILIES: dict[str, tuple[str, Callable[..., Profile]]] = {
    "flat": ("flat", lambda: _slope(0.0)),
    "hilly": ("hilly-h-w-seed", _hilly),
    "steppy": ("steppy-h-w-seed", _steppy),
    "uphill": ("uphill-a", _slope),
    "downhill": ("downhill-a", lambda a: _slope(-a)),
    "flatWithStart": ("flatWithStart-seed", _flat_with_start),
}
_FORMS = [form for form, _ in _FAMILIES.values()]
