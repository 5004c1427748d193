"""The simulator: a batch of soft robots, each in a world of its own."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor

from physics import backend, checks
from physics.engine import kernels
from physics.engine.contacts import ground_detection
from physics.engine.memory import layout as lay
from physics.engine.memory import model
from physics.engine.memory import state as st
from physics.engine.memory.grouping import Grouping, lanes_for
from physics.engine.memory.model import Engine
from physics.observations import Observed
from physics.scene import clock, material
from physics.scene.damage import Damage
from physics.scene.morphology import Morphology
from physics.scene.sensors import Apparatus
from physics.scene.terrain import Terrain

_FIRST_STEPS = 3700  # the table of sensor windows starts with one minute
_STRETCH = 1.3  # of a robot's diagonal, at most


class Simulator(Observed):
    """N worlds with one robot each, stepped together.

    Every world has its own terrain, seed and lifetime, and its result does not depend on the
    other worlds of the batch, on the number of threads or on its place.
    """

    def __init__(
        self,
        shape: str | Any,
        terrain: Terrain | Sequence[Terrain] | None,
        n_worlds: int = 1,
        *,
        sensors: str | Apparatus | None = None,
        noise: float = 0.0,
        gravity: float = 9.8,
        dtype: torch.dtype = torch.float32,
        device: str | torch.device = "cpu",
        seed: int | Sequence[int] = 0,
        damage: Damage | None = None,
        lifetime: float | Sequence[float] | None = None,
        engine: Engine | None = None,
        threads: int | None = None,
        lanes: int | None = None,
    ) -> None:
        """Builds the worlds and places the robots.

        Args:
            shape: name ("biped-4x3"), 2-D 0/1 array with the top row first, or Morphology.
            terrain: one for all worlds, a list of N, or None (no ground).
            n_worlds: N.
            sensors: "low", "medium", "high", an Apparatus, or None.
            noise: standard deviation of the readings' noise, in units of each sensor's range.
            gravity: downward acceleration [m/s^2].
            dtype: torch.float32 or torch.float64.
            device: where the state lives: "cpu", or "cuda" where PyTorch finds a GPU; a process
                simulates on one of them.
            seed: of noise and damage: an integer, from which every world's seed is derived, or
                N integers, one per world.
            damage: when and how voxels break.
            lifetime: [s], one for all or N of them; a world that reaches it stands still.
            engine: settings of the solver.
            threads: at most so many; None: all cores.
            lanes: worlds per vector; None: the fastest; 1 gives the scalar program, for checks.

        Raises:
            ValueError: an argument is not one of these; the message names it.
        """
        self.morphology = Morphology.of(shape)
        self.apparatus = Apparatus.of(sensors, self.morphology)
        self.n_worlds = checks.positive_integer("n_worlds", n_worlds)
        self.n_voxels = self.morphology.n_voxels
        self.n_readings = self.apparatus.n_readings
        self.sensor_names = self.apparatus.names(self.morphology)
        self.sensor_kinds = self.apparatus.kinds
        self.dtype = dtype
        self.device = checks.device(device)
        self.damage = checks.instance("damage", damage, Damage)
        self._noise = checks.finite("noise", noise, 0.0)
        self._gravity = checks.finite("gravity", gravity)
        self._engine = checks.instance("engine", engine, Engine) or Engine()
        self._seeds = checks.world_seeds(seed, self.n_worlds)
        self._lifetimes = checks.lifetimes_in_steps(lifetime, self.n_worlds)
        self._terrains = checks.terrain_list(terrain, self.n_worlds)
        if threads is not None:
            checks.positive_integer("threads", threads)
        device_type = self.device.type
        if lanes is None:
            lanes = lanes_for(self.n_worlds, dtype, threads, device_type)
        self.lanes = checks.lanes(lanes, device_type)
        features = self._engine.features(self.morphology)
        self.program = backend.Program(dtype, lanes, lanes, features, device_type)
        kernels.play(self.program)  # refuses other dtypes
        self._grouping = Grouping.of(self.program, self.n_worlds, threads)
        groups = self._grouping.whole.count
        self._segments, profiles = checks.pack_terrains(
            self._terrains, self._extent(), groups * lanes
        )
        self._profiles = torch.from_numpy(profiles).to(self.device, dtype)
        self._build(_FIRST_STEPS)
        self._state = st.allocate(self._model.layout, self.n_worlds, lanes, dtype, self.device)
        self.reset()

    # --- life -----------------------------------------------------------------------------------

    def reset(self, worlds: Tensor | None = None) -> Tensor | None:
        """Places robots at birth and senses.

        Args:
            worlds: which ones, (N,) bool; None: all.

        Returns:
            Readings of all worlds, (N, R), or None without sensors. Velocity and touch, being
            averages over steps, start at 0.5 and 0.
        """
        poses = st.initial_poses(self.morphology, self._terrains, self.n_worlds)
        newborn = st.newborn(self._state, torch.from_numpy(poses), self._seeds, self._lifetimes)
        self._break(newborn)
        if worlds is None:
            self._state = newborn
        else:
            chosen = self._state.lanes_of(self._mask(worlds)) > 0
            self._state.items.copy_(torch.where(chosen[:, None], newborn.items, self._state.items))
        return self._look()

    def step(self, actuation: Tensor) -> Tensor | None:
        """One control step of 1/60 s under an actuation, then sensing.

        Args:
            actuation: (N, V), clipped to [-1, 1]; +1 contracts, -1 expands.

        Returns:
            Readings, (N, R), or None without sensors.

        Raises:
            ValueError: wrong shape, or not finite.
        """
        checks.tensor("actuation", actuation, worlds=self.n_worlds, voxels=self.n_voxels)
        return self.run(actuation[None])

    def run(self, actuations: Tensor) -> Tensor | None:
        """Many control steps in one call, each as ``step`` does it.

        Args:
            actuations: (T, N, V), clipped to [-1, 1].

        Returns:
            Readings after the last step, (N, R), or None without sensors.

        Raises:
            ValueError: wrong shape, or not finite (on a GPU, where it would take a wait to look,
                the world fails instead).
        """
        checks.tensor(
            "actuations", actuations, steps=None, worlds=self.n_worlds, voxels=self.n_voxels
        )
        actions = actuations.detach().to(self.device, self.dtype).contiguous()
        if self.device.type == "cpu" and not bool(torch.isfinite(actions).all()):
            raise ValueError("actuation: expected finite numbers, got NaN or infinity")
        self._reserve(len(actions))
        readings = self._readings()
        self._play(actions, readings, 0, len(actions))
        self._steps += len(actions)
        return self._given(readings)

    def run_closed_loop(
        self, kernel: Callable[[backend.Program], backend.Kernel], brain: Tensor, steps: int
    ) -> None:
        """Many steps with a controller inside the kernel (see ``rollout.closed_loop``).

        Args:
            kernel: gives the kernel for a program; the same one whenever it is asked.
            brain: the controller's tensor, (groups, items, lanes), of this simulator's dtype,
                changed in place; its memory in the order of kernels (`backend.unpacked`).
            steps: how many.

        Raises:
            ValueError: a tensor for other worlds, of another type or in another order.
        """
        checks.tensor(
            "brain", brain, groups=self._grouping.whole.count, items=None, lanes=self.lanes
        )
        if brain.dtype != self.dtype or not backend.packed(brain, self.lanes).is_contiguous():
            raise ValueError(
                f"brain: expected {self.dtype} in the order of backend.unpacked, got "
                f"{brain.dtype} with strides {brain.stride()}"
            )
        self._reserve(steps)
        for part in self._grouping.parts_for(steps):
            tensors = *self.kernel_tensors(part.program), part.program.packed(brain)
            kernel(part.program)(*tensors, steps, part.first, part.count, part.chunks)
        self._steps += steps

    def kernel_tensors(self, program: backend.Program) -> tuple[Tensor, ...]:
        """What every kernel takes first: state, lists, ground, and the model's two tables."""
        lists = backend.packed(self._state.lists, self.lanes)
        items = program.packed(self._state.items)
        return items, lists, self._profiles, self._integers, self._numbers

    # --- set-up and checks ----------------------------------------------------------------------

    def set_poses(self, poses: Tensor, velocities: Tensor | None = None) -> Tensor | None:
        """Moves the squares by hand and senses; time stands still.

        Args:
            poses: (N, V, 4, 3) x, y [m], angle [rad].
            velocities: (N, V, 4, 3) vx, vy [m/s], omega [rad/s]; None: at rest.

        Returns:
            Readings, as ``reset``.

        Raises:
            ValueError: wrong shape.
        """
        checks.tensor("poses", poses, **self._squares())
        rates = torch.zeros_like(poses) if velocities is None else velocities
        checks.tensor("velocities", rates, **self._squares())
        st.set_poses(self._state, poses)
        scale = torch.tensor([1.0, 1.0, lay.GYRATION], dtype=torch.float64)
        lanes = self._state.lanes_of(rates.double().cpu() * scale)
        self._state.bodies()[:, :, :, lay.VX : lay.W + 1] = lanes
        st.forget_window(self._state)
        return self._look()

    def replay(self, poses: Tensor, velocities: Tensor) -> Tensor | None:
        """What the robots would have sensed along a recorded motion; time goes on.

        Args:
            poses: of the squares after each step, (T, N, V, 4, 3), as for ``set_poses``.
            velocities: likewise, (T, N, V, 4, 3).

        Returns:
            Readings after each step, (T, N, R), or None without sensors.

        Raises:
            ValueError: wrong shape.
        """
        checks.tensor("poses", poses, steps=None, **self._squares())
        checks.tensor("velocities", velocities, steps=len(poses), **self._squares())
        self._reserve(len(poses))
        readings = self._readings().new_zeros(len(poses), self.n_worlds, self.n_readings)
        for k, pose in enumerate(poses):
            self._state.header(lay.H_STEP).add_(1.0)
            now = self.set_poses(pose, velocities[k])
            if now is not None:
                readings[k] = now
        return self._given(readings)

    def _squares(self) -> dict[str, int]:
        """Sizes of a table of squares."""
        return {"worlds": self.n_worlds, "voxels": self.n_voxels, "squares": 4, "numbers": 3}

    def _extent(self) -> float:
        """Width of ground that a robot may need at once, whatever its posture [m]."""
        size = material.VOXEL_SIDE * math.hypot(self.morphology.width, self.morphology.height)
        return _STRETCH * size + 2 * (model.reach(self.apparatus) + ground_detection.MARGIN)

    def _build(self, max_steps: int) -> None:
        """Makes the model and its tables."""
        self._model = model.build(
            self.morphology,
            self.apparatus,
            self._engine,
            self._gravity,
            self._noise,
            self._segments,
            self._extent(),
            self.damage.mode if self.damage else "rest",
            max_steps,
            self.lanes,
        )
        self._integers = torch.from_numpy(self._model.integers).to(self.device)
        self._numbers = torch.from_numpy(self._model.numbers).to(self.device, self.dtype)

    def _reserve(self, steps: int) -> None:
        """Makes the table of sensor windows long enough for ``steps`` more."""
        if self._steps + steps > self._model.max_steps:
            self._build(max(2 * self._model.max_steps, self._steps + steps))

    def _break(self, state: st.State) -> None:
        """Writes when each voxel breaks and mends, if there is damage."""
        if self.damage is None:
            return
        broken = self.damage.broken(self._seeds.tolist(), self.n_voxels)
        mask = state.lanes_of(torch.tensor(broken)) > 0
        start = float(clock.steps_in(self.damage.time))
        end = self.damage.until
        stop = st.ENDLESS if math.isinf(end) else float(clock.steps_in(end))
        view = state.voxels(lay.BREAKS, 2)
        view[:, :, 0] = torch.where(mask, start, view[:, :, 0])
        view[:, :, 1] = torch.where(mask, stop, view[:, :, 1])

    def _look(self) -> Tensor | None:
        """Contacts and readings of the present poses."""
        self._steps = int(self._state.header(lay.H_STEP).max())
        readings = self._readings()
        self._play(readings.new_zeros(1, self.n_worlds, self.n_voxels), readings, -1, 0)
        return self._given(readings)

    def _play(self, actions: Tensor, readings: Tensor, begin: int, end: int) -> None:
        """Runs the kernel for given actuations on all worlds."""
        for part in self._grouping.parts_for(end - begin):
            tensors = *self.kernel_tensors(part.program), actions, readings
            kernel = kernels.play(part.program)
            kernel(*tensors, begin, end, part.first, part.count, part.chunks)

    def _readings(self) -> Tensor:
        return torch.zeros(
            self.n_worlds, max(1, self.n_readings), dtype=self.dtype, device=self.device
        )

    def _given(self, readings: Tensor) -> Tensor | None:
        return readings if self.n_readings else None

    def _mask(self, worlds: Tensor) -> Tensor:
        if checks.tensor("worlds", worlds, worlds=self.n_worlds).dtype != torch.bool:
            raise ValueError(f"worlds: expected a bool mask, got {worlds.dtype}")
        return worlds
