"""The robots of a batch: one body in all worlds, or bodies that differ."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from physics.scene.morphology import Morphology
from physics.scene.sensors import Apparatus

__all__ = ["Bodies", "Body"]

Rows = slice | np.ndarray
"""Which of some worlds: all of them, or these."""


@dataclass(frozen=True)
class Body:
    """A robot: its shape and its sensors.

    Attributes:
        morphology: the shape.
        apparatus: the sensors.
    """

    morphology: Morphology
    apparatus: Apparatus

    @property
    def n_voxels(self) -> int:
        """V of this robot."""
        return self.morphology.n_voxels


@dataclass(frozen=True, eq=False)
class Bodies:
    """Which robot is in which of N worlds.

    Attributes:
        unlike: the robots that differ, in the order in which worlds first have them.
        of_world: the number of each world's robot in that list, (N,).
    """

    unlike: tuple[Body, ...]
    of_world: np.ndarray

    @classmethod
    def of(cls, shape: Any, sensors: Any, n_worlds: int) -> Bodies:
        """The robots that arguments of `Simulator` stand for.

        Args:
            shape: one for all worlds, or a list of N: names, grids or morphologies.
            sensors: one for all worlds; for a list of shapes also a list of N.
            n_worlds: N.

        Raises:
            ValueError: one of them is wrong, or they are not N.
        """
        shapes = several_shapes(shape)
        if shapes is None:
            morphology = Morphology.of(shape)
            body = Body(morphology, Apparatus.of(sensors, morphology))
            return cls((body,), np.broadcast_to(np.int64(0), n_worlds))  # which takes no memory
        if len(shapes) != n_worlds:
            raise ValueError(
                f"shape: expected one, or a list of one for each of the {n_worlds} worlds, got a "
                f"list of {len(shapes)}"
            )
        own = list(sensors) if isinstance(sensors, list | tuple) else [sensors] * n_worlds
        if len(own) != n_worlds:
            raise ValueError(
                f"sensors: expected one, or a list of one for each of the {n_worlds} worlds, got a "
                f"list of {len(own)}"
            )
        numbers: dict[Any, int] = {}
        unlike: list[Body] = []
        of_world = np.empty(n_worlds, dtype=np.int64)
        for world, (each, spec) in enumerate(zip(shapes, own, strict=True)):
            morphology = Morphology.of(each)
            body = Body(morphology, Apparatus.of(spec, morphology))
            key = (morphology.grid.shape, morphology.grid.tobytes(), morphology.materials)
            number = numbers.setdefault((*key, body.apparatus), len(unlike))
            if number == len(unlike):
                unlike.append(body)
            of_world[world] = number
        return cls(tuple(unlike), of_world)

    @property
    def alike(self) -> bool:
        """Whether all worlds have the same robot."""
        return len(self.unlike) == 1

    @property
    def n_voxels(self) -> int:
        """V: of the robot that has most of them."""
        return max(body.n_voxels for body in self.unlike)

    @property
    def n_readings(self) -> int:
        """R: of the robot that has most of them."""
        return max(body.apparatus.n_readings for body in self.unlike)

    @property
    def counts(self) -> list[int]:
        """Worlds of each of the unlike robots."""
        return np.bincount(self.of_world, minlength=len(self.unlike)).tolist()

    def present(self) -> np.ndarray:
        """Which voxels there are, (N, V) bool."""
        counts = np.array([body.n_voxels for body in self.unlike])
        return np.arange(self.n_voxels) < counts[self.of_world][:, None]

    def among(self, chosen: np.ndarray) -> Iterator[tuple[int, Rows]]:
        """The robots of some worlds.

        Args:
            chosen: numbers of k worlds.

        Yields:
            The number of each of the unlike robots that is among them, and which of the k have it.
        """
        if self.alike:
            yield 0, slice(None)
            return
        own = self.of_world[chosen]
        for number in np.unique(own):
            yield int(number), np.flatnonzero(own == number)


def several_shapes(shape: Any) -> Sequence[Any] | None:
    """The shapes of a list of them; None for one shape, which may be a nested list of numbers."""
    if isinstance(shape, Morphology | str) or not isinstance(shape, list | tuple):
        return None
    if len(shape) == 0 or not all(
        isinstance(each, Morphology | str) or _is_grid(each) for each in shape
    ):
        return None
    return shape


def _is_grid(value: Any) -> bool:
    """Whether it is a table of numbers."""
    if isinstance(value, np.ndarray):
        return value.ndim == 2
    return isinstance(value, list | tuple) and any(isinstance(row, list | tuple) for row in value)
