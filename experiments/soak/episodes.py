"""Random staggered resets of vector environments: every world as alone, and no memory lost."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import torch
from torch import Tensor

from experiments.soak.counts import EpisodeCounts
from experiments.soak.memory import resident_memory
from physics import Damage
from physics.envs import VoxelVectorEnv

__all__ = ["try_episodes"]

_WORLDS = 24
_STEPS = 240
_COMPARED = 3  # worlds that go through the same alone
_SHAPES = ("worm-3x1", "biped-4x3", "box-2x2", "comb-5x2")
_TERRAINS = ("hilly-3-30", "flat", "steppy-1-10", "uphill-10")


def try_episodes(seed: int, trial: int, counts: EpisodeCounts) -> None:
    """One trial: worlds that are reset at random, some with seeds, beside some of them alone.

    Args:
        seed: Of all trials.
        trial: Number of this one; with the seed it decides everything.
        counts: To be added to.
    """
    draws = np.random.default_rng((seed, 7, trial))
    shapes: Any = str(draws.choice(_SHAPES))
    if draws.random() < 0.3:
        shapes = [str(each) for each in draws.choice(_SHAPES, _WORLDS)]
    settings: dict[str, Any] = {
        "terrain": str(draws.choice(_TERRAINS)),
        "sensors": str(draws.choice(["low", "medium", "high"])),
        "noise": float(draws.choice([0.0, 0.05])),
        "damage": Damage(time=0.5, mode=str(draws.choice(["rest", "blind"]))),
        "episode": 10.0,
        "autoreset": "disabled",
        "threads": 1,
    }
    resets = _plan(draws)
    seeds = draws.integers(2**31, size=_WORLDS).tolist()
    everyone = list(range(_WORLDS))
    actions = torch.from_numpy(draws.uniform(-1, 1, (_STEPS, _WORLDS, 12))).float()
    seen = _run(shapes, everyone, seeds, resets, actions, settings)
    faults: Counter[str] = Counter()
    faults["not finite"] += int((~seen.isfinite()).flatten(1).any(1).sum())
    for world in draws.choice(_WORLDS, _COMPARED, replace=False).tolist():
        alone = _run(shapes, [world], seeds, resets, actions, settings)
        own = seen[world, :, : alone.shape[2]]
        faults["other than alone"] += int(not torch.equal(own, alone[0]))
    counts.trials += 1
    counts.steps += (_WORLDS + _COMPARED) * _STEPS
    counts.resets += sum(len(worlds) for worlds in resets.values())
    counts.faults.update(faults)
    if any(faults.values()) and len(counts.examples) < 20:
        counts.examples.append(f"seed {seed}, trial {trial}: {dict(faults)} {shapes} {settings}")
    if counts.trials % 20 == 0:
        counts.memory.append(resident_memory())


def _plan(draws: np.random.Generator) -> dict[int, dict[int, int | None]]:
    """Which worlds begin an episode before which step, and with which seed, if with a new one."""
    plan: dict[int, dict[int, int | None]] = {}
    for step in np.flatnonzero(draws.random(_STEPS) < 0.15).tolist():
        chosen = draws.choice(_WORLDS, draws.integers(1, 5), replace=False).tolist()
        has_seed = bool(draws.random() < 0.3)
        plan[step] = {world: int(draws.integers(2**31)) if has_seed else None for world in chosen}
    return plan


def _run(
    shapes: Any,
    worlds: list[int],
    seeds: list[int],
    resets: dict[int, dict[int, int | None]],
    actions: Tensor,
    settings: dict[str, Any],
) -> Tensor:
    """Observations of some of the worlds after every 20th step, (worlds, looks, R)."""
    own = [shapes[world] for world in worlds] if isinstance(shapes, list) else shapes
    env = VoxelVectorEnv(own, num_envs=len(worlds), **settings)
    env.reset(seed=[seeds[world] for world in worlds])
    voxels = env.sim.n_voxels
    looks = []
    for step in range(_STEPS):
        begun = resets.get(step, {})
        if any(world in begun for world in worlds):
            mask = torch.tensor([world in begun for world in worlds])
            fresh = [begun.get(world) for world in worlds]
            seed = fresh if any(each is not None for each in fresh) else None
            env.reset(seed=seed, options={"reset_mask": mask})
        observations = env.step(actions[step, worlds, :voxels])[0]
        if step % 20 == 19:
            looks.append(observations)
    return torch.stack(looks, 1)
