"""Pictures of a world for environments, all of one size."""

from __future__ import annotations

import numpy as np

from physics.render import draw
from physics.render.canvas import Camera
from physics.scene.material import VOXEL_SIDE
from physics.simulator import Simulator

__all__ = ["picture"]

_SIZE = (480, 288)  # width and height [pixels]
_ROOM = 2.5  # widths of the robot, or heights, that a picture shows


def picture(sim: Simulator, world: int) -> np.ndarray:
    """The robot of a world and the ground around it, (height, width, 3) uint8."""
    count = sim.morphologies[world].n_voxels
    poses = sim.mass_poses()[world, :count].double().cpu().numpy()
    poses = np.nan_to_num(poses, posinf=0.0, neginf=0.0)  # of a world that has failed
    actuation = sim.actuation()[world, :count].double().cpu().numpy()
    frame = draw.Frame(poses, float(sim.times[world]), actuation=actuation)
    shape = sim.morphologies[world]
    across, upwards = (VOXEL_SIDE * _ROOM * size for size in (shape.width, shape.height))
    scale = min(_SIZE[0] / across, _SIZE[1] / upwards)
    x, y = poses[..., :2].mean((0, 1))
    terrain = sim.terrains[world] if sim.terrains else None
    view = Camera((float(x), float(y)), scale, _SIZE)
    return np.asarray(draw.draw_frame(frame, terrain, camera=view, legend=False).image())
