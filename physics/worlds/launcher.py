"""The tensors of a batch of worlds, and the launching of kernels on them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import torch
from torch import Tensor

from physics import backend
from physics.engine import kernels
from physics.engine.memory import layout as lay
from physics.engine.memory import model
from physics.engine.memory import state as st
from physics.engine.memory.grouping import Grouping
from physics.engine.memory.model import Engine
from physics.scene import clock
from physics.scene.conditions import Conditions
from physics.scene.damage import Damage
from physics.scene.morphology import Morphology
from physics.scene.sensors import Apparatus
from physics.worlds.batch import Batch
from physics.worlds.observations import Observed

__all__ = ["Launcher"]

_FIRST_STEPS = 3700  # the table of sensor windows starts with one minute
_GAP = 4  # groups that are sensed again in vain rather than in two launches


class Launcher(Observed):
    """N worlds in memory; what a kernel needs, and how it is launched.

    Attributes:
        morphology, apparatus: of the robots.
        n_worlds, n_voxels: N, V.
        lanes: worlds of a group.
        control_interval: engine steps in a control step.
        damage: when and how voxels break, if they do.
        program: what kernels are compiled for.
    """

    morphology: Morphology
    apparatus: Apparatus
    n_worlds: int
    n_voxels: int
    lanes: int
    control_interval: int
    damage: Damage | None
    program: backend.Program
    _engine: Engine
    _conditions: Conditions
    _grouping: Grouping
    _batch: Batch

    def kernel_tensors(self, program: backend.Program) -> tuple[Tensor, ...]:
        """What every kernel takes first: state, lists, ground, and the model's two tables."""
        lists = backend.packed(self._state.lists, self.lanes)
        items = program.packed(self._state.items)
        return items, lists, self._batch.profiles, self._integers, self._numbers

    def _allocate(self) -> None:
        """Makes the model, and a state for it."""
        self._build(_FIRST_STEPS)
        self._state = st.allocate(
            self._model.layout, self.n_worlds, self.lanes, self.dtype, self.device
        )

    @torch.inference_mode(False)
    def _build(self, max_steps: int) -> None:
        """Makes the model and its tables."""
        self._model = model.build(
            self.morphology,
            self.apparatus,
            self._engine,
            self._conditions,
            self._batch.segments,
            self._batch.extent,
            self.damage.mode if self.damage else "rest",
            max_steps,
            self.lanes,
        )
        self._integers = torch.from_numpy(self._model.integers).to(self.device)
        self._numbers = torch.from_numpy(self._model.numbers).to(self.device, self.dtype)

    def _widen(self) -> None:
        """Makes the terrain window as wide as the batch needs it by now."""
        self._build(self._model.max_steps)
        self._state = st.widened(self._state, self._model.layout)

    def _reserve(self, steps: int) -> None:
        """Makes the table of sensor windows long enough for ``steps`` more.

        Raises:
            ValueError: worlds cannot count so far.
        """
        if self._steps + steps > clock.ENDLESS:
            raise ValueError(
                f"steps: expected at most {int(clock.ENDLESS) - self._steps} more, since a world "
                f"counts 2^24 steps (77 hours) after a reset, got {steps}; reset the worlds"
            )
        if self._steps + steps > self._model.max_steps:
            self._build(max(2 * self._model.max_steps, self._steps + steps))

    def _begin(self, chosen: np.ndarray) -> None:
        """Puts some worlds at the start of an episode."""
        layout = self._model.layout
        blank, (own, values) = self._batch.blank(layout), self._batch.first_states(layout, chosen)
        if len(chosen) == self.n_worlds:
            st.fill(self._state, blank, own, values)
        else:
            st.replace(self._state, chosen, blank, own, values)

    def _look(self, chosen: np.ndarray | None = None) -> Tensor | None:
        """Contacts and readings of the present poses, which have just been changed.

        Args:
            chosen: numbers of the worlds whose poses have changed; None: of all.

        Returns:
            Readings of all worlds.
        """
        self._center = None
        self._steps = int(self._state.header(lay.H_STEP).max())
        whole = self._grouping.whole
        if chosen is None or len(chosen) == self.n_worlds:
            readings, ranges = self._readings(), iter([(0, whole.count)])
        else:
            readings, ranges = self._last_readings(), _ranges(np.unique(chosen // self.lanes))
        actions = readings.new_empty(1, self.n_worlds, self.n_voxels)  # not read
        tensors = *self.kernel_tensors(whole.program), actions, readings
        for first, count in ranges:
            kernel = kernels.play(whole.program)
            kernel(*tensors, -1, 0, first, count, min(count, whole.chunks))
        return self._given(readings)

    def _play(self, actions: Tensor, readings: Tensor, begin: int, end: int) -> None:
        """Runs the kernel for given actuations on all worlds."""
        self._center = None
        for part in self._grouping.parts_for(end - begin):
            tensors = *self.kernel_tensors(part.program), actions, readings
            kernel = kernels.play(part.program)
            kernel(*tensors, begin, end, part.first, part.count, part.chunks)

    def _readings(self) -> Tensor:
        """Room for readings, which kernels fill."""
        return torch.empty(
            self.n_worlds, max(1, self.n_readings), dtype=self.dtype, device=self.device
        )

    def _last_readings(self) -> Tensor:
        """A copy of the readings, and room where there are none."""
        return self.readings().clone() if self.n_readings else self._readings()

    def _given(self, readings: Tensor) -> Tensor | None:
        return readings if self.n_readings else None

    def _squares(self) -> dict[str, Any]:
        """Sizes of a table of squares."""
        return {"worlds": self.n_worlds, "voxels": self.n_voxels, "squares": 4, "numbers": 3}


def _ranges(groups: np.ndarray) -> Iterator[tuple[int, int]]:
    """First and count of ranges that hold some groups, given in order, and few others."""
    breaks = np.flatnonzero(np.diff(groups) > _GAP) + 1
    for part in np.split(groups, breaks):
        yield int(part[0]), int(part[-1] - part[0] + 1)
