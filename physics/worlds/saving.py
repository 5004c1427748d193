"""A simulator's worlds as a dictionary of tensors, to save and to go on from."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from physics.engine.memory.state import State
from physics.scene.terrain import Terrain
from physics.worlds.batch import Batch

__all__ = ["check_fit", "pack", "unpack_terrains"]

FORMAT = 2  # since steps are counted in two digits


def pack(state: State, batch: Batch, signature: dict[str, Any]) -> dict[str, Any]:
    """All that a simulator needs to go on exactly, as `torch.save` keeps it and
    `torch.load(..., weights_only=True)` reads it.

    Args:
        state: The state of the worlds.
        batch: what they started from.
        signature: what another simulator must agree in.
    """
    terrains = batch.terrains or []
    unique = list(dict.fromkeys(terrains))
    numbers = {terrain: k for k, terrain in enumerate(unique)}
    return {
        "format": FORMAT,
        **signature,
        "segments": state.layout.segments,
        "items": state.items.clone(),
        "lists": state.lists.clone(),
        "seeds": torch.from_numpy(batch.seeds.copy()),
        "episodes": torch.from_numpy(batch.episodes.copy()),
        "terrain_names": [terrain.name for terrain in unique],
        "terrain_points": [
            torch.from_numpy(np.stack([terrain.xs, terrain.ys], 1)) for terrain in unique
        ],
        "terrain_of_world": torch.tensor([numbers[terrain] for terrain in terrains], device="cpu"),
    }


def unpack_terrains(saved: dict[str, Any]) -> list[Terrain]:
    """The terrain of every world; none without ground."""
    unique = [
        Terrain.from_profile(points[:, 0].numpy(), points[:, 1].numpy(), name)
        for name, points in zip(saved["terrain_names"], saved["terrain_points"], strict=True)
    ]
    return [unique[k] for k in saved["terrain_of_world"].tolist()]


def check_fit(saved: Any, signature: dict[str, Any]) -> None:
    """Raises unless the worlds are those of a simulator with this signature.

    Raises:
        ValueError: they are not, or are of another format; the message says in what they differ.
    """
    if not isinstance(saved, dict) or "format" not in saved:
        raise ValueError(
            f"state_dict: expected what Simulator.state_dict() returned, got {type(saved).__name__}"
        )
    if saved["format"] != FORMAT:
        other = "a newer" if saved["format"] > FORMAT else "an older"
        raise ValueError(
            f"state_dict: expected format {FORMAT}, got {saved['format']}; it is of {other} version"
        )
    for name, own in signature.items():
        if saved.get(name) != own:
            raise ValueError(
                f"state_dict: expected worlds with {name} {own!r}, got {saved.get(name)!r}; make "
                "the simulator with the same settings"
            )
