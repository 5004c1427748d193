"""Worlds with different robots in one batch: each as in a batch of its own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from physics import Damage, Morphology, Simulator, Terrain

SHAPES = ["biped-4x3", "worm-3x1", "worm-3x1", "biped-4x3", "box-2x2"]
N = len(SHAPES)
GROUNDS = [Terrain.from_name(f"hilly-3-30-{seed}") for seed in range(N)]
SEEDS = [5, 6, 7, 8, 9]
STEPS = 30
ACTIONS = 2 * torch.rand(STEPS, N, 10, generator=torch.Generator().manual_seed(3)) - 1
SETTINGS: dict[str, Any] = {"sensors": "high", "noise": 0.01, "threads": 1}
EVOGYM = Morphology.from_evogym(np.array([[3, 4, 1], [2, 0, 3]]))


def own(shape: Any, worlds: list[int], **settings: Any) -> Simulator:
    """Some of the worlds, all with one robot, in a batch of their own."""
    return Simulator(
        shape,
        [GROUNDS[world] for world in worlds],
        len(worlds),
        seed=[SEEDS[world] for world in worlds],
        **{**SETTINGS, **settings},
    )


def mixed(shapes: list[Any] = SHAPES, **settings: Any) -> Simulator:
    return Simulator(shapes, GROUNDS, N, seed=SEEDS, **{**SETTINGS, **settings})


def same(sim: Simulator, alone: Simulator, worlds: list[int]) -> bool:
    """Whether some worlds are as in a batch of their own, bit for bit."""
    v, r = alone.n_voxels, alone.n_readings
    return all(
        torch.equal(ours, theirs)
        for ours, theirs in [
            (sim.mass_poses()[worlds, :v], alone.mass_poses()),
            (sim.mass_velocities()[worlds, :v], alone.mass_velocities()),
            (sim.center_of_mass()[worlds], alone.center_of_mass()),
            (sim.readings()[worlds, :r], alone.readings()),
            (sim.touching()[worlds, :v], alone.touching()),
            (sim.area_ratios()[worlds, :v], alone.area_ratios()),
        ]
    )


def worlds_of(shape: Any, shapes: list[Any] = SHAPES) -> list[int]:
    return [world for world, each in enumerate(shapes) if each is shape]


@pytest.mark.parametrize("settings", [{}, {"damage": Damage(0.5, 0.1), "control_delay": 2}])
def test_every_robot_moves_as_in_a_batch_of_its_own(settings: dict[str, Any]) -> None:
    sim = mixed(**settings)
    for step in range(STEPS):
        readings = sim.step(ACTIONS[step])
    assert readings is not None
    assert torch.equal(readings, sim.readings())
    for shape in dict.fromkeys(SHAPES):
        worlds = worlds_of(shape)
        alone = own(shape, worlds, **settings)
        alone.run(ACTIONS[:, worlds, : alone.n_voxels])
        assert same(sim, alone, worlds)


def test_materials_and_one_voxel_do_not_change_the_others() -> None:
    """Robots that alone need fewer features of the engine get the same bits in its full program."""
    shapes: list[Any] = ["box-1x1", EVOGYM, "worm-3x1", EVOGYM, "worm-3x1"]
    sim = mixed(shapes)
    sim.run(ACTIONS[..., : sim.n_voxels])
    for shape in (shapes[0], EVOGYM, shapes[2]):
        worlds = worlds_of(shape, shapes)
        alone = own(shape, worlds)
        alone.run(ACTIONS[:, worlds, : alone.n_voxels])
        assert same(sim, alone, worlds)


def test_partial_resets_with_seeds_and_terrains() -> None:
    sim = mixed()
    sim.run(ACTIONS)
    mask = torch.tensor([False, True, False, True, False])
    grounds = [Terrain.from_name(f"steppy-1-10-{seed}") for seed in (1, 2)]
    sim.reset(mask, seeds=[31, 32], terrains=grounds)
    sim.run(ACTIONS)
    for world, seed, ground in [(1, 31, grounds[0]), (3, 32, grounds[1])]:
        alone = Simulator(SHAPES[world], ground, seed=[seed], **SETTINGS)
        alone.run(ACTIONS[:, [world], : alone.n_voxels])
        assert same(sim, alone, [world])
    alone = own("box-2x2", [4])
    alone.run(torch.cat([ACTIONS, ACTIONS])[:, [4], :4])
    assert same(sim, alone, [4])


def test_what_a_robot_lacks() -> None:
    sim = mixed()
    readings = sim.run(ACTIONS)
    assert sim.n_voxels == 10
    present = sim.voxels_present()
    assert present.sum(1).tolist() == [10, 3, 3, 10, 4]
    assert sim.mass_poses().isnan().all(3).all(2).eq(~present).all()
    assert not sim.touching()[~present].any()
    assert (sim.actuation()[~present] == 0).all()
    assert readings is not None
    assert torch.isfinite(readings).all()
    assert (readings[1, own("worm-3x1", [1]).n_readings :] == 0).all()
    assert not sim.failed().any()


def test_saved_worlds_go_on() -> None:
    sim, other = mixed(), mixed()
    sim.run(ACTIONS)
    other.load_state_dict(sim.state_dict())
    assert torch.equal(sim.run(ACTIONS), other.run(ACTIONS))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="robot"):
        mixed(SHAPES[::-1]).load_state_dict(sim.state_dict())


def test_poses_can_be_set() -> None:
    sim, other = mixed(noise=0.0), mixed(noise=0.0)
    sim.run(ACTIONS)
    other.set_poses(sim.mass_poses(), sim.mass_velocities())
    assert torch.allclose(other.mass_poses(), sim.mass_poses(), atol=1e-5, equal_nan=True)
    assert torch.allclose(other.center_of_mass(), sim.center_of_mass(), atol=1e-5)


def test_many_worlds_of_each() -> None:
    """Groups of the same robot, full, half full and nearly empty, in one and in two programs."""
    shapes = ["box-2x2"] * 17 + ["worm-3x1"] * 12 + ["box-2x2"] * 2
    flat = Terrain.from_name("flat")
    actions = 2 * torch.rand(61, len(shapes), 4, generator=torch.Generator().manual_seed(4)) - 1
    settings: dict[str, Any] = {"sensors": "low", "threads": 1, "lanes": 16}
    sim = Simulator(shapes, flat, len(shapes), seed=range(len(shapes)), **settings)
    sim.run(actions)
    for shape in ("box-2x2", "worm-3x1"):
        worlds = [world for world, each in enumerate(shapes) if each == shape]
        alone = Simulator(shape, flat, len(worlds), seed=worlds, **settings)
        alone.run(actions[:, worlds, : alone.n_voxels])
        assert same(sim, alone, worlds)


@pytest.mark.parametrize(
    ("shape", "settings", "message"),
    [
        (
            ["worm-3x1"],
            {},
            "shape: expected one, or .* for each of the 5 worlds, got .* 1",
        ),
        (
            SHAPES,
            {"sensors": ["low"]},
            "sensors: .* for each of the 5 worlds, got .* 1",
        ),
        (SHAPES, {"damage": Damage(mask=[True] * 10)}, "damage: expected no mask"),
        (["worm-3x1", "snake"] * 2 + ["worm-3x1"], {}, "shape: expected .* got 'snake'"),
    ],
)
def test_mistakes_are_told(shape: Any, settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Simulator(shape, None, N, **{**SETTINGS, **settings})


def test_one_robot_is_asked_for_where_there_are_several() -> None:
    sim = mixed()
    with pytest.raises(ValueError, match="morphology: expected one robot .* got 3 that differ"):
        _ = sim.morphology
    assert [each.name for each in sim.morphologies] == SHAPES


def test_a_policy_drives_robots_of_all_sizes() -> None:
    seen: list[Tensor] = []

    def policy(readings: Tensor) -> Tensor:
        seen.append(readings)
        return torch.zeros(N, 10)

    way = mixed().rollout(policy, 3)
    assert way.shape == (3, N, 2)
    assert torch.isfinite(way).all()
    assert torch.isfinite(torch.stack(seen)).all()
