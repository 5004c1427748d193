"""What can be seen of a batch of worlds, as tensors in world order."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from physics.engine.memory import layout as lay
from physics.engine.memory.state import State
from physics.scene import clock, material
from physics.scene.bodies import Bodies

__all__ = ["Observed"]


class Observed:
    """Reads the state of N worlds with V voxels each; every call copies.

    Attributes:
        dtype, device: The data type and the device of the state.
        n_readings: The number of readings of a world's sensors, R.
        bodies: The robots. Where they differ, V and R are those of the largest; voxels that a
            world's robot lacks have NaN for numbers, False for flags and actuation 0, and
            readings that it lacks are 0.
    """

    dtype: torch.dtype
    device: torch.device
    n_readings: int
    bodies: Bodies
    _state: State
    _steps: int  # that no world has exceeded since its last reset
    _steps_exact: bool  # whether some world has taken as many
    _center: Tensor | None = None  # of mass, if it was asked for since worlds moved

    @property
    def time(self) -> float:
        """Age of the world that was reset longest ago [s]."""
        return clock.time_after(self._most_steps())

    @property
    def times(self) -> Tensor:
        """Age of every world [s], (N,) float64."""
        steps = self._state.steps().cpu().numpy()
        return torch.from_numpy(clock.times_after(steps)).to(self.device)

    def _most_steps(self) -> int:
        """Steps of the world that has taken most of them since its last reset."""
        if not self._steps_exact:
            self._steps, self._steps_exact = int(self._state.steps().max()), True
        return self._steps

    def mass_poses(self) -> Tensor:
        """Poses of the squares, (N, V, 4, 3): x, y [m], angle [rad] in [-pi, pi]; corners NW, NE,
        SE, SW."""
        bodies = self._state.worlds(self._state.bodies())
        x, y = bodies[..., lay.X], bodies[..., lay.Y]
        return torch.stack([x, y, torch.atan2(bodies[..., lay.SIN], bodies[..., lay.COS])], -1)

    def mass_velocities(self) -> Tensor:
        """Velocities of the squares, (N, V, 4, 3): vx, vy [m/s], omega [rad/s]."""
        velocities = self._state.worlds(self._state.bodies()[:, :, :, lay.VX : lay.W + 1])
        velocities[..., 2] /= lay.GYRATION
        return velocities

    def voxel_centers(self) -> Tensor:
        """Mean of each voxel's four squares [m], (N, V, 2)."""
        squares = self._state.bodies()[:, :, :, lay.X : lay.Y + 1]
        if self.device.type == "cpu":  # numpy takes less to begin
            nw, ne, se, sw = squares.numpy().transpose(2, 0, 1, 3, 4)
            return self._state.worlds(torch.from_numpy((nw + ne + se + sw) / 4))
        return self._state.worlds(squares.mean(2))

    def center_of_mass(self) -> Tensor:
        """Mean of the voxel centres [m], (N, 2)."""
        if self._center is None:
            self._center = self._mean_over_voxels(self.voxel_centers())
        return self._center.clone()

    def _move_centers(self, chosen: np.ndarray) -> None:
        """Takes note that since robots' centres were asked for only these worlds have changed."""
        if self._center is None or self._state.places is not None:
            self._center = None
            return
        numbers = _center_items(self._state.layout.voxels)
        squares = torch.from_numpy(self._state.of_worlds(numbers, chosen)).to(self.device)
        centers = squares.unflatten(1, (-1, 4, 2)).mean(2).mean(1)
        self._center[torch.from_numpy(chosen).to(self.device)] = centers

    def voxels_present(self) -> Tensor:
        """Which voxels the robots have, (N, V) bool: all, unless robots differ."""
        return torch.from_numpy(self.bodies.present()).to(self.device)

    def _mean_over_voxels(self, values: Tensor) -> Tensor:
        """Of what voxels have, (N, V, ...), the mean in each robot, (N, ...)."""
        if self.bodies.alike:
            return values.mean(1)
        means = torch.empty_like(values[:, 0])
        counts = self.voxels_present().sum(1)
        for count in counts.unique().tolist():  # a sum depends on the number of its terms
            own = counts == count
            means[own] = values[own, :count].mean(1)
        return means

    def area_ratios(self) -> Tensor:
        """Area of each voxel over its area at rest, (N, V)."""
        bodies = self._state.worlds(self._state.bodies())
        corners = torch.tensor(material.CORNER_SIGNS, dtype=self.dtype, device=self.device)
        ax, ay = (corners * material.SQUARE_HALF).unbind(-1)
        c, s = bodies[..., lay.COS], bodies[..., lay.SIN]
        x = bodies[..., lay.X] - bodies[..., :1, lay.X] + (c * ax - s * ay)
        y = bodies[..., lay.Y] - bodies[..., :1, lay.Y] + (s * ax + c * ay)
        cross = material.crossed_diagonals(x.unbind(-1), y.unbind(-1))
        return cross.abs() / (2 * material.VOXEL_SIDE**2)

    def touching(self) -> Tensor:
        """Whether each voxel touches the ground, (N, V) bool."""
        pairs = self._state.voxels(lay.PAIRS, 4 * lay.PAIRS_PER_BODY * lay.PAIR_ITEMS)
        points = pairs.unflatten(2, (-1, lay.PAIR_ITEMS))[:, :, :, lay.PA_POINTS :]
        depths = points.unflatten(3, (2, lay.POINT_ITEMS))[:, :, :, :, lay.PT_DEPTH]
        return self._state.worlds((depths >= 0).flatten(2, 3).any(2))

    def actuation(self) -> Tensor:
        """The actuation in force, (N, V)."""
        return self._state.worlds(self._state.voxels(lay.ACTUATION)[:, :, 0])

    def broken(self) -> Tensor:
        """Which voxels are broken in the step to come, (N, V) bool."""
        highs = [self._state.header(item) for item in (lay.H_BREAKS_HIGH, lay.H_MENDS_HIGH)]
        digits = self._state.worlds(torch.stack(highs, 1)).double()[:, None]
        lower = self._state.worlds(self._state.voxels(lay.BREAKS, 2)).double()
        span = digits * lay.STEPS_PER_HIGH + lower
        step = self._state.steps()[:, None]
        return (step >= span[..., 0]) & (step < span[..., 1])

    def readings(self) -> Tensor:
        """What the sensors read last, (N, R), noise included."""
        first = self._state.layout.reading_block
        return self._state.worlds(self._state.items[:, first : first + self.n_readings])

    def failed(self) -> Tensor:
        """Worlds that became non-finite and were stopped, (N,) bool."""
        return self._state.worlds(self._state.header(lay.H_FAILED)) > 0

    def left_ground(self) -> Tensor:
        """Worlds that stand still because the robot's centre is beyond the ends of its ground, (N,)
        bool. It does not count as failure; see `times` for when that was."""
        return self._state.worlds(self._state.header(lay.H_LEFT)) > 0

    def ended(self) -> tuple[Tensor, Tensor]:
        """What `failed` and `left_ground` tell, looked up together."""
        first = self._state.layout.header + lay.H_FAILED
        flags = self._state.worlds(self._state.items[:, first : first + 2]) > 0
        return flags[:, 0], flags[:, 1]

    def _moved(self, chosen: np.ndarray) -> np.ndarray:
        """Which of some worlds have moved since they were last reset, (k,) bool."""
        counter = self._state.layout.header + np.array([lay.H_STEP, lay.H_STEP_HIGH])
        return np.asarray((self._state.of_worlds(counter, chosen) > 0).any(axis=1))

    def alive(self) -> Tensor:
        """Whether the last step moved each world, (N,) bool: neither failed nor over."""
        return self._state.worlds(self._state.header(lay.H_ALIVE)) > 0


@lru_cache(maxsize=8)
def _center_items(voxels: int) -> np.ndarray:
    """Numbers of the items with x and y of all squares, (V * 4 * 2,)."""
    voxel, square, item = np.indices((voxels, 4, 2))
    return (voxel * lay.VOXEL_ITEMS + square * lay.BODY_ITEMS + lay.X + item).ravel()
