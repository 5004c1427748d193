"""Damage of sensors, damage by masks, and the end of damage."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from physics import Damage, Simulator, Terrain
from physics.scene.clock import steps_in
from tests.physics.worlds import gaits

WORLDS, STEPS = 10, 45
BREAKS, MENDS = 0.25, 0.5  # [s]
FIRST, LAST = steps_in(BREAKS), steps_in(MENDS)  # steps after which damage begins and is over
SOME = torch.tensor([voxel in (0, 3, 4, 9) for voxel in range(10)])
GROUND = Terrain.from_name("hilly-1-5-0")


def live(damage: Any, noise: float = 0.05) -> tuple[Tensor, Tensor, Tensor]:
    """Readings, actuation in force and poses after each step of bipeds, (STEPS, WORLDS, ...)."""
    sim = Simulator("biped-4x3", GROUND, WORLDS, sensors="high", noise=noise, damage=damage, seed=7)
    readings, actuations, poses = [], [], []
    for actuation in gaits(STEPS, WORLDS, 10).float():
        readings.append(sim.step(actuation))
        actuations.append(sim.actuation())
        poses.append(sim.mass_poses())
    return torch.stack(readings), torch.stack(actuations), torch.stack(poses)


def voxel_of_reading() -> list[int]:
    sim = Simulator("biped-4x3", None, sensors="high")
    names = sim.morphology.voxel_names
    return [names.index("_".join(name.split("_")[:2])) for name in sim.sensor_names]


# --- blind ----------------------------------------------------------------------------------------


def test_a_blind_voxel_moves_as_before_and_its_sensors_read_nought():
    healthy, blind = live(None), live(Damage(time=BREAKS, mode="blind", until=MENDS))
    assert torch.equal(blind[1], healthy[1])
    assert torch.equal(blind[2], healthy[2])
    obeys = live(Damage(time=BREAKS))[1] == healthy[1]  # the same voxels break in all modes
    dark = torch.zeros(STEPS, WORLDS, 10, dtype=torch.bool)
    dark[FIRST - 1 : LAST - 1] = ~obeys[FIRST:].all(0)  # row FIRST - 1 is after FIRST steps
    off = dark[..., voxel_of_reading()]
    assert 0.3 < off[FIRST].float().mean() < 0.7
    assert (healthy[0] != 0)[off].all()  # noise sees to that
    assert torch.equal(blind[0], torch.where(off, 0.0, healthy[0]))


def test_a_blind_voxels_averages_go_on_in_secret():
    """What a mended sensor reads at once is what a healthy one reads, window and all."""
    damage = Damage(time=BREAKS, mode="blind", until=MENDS, mask=torch.ones(10, dtype=torch.bool))
    healthy, blind = live(None, noise=0.0)[0], live(damage, noise=0.0)[0]
    assert (blind[FIRST - 1 : LAST - 1] == 0).all()
    assert torch.equal(blind[LAST - 1 :], healthy[LAST - 1 :])
    assert torch.equal(blind[: FIRST - 1], healthy[: FIRST - 1])


def test_damage_at_birth_is_seen_at_birth():
    blind = Damage(time=0.0, mode="blind", mask=SOME)
    sim = Simulator("biped-4x3", None, 3, sensors="high", noise=0.1, damage=blind)
    off = SOME[voxel_of_reading()]
    readings = sim.reset()
    assert (readings[:, off] == 0).all()
    assert (readings[:, ~off] != 0).all()


# --- masks ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [torch.as_tensor, np.asarray, lambda mask: mask.tolist()])
@pytest.mark.parametrize("shape", ["voxels", "worlds and voxels"])
def test_a_mask_says_which_voxels_break(kind, shape):
    mask = SOME if shape == "voxels" else torch.rand(WORLDS, 10, generator=seeded()) < 0.3
    damage = Damage(probability=1.0, time=BREAKS, mask=kind(mask))
    actuations, asked = live(damage)[1], gaits(STEPS, WORLDS, 10).float()
    assert torch.equal(actuations[:FIRST], asked[:FIRST])
    lost = mask.expand(WORLDS, 10)
    assert torch.equal(actuations[FIRST:], torch.where(lost, 0.0, asked[FIRST:]))


def seeded() -> torch.Generator:
    return torch.Generator().manual_seed(0)


def test_a_mask_is_kept_as_it_was():
    mask = SOME.clone()
    damage = Damage(mask=mask)
    mask[:] = True
    assert damage.mask.tolist() == SOME.tolist()
    with pytest.raises(ValueError, match="read-only"):
        damage.mask[0] = False


@pytest.mark.parametrize(
    ("mask", "message"),
    [
        ([0, 1], r"mask of bools, got \[0, 1\]"),
        ([[True], [True, False]], "mask of bools"),
        ("biped", "mask of bools, got 'biped'"),
    ],
)
def test_masks_that_are_not_bools_are_refused(mask, message):
    with pytest.raises(ValueError, match=message):
        Damage(mask=mask)


@pytest.mark.parametrize("shape", [(9,), (2, 10), (3, 9), (1, 3, 10), ()])
def test_masks_of_another_shape_are_refused(shape):
    damage = Damage(mask=np.zeros(shape, bool))
    with pytest.raises(ValueError, match=r"shape \(voxels=10,\) or \(worlds=3, voxels=10\), got"):
        Simulator("biped-4x3", None, 3, damage=damage)


# --- all modes --------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["rest", "frozen", "random", "blind"])
def test_damage_is_over_after_its_time(mode):
    """The robots remember it, but obey and see again."""
    settings: dict[str, Any] = {"time": BREAKS, "mode": mode}
    healthy = live(None)
    ends, stays = live(Damage(until=MENDS, **settings)), live(Damage(until=math.inf, **settings))
    part = 0 if mode == "blind" else 1
    assert torch.equal(ends[part][: LAST - 1], stays[part][: LAST - 1])
    assert not torch.equal(ends[part][LAST:], stays[part][LAST:])
    assert torch.equal(ends[1][LAST:], healthy[1][LAST:])
    assert (ends[0][LAST:] != 0).all()


@pytest.mark.parametrize("mode", ["rest", "frozen", "random", "blind"])
@pytest.mark.parametrize("masked", [False, True])
def test_a_damaged_world_is_the_same_alone(mode, masked):
    masks = torch.rand(WORLDS, 10, generator=seeded()) < 0.5 if masked else None
    actuations = gaits(STEPS, WORLDS, 10).float()

    def run(worlds: list[int]) -> tuple[Tensor, Tensor]:
        own = None if masks is None else masks[worlds]
        sim = Simulator(
            "biped-4x3",
            GROUND,
            len(worlds),
            sensors="high",
            noise=0.05,
            seed=worlds,
            damage=Damage(time=BREAKS, mode=mode, mask=own),
        )
        readings = sim.run(actuations[:, worlds])
        return readings, sim.mass_poses()

    readings, poses = run(list(range(WORLDS)))
    for world in (0, 4, 9):
        own_readings, own_poses = run([world])
        assert torch.equal(own_readings[0], readings[world])
        assert torch.equal(own_poses[0], poses[world])


# --- damage of each world -------------------------------------------------------------------------


def test_worlds_may_break_at_different_times():
    """Each as if all had its damage; None breaks nothing."""
    early = Damage(0.5, BREAKS)
    late = Damage(time=MENDS, mask=SOME)
    each = [None, early, late, early, None, late, early, late, None, early]
    mixed = live(each)
    for damage in (None, early, late):
        worlds = [world for world, own in enumerate(each) if own is damage]
        alone = live(damage)
        for ours, theirs in zip(mixed, alone, strict=True):
            assert torch.equal(ours[:, worlds], theirs[:, worlds])


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        ([None] * 3, "damage: expected one or a list of 10, got 3"),
        ([Damage(), Damage(mode="blind")] * 5, "same mode in all worlds, got blind, rest"),
        ([0.5] * 10, "damage: expected physics.Damage or None, got 0.5"),
    ],
)
def test_bad_damage_of_worlds_is_told(damage, message):
    with pytest.raises(ValueError, match=message):
        live(damage)
