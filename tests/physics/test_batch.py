"""A world's result depends on nothing but itself: not on the batch, threads, lanes or calls."""

from __future__ import annotations

import math
from typing import Any

import pytest
import torch
from torch import Tensor

from physics import Damage, Simulator, Terrain
from physics.scene.clock import steps_in
from tests.physics.worlds import gaits

STEPS = 60
TERRAINS = [Terrain.from_name(name) for name in ("flat", "steppy-1-8-3", "hilly-0.5-3-2")]
TERRAINS += [Terrain.from_name(f"hilly-3-30-{seed}") for seed in range(4)]
STEEP = [Terrain.from_name(name) for name in ("steppy-5-10-7", "hilly-3-2-1", "steppy-3-1-0")]
STEEP += [Terrain.from_profile([0, 10, 20, 20.5, 29, 29.1, 90], [100, 0, 0, 4, 4, -16, -16])]
HALF = Damage(time=0.5, mode="random")


def ground(world: int) -> Terrain:
    return TERRAINS[world % len(TERRAINS)]


def batch(worlds: list[int], **settings: Any) -> Simulator:
    """The worlds of these numbers: each with its own terrain and seed, noise and damage."""
    terrains = settings.pop("terrain", [ground(world) for world in worlds])
    settings = {"sensors": "high", "noise": 0.05, "damage": HALF, "seed": worlds, **settings}
    return Simulator("biped-4x3", terrains, len(worlds), **settings)


def actuations(worlds: list[int], steps: int = STEPS) -> Tensor:
    return gaits(steps, 400, 10)[:, worlds].float()


def state(sim: Simulator) -> Tensor:
    """All that can be seen of every world, (N, ...)."""
    seen = (sim.mass_poses(), sim.mass_velocities(), sim.actuation(), sim.touching().float())
    return torch.cat([part.flatten(1) for part in seen], 1)


