"""Ground profiles: straight segments through (xs, ys), with walls at both ends.

Random profiles are drawn with the generator of the Java platform, so that a terrain of the
reference simulator and ours of the same name are one and the same.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from physics.scene.java_random import JavaRandom, java_gaussian_pairs

__all__ = ["Terrain"]

_START, _END = 10.0, 1990.0  # the ground between the walls [m]
_WALL_WIDTH, _WALL_TOP = 10.0, 100.0  # [m]
_FLAT_HEIGHT = 5.0  # [m]
_STEP_RAMP = 0.5  # horizontal length of a step of "steppy" [m]
_TILTED_LENGTH = 24.0  # of the start of "flatWithStart" [m]
_GREATEST_TILT = math.radians(10)
_FARTHEST = 1e7  # coordinate: beyond it float32 rounds to metres [m]


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
        steppy-h-w-seed    level treads as long as these steps, each followed by a ramp 0.5 m long
                           and g' h high
        uphill-a           rises from 5 m by sin a for every metre across, a in degrees
        downhill-a         falls to 5 m likewise
        flatWithStart-seed 24 m tilted by up to 10 degrees, at random, then level at 5 m: each
                           seed makes the robot start in another pose
        =================  ===============================================================

        Args:
            name: One of these, or an open name without its seed ("hilly-3-30").
            seed: Completes an open name ("hilly-3-30" to "hilly-3-30-7"); a name that is complete,
                or has no seed, is the same whatever it is.

        Raises:
            ValueError: if the name is unknown, has another number of fields, a field is not a
                number in range, or the ground would reach farther than 1e7 m.
        """
        return cls._of_names(
            [f"{name}-{seed}" if seed is not None and cls.is_open(name) else name]
        )[0]

    @staticmethod
    def is_open(name: str) -> bool:
        """Whether a name of the catalogue lacks its seed and nothing else.

        Raises:
            ValueError: the name is unknown.
        """
        form, fields = _fields_of(name)
        return form.endswith("-seed") and len(fields) == form.count("-") - 1

    @classmethod
    def from_open_name(cls, name: str, seeds: Sequence[int]) -> list[Terrain]:
        """Terrains of an open name ("hilly-3-30"), one for each seed: those of `from_name`, drawn
        together, which takes a fraction of the time.

        Args:
            name: a name of the catalogue without its seed.
            seeds: integers >= 0.

        Raises:
            ValueError: as `from_name`, or the name is complete or has no seed.
        """
        if not cls.is_open(name):
            raise ValueError(
                f"terrain: expected a name without its seed, such as hilly-3-30, got {name!r}"
            )
        names = [f"{name}-{seed}" for seed in seeds]
        return cls._of_names(names) if names else []

    @classmethod
    def _of_names(cls, names: list[str]) -> list[Terrain]:
        """Terrains of complete names that differ in their seeds only."""
        form, fields = _fields_of(names[0])
        family, *expected = form.split("-")
        if len(fields) != len(expected):
            raise ValueError(
                f"terrain: expected {form} ({len(expected)} field(s)), got {names[0]!r} "
                f"({len(fields)} field(s))"
            )
        values = [
            _parse(field, text, names[0]) for field, text in zip(expected, fields, strict=True)
        ]
        if expected[-1:] == ["seed"]:
            values[-1] = [_parse("seed", each.rpartition("-")[2], each) for each in names]
        with np.errstate(over="ignore", invalid="ignore"):
            profiles = _FAMILIES[family][1](*values)
        for name, profile in zip(names, profiles, strict=True):
            _check_extent(*profile, name)
        return [cls._of_arrays(*each, name) for name, each in zip(names, profiles, strict=True)]

    @classmethod
    def from_profile(cls, xs: Any, ys: Any, name: str = "profile") -> Terrain:
        """A terrain through given points.

        Args:
            xs: abscissas [m], 1-D, at least two, increasing.
            ys: heights [m], as many.
            name: The name of the terrain.

        Raises:
            ValueError: if the points are too few, not finite, not paired, not increasing in x or
                farther than 1e7 m.
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
        _check_extent(xs, ys, name)
        return cls._of_arrays(xs, ys, name)

    @classmethod
    def _of_arrays(cls, xs: np.ndarray, ys: np.ndarray, name: str) -> Terrain:
        xs.setflags(write=False)
        ys.setflags(write=False)
        return cls(xs, ys, name)

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


def _fields_of(name: Any) -> tuple[str, list[str]]:
    """The form of a name of the catalogue, such as hilly-h-w-seed, and the fields it has."""
    family, *fields = name.split("-") if isinstance(name, str) else ("",)
    if family not in _FAMILIES:
        raise ValueError(f"terrain: expected one of {', '.join(_FORMS)}, got {name!r}")
    return _FAMILIES[family][0], fields


def _parse(field: str, text: str, name: str) -> Any:
    """The value of one field of a name; see _FIELDS for what the letters stand for."""
    wanted, accept = _FIELDS[field]
    value: float | int = math.nan
    if field == "seed":
        value = int(text) if _INTEGER.fullmatch(text) else math.nan
    elif _DECIMAL.fullmatch(text):
        value = float(text)
    if not (math.isfinite(value) and accept(value)):
        raise ValueError(f"terrain: expected {field} = {wanted}, got {text!r} in {name!r}")
    return value


# --- profiles -----------------------------------------------------------------------------------

Profile = tuple[np.ndarray, np.ndarray]


def _walled(xs: np.ndarray, ys: np.ndarray, left: float, right: float) -> Profile:
    """The ground (xs, ys) between two walls, up to heights ``left`` and ``right`` [m]."""
    profile = np.empty((2, len(xs) + 2))
    profile[0, 1:-1], profile[1, 1:-1] = xs, ys
    profile[0, 0], profile[0, -1] = xs[0] - _WALL_WIDTH, xs[-1] + _WALL_WIDTH
    profile[1, 0], profile[1, -1] = left, right
    return profile[0], profile[1]


def _slope(degrees: float) -> list[Profile]:
    rise = (_END - _START) * math.sin(math.radians(degrees))
    ends = _FLAT_HEIGHT + np.array([max(0.0, -rise), max(0.0, rise)])
    wall = _WALL_TOP - _FLAT_HEIGHT
    return [_walled(np.array([_START, _END]), ends, ends[0] + wall, ends[1] + wall)]


def _hilly(h: float, w: float, seeds: list[int]) -> list[Profile]:
    return [_walled(*walk, _WALL_TOP, _WALL_TOP) for walk in _walks(h, w, seeds, until=_END)]


def _steppy(h: float, w: float, seeds: list[int]) -> list[Profile]:
    profiles = []
    for starts, heights in _walks(h, w, seeds, until=_END, pause=_STEP_RAMP):
        # A tread is level up to the ramp, at whose end the next one begins.
        xs = np.stack((starts[1:] - _STEP_RAMP, starts[1:]), axis=1).ravel()
        ys = np.stack((heights[:-1], heights[1:]), axis=1).ravel()
        xs, ys = np.concatenate(([_START], xs)), np.concatenate(([0.0], ys))
        profiles.append(_walled(xs, ys, _WALL_TOP, _WALL_TOP))
    return profiles


def _flat_with_start(seeds: list[int]) -> list[Profile]:
    profiles = []
    for seed in seeds:
        numbers = JavaRandom(seed)
        for _ in range(numbers.below(10) + 10):
            numbers.uniform()
        tilt = _GREATEST_TILT * (2 * numbers.uniform() - 1)
        xs = np.array([_START, _START + _TILTED_LENGTH, _END])
        ys = _FLAT_HEIGHT + np.array([_TILTED_LENGTH * math.sin(tilt), 0.0, 0.0])
        profiles.append(_walled(xs, ys, _WALL_TOP, _WALL_TOP))
    return profiles


def _walks(h: float, w: float, seeds: list[int], until: float, pause: float = 0.0) -> list[Profile]:
    """The random walks of "hilly" from (10, 0) to the first point at or beyond ``until``, with
    steps longer by ``pause``, one for each seed."""
    attempts = 32 + int(1.4 * (until - _START) / max(w, 1.0))  # mostly enough
    across, up, pairs = java_gaussian_pairs(seeds, attempts)
    while True:
        xs = np.empty((len(seeds), attempts + 1))
        xs[:, 0] = _START
        xs[:, 1:] = np.maximum(1.0, (across * 0.25 + 1.0) * w) + pause
        xs.cumsum(axis=1, out=xs)
        points = (xs < until).sum(1) + 1
        if (points <= pairs + 1).all():
            break
        attempts *= 2
        across, up, pairs = java_gaussian_pairs(seeds, attempts)
    ys = np.zeros((len(seeds), int(points.max())))
    ys[:, 1:] = up[:, : ys.shape[1] - 1] * h
    ys.cumsum(axis=1, out=ys)
    return [(xs[k, :own], ys[k, :own]) for k, own in enumerate(points)]


def _check_extent(xs: np.ndarray, ys: np.ndarray, name: str) -> None:
    if not (np.abs(xs).max() <= _FARTHEST and np.abs(ys).max() <= _FARTHEST):  # nor is NaN
        raise ValueError(
            f"terrain: expected coordinates within {_FARTHEST:g} m, got farther ones in {name!r}"
        )


# --- the catalogue ------------------------------------------------------------------------------

_INTEGER = re.compile("[0-9]{1,18}")
_DECIMAL = re.compile(r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE]\+?[0-9]{1,3})?")
_FIELDS: dict[str, tuple[str, Callable[[float], bool]]] = {
    "h": ("a height >= 0 [m]", lambda value: value >= 0),
    "w": ("a length > 0 [m]", lambda value: value > 0),
    "a": ("an angle in [0, 90) [degrees]", lambda value: 0 <= value < 90),
    "seed": ("an integer >= 0", lambda value: value >= 0),
}
_FAMILIES: dict[str, tuple[str, Callable[..., list[Profile]]]] = {
    "flat": ("flat", lambda: _slope(0.0)),
    "hilly": ("hilly-h-w-seed", _hilly),
    "steppy": ("steppy-h-w-seed", _steppy),
    "uphill": ("uphill-a", _slope),
    "downhill": ("downhill-a", lambda a: _slope(-a)),
    "flatWithStart": ("flatWithStart-seed", _flat_with_start),
}
_FORMS = [form for form, _ in _FAMILIES.values()]
