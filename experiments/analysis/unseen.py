"""Re-assessment of finished individuals on terrains that their evolution never met (Sec. IV-A)."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from torch import Tensor

from experiments.config import EvolveConfig
from experiments.config.options import options_of
from experiments.io.csvfile import write_csv
from experiments.io.outputs import require_writable
from experiments.rollout import seeds
from experiments.rollout.episode import start_episode
from experiments.rollout.scenarios import Scenarios
from experiments.runs.champions import Champions
from experiments.runs.names import evaluation_file
from experiments.runs.tensorboard import EventFile
from experiments.runs.tensorboard.tracker import run_folders

__all__ = [
    "Assessment",
    "assess",
    "changed_conditions",
    "evaluate_run",
    "reassess",
    "speeds_on",
]


_CHANGEABLE = (
    *("noise", "noise_area", "noise_touch", "noise_velocity", "noise_lidar"),
    *("gravity", "friction", "spring_frequency", "spring_damping"),
    *("control_interval", "control_delay", "actuation_cutoff"),
    *("damage_mode", "damage_probability", "damage_time", "damage_until", "damage_voxels"),
    "duration",
)
"""What champions can meet otherwise than their evolution did."""


@dataclass(frozen=True)
class Assessment:
    """Speeds of the champions of a run on unseen terrains.

    Attributes:
        champions: The champions of the run.
        config: the conditions that they met.
        scenarios: S of them.
        speeds: [m/s], shape (runs, S), float64, NaN where the episode failed.
    """

    champions: Champions
    config: EvolveConfig
    scenarios: Scenarios
    speeds: Tensor

    def log(self, folder: Path) -> None:
        """Show each run's median in TensorBoard, at the last generation.

        Args:
            folder: The folder of the run.
        """
        config = self.config
        name = f"evaluation-{config.terrain}-{config.damage}"
        for path, speeds in zip(run_folders(folder, config.runs), self.speeds, strict=True):
            with EventFile(path, part=name) as file:
                value = speeds.nanquantile(0.5).item()
                tag = f"evaluation/{config.terrain}-{config.damage}"
                file.scalars({tag: None if math.isnan(value) else value}, config.generations)

    def write(self, out: Path) -> Path:
        """Write the CSV file: run, terrain, damage, speed [m/s]."""
        rows = [
            (run, name, self.config.damage, speed)
            for run, own in enumerate(self.speeds.tolist())
            for name, speed in zip(self.scenarios.names, own, strict=True)
        ]
        return write_csv(out, ("run", "terrain", "damage", "speed"), rows)


def speeds_on(config: EvolveConfig, genomes: Tensor, scenarios: Scenarios) -> Tensor:
    """Speeds of individuals, each in each of several scenarios.

    Args:
        config: The options of their evolution, or with another `damage`.
        genomes: shape (K, G).
        scenarios: S of them.

    Returns:
        Speeds [m/s], shape (K, S), float64, NaN where the episode failed. All K individuals meet
        the same terrains, noise and damage.
    """
    n_individuals, n_scenarios = len(genomes), len(scenarios)
    each = genomes.repeat_interleave(n_scenarios, 0)
    outcome = start_episode(config, each, scenarios * n_individuals).finish()
    return outcome.speed.cpu().reshape(n_individuals, n_scenarios)


def reassess(
    config: EvolveConfig, genomes: Tensor, terrain_seeds: Sequence[int], seed: int = 0
) -> Tensor:
    """Speeds of individuals, each on each of several terrains of one kind.

    Args:
        config: The options of their evolution, or with another `terrain` or `damage`.
        genomes: shape (K, G).
        terrain_seeds: as in `Scenarios.unseen`.
        seed: as in `Scenarios.unseen`.

    Returns:
        As `speeds_on`.
    """
    return speeds_on(config, genomes, Scenarios.unseen(config.terrain, terrain_seeds, seed))


def assess(
    folder: Path,
    n_terrains: int,
    terrain: str | None = None,
    damage: Literal["none", "half"] | None = None,
    seed: int = 0,
    changes: Mapping[str, Any] | None = None,
) -> Assessment:
    """Re-assess the champions of a run; nothing is written.

    Args:
        folder: The folder of the run.
        n_terrains: number of unseen terrains.
        terrain: kind of terrain; None for the run's.
        damage: "none" or "half"; None for the run's.
        seed: decides noise, damage and the initial weights.
        changes: other options in place of the run's, such as {"gravity": 5.0}.

    Raises:
        ValueError: an option is wrong, or the run cannot be read.
    """
    champions = Champions.load(folder)
    config = replace(
        champions.config,
        terrain=champions.config.terrain if terrain is None else terrain,
        damage=champions.config.damage if damage is None else damage,
        **(changes or {}),
    )
    config.validate()
    scenarios = Scenarios.unseen(config.terrain, seeds.unseen_terrain_seeds(n_terrains), seed)
    return Assessment(champions, config, scenarios, speeds_on(config, champions.genomes, scenarios))


def changed_conditions(changes: Sequence[str]) -> dict[str, Any]:
    """Options of the robot, the world and the control in place of a run's.

    Args:
        changes: each "NAME=VALUE", such as "gravity=5", "noise_lidar=0.1" or "control_delay=2".

    Raises:
        ValueError: there is no such option, or it is none that can be changed afterwards.
    """
    found: dict[str, Any] = {}
    for change in changes:
        name, _, text = change.partition("=")
        if name not in _CHANGEABLE or not text:
            raise ValueError(
                f"change: expected NAME=VALUE with one of {', '.join(_CHANGEABLE)}, got {change!r}"
            )
        try:
            found[name] = json.loads(text)
        except ValueError:
            found[name] = text
        if name == "damage_voxels":
            found[name] = text
    return found


def evaluate_run(
    folder: Path,
    n_terrains: int,
    terrain: str | None,
    damage: Literal["none", "half"] | None,
    seed: int,
    out: Path | None,
    changes: Sequence[str] = (),
) -> None:
    """Re-assess the champions of a run, print a summary and write every speed to a CSV file.

    Args:
        folder: as in `assess`, like the next four.
        n_terrains: number of unseen terrains.
        terrain: kind of terrain.
        damage: "none" or "half".
        seed: decides noise, damage and the initial weights.
        out: the CSV file, with columns run, terrain, damage, speed [m/s]; by default one in the
            run's folder, named after the conditions.
        changes: other conditions of the world than the run's, each "NAME=VALUE".

    Raises:
        ValueError: an option is wrong, or the run cannot be read; nothing was written then.
    """
    require_writable(out, folder)
    changed = changed_conditions(changes)
    assessment = assess(folder, n_terrains, terrain, damage, seed, changed)
    config, speeds = assessment.config, assessment.speeds
    options = options_of(EvolveConfig)
    words = [options[name].suffix(getattr(config, name)) for name in changed]
    if out is None:
        name = Path(evaluation_file(config, n_terrains, seed))
        out = folder / "-".join([name.stem, *words])
        out = out.with_name(out.name + name.suffix)
    assessment.write(out)
    if not changed:
        assessment.log(folder)
    conditions = "".join(f", {word}" for word in [f"damage {config.damage}", *words])
    print(f"{config.terrain}{conditions}, {n_terrains} terrain(s), speeds in m/s:")
    for run, own in enumerate(speeds):
        low, middle, high = own.nanquantile(own.new_tensor([0.25, 0.5, 0.75])).tolist()
        evolved = assessment.champions.fitness[run].item()
        print(
            f"champion of run {run}: median {middle:.2f}, quartiles {low:.2f} to {high:.2f}, "
            f"{int(own.isnan().sum())} failed (in evolution {evolved:.2f})"
        )
    print(f"wrote {out}")
