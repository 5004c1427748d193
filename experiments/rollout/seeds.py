"""Where every random number of an experiment comes from.

Seeds are derived, not drawn: each is a hash of the run's seed and of what it is for. An episode
therefore meets the same terrain, noise and damage whether it is evaluated alone, in a batch, or
after a run was stopped and resumed.
"""

from __future__ import annotations

from hashlib import blake2b
from typing import Literal

__all__ = ["Purpose", "derive", "terrain_seed", "unseen_terrain_seeds"]

Purpose = Literal["terrain", "world", "init", "unseen", "unseen-init", "pruning"]

_UNSEEN = 1_000_000  # terrain seeds below are kept for re-assessment; evolution uses those above
_TERRAIN_SPAN = 2**31  # terrain seeds stay below, so that names remain short


def derive(run_seed: int, purpose: Purpose, *indices: int) -> int:
    """A seed in [0, 2**63) for one purpose.

    Args:
        run_seed: the seed of the run.
        purpose: what it is for: "terrain"; "world" (sensor noise and damage); "init" (initial
            weights); "unseen" and "unseen-init", the same of a re-assessment; "pruning", which
            synapses to prune at random.
        indices: what it belongs to, such as (generation, individual).
    """
    text = f"{run_seed}/{purpose}/{'/'.join(map(str, indices))}"
    return int.from_bytes(blake2b(text.encode(), digest_size=8).digest(), "big") >> 1


def terrain_seed(run_seed: int, generation: int, individual: int) -> int:
    """Seed of the terrain of one evaluation of an evolution, never one of the unseen."""
    seed = derive(run_seed, "terrain", generation, individual)
    return _UNSEEN + seed % (_TERRAIN_SPAN - _UNSEEN)


def unseen_terrain_seeds(count: int) -> list[int]:
    """The predefined seeds 0, 1, ... of terrains that no evolution meets.

    Raises:
        ValueError: count is not within 1..1,000,000.
    """
    if not 1 <= count <= _UNSEEN:
        raise ValueError(f"terrains: expected 1 to {_UNSEEN}, got {count!r}")
    return list(range(count))
