"""Where robots start: free of the ground, and as recorded where they were free already."""

from __future__ import annotations

import numpy as np
import pytest

from physics import Morphology, Simulator, Terrain
from physics.scene import material

SPIKE = Terrain.from_profile([0, 10, 13.4, 13.5, 13.6, 100], [100, 0, 0, 8, 0, 0])


def gap(sim: Simulator, terrain: Terrain) -> float:
    """Least height of a square's lower edge over the ground anywhere under it [m]."""
    x, y, _ = sim.mass_poses()[0].double().unbind(-1)
    places = x.numpy()[..., None] + np.linspace(-0.6, 0.6, 1201)
    return float((y.numpy()[..., None] - material.SQUARE_HALF - terrain.height(places)).min())


@pytest.mark.parametrize("shape", ["biped-4x3", "worm-7x1"])
@pytest.mark.parametrize("name", ["steppy-5-10", "hilly-30-1", "hilly-3-5", "spike"])
def test_robots_start_free_of_the_ground(shape: str, name: str) -> None:
    terrains = (
        [SPIKE] if name == "spike" else [Terrain.from_name(name, seed=seed) for seed in range(12)]
    )
    for terrain in terrains:
        sim = Simulator(shape, terrain)
        assert gap(sim, terrain) > -0.01
        assert not sim.touching().any()


def test_free_starts_are_as_recorded() -> None:
    """The least height of a voxel over the ground at its centre is 1 m."""
    cells = np.array(Morphology.from_name("biped-4x3").cells)
    for seed in range(20):
        terrain = Terrain.from_name("hilly-3-30", seed=seed)
        centres = Simulator("biped-4x3", terrain).voxel_centers()[0].double().numpy()
        assert centres[:, 0] == pytest.approx(12.5 + 3 * cells[:, 0], abs=1e-5)
        heights = centres[:, 1] - 1.5 - terrain.height(centres[:, 0])
        assert heights.min() == pytest.approx(1.0, abs=1e-5)
