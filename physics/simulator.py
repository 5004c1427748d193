"""The simulator: a batch of soft robots, each in a world of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from physics import backend, checks
from physics.engine import kernels
from physics.engine.memory.grouping import Grouping, block_for, lanes_for_robots
from physics.engine.memory.settings import Engine
from physics.scene import clock, material
from physics.scene.bodies import Bodies
from physics.scene.conditions import Conditions
from physics.scene.damage import Damage
from physics.scene.damage import of_worlds as damages_of_worlds
from physics.scene.sensors import Apparatus
from physics.scene.terrain import Terrain
from physics.worlds import selection
from physics.worlds.batch import Batch
from physics.worlds.handling import Handled
from physics.worlds.launcher import extent
from physics.worlds.seeds import world_seeds


class Simulator(Handled):
    """N worlds with one robot each, stepped together.

    Every world has its own terrain, seed and lifetime, and its result does not depend on the
    other worlds of the batch, on the number of threads or on its place.
    """

    @torch.inference_mode(False)  # the state outlives the mode it may be made in
    def __init__(
        self,
        shape: str | Any,
        terrain: Terrain | Sequence[Terrain] | None,
        n_worlds: int = 1,
        *,
        sensors: str | Apparatus | Sequence[str | Apparatus] | None = None,
        noise: float | Mapping[str, float] = 0.0,
        gravity: float | Sequence[float] = 9.8,
        dtype: torch.dtype = torch.float32,
        device: str | torch.device = "cpu",
        seed: int | Sequence[int] = 0,
        damage: Damage | Sequence[Damage | None] | None = None,
        lifetime: float | Sequence[float] | None = None,
        engine: Engine | None = None,
        friction: float | Sequence[float] | None = None,
        spring_frequency: float | Sequence[float] = material.SPRING_FREQUENCY,
        spring_damping: float | Sequence[float] = material.SPRING_DAMPING_RATIO,
        control_interval: int = 1,
        control_delay: int = 0,
        actuation_cutoff: float | None = None,
        threads: int | None = None,
        lanes: int | None = None,
    ) -> None:
        """Builds the worlds and places the robots.

        Args:
            shape: name ("biped-4x3"), 2-D 0/1 array with the top row first, or Morphology; or a
                list of N of them, one for each world. Then V and R are those of the largest robots:
                actuation of voxels that a robot lacks is ignored, and see `Observed` for what is
                returned of them. Worlds with the same robot are computed together: a robot in 8
                worlds costs what it costs alone, one in fewer worlds as much as in 8.
            terrain: one for all worlds, a list of N, or None (no ground).
            n_worlds: The number of worlds, N.
            sensors: "low", "medium", "high", an Apparatus, or None; for a list of shapes also a
                list of N.
            noise: standard deviation of the readings' noise, in units of each sensor's range; or
                one for each kind of sensor, {"area": 0.01, "lidar": 0.1}, none for others.
            gravity: downward acceleration [m/s^2], one for all worlds or N of them.
            dtype: torch.float32 or torch.float64.
            device: where the state lives: "cpu", or "cuda" where PyTorch finds a GPU; a process
                simulates on one of them.
            seed: The seed of noise and damage: an integer, from which every world's seed is
                derived, or N integers, one per world.
            damage: when and how voxels break; one for all worlds, or N of them or None, which have
                the same mode.
            lifetime: [s], one for all or N of them; a world that reaches it stands still.
            engine: settings of the solver.
            friction: coefficient between a square and the ground, as `Engine.friction`; one for all
                worlds or N of them.
            spring_frequency: The frequency of the voxels' springs [Hz], one for all worlds or N of
                them.
            spring_damping: their damping ratio, likewise.
            control_interval: engine steps of 1/60 s in a control step. `step`, `run` and
                controllers in the kernel act once per control step; sensors sample, and voxels
                break, at every engine step.
            control_delay: control steps that a command waits before it acts.
            actuation_cutoff: cut-off frequency [Hz] of a first-order low-pass between commands and
                actuation; None: actuation follows at once.
            threads: The most threads to use; None: all cores.
            lanes: worlds per vector; None: the fastest; 1 gives the scalar program, for checks.

        Raises:
            ValueError: an argument is not one of these; the message names it.
        """
        self.n_worlds = checks.positive_integer("n_worlds", n_worlds)
        self.bodies = Bodies.of(shape, sensors, self.n_worlds)
        self.n_voxels = self.bodies.n_voxels
        self.n_readings = self.bodies.n_readings
        self.dtype = dtype
        self.device = checks.device(device)
        damages = damages_of_worlds(damage, self.n_worlds)
        self.damage = next((each for each in damages or () if each is not None), None)
        self._engine = checks.instance("engine", engine, Engine) or Engine()
        checks.require_memory("n_worlds", self.n_worlds, self._bytes_per_world())
        self._conditions = Conditions.of(
            self.n_worlds,
            gravity,
            _friction(self._engine, friction),
            spring_frequency,
            spring_damping,
            noise,
            control_interval,
            control_delay,
            actuation_cutoff,
        )
        self.control_interval = self._conditions.control_interval
        seeds = world_seeds(seed, self.n_worlds)
        lifetimes = selection.lifetimes_in_steps(lifetime, self.n_worlds)
        terrains = selection.terrain_list(terrain, self.n_worlds)
        if threads is not None:
            threads = checks.positive_integer("threads", threads)
        device_type = self.device.type
        if lanes is None:
            lanes = lanes_for_robots(self.bodies.counts, dtype, threads, device_type)
        self.lanes = lanes = checks.lanes(lanes, device_type)
        features = self._features()
        self.program = backend.Program(
            dtype, lanes, lanes, features, device_type, block_for(self.n_worlds, device_type)
        )
        kernels.play(self.program)  # refuses other dtypes
        self._grouping = Grouping.of_robots(self.program, self.bodies.counts, threads)
        places = np.arange(self.n_worlds)
        self._places = None
        if not self.bodies.alike:
            places = self._grouping.places(self.bodies.of_world)
            self._places = torch.from_numpy(places).to(self.device)
        self._batch = Batch(
            self.bodies,
            terrains,
            max(extent(body) for body in self.bodies.unlike),
            seeds,
            lifetimes,
            damages,
            self._conditions,
            places,
            self._grouping.whole.count * lanes,
            torch.empty(0, dtype=dtype, device=self.device),
        )
        self._allocate()
        self._at_start = False
        self.reset()

    @property
    def at_start(self) -> bool:
        """Whether every world is as `reset` left it, so that another reset would change nothing."""
        return self._at_start

    # --- episodes -------------------------------------------------------------------------------

    @torch.inference_mode(False)
    def reset(
        self,
        worlds: Tensor | np.ndarray | None = None,
        seeds: int | Sequence[int] | None = None,
        terrains: Terrain | Sequence[Terrain] | None = None,
    ) -> Tensor | None:
        """Begins an episode in some or all worlds, and senses.

        Without seeds, a world that has moved since it was last reset draws new noise and damage,
        which follow from its seed and from the number of episodes it has ended.

        Args:
            worlds: which ones, (N,) bool, a tensor or an array; None: all.
            seeds: new ones for these worlds, one for each, whose first episode this is. For all
                worlds, also one integer, as the argument `seed` of the simulator.
            terrains: new ones for these worlds: one for each, or one for all of them.

        Returns:
            Readings of all worlds, (N, R), or None without sensors. Velocity and touch, being
            averages over steps, start at 0.5 and 0.

        Raises:
            ValueError: an argument is for other worlds, or there is no ground to replace; nothing
                has changed then.
        """
        chosen, fresh_terrains = self._chosen(worlds, terrains)
        if seeds is not None and not checks.is_sequence(seeds) and len(chosen) < self.n_worlds:
            raise ValueError(
                f"seeds: expected one for each of the {len(chosen)} worlds, got {seeds!r}"
            )
        fresh = None if seeds is None else world_seeds(seeds, len(chosen))
        if len(chosen) == 0:
            return self._given(self._last_readings())
        if fresh is not None:
            self._batch.set_seeds(chosen, fresh)
        else:
            self._batch.count_episodes(chosen, self._moved(chosen))
        if fresh_terrains is not None and self._batch.set_terrains(chosen, fresh_terrains):
            self._widen()
        self._begin(chosen)
        if len(chosen) == self.n_worlds:
            self._at_start, self._steps, self._steps_exact = True, 0, True
        else:
            self._steps_exact = False
        return self._look(chosen)

    def prepare(
        self,
        worlds: Tensor | np.ndarray | None = None,
        terrains: Terrain | Sequence[Terrain] | None = None,
    ) -> None:
        """Works out ahead how worlds will begin their next episodes, which is cheaper for many of
        them together than for each when it is reset. It changes no world and no result: a reset of
        one of them to the same terrain and without seeds takes a fraction of the time.

        Args:
            worlds: which ones, as for `reset`.
            terrains: on which terrains that will be, as for `reset`.

        Raises:
            ValueError: as `reset`.
        """
        chosen, fresh = self._chosen(worlds, terrains)
        if len(chosen):
            self._batch.prepare(self._model.layout, chosen, fresh)

    def _chosen(self, worlds: Any, terrains: Any) -> tuple[np.ndarray, list[Terrain] | None]:
        """The numbers of worlds to be reset, and their new terrains."""
        chosen = selection.chosen_worlds("worlds", worlds, self.n_worlds)
        fresh = selection.terrain_list(terrains, len(chosen))
        if fresh is not None and self._batch.terrains is None:
            raise ValueError("terrains: expected None in worlds without ground; drop it")
        return chosen, fresh

    def step(self, actuation: Tensor) -> Tensor | None:
        """One control step under an actuation, then sensing.

        Args:
            actuation: (N, V), clipped to [-1, 1]; +1 contracts, -1 expands.

        Returns:
            Readings, (N, R), or None without sensors.

        Raises:
            ValueError: wrong shape, or not finite.
        """
        checks.tensor("actuation", actuation, worlds=self.n_worlds, voxels=self.n_voxels)
        return self._run("actuation", actuation[None])

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
        return self._run("actuations", actuations)

    def _run(self, name: str, actuations: Tensor) -> Tensor | None:
        """`run`, by the name of the argument that holds the actuations."""
        actions = actuations.detach().to(self.device, self.dtype).contiguous()
        if self.device.type == "cpu":
            checks.finite_numbers(name, actions)
        steps = len(actions) * self.control_interval
        self._require_countable(steps)
        readings = self._readings()
        self._at_start = False
        self._play(actions, readings, 0, steps)
        self._steps += steps
        return self._given(readings)

    def rollout(self, policy: Callable[[Tensor], Tensor], steps: int, *, every: int = 1) -> Tensor:
        """Many control steps with a policy in PyTorch.

        Args:
            policy: A function from readings (N, R) to actuation (N, V); it is called without
                gradients.
            steps: The number of control steps, T.
            every: control steps between two calls of the policy, which act under the same
                actuation. (`control_interval` makes control steps longer instead.)

        Returns:
            Robots' centres after each step [m], (T, N, 2).

        Raises:
            ValueError: there are no sensors, or the policy returns another shape or no numbers.
        """
        every = checks.positive_integer("every", every)
        if self.n_readings == 0:
            raise ValueError('sensors: expected some for a policy, got none; give sensors="low"')
        way = torch.empty(steps, self.n_worlds, 2, dtype=self.dtype, device=self.device)
        actuation = torch.zeros(0)
        with torch.no_grad():
            readings = self.readings()
            for step in range(steps):
                if step % every == 0:
                    actuation = policy(readings)
                now = self.step(actuation)
                assert now is not None
                readings = now
                way[step] = self.center_of_mass()
        return way

    def control_steps(self, duration: float) -> int:
        """Control steps of a rollout of so many seconds, the last one in full.

        Raises:
            ValueError: the duration is negative or not finite.
        """
        return -(-clock.steps_in(duration) // self.control_interval)


def _friction(engine: Engine, friction: Any) -> Any:
    """The friction given by itself, or else the engine's."""
    if friction is None:
        return engine.friction
    if engine.friction != Engine().friction:
        raise ValueError(
            f"friction: expected it once, got friction={friction!r} and "
            f"engine.friction={engine.friction!r}; leave one of them out"
        )
    return friction
