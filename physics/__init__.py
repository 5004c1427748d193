"""Batched simulation of 2-D voxel-based soft robots.

import torch, physics

sim = physics.Simulator("biped-4x3", physics.Terrain.from_name("hilly-3-30-7"), n_worlds=40,
                        sensors="high")
readings = sim.reset()
for _ in range(60):
    readings = sim.step(torch.zeros(40, sim.n_voxels))
"""

import sys

from physics.engine.memory.settings import Engine
from physics.renamed import keep_old_names
from physics.scene.bodies import Bodies, Body
from physics.scene.clock import steps_in
from physics.scene.damage import Damage
from physics.scene.material import DT
from physics.scene.morphology import Morphology
from physics.scene.sensors import Apparatus, Sensor
from physics.scene.terrain import Terrain
from physics.simulator import Simulator

__all__ = [
    "DT",
    "Apparatus",
    "Bodies",
    "Body",
    "Damage",
    "Engine",
    "Morphology",
    "Sensor",
    "Simulator",
    "Terrain",
    "steps_in",
]

keep_old_names(sys.modules[__name__])
