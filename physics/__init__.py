"""Batched simulation of 2-D voxel-based soft robots.

import torch, physics

sim = physics.Simulator("biped-4x3", physics.Terrain.from_name("hilly-3-30-7"), n_worlds=40,
                        sensors="high")
readings = sim.reset()
for _ in range(60):
    readings = sim.step(torch.zeros(40, sim.n_voxels))
"""

from physics.apparatus import Apparatus, Sensor
from physics.damage import Damage
from physics.model import Engine
from physics.morphology import Morphology
from physics.simulator import Simulator
from physics.terrain import Terrain

__all__ = ["Apparatus", "Damage", "Engine", "Morphology", "Sensor", "Simulator", "Terrain"]
