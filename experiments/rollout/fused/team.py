"""The networks of worlds with different robots, packed for the simulator's kernel."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import torch
from torch import Tensor

import hebbtorch
from experiments.rollout.fused import kernel as k
from experiments.rollout.fused.loop import FusedLoop, Share, packed_rows
from experiments.rollout.team import Team, refuse
from physics import Simulator
from physics.backend import unpacked

__all__ = ["FusedTeamLoop", "pack_team"]


@dataclass(frozen=True)
class FusedTeamLoop:
    """The networks of a team, packed for the kernel; with the methods of `FusedLoop`.

    Attributes:
        items: (groups, items, lanes), with room for the largest network.
        parts: The networks of each robot in it.
    """

    items: Tensor
    parts: tuple[FusedLoop, ...]

    def run(self, sim: Simulator, steps: int, monitor: hebbtorch.Monitor | None = None) -> None:
        """Lets the worlds of ``sim`` live for some control steps."""
        refuse(monitor)
        if steps > 0:
            features = self.parts[0].layout.features
            sim.run_closed_loop(partial(k.kernel, features), self.items, steps)

    def freeze(self) -> None:
        """Ends learning: from now on the weights stay as they are."""
        self.items[:, k.PLASTIC] = 0.0

    def state(self) -> hebbtorch.State:
        """The state as it is now."""
        return Team.joined([part.state() for part in self.parts])


def pack_team(sim: Simulator, team: Team, state: hebbtorch.State) -> FusedTeamLoop:
    """The networks of a team and their weights in the kernel's order.

    Args:
        sim: N worlds.
        team: Their networks, all with the same features.
        state: Their state.
    """
    loops, tables = [], []
    for network, own, worlds in zip(team.networks, team.split(state), team.worlds, strict=True):
        share = Share(len(worlds), network.sizes[0], network.sizes[-1], sim.dtype, sim.device)
        rows, layout = packed_rows(share, network, own)
        places = torch.from_numpy(sim.places[worlds]).to(sim.device)
        tables.append(rows)
        loops.append(FusedLoop(rows, network, own, layout, places))
    room = max(rows.shape[1] for rows in tables)
    groups, lanes = sim.groups, sim.lanes
    flat = torch.zeros(groups * lanes, room, dtype=sim.dtype, device=sim.device)
    for rows, loop in zip(tables, loops, strict=True):
        assert loop.places is not None
        flat[loop.places, : rows.shape[1]] = rows
    items = unpacked(flat.unflatten(0, (groups, lanes)).movedim(1, -1), lanes)
    return FusedTeamLoop(items, tuple(replace(loop, items=items) for loop in loops))
