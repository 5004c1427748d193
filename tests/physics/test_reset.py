"""What begins anew with an episode: noise, damage and terrain, in some worlds or in all."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from physics import Damage, Simulator, Terrain
from physics.worlds.first_states import FirstStates
from tests.physics.test_batch import STEPS, actuations, batch, ground, state

WORLDS = list(range(19))
SOME = torch.tensor([world in (2, 3, 17) for world in WORLDS])
CHOSEN = [2, 3, 17]
FLAT = Terrain.from_name("flat")
# More points and more segments within reach than any terrain of `batch`.
ROUGH = Terrain.from_name("steppy-0.1-1-4")


def episode(sim: Simulator, worlds: list[int] = WORLDS) -> tuple[Tensor, Tensor]:
    """Readings and states after STEPS steps."""
    return sim.run(actuations(worlds)), state(sim)


def test_the_next_episode_has_other_noise_and_damage_and_the_seed_decides_which():
    sim = batch(WORLDS)
    first, start = episode(sim), sim.reset()
    second = episode(sim)
    assert not (first[0] == second[0]).all(1).any()  # noise, in every world
    assert not torch.equal(first[1], second[1])  # damage
    again = batch(WORLDS)
    episode(again)
    assert torch.equal(again.reset(), start)
    assert all(torch.equal(*pair) for pair in zip(episode(again), second, strict=True))
    again.reset()
    assert not torch.equal(episode(again)[0], second[0])


def test_an_episode_is_counted_once_it_has_moved():
    sim = batch(WORLDS)
    start = sim.reset()
    assert torch.equal(sim.reset(), start)
    assert torch.equal(start, batch(WORLDS).reset())
    assert sim.at_start
    sim.step(actuations(WORLDS)[0])
    assert not sim.at_start
    assert not torch.equal(sim.reset(), start)
    assert sim.at_start
    sim.set_poses(sim.mass_poses() + 1.0)
    assert not sim.at_start
    sim.reset(torch.arange(sim.n_worlds) > 0)
    assert not sim.at_start  # the first world still stands elsewhere


def test_seeds_begin_their_first_episode():
    sim = batch(WORLDS)
    first = episode(sim)
    for _ in range(2):
        sim.reset(seeds=WORLDS)
        assert sim.time == 0.0
        assert all(torch.equal(*pair) for pair in zip(episode(sim), first, strict=True))
    one = Simulator("box-1x1", None, 3, sensors="low", noise=0.1, seed=7)
    start = one.reset()
    one.step(torch.zeros(3, 1))
    assert torch.equal(one.reset(seeds=np.int64(7)), start)


def test_a_world_that_is_reset_alone_goes_on_as_it_would_in_a_batch():
    """Whatever its neighbours do, its k-th episode is the same."""
    sim = batch(WORLDS)
    episode(sim)
    sim.reset(SOME)
    sim.run(actuations(WORLDS)[:5])
    sim.reset(SOME.numpy())
    readings, states = episode(sim)
    for world in CHOSEN:
        alone = batch([world])
        for _ in range(2):
            alone.step(actuations([world])[0])
            alone.reset()
        own_readings, own_state = episode(alone, [world])
        assert torch.equal(own_readings[0], readings[world])
        assert torch.equal(own_state[0], states[world])


@pytest.mark.parametrize("changes", [{}, {"seeds": [5, 6, 5]}, {"terrains": ROUGH}])
def test_reset_of_some_worlds_leaves_the_others_alone(changes):
    sim, kept = batch(WORLDS), batch(WORLDS)
    half, rest = actuations(WORLDS).split(STEPS // 2)
    sim.run(half)
    before = kept.run(half)
    readings = sim.reset(SOME, **changes)
    assert torch.equal(readings[~SOME], before[~SOME])
    assert sim.times.tolist() == pytest.approx([0.0 if a else 0.5 for a in SOME.tolist()])
    readings, kept_readings = sim.run(rest), kept.run(rest)
    assert torch.equal(readings[~SOME], kept_readings[~SOME])
    assert torch.equal(state(sim)[~SOME], state(kept)[~SOME])


@pytest.mark.parametrize("whole", [True, False])
def test_another_terrain_is_as_if_it_had_been_there_from_the_start(whole):
    worlds = WORLDS if whole else CHOSEN
    terrains = [ROUGH if k % 2 else ground(k + 3) for k in range(len(worlds))]
    sim = batch(WORLDS)
    episode(sim)
    start = sim.reset(None if whole else SOME, seeds=worlds, terrains=terrains)
    fresh = batch(worlds, terrain=terrains)
    assert torch.equal(start[worlds], fresh.reset())
    readings, states = episode(sim)
    own_readings, own_states = episode(fresh, worlds)
    assert torch.equal(readings[worlds], own_readings)
    assert torch.equal(states[worlds], own_states)
    assert sim.touching().any()


@pytest.mark.parametrize("later", [{}, {"seeds": [5, 6, 5]}, {"terrains": ROUGH}])
def test_what_is_worked_out_ahead_is_what_a_reset_does(later):
    """Also for another terrain or seed than was foreseen."""
    sim, kept = batch(WORLDS), batch(WORLDS)
    for each in (sim, kept):
        episode(each)
    terrains = [ground(5), ROUGH, ground(6)]
    sim.prepare(SOME, terrains)
    assert torch.equal(state(sim), state(kept))
    asked = {"terrains": terrains, **later}
    assert torch.equal(sim.reset(SOME, **asked), kept.reset(SOME, **asked))
    assert all(torch.equal(*pair) for pair in zip(episode(sim), episode(kept), strict=True))


@pytest.mark.parametrize(
    ("moved", "asked"), [(True, {"seeds": [5, 6, 5]}), (True, {"terrains": FLAT}), (False, {})]
)
def test_what_is_worked_out_for_another_episode_is_left(moved, asked):
    """Another seed or terrain; or the same episode again, for the worlds have not moved."""
    sim, kept = batch(WORLDS), batch(WORLDS)
    if moved:
        for each in (sim, kept):
            episode(each)
    sim.prepare(SOME)
    assert torch.equal(sim.reset(SOME, **asked), kept.reset(SOME, **asked))
    assert all(torch.equal(*pair) for pair in zip(episode(sim), episode(kept), strict=True))


def test_what_is_worked_out_is_not_for_worlds_that_are_loaded():
    sim, kept = batch(WORLDS, terrain=None), batch(WORLDS, terrain=None)
    kept.reset(seeds=[world + 1 for world in WORLDS])
    episode(kept)
    sim.prepare(SOME)
    sim.load_state_dict(kept.state_dict())
    assert torch.equal(sim.reset(SOME), kept.reset(SOME))
    assert all(torch.equal(*pair) for pair in zip(episode(sim), episode(kept), strict=True))


def test_a_reset_that_was_foreseen_works_nothing_out(monkeypatch):
    sim, kept = batch(WORLDS), batch(WORLDS)
    for each in (sim, kept):
        episode(each)
    sim.prepare(SOME)
    expected = kept.reset(SOME)
    monkeypatch.setattr(FirstStates, "of_worlds", None)
    assert torch.equal(sim.reset(SOME), expected)
    with pytest.raises(TypeError):  # it is used once
        sim.reset(SOME)


def test_centres_are_where_the_reset_robots_are():
    sim = batch(WORLDS)
    episode(sim)
    before = sim.center_of_mass()
    sim.reset(SOME)
    assert torch.equal(sim.center_of_mass(), sim.voxel_centers().mean(1))
    assert torch.equal(sim.center_of_mass()[~SOME], before[~SOME])
    assert not (sim.center_of_mass()[SOME] == before[SOME]).any()


def test_a_mask_of_damage_stays_with_its_world():
    mask = torch.rand(len(WORLDS), 10, generator=torch.Generator().manual_seed(0)) < 0.5
    sim = batch(WORLDS, noise=0.0, damage=Damage(time=0.0, mask=mask))
    for _ in range(2):
        sim.run(actuations(WORLDS)[:2])
        assert torch.equal(sim.actuation() == 0, mask)
        sim.reset(SOME)


def test_no_world_may_be_chosen():
    sim = batch(WORLDS)
    readings, before = episode(sim)
    assert torch.equal(sim.reset(torch.zeros(len(WORLDS), dtype=torch.bool)), readings)
    assert torch.equal(state(sim), before)


def without_ground() -> Simulator:
    return Simulator("worm-2x1", None, 2)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"worlds": torch.zeros(3, dtype=torch.bool)}, r"worlds: .*worlds=2.* got shape \(3,\)"),
        ({"worlds": np.zeros(2)}, "worlds: expected a bool mask, got torch.float64"),
        ({"worlds": [True, False]}, "worlds: expected a tensor .* got list"),
        ({"seeds": [1]}, "seed: expected one integer or 2 of them, got 1"),
        ({"seeds": [1, -1]}, "seed: expected integers >= 0, got -1"),
        ({"seeds": 3, "worlds": torch.tensor([True, False])}, "seeds: expected one for each of"),
        ({"terrains": [FLAT]}, "terrain: expected one Terrain, a list of 2 or None, got 1"),
        ({"terrains": "flat"}, "terrain: expected physics.Terrain, got 'flat'"),
        ({"terrains": FLAT, "seeds": [1, 2, 3]}, "seed: expected one integer or 2"),
    ],
)
def test_bad_arguments_are_told_and_change_nothing(arguments: dict[str, Any], message: str):
    sims = [Simulator("worm-2x1", FLAT, 2, sensors="low", noise=0.1) for _ in range(2)]
    for sim in sims:
        sim.step(torch.zeros(2, 2))
    with pytest.raises(ValueError, match=message):
        sims[0].reset(**arguments)
    assert torch.equal(state(sims[0]), state(sims[1]))
    assert torch.equal(sims[0].reset(), sims[1].reset())


def test_terrains_need_ground():
    with pytest.raises(ValueError, match="terrains: expected None in worlds without ground"):
        without_ground().reset(terrains=FLAT)


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda sim: pickle.loads(pickle.dumps(sim))])
def test_a_copy_goes_on_as_the_original(duplicate):
    sim = batch(WORLDS)
    episode(sim)
    sim.reset(SOME)
    other = duplicate(sim)
    for _ in range(2):
        assert all(torch.equal(*pair) for pair in zip(episode(sim), episode(other), strict=True))
        assert torch.equal(sim.reset(), other.reset())


def test_worlds_made_in_inference_mode_can_be_reset_outside():
    with torch.inference_mode():
        sim = Simulator("worm-2x1", FLAT, 3, sensors="low")
        sim.step(torch.zeros(3, 2))
        sim.reset(torch.tensor([True, False, False]))
    sim.reset(torch.tensor([True, False, False]))
    sim.reset(terrains=ROUGH)
    sim.reset()
