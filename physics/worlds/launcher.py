"""The tensors of a batch of worlds, and the launching of kernels on them."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from physics import backend, checks
from physics.engine import kernels
from physics.engine.contacts import terrain_window
from physics.engine.memory import layout as lay
from physics.engine.memory import model
from physics.engine.memory import state as st
from physics.engine.memory.grouping import Grouping
from physics.engine.memory.layout import Layout
from physics.engine.memory.settings import Engine
from physics.scene import clock, material
from physics.scene.bodies import Bodies, Body
from physics.scene.conditions import Conditions
from physics.scene.damage import Damage
from physics.worlds.batch import Batch
from physics.worlds.contents import Contents
from physics.worlds.first_states import own_items, varied
from physics.worlds.observations import Observed

__all__ = ["Launcher", "extent"]

_STRETCH = 1.3  # of a robot's diagonal, at most
_GAP = 4  # groups that are sensed again in vain rather than in two launches


class Launcher(Contents, Observed):
    """N worlds in memory; what a kernel needs, and how it is launched.

    Attributes:
        bodies: The robots.
        n_worlds, n_voxels: The numbers of worlds, N, and of voxels of each robot, V.
        lanes: worlds of a group.
        control_interval: engine steps in a control step.
        damage: when and how voxels break, if they do: in all worlds, or in the first that has it.
        program: what kernels are compiled for.
    """

    bodies: Bodies
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
    _places: Tensor | None  # of the worlds; None: in order
    _worlds: Tensor | None  # which world lies at each place, 0 where none does

    @property
    def groups(self) -> int:
        """Of worlds, each of as many lanes."""
        return self._grouping.whole.count

    @property
    def places(self) -> np.ndarray:
        """Where each world lies, counted through the lanes of all groups, (N,) int64."""
        return self._state.place_of(np.arange(self.n_worlds))

    def kernel_tensors(self, program: backend.Program) -> tuple[Tensor, ...]:
        """What every kernel takes first: state, lists, ground, and the model's two tables."""
        lists = backend.packed(self._state.lists, self.lanes)
        items = program.packed(self._state.items)
        return items, lists, self._batch.profiles, self._integers, self._numbers

    def _allocate(self) -> None:
        """Makes the model, and a state for it."""
        self._build()
        groups = self._grouping.whole.count
        self._state = st.allocate(
            self._model.layout,
            self.n_worlds,
            groups,
            self.lanes,
            self.dtype,
            self.device,
            self._places,
        )
        self._worlds = None
        if self._places is not None:
            self._worlds = torch.zeros_like(self._places).new_zeros(groups * self.lanes)
            self._worlds[self._places] = torch.arange(self.n_worlds, device=self.device)

    @torch.inference_mode(False)
    def _build(self) -> None:
        """Makes the model and its tables."""
        models: list[model.Model] = []
        for _ in range(1 if self.bodies.alike else 2):  # the second time there is room for all
            rooms = [each.layout for each in models]
            room = functools.reduce(Layout.union, rooms) if rooms else None
            models = [self._model_of(body, room) for body in self.bodies.unlike]
        self._model = (
            models[0] if self.bodies.alike else model.joined(models, self._grouping.robots)
        )
        self._integers = torch.from_numpy(self._model.integers).to(self.device)
        self._numbers = torch.from_numpy(self._model.numbers).to(self.device, self.dtype)

    def _model_of(self, body: Body, room: Layout | None) -> model.Model:
        """The model of one of the robots, in a layout with room for others."""
        return model.build(
            body.morphology,
            body.apparatus,
            self._engine,
            self._conditions,
            self._batch.segments,
            extent(body),
            self.damage.mode if self.damage else "rest",
            self.lanes,
            room,
        )

    def _widen(self) -> None:
        """Makes the terrain window as wide as the batch needs it by now."""
        self._build()
        self._state = st.widened(self._state, self._model.layout)

    def _bytes_per_world(self) -> int:
        """Least memory that a world takes, with what is copied when it is made [bytes]."""
        items = self.n_voxels * lay.VOXEL_ITEMS
        return 2 * items * (8 if self.dtype == torch.float64 else 4)

    def _features(self) -> backend.Features:
        """What kernels must have to simulate these robots."""
        each = [self._engine.features(body.morphology) for body in self.bodies.unlike]
        return backend.Features(
            any(features.self_collision for features in each),
            any(features.continuous for features in each),
            varied(self._conditions, self.bodies),
        )

    def _require_countable(self, steps: int) -> None:
        """Raises ValueError unless worlds can count so many more steps."""
        if self._steps + steps > clock.MOST_STEPS and (
            self._most_steps() + steps > clock.MOST_STEPS
        ):
            raise ValueError(
                f"steps: expected at most {clock.MOST_STEPS - self._steps} more, since a world "
                f"counts 2^31 steps (414 days) after a reset, got {steps}; reset the worlds"
            )

    def _begin(self, chosen: np.ndarray) -> None:
        """Puts some worlds at the start of an episode."""
        layout = self._model.layout
        blank, own = self._batch.first.blank(layout), own_items(layout)
        values = self._batch.first_states(layout, chosen)
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
        whole = self._grouping.whole
        if chosen is None or len(chosen) == self.n_worlds:
            self._center = None
            readings, ranges = self._readings(), iter([(0, whole.count)])
        else:
            self._move_centers(chosen)
            groups = sorted(set((self._state.place_of(chosen) // self.lanes).tolist()))
            readings, ranges = self._last_readings(), _ranges(groups)
        actions = readings.new_empty(1, self.n_worlds, self.n_voxels)  # not read
        tensors = *self.kernel_tensors(whole.program), actions, readings
        for first, count in ranges:
            kernel = kernels.play(whole.program)
            kernel(*tensors, -1, 0, first, count, min(count, whole.chunks))
        return self._given(readings)

    def _play(self, actions: Tensor, readings: Tensor, begin: int, end: int) -> None:
        """Runs the kernel for given actuations on all worlds."""
        self._center = None
        if self._worlds is not None:
            actions = actions[:, self._worlds]
        for part in self._grouping.parts_for(end - begin):
            tensors = *self.kernel_tensors(part.program), actions, readings
            kernel = kernels.play(part.program)
            kernel(*tensors, begin, end, part.first, part.count, part.chunks)

    def run_closed_loop(
        self, kernel: Callable[[backend.Program], backend.Kernel], controller: Tensor, steps: int
    ) -> Tensor | None:
        """Many control steps with a controller inside the kernel.

        Args:
            kernel: gives the kernel for a program, one of ``kernels.closed_loop``; the same one
                whenever it is asked.
            controller: the controller's tensor, (groups, items, lanes), of this simulator's dtype,
                changed in place; its memory in the order of kernels (`backend.unpacked`).
            steps: how many control steps.

        Returns:
            Readings after the last step, (N, R), or None without sensors.

        Raises:
            ValueError: a tensor for other worlds, of another type or in another order.
        """
        checks.tensor(
            "controller",
            controller,
            groups=self._grouping.whole.count,
            items=None,
            lanes=self.lanes,
        )
        if (
            controller.dtype != self.dtype
            or not backend.packed(controller, self.lanes).is_contiguous()
        ):
            raise ValueError(
                f"controller: expected {self.dtype} in the order of backend.unpacked, got "
                f"{controller.dtype} with strides {controller.stride()}"
            )
        engine_steps = steps * self.control_interval
        self._require_countable(engine_steps)
        self._center, self._at_start = None, False
        readings = self._readings()
        for part in self._grouping.parts_for(engine_steps):
            tensors = *self.kernel_tensors(part.program), part.program.packed(controller)
            kernel(part.program)(*tensors, readings, 0, steps, part.first, part.count, part.chunks)
        self._steps += engine_steps
        return self._given(readings)

    def _readings(self) -> Tensor:
        """Room for readings, which kernels fill if worlds lie in order."""
        if self._places is not None:
            return torch.empty(1, max(1, self.n_readings), dtype=self.dtype, device=self.device)
        return torch.empty(
            self.n_worlds, max(1, self.n_readings), dtype=self.dtype, device=self.device
        )

    def _last_readings(self) -> Tensor:
        """A copy of the readings, and room where there are none."""
        if self._places is not None or not self.n_readings:
            return self._readings()
        return self.readings()

    def _given(self, readings: Tensor) -> Tensor | None:
        """What callers get: the readings that kernels filled, or those of the state."""
        if not self.n_readings:
            return None
        return readings if self._places is None else self.readings()

    def _squares(self) -> dict[str, Any]:
        """Sizes of a table of squares."""
        return {"worlds": self.n_worlds, "voxels": self.n_voxels, "squares": 4, "numbers": 3}


def extent(body: Body) -> float:
    """Width of ground that a robot may need at once, whatever its posture [m]."""
    shape = body.morphology
    size = material.VOXEL_SIDE * math.hypot(shape.width, shape.height)
    return _STRETCH * size + 2 * (model.reach(body.apparatus) + terrain_window.MARGIN)


def _ranges(groups: Sequence[int]) -> Iterator[tuple[int, int]]:
    """First and count of ranges that hold some groups, given in order, and few others."""
    first = last = groups[0]
    for group in groups:
        if group - last > _GAP:
            yield first, last - first + 1
            first = group
        last = group
    yield first, last - first + 1
