"""Replays open-loop motions and follows them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from physics import Simulator

__all__ = ["DTYPES", "STARTS", "Track", "disturbed", "follow", "speeds"]

DTYPES = {"f32": torch.float32, "f64": torch.float64}
STARTS = 4  # of a chaotic motion, over which speeds are averaged
_SHIFT = 1e-6
_CHUNK = 600  # control steps per call, to bound the memory of a long motion's actuations


@dataclass(frozen=True)
class Track:
    """A motion of one world, from its start on.

    Attributes:
        poses: The poses of the squares, (T + 1, V, 4, 3) x, y [m], angle [rad].
        areas: The areas of the voxels over their area at rest, (T + 1, V).
    """

    poses: np.ndarray
    areas: np.ndarray

    @property
    def centers(self) -> np.ndarray:
        """Of the voxels [m], (T + 1, V, 2)."""
        return self.poses[..., :2].mean(axis=2)


def follow(sim: Simulator, actuations: np.ndarray) -> Track:
    """Moves the one world of ``sim`` from where it is.

    Args:
        sim: A simulator of one world.
        actuations: (T, V); row k acts in step k + 1.
    """
    poses, areas = [sim.mass_poses()], [sim.area_ratios()]
    for actuation in torch.from_numpy(actuations).to(sim.dtype):
        sim.step(actuation[None])
        poses.append(sim.mass_poses())
        areas.append(sim.area_ratios())
    return Track(
        torch.cat(poses).double().cpu().numpy(),
        torch.cat(areas).double().cpu().numpy(),
    )


def disturbed(values: Tensor, dim: int, starts: int = STARTS) -> Tensor:
    """Values beside others that chaos tells from them: start k scales them by 1 - k 1e-6.

    Args:
        values: actuations or genomes.
        dim: The dimension along which robots lie, and then the starts, one after the other.
        starts: The number of starts; the first is undisturbed.
    """
    return torch.cat([(1 - k * _SHIFT) * values for k in range(starts)], dim)


def speeds(sim: Simulator, actuations: Tensor) -> np.ndarray:
    """Mean velocities along x of an episode as in the reference [m/s], (N,); NaN where it failed.

    Args:
        sim: N worlds at their start.
        actuations: (T, N, V); a first step with zero actuation comes before row 0.
    """
    sim.step(torch.zeros(sim.n_worlds, sim.n_voxels))
    start, began = sim.center_of_mass()[:, 0].double(), sim.time
    for chunk in actuations.split(_CHUNK):
        sim.run(chunk)
    speed = (sim.center_of_mass()[:, 0].double() - start) / (sim.time - began)
    return torch.where(sim.failed(), torch.nan, speed).cpu().numpy()