@pytest.mark.parametrize("size", [7, 400])
def test_a_world_alone_equals_the_same_world_in_a_batch(size):
    worlds = list(range(size))
    together = batch(worlds)
    readings = together.run(actuations(worlds))
    for world in {0, 1, 2, size // 2, size - 1}:
        alone = batch([world])
        assert torch.equal(alone.run(actuations([world]))[0], readings[world])
        assert torch.equal(state(alone)[0], state(together)[world])
    assert len(torch.unique(state(together), dim=0)) == size


@pytest.mark.parametrize("shape", ["worm-7x1", "biped-4x3"])
def test_a_world_on_steep_ground_equals_itself_among_other_grounds(shape):
    """However many segments are kept for the others, and whatever their slopes."""
    terrains = STEEP + TERRAINS[:3]
    sim = Simulator(shape, terrains, len(terrains))
    actions = gaits(240, len(terrains), sim.n_voxels).float()
    sim.run(actions)
    for world, terrain in enumerate(terrains):
        alone = Simulator(shape, terrain)
        alone.run(actions[:, world : world + 1])
        assert torch.equal(state(alone)[0], state(sim)[world])


def test_threads_and_lanes_change_no_bit():
    worlds = list(range(19))
    results = []
    for settings in (
        {"threads": 1},
        {"threads": 2},
        {"threads": 16},
        {"lanes": 1},
        {"lanes": 8},
        {"lanes": 16},
    ):
        sim = batch(worlds, **settings)
        results.append((sim.run(actuations(worlds)), state(sim)))
    for readings, states in results[1:]:
        assert torch.equal(readings, results[0][0])
        assert torch.equal(states, results[0][1])


def test_many_steps_at_once_equal_single_steps():
    worlds = list(range(9))
    at_once, stepped = batch(worlds), batch(worlds)
    readings = at_once.run(actuations(worlds))
    for actuation in actuations(worlds):
        last = stepped.step(actuation)
    assert torch.equal(readings, last)
    assert torch.equal(state(at_once), state(stepped))
    assert at_once.time == stepped.time == pytest.approx(STEPS / 60)


def test_an_empty_run_changes_nothing():
    sim = batch([3])
    readings = sim.run(actuations([3]))
    before = state(sim)
    assert torch.equal(sim.run(actuations([3])[:0]), readings)
    assert torch.equal(state(sim), before)


def test_a_lifetime_stops_its_world_only():
    worlds = list(range(9))
    lifetimes = [0.1 * (world + 1) for world in worlds]  # [s]
    steps = [steps_in(lifetime) for lifetime in lifetimes]
    sim, endless = batch(worlds, lifetime=lifetimes), batch(worlds)
    for step, actuation in enumerate(actuations(worlds)[:40], start=1):
        sim.step(actuation)
        endless.step(actuation)
        lives_on = torch.tensor([step <= last for last in steps])
        if step in steps:
            assert torch.equal(state(sim)[lives_on], state(endless)[lives_on])
    over = torch.tensor(steps) < 40
    assert 0 < over.sum() < 9
    for world in over.nonzero()[:, 0].tolist():
        alone = batch([world])
        alone.run(actuations([world])[: steps[world]])
        assert torch.equal(sim.mass_poses()[world], alone.mass_poses()[0])
        assert sim.times[world] == pytest.approx(steps[world] / 60)
        assert (sim.mass_velocities()[world] == 0).all()
    assert not sim.failed().any()


@pytest.mark.parametrize("poison", [math.nan, math.inf, 1e20])
def test_a_broken_world_is_told_and_its_neighbours_go_on(poison):
    worlds = list(range(11))
    sick, well = batch(worlds), batch(worlds)
    half, rest = actuations(worlds).split(STEPS // 2)
    for sim, value in ((sick, poison), (well, None)):
        sim.run(half)
        poses = sim.mass_poses()
        if value is not None:
            poses[4, 3, 2, 0] = value
        sim.set_poses(poses, sim.mass_velocities())
    readings, well_readings = sick.run(rest), well.run(rest)
    others = torch.tensor([world != 4 for world in worlds])
    assert sick.failed().tolist() == [not other for other in others.tolist()]
    assert not well.failed().any()
    assert torch.equal(readings[others], well_readings[others])
    assert torch.equal(state(sick)[others], state(well)[others])
    sick.reset(~others, seeds=[4])
    assert not sick.failed().any()
    assert torch.equal(sick.run(half)[4], batch(worlds).run(half)[4])


# --- damage -------------------------------------------------------------------------------------


BREAKS = 0.25  # [s]
FIRST = steps_in(BREAKS)  # steps done by then: the command computed after them is the first lost


def damaged(mode: str, until: float = math.inf) -> tuple[Tensor, Tensor]:
    """40 bipeds broken at BREAKS, their actuation in force at each step, and what was asked."""
    damage = Damage(time=BREAKS, mode=mode, until=until)
    sim = Simulator("biped-4x3", None, 40, gravity=0.0, damage=damage, seed=3)
    asked = gaits(STEPS, 40, 10).float()
    seen = []
    for actuation in asked:
        sim.step(actuation)
        seen.append(sim.actuation())
    return torch.stack(seen), asked


@pytest.mark.parametrize("mode", ["rest", "frozen", "random"])
def test_broken_voxels_obey_no_longer(mode):
    seen, asked = damaged(mode)
    assert torch.equal(seen[:FIRST], asked[:FIRST])
    broken = (seen[FIRST:] != asked[FIRST:]).any(0)
    assert 0.4 < broken.float().mean() < 0.6
    assert len(torch.unique(broken, dim=0)) > 30  # every world breaks its own voxels
    assert torch.equal(seen[FIRST:, ~broken], asked[FIRST:, ~broken])
    lost = seen[FIRST:, broken]
    if mode == "rest":
        assert (lost == 0).all()
    elif mode == "frozen":
        assert torch.equal(lost, asked[FIRST - 1, broken].expand_as(lost))
    else:
        n = lost.numel()
        assert lost.abs().max() <= 1.0
        assert abs(lost.mean()) < 5 / math.sqrt(3 * n)
        assert abs(lost.var() - 1 / 3) < 5 * math.sqrt(4 / 45 / n)
        assert torch.unique(lost).numel() > 0.99 * n


def test_broken_voxels_may_mend():
    seen, asked = damaged("rest", until=0.5)
    works = steps_in(0.5)
    assert torch.equal(seen[works:], asked[works:])
    assert not torch.equal(seen[works - 1], asked[works - 1])


def test_damage_modes_break_the_same_voxels():
    masks = [
        (seen[FIRST:] != asked[FIRST:]).any(0) for seen, asked in map(damaged, ("rest", "frozen"))
    ]
    assert torch.equal(*masks)


@pytest.mark.parametrize(("mode", "ratio"), [("rest", 1.0), ("frozen", 0.775)])
def test_a_broken_voxels_shape_is_left_to_its_springs(mode, ratio):
    damage = Damage(probability=1.0, time=1.0, mode=mode)
    sim = Simulator("box-1x1", None, gravity=0.0, damage=damage)
    sim.run(torch.ones(60, 1, 1))
    assert sim.area_ratios().item() == pytest.approx(0.775, abs=1e-5)
    sim.run(-torch.ones(180, 1, 1))
    assert sim.area_ratios().item() == pytest.approx(ratio, abs=1e-5)
