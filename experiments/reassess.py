"""Re-assessment of finished individuals on terrains that their evolution never met (Sec. IV-A)."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from torch import Tensor

from experiments import controller, seeds
from experiments.champion import Champions
from experiments.config import EvolveConfig, fresh_terrain
from experiments.evaluate import lives
from experiments.store import write_atomically
from physics import Terrain

__all__ = ["reassess", "report"]


def reassess(
    config: EvolveConfig, genomes: Tensor, terrain_seeds: Sequence[int], seed: int = 0
) -> Tensor:
    """Speeds of individuals, each on each of several terrains.

    Args:
        config: of their evolution, or with another `terrain` or `damage`. Where `terrain` is a
            full name, that one is met every time, with other noise and damage.
        genomes: shape (K, G).
        terrain_seeds: of S terrains, such as `seeds.unseen_terrain_seeds(S)`.
        seed: decides noise, damage and the weights at birth.

    Returns:
        Speeds [m/s], shape (K, S), float64, NaN where the life failed. All K individuals meet
        the same terrains, noise and damage.
    """
    n_individuals, n_terrains = len(genomes), len(terrain_seeds)
    networks = controller.build(config, n_individuals * n_terrains)
    networks.set_genomes(genomes.repeat_interleave(n_terrains, 0))
    names = [fresh_terrain(config.terrain, each) for each in terrain_seeds]
    worlds = [seeds.derive(seed, "unseen", each) for each in terrain_seeds]
    births = [seeds.derive(seed, "unseen-init", each) for each in terrain_seeds]
    life = lives(
        config,
        networks,
        [Terrain.from_name(name) for name in names] * n_individuals,
        worlds * n_individuals,
        births * n_individuals,
    )
    return life.speed.cpu().reshape(n_individuals, n_terrains)


def report(
    folder: Path,
    n_terrains: int,
    terrain: str | None,
    damage: Literal["none", "half"] | None,
    seed: int,
    out: Path | None,
) -> None:
    """Re-assess the champions of a run, print a summary and write every speed to a CSV file.

    Args:
        folder: of the run.
        n_terrains: number of unseen terrains.
        terrain: kind of terrain; None for the run's.
        damage: "none" or "half"; None for the run's.
        seed: decides noise, damage and the weights at birth.
        out: the CSV file, with columns run, terrain, damage, speed [m/s]; by default one in the
            run's folder, named after the conditions.

    Raises:
        ValueError: an option is wrong, or the run cannot be read; nothing was written then.
    """
    champions = Champions.load(folder)
    config = replace(
        champions.config,
        terrain=champions.config.terrain if terrain is None else terrain,
        damage=champions.config.damage if damage is None else damage,
    )
    config.validate()
    out = out or folder / f"evaluation-{config.terrain}-{config.damage}.csv"
    if not out.parent.is_dir():
        raise ValueError(f"out: expected a file in an existing folder, got {str(out)!r}; create it")
    terrain_seeds = seeds.unseen_terrain_seeds(n_terrains)
    speeds = reassess(config, champions.genomes, terrain_seeds, seed)
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(("run", "terrain", "damage", "speed"))
    for run, own in enumerate(speeds.tolist()):
        for terrain_seed, speed in zip(terrain_seeds, own, strict=True):
            name = fresh_terrain(config.terrain, terrain_seed)
            writer.writerow((run, name, config.damage, repr(speed)))
    write_atomically(out, table.getvalue().encode())
    print(f"{config.terrain}, damage {config.damage}, {n_terrains} terrain(s), speeds in m/s:")
    for run, own in enumerate(speeds):
        low, middle, high = own.nanquantile(own.new_tensor([0.25, 0.5, 0.75])).tolist()
        evolved = champions.fitness[run].item()
        print(
            f"champion of run {run}: median {middle:.2f}, quartiles {low:.2f} to {high:.2f}, "
            f"{int(own.isnan().sum())} failed (in evolution {evolved:.2f})"
        )
    print(f"wrote {out}")
