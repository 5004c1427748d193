"""Speed of Hebbian controllers and of the baseline: the paper's Fig. 2, 3, 4 and 5."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.report.figures import boxes, curves
from experiments.report.figures.boxes import Box
from experiments.report.figures.curves import Curve
from experiments.report.finished_runs import FinishedRuns, Table, gather, per_run
from experiments.runs.names import MORE_EVALUATION_TERRAINS, evaluation_file

__all__ = [
    "box",
    "damage",
    "damage_evolution",
    "effectiveness",
    "evolution",
    "generalization",
    "main_models",
    "unseen",
    "unseen_per_run",
]

Values = NDArray[np.float64]

_UNIT = "Speeds in m/s; medians over runs with 95 % bootstrap intervals. "
_HONEST = (
    "Tests and medians take one number per run, its median over the terrains; `p_pooled` takes "
    "every terrain of every run for independent, as the paper's figure does. "
)


def effectiveness(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Fig. 2: speed of each run's best individual at the end of evolution.

    Args:
        run_folders: The folders of finished runs; those that do not belong here are passed over.
        out: an existing folder.

    Returns:
        The files written; none if there is nothing to draw. So do all figures.
    """
    found = main_models(gather(run_folders), "none")
    drawn = [box(each, each.fitness) for each in found]
    return boxes.draw(
        drawn, out, "effectiveness", "MLP", f"{_UNIT}Best individual of the last generation."
    )


def generalization(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Fig. 3: speed of the best individuals on unseen hilly terrains."""
    return _unseen_figure(run_folders, out, "generalization", "none")


def damage(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Fig. 5: as Fig. 3, evolved and re-assessed with voxels that break at half of the episode."""
    return _unseen_figure(run_folders, out, "damage", "half")


def evolution(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """Fig. 4: best speed of each generation."""
    return _course(run_folders, out, "evolution", "none")


def damage_evolution(run_folders: Sequence[Path], out: Path) -> list[Path]:
    """As Fig. 4, with voxels that break at half of the episode."""
    return _course(run_folders, out, "damage_evolution", "half")


def main_models(conditions: Sequence[FinishedRuns], damage: str) -> list[FinishedRuns]:
    """The paper's main Hebbian model and the baseline, evolved with a kind of damage."""
    chosen = [each for each in conditions if not each.variant and each.config.damage == damage]
    return sorted(chosen, key=lambda each: each.config.controller == "mlp")  # Hebbian first


def unseen(condition: FinishedRuns) -> Table | None:
    """Re-assessment on unseen terrains of the kind, and with the damage, of the evolution: on 40 of
    them where that was done, else on the paper's 10."""
    more = condition.table(evaluation_file(condition.config, MORE_EVALUATION_TERRAINS))
    return condition.table(evaluation_file(condition.config)) if more is None else more


def unseen_per_run(condition: FinishedRuns) -> Values:
    """Median speed on unseen terrains [m/s], shape (runs,); empty if there was none."""
    table = unseen(condition)
    return np.empty(0) if table is None else per_run(table)


def _unseen_figure(run_folders: Sequence[Path], out: Path, name: str, damage: str) -> list[Path]:
    drawn = [
        box(each, per_run(table), table["speed"])
        for each in main_models(gather(run_folders), damage)
        if (table := unseen(each)) is not None
    ]
    return boxes.draw(drawn, out, name, "MLP", _UNIT + _HONEST)


def _course(run_folders: Sequence[Path], out: Path, name: str, damage: str) -> list[Path]:
    drawn = []
    for each in main_models(gather(run_folders), damage):
        best = each.curves()
        if best.size:
            generations = np.arange(1.0, best.shape[1] + 1)
            drawn.append(
                Curve(each.config.shape, each.config.sensors, each.label, generations, best)
            )
    caption = (
        "Best speed of a generation [m/s]: median, quartiles and standard deviation over runs."
    )
    return curves.draw(drawn, out, name, ("generation", "generation"), caption, points=11)


def box(condition: FinishedRuns, values: Values, pooled: Values | None = None) -> Box:
    """The box of a condition: `values` per run [m/s], `pooled` what is drawn if that is more."""
    config = condition.config
    return Box(config.shape, config.sensors, condition.label, values, pooled)
