"""What a campaign would do: a table of its conditions, for --dry-run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.table import Table

from experiments.campaign import cost
from experiments.campaign.grid import Condition
from experiments.campaign.root import ConditionStatus
from experiments.config import EvolveConfig

__all__ = ["Estimate", "estimate", "show"]

_PLAIN_WIDTH = 150  # of a table that does not go to a terminal
_MEGA = 1e6


@dataclass(frozen=True)
class Estimate:
    """What a condition would take.

    Attributes:
        condition: The condition, its config with the options of the machine.
        status: how far it is.
        evaluations: episodes, all in all.
        robot_steps: steps of the simulator of all robots, all in all.
        seconds: expected wall time of what is left [s].
        disk: expected size of the run's folder [bytes].
    """

    condition: Condition
    status: ConditionStatus
    evaluations: int
    robot_steps: int
    seconds: float
    disk: int

    @property
    def state(self) -> str:
        """In words."""
        if self.status.finished:
            return "done"
        if self.status.generation:
            return f"goes on at generation {self.status.generation + 1}"
        return "to do"


def estimate(
    conditions: Sequence[Condition], statuses: Mapping[str, ConditionStatus]
) -> list[Estimate]:
    """What conditions would take, from a short measurement for each kind of robot."""
    paces: dict[tuple[Any, ...], float] = {}
    estimates = []
    for condition in conditions:
        config, status = condition.config, statuses[condition.name]
        left = 0.0
        if not status.finished:
            kind = _kind(config)
            if kind not in paces:
                paces[kind] = cost.seconds_per_robot_step(config)
            left = 1 - status.generation / config.generations
            left *= cost.robot_steps(config) * paces[kind]
        estimates.append(
            Estimate(
                condition,
                status,
                cost.evaluations(config),
                cost.robot_steps(config),
                left,
                cost.disk_bytes(config),
            )
        )
    return estimates


def show(estimates: Sequence[Estimate]) -> None:
    """Print the table and its totals."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=_PLAIN_WIDTH)
    table = Table(box=None, header_style="")
    table.add_column("condition", no_wrap=True)
    for title in ("runs", "generations", "evaluations", "million robot-steps", "minutes", "MB"):
        table.add_column(title, justify="right")
    table.add_column("state")
    for each in estimates:
        config = each.condition.config
        table.add_row(
            each.condition.name,
            *(str(config.runs), str(config.generations), *_amounts([each])),
            each.state,
        )
    table.add_row(f"{len(estimates)} conditions", "", "", *_amounts(estimates), "")
    console.print(table)


def _amounts(estimates: Sequence[Estimate]) -> list[str]:
    return [
        f"{sum(each.evaluations for each in estimates):,}",
        f"{sum(each.robot_steps for each in estimates) / _MEGA:,.1f}",
        f"{sum(each.seconds for each in estimates) / 60:,.1f}",
        f"{sum(each.disk for each in estimates) / _MEGA:,.1f}",
    ]


def _kind(config: EvolveConfig) -> tuple[Any, ...]:
    """What the time of a robot-step depends on."""
    return config.shape, config.sensors, config.controller, config.normalize
