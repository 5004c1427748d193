"""Damage: from some time on, some voxels no longer work (paper, Sec. IV-B)."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from physics.scene import clock

__all__ = ["Damage", "of_worlds"]

MODES = ("rest", "frozen", "random", "blind")
_STREAM = 0xDA3A6E  # keeps these draws apart from other uses of a world's seed


@dataclass(frozen=True, eq=False)
class Damage:
    """When, how likely and how voxels break.

    Attributes:
        probability: The probability of each voxel to break, independently; unused if there is a
            mask.
        time: when it happens [s].
        mode: what a broken voxel does. "rest" (the paper's text): its springs are at rest length
            and external forces alone shape it. "frozen" (the reference simulator): it keeps the
            actuation it had. "random": it takes a random actuation at every step. "blind": it
            obeys, but its sensors read 0, without noise.
        until: when broken voxels work again [s].
        mask: which voxels break instead of a random choice: bools of shape (V,), the same in every
            world, or (N, V); a tensor, array or list. Kept as a read-only array.
    """

    probability: float = 0.5
    time: float = 30.0
    mode: str = "rest"
    until: float = math.inf
    mask: Any = None

    def __post_init__(self) -> None:
        if not 0 <= self.probability <= 1:
            raise ValueError(f"damage: expected probability in [0, 1], got {self.probability!r}")
        if not (math.isfinite(self.time) and self.time >= 0):
            raise ValueError(f"damage: expected a finite time >= 0 s, got {self.time!r}")
        clock.steps_in(self.time, "damage: time")
        if math.isfinite(self.until):
            clock.steps_in(max(0.0, self.until), "damage: until")
        if not self.until > self.time:
            raise ValueError(f"damage: expected until > time = {self.time} s, got {self.until!r}")
        if self.mode not in MODES:
            raise ValueError(f"damage: expected mode in {', '.join(MODES)}, got {self.mode!r}")
        if self.mask is not None:
            object.__setattr__(self, "mask", _bools(self.mask))

    @classmethod
    def from_name(cls, name: str) -> Damage | None:
        """None for "none", `Damage()` for "half"; until version 0.3, and with a warning.

        Raises:
            ValueError: the name is neither.
        """
        words = "Damage.from_name goes with version 0.3; say None or Damage()"
        warnings.warn(words, DeprecationWarning, stacklevel=2)
        if name not in ("none", "half"):
            raise ValueError(f"damage: expected none or half, got {name!r}")
        return cls() if name == "half" else None

    def sample(self, seed: int, n_voxels: int) -> np.ndarray:
        """Which voxels of one world break.

        Args:
            seed: that world's seed, an integer >= 0; nothing else decides.
            n_voxels: The number of voxels, V.

        Returns:
            True where broken, shape (V,), bool.

        Raises:
            ValueError: if the seed is negative.
        """
        if seed < 0:
            raise ValueError(f"damage: expected a seed >= 0, got {seed!r}")
        return np.random.default_rng((_STREAM, seed)).random(n_voxels) < self.probability

    def broken_mask(self, n_worlds: int, n_voxels: int) -> np.ndarray | None:
        """The mask for a batch of worlds, (N, V) bool, or None where chance decides.

        Raises:
            ValueError: if the mask is not for N worlds or V voxels.
        """
        if self.mask is None:
            return None
        shape = (n_worlds, n_voxels)
        if self.mask.shape not in (shape, shape[1:]):
            raise ValueError(
                f"damage: expected a mask of shape (voxels={n_voxels},) or "
                f"(worlds={n_worlds}, voxels={n_voxels}), got {self.mask.shape}"
            )
        return np.broadcast_to(self.mask, shape)


def of_worlds(damage: Any, n_worlds: int) -> list[Damage | None] | None:
    """The damage of each world, from one for all of them or a list of N; None: no damage.

    Raises:
        ValueError: it is none of these, or worlds have different modes.
    """
    if damage is None or isinstance(damage, Damage):
        return None if damage is None else [damage] * n_worlds
    each = list(damage) if isinstance(damage, list | tuple) else [damage]
    if strange := [one for one in each if not (one is None or isinstance(one, Damage))]:
        raise ValueError(f"damage: expected physics.Damage or None, got {strange[0]!r}")
    if len(each) != n_worlds:
        raise ValueError(f"damage: expected one or a list of {n_worlds}, got {len(each)}")
    if len(modes := {one.mode for one in each if one is not None}) > 1:
        raise ValueError(
            f"damage: expected the same mode in all worlds, got {', '.join(sorted(modes))}"
        )
    return each if modes else None


def _bools(mask: Any) -> np.ndarray:
    """The mask as a read-only array of its own."""
    try:
        table = np.asarray(mask).copy()
    except ValueError:  # rows of different lengths
        table = np.array(None)
    if table.dtype != bool:
        raise ValueError(f"damage: expected a mask of bools, got {mask!r}")
    table.setflags(write=False)
    return table
