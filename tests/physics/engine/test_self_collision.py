"""Squares of one robot that meet: the slow oracle, momentum, legs that do not pass, batches."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import torch
from torch import Tensor

from physics import Engine, Morphology, Simulator, Terrain
from physics.scene import material
from tests.physics.worlds import DOUBLE, beside_oracle, gaits

COLLIDE = Engine(self_collision=True)
HILLS = Terrain.from_name("hilly-3-30-7")
LEGS = "comb-3x2"  # two legs, one voxel apart


def unjoined(shape: str) -> Tensor:
    """Pairs of squares of different voxels that no weld joins, (P, 2)."""
    morphology = Morphology.of(shape)
    welds = {frozenset(weld) for weld in morphology.welds}
    pairs = itertools.combinations(range(4 * morphology.n_voxels), 2)
    return torch.tensor(
        [pair for pair in pairs if pair[0] // 4 != pair[1] // 4 and frozenset(pair) not in welds]
    )


def deepest(sim: Simulator) -> Tensor:
    """Greatest overlap of unjoined squares along the separating axis (negative: a gap) [m], (N,).

    From the corners of the squares, on the four directions of their edges.
    """
    poses = sim.mass_poses().double().flatten(1, 2)
    first, second = unjoined(str(sim.morphology.name)).unbind(1)
    signs = torch.tensor(material.CORNER_SIGNS, dtype=DOUBLE) * material.SQUARE_HALF
    axes = torch.stack([poses[..., 2].cos(), poses[..., 2].sin()], -1)
    turned = torch.stack([-axes[..., 1], axes[..., 0]], -1)
    corners = (
        poses[..., None, :2] + signs[:, :1] * axes[:, :, None] + signs[:, 1:] * turned[:, :, None]
    )
    overlaps = []
    for directions in (axes[:, first], turned[:, first], axes[:, second], turned[:, second]):
        shadows = [
            (corners[:, squares] * directions[:, :, None]).sum(-1) for squares in (first, second)
        ]
        (low1, high1), (low2, high2) = ((s.amin(-1), s.amax(-1)) for s in shadows)
        overlaps.append(torch.minimum(high1 - low2, high2 - low1))
    return torch.stack(overlaps).amin(0).amax(-1)


def clap(sim: Simulator, speed: float) -> tuple[Tensor, Tensor]:
    """Poses as they are and velocities that swing the legs of LEGS towards each other."""
    poses = sim.mass_poses()
    velocities = torch.zeros_like(poses)
    low = torch.tensor([y == 0 for _, y in sim.morphology.cells])
    left = torch.tensor([x == 0 for x, _ in sim.morphology.cells])
    velocities[:, low & left, :, 0] = speed
    velocities[:, low & ~left, :, 0] = -speed
    return poses, velocities


# --- other programs -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "terrain", "gravity", "steps"),
    [
        ("box-2x2", None, 0.0, 120),
        ("biped-4x3", None, 0.0, 40),
        ("biped-4x3", HILLS, 9.8, 60),
        ("tripod-5x3", HILLS, 9.8, 60),
    ],
)
def test_a_gait_follows_the_oracle(shape, terrain, gravity, steps):
    voxels = Morphology.of(shape).n_voxels
    actuations = gaits(steps, 1, voxels)
    worst, met = beside_oracle(shape, terrain, gravity, actuations, self_collision=True)
    assert worst < 1e-9
    assert met["self_contacts"] > steps / 2


def test_clapping_legs_follow_the_oracle():
    """Fast and out of shape: bounces, slips, one and two points, deep overlaps."""
    sim = Simulator(LEGS, None, gravity=0.0, dtype=DOUBLE)
    self_contacts = 0
    for seed in range(6):
        random = np.random.default_rng(seed)
        poses, velocities = (part[0].numpy().copy() for part in clap(sim, 14.0))
        poses += random.uniform(-0.1, 0.1, poses.shape)
        velocities += random.normal(scale=2.0, size=velocities.shape)
        worst, met = beside_oracle(
            LEGS, None, 0.0, gaits(30, 1, 5, seed), poses, velocities, self_collision=True
        )
        assert worst < 1e-9
        self_contacts += met["self_contacts"]
    assert self_contacts > 60


# --- what collisions are for --------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32])
def test_legs_do_not_pass_through_each_other(dtype):
    overlap = {}
    for collides in (True, False):
        engine = Engine(self_collision=collides)
        sim = Simulator(LEGS, None, gravity=0.0, dtype=dtype, engine=engine)
        sim.set_poses(*clap(sim, 18.0))
        overlap[collides] = 0.0
        for _ in range(60):
            sim.step(torch.zeros(1, 5))
            overlap[collides] = max(overlap[collides], deepest(sim).item())
    assert overlap[False] > material.SQUARE_SIDE
    assert 0.0 < overlap[True] < 0.2  # they may close by more than that in one step


def test_squares_pushed_into_each_other_part():
    """Legs set 0.1 m into each other, away from their hips: no overlap stays."""
    sim = Simulator(LEGS, None, gravity=0.0, dtype=DOUBLE, engine=COLLIDE)
    poses, inwards = clap(sim, material.VOXEL_SIDE / 2 + 0.05)
    sim.set_poses(poses + inwards)
    assert deepest(sim).item() == pytest.approx(0.1, abs=1e-9)
    worst = []
    for _ in range(120):
        sim.step(torch.zeros(1, 5))
        worst.append(deepest(sim).item())
    assert max(worst) < 0.15
    assert max(worst[30:]) < 2 * material.LINEAR_TOLERANCE


def test_momentum_is_conserved():
    sim = Simulator(
        LEGS, None, gravity=0.0, dtype=DOUBLE, engine=Engine(self_collision=True, damping=0.0)
    )
    poses, velocities = clap(sim, 16.0)
    velocities += torch.tensor([0.7, -0.4, 0.1], dtype=DOUBLE)
    sim.set_poses(poses, velocities)

    def momentum() -> Tensor:
        return material.SQUARE_MASS * sim.mass_velocities()[..., :2].sum((1, 2))

    before, touched = momentum(), 0
    for actuation in gaits(60, 1, 5):
        sim.step(actuation)
        touched += deepest(sim).item() > 0
        assert (momentum() - before).abs().max() < 1e-12
    assert touched > 5


@pytest.mark.parametrize("shape", ["biped-4x3", "worm-7x1", LEGS])
def test_robots_collide_with_themselves_by_default(shape):
    ends = []
    for engine in (None, COLLIDE):
        sim = Simulator(shape, HILLS, engine=engine)
        assert sim.program.features.self_collision
        sim.run(gaits(90, 1, sim.n_voxels))
        ends.append(sim.mass_poses())
    assert torch.equal(*ends)


def test_a_single_voxel_has_nothing_to_collide_with():
    sims = [Simulator("box-1x1", None, engine=engine) for engine in (Engine(), COLLIDE)]
    for sim in sims:
        sim.run(gaits(30, 1, 1))
    assert torch.equal(sims[0].mass_poses(), sims[1].mass_poses())


@pytest.mark.parametrize("shape", ["comb-5x4", "biped-4x3"])
def test_by_default_no_legs_pass_through_each_other(shape):
    """Bang-bang actuation of full amplitude, under which those of most shapes do otherwise."""
    worlds = 16
    terrains = [Terrain.from_name(f"hilly-3-30-{seed}") for seed in range(worlds)]
    deepest_overlap = {}
    for engine in (Engine(self_collision=False), None):
        sim = Simulator(shape, terrains, worlds, engine=engine)
        overlaps = []
        for actuation in gaits(40, worlds, sim.n_voxels, seed=3).sign().split(1):
            sim.run(actuation.expand(15, -1, -1))
            overlaps.append(deepest(sim))
        deepest_overlap[engine is None] = torch.stack(overlaps).max().item()
    if shape != "biped-4x3":  # its legs are short
        assert deepest_overlap[False] > material.SQUARE_SIDE
    assert deepest_overlap[True] < 0.25


# --- batches ------------------------------------------------------------------------------------


def crumpled(sim: Simulator, worlds: list[int]) -> Tensor:
    """The poses, with every third robot pressed into a few metres: some 300 pairs of squares
    overlap, ten times as many as a world holds."""
    poses = sim.mass_poses()
    for place, world in enumerate(worlds):
        if world % 3 == 0:
            random = torch.Generator().manual_seed(world)
            poses[place, ..., :2] *= 0.3
            poses[place] += torch.rand(poses[place].shape, generator=random)
    return poses


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32])
def test_a_world_is_the_same_alone_and_in_any_batch(dtype):
    worlds = list(range(19))
    actuations = gaits(60, 19, 13).to(dtype)

    def run(chosen: list[int], **settings: int) -> Tensor:
        sim = Simulator("tripod-5x3", HILLS, len(chosen), dtype=dtype, engine=COLLIDE, **settings)
        sim.set_poses(crumpled(sim, chosen))
        sim.run(actuations[:, chosen])
        assert not sim.failed().any()
        return torch.stack([sim.mass_poses(), sim.mass_velocities()], 1)

    together = run(worlds)
    assert len(torch.unique(together, dim=0)) == 19
    assert torch.equal(run(worlds, threads=2), together)
    assert torch.equal(run(worlds, lanes=1), together)
    assert torch.equal(run(worlds[::-1]).flip(0), together)
    for world in (0, 7, 18):
        assert torch.equal(run([world])[0], together[world])


def test_reset_of_some_worlds_leaves_the_others_alone():
    again = torch.arange(11) % 4 == 1
    half, rest = gaits(80, 11, 13).float().split(40)
    sim, kept, fresh = (Simulator("tripod-5x3", HILLS, 11, engine=COLLIDE) for _ in range(3))
    sim.run(half)
    kept.run(half)
    sim.reset(again)
    for each in (sim, kept, fresh):
        each.run(rest)
    assert torch.equal(sim.mass_poses()[~again], kept.mass_poses()[~again])
    assert torch.equal(sim.mass_poses()[again], fresh.mass_poses()[again])
