"""Did a change of the code move speeds? The same conditions in two folders, run by run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from experiments.campaign.grid import Condition, Scale
from experiments.report import intervals, statistics
from experiments.report.bundle import unpacked
from experiments.report.finished_runs import FinishedRuns, find_runs, gather
from experiments.report.intervals import Estimate
from experiments.report.statistics import Comparison, Pair

__all__ = ["Difference", "compare", "read", "show"]

Values = NDArray[np.float64]
_PLAIN_WIDTH = 150  # of a table that does not go to a terminal


@dataclass(frozen=True)
class Difference:
    """What became of the champions' speeds of one condition.

    Attributes:
        name: The name of the condition.
        identical: whether every run gave the same speed, bit for bit.
        comparison: The comparison of the runs now (first) with those before; None without them.
        shift: how much faster they are now [m/s].
    """

    name: str
    identical: bool = False
    comparison: Comparison | None = None
    shift: Estimate | None = None

    @property
    def moved(self) -> bool:
        """Whether the speeds differ significantly, corrected for the number of conditions."""
        return self.comparison is not None and self.comparison.significant

    @property
    def verdict(self) -> str:
        """In words."""
        if self.comparison is None:
            return "not there before"
        if self.identical:
            return "identical"
        if self.moved:
            return "faster" if self.comparison.a12 > 0.5 else "slower"
        return self.comparison.verdict


def read(root: Path, scale: Scale) -> list[FinishedRuns]:
    """The finished conditions of the campaign to compare with.

    Args:
        root: its folder, packed or not.
        scale: The scale of the campaign that will be compared.

    Raises:
        ValueError: there are none, or they are of another scale.
    """
    if not root.is_dir():
        raise ValueError(f"against: expected the folder of a campaign, got {str(root)!r}")
    with unpacked([root]) as folders:
        found = gather(find_runs(folders))
    if not found:
        raise ValueError(f"against: expected finished runs below {str(root)!r}, found none")
    config = found[0].config
    for name, value in asdict(scale).items():
        if name not in ("runs", "seed") and getattr(config, name) != value:
            raise ValueError(
                f"against: expected a campaign with {name} {value} like this one, got "
                f"{getattr(config, name)} in {str(root)!r}"
            )
    return found


def compare(
    conditions: Sequence[Condition], folders: Mapping[str, Path], before: Sequence[FinishedRuns]
) -> list[Difference]:
    """Compare the champions of finished conditions with those of another campaign.

    Args:
        conditions: The conditions of this campaign.
        folders: The folders of those that are finished, by name.
        before: the other campaign's.
    """
    differences, pairs, identical = [], [], []
    for condition in conditions:
        if condition.name not in folders:
            continue
        (now,) = gather([folders[condition.name]])
        other = next((each for each in before if each.config == now.config), None)
        if other is None:
            differences.append(Difference(condition.name))
            continue
        pairs.append(Pair("now", "before", now.fitness, other.fitness, condition.name))
        identical.append(_same_runs(now, other))
    found = [
        Difference(
            pair.where, same, comparison, intervals.shift(pair.first_values, pair.second_values)
        )
        for pair, comparison, same in zip(pairs, statistics.compare(pairs), identical, strict=True)
    ]
    return [*found, *differences]


def show(differences: Sequence[Difference], root: Path) -> None:
    """Print what moved."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=_PLAIN_WIDTH)
    table = Table(box=None, header_style="")
    table.add_column("condition", no_wrap=True)
    for title in ("runs", "before", "now", "shift [m/s]", "A12", "Holm p"):
        table.add_column(title, justify="right")
    table.add_column("verdict")
    for each in differences:
        table.add_row(each.name, *_cells(each), each.verdict)
    console.print(f"speeds against {root}, medians in m/s:")
    console.print(table)
    moved = sum(each.moved for each in differences)
    same = sum(each.identical for each in differences)
    console.print(f"{moved} of {len(differences)} conditions moved, {same} are identical")


def _cells(difference: Difference) -> list[str]:
    comparison = difference.comparison
    if comparison is None:
        return [""] * 6
    now, before = comparison.medians
    return [
        f"{comparison.n[0]}, {comparison.n[1]}",
        f"{before.value:.2f}",
        f"{now.value:.2f}",
        str(difference.shift),
        f"{comparison.a12:.2f}",
        f"{comparison.p_holm:.2g}",
    ]


def _same_runs(now: FinishedRuns, before: FinishedRuns) -> bool:
    seeds = [[seed for _, _, seed in each.sources] for each in (now, before)]
    return seeds[0] == seeds[1] and np.array_equal(now.fitness, before.fitness, equal_nan=True)
