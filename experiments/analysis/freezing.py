"""True learning (paper, Sec. IV-B, Fig. 6 and 10): how do weights act once learning has stopped?

A champion acts once on an unseen terrain, plastic as it is, and its weights are kept at every
whole second. Each of these snapshots then acts anew on other unseen terrains, with weights that
stay as they are. A network that learned for good walks on; one that needs its plasticity falls
back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import Tensor

from experiments.analysis.unseen import speeds_on
from experiments.config import EvolveConfig
from experiments.io.csvfile import labelled, write_csv
from experiments.io.outputs import require_writable
from experiments.rollout import controller, seeds
from experiments.rollout.episode import Episode, simulator, start_episode
from experiments.rollout.scenarios import Scenarios
from experiments.runs.champions import Champions
from experiments.runs.names import FREEZING_TERRAINS, freezing_file
from experiments.runs.tensorboard import EventFile
from experiments.runs.tensorboard.tracker import run_folders

__all__ = [
    "Freezing",
    "act",
    "freeze",
    "freeze_run",
    "learn",
    "plastic_champions",
    "training_and_test",
]

Weights = tuple[Tensor, ...]  # one (..., out, in) per layer

_MOST_WORLDS = 4000  # at once, to bound the memory
_SHOWN = (0, 1, 5, 10, 20, 30, 60)  # [s], in the table printed


@dataclass(frozen=True)
class Freezing:
    """Speeds of frozen champions.

    Attributes:
        title: what was frozen.
        terrains: names of S terrains.
        speeds: [m/s], shape (runs, seconds, S), float64, by the second at which the weights were
            frozen, from 0, the start; NaN where the episode failed.
    """

    title: str
    terrains: list[str]
    speeds: Tensor

    @property
    def middle(self) -> Tensor:
        """Median over the runs of their mean speed over the terrains [m/s], shape (seconds,)."""
        return self.speeds.nanmean(-1).nanquantile(0.5, 0)

    @property
    def spread(self) -> Tensor | None:
        """Standard deviation over the runs (n - 1) likewise; None for a single run."""
        if len(self.speeds) < 2:
            return None
        deviations = self.speeds.nanmean(-1) - self.speeds.nanmean(-1).nanmean(0)
        n = (~deviations.isnan()).sum(0)
        return (deviations.square().nansum(0) / (n - 1).clamp(min=1)).sqrt()

    def write(self, out: Path) -> Path:
        """Write a CSV file: run, second, terrain, speed [m/s]."""
        runs, seconds, _ = map(range, self.speeds.shape)
        rows = labelled(self.speeds, runs, seconds, self.terrains)
        return write_csv(out, ("run", "second", "terrain", "speed"), rows)

    def draw(self, out: Path) -> list[Path]:
        """Draw them as PNG and PDF: median over the runs within their quartiles.

        Args:
            out: path of the PNG file.
        """
        # Slow to import, and most that import this module draw nothing.
        from experiments.io import style

        seconds, of_runs = range(len(self.middle)), self.speeds.nanmean(-1)
        with style.sheet(out.parent, out.stem, (4.4, 2.4)) as sheet:
            axes = sheet.panel(0)
            look = style.looks([""])[""]
            if len(self.speeds) > 1:
                low, high = of_runs.nanquantile(of_runs.new_tensor([0.25, 0.75]), 0).numpy()
                axes.fill_between(seconds, low, high, color=look.color, alpha=0.25, lw=0)
            axes.plot(seconds, self.middle.numpy(), color=look.color)
            axes.axhline(0, color="0.7", linewidth=0.8, zorder=0)
            axes.set(xlabel="weights frozen at [s]", ylabel="speed once frozen [m/s]")
            axes.set_title(self.title)
            of_band = "; line: median, band: quartiles over runs" if len(self.speeds) > 1 else ""
            sheet.note(
                f"{style.counted([len(self.speeds)])}, mean over {len(self.terrains)} unseen "
                f"terrain(s){of_band}"
            )
        return sheet.files

    def log(self, folder: Path, runs: int) -> None:
        """Show them in TensorBoard, by the seconds of the champions' episodes.

        Args:
            folder: The folder of the run.
            runs: The number of runs of the evolution.
        """
        for path, speeds in zip(run_folders(folder, runs), self.speeds.nanmean(-1), strict=True):
            with EventFile(path / "life", part="freeze") as file:
                for second, speed in enumerate(speeds.tolist()):
                    file.scalars({"freeze/speed": None if math.isnan(speed) else speed}, second)


def freeze(champions: Champions, n_terrains: int = FREEZING_TERRAINS, seed: int = 0) -> Freezing:
    """Freeze champions at every whole second of an episode, and assess them from then on.

    Args:
        champions: plastic ones, see `plastic_champions`; shape, sensors, damage and duration of
            all episodes are those of their evolution.
        n_terrains: S, terrains on which each snapshot is assessed.
        seed: decides noise, damage and the initial weights.

    Raises:
        ValueError: n_terrains is not a number of unseen terrains.
    """
    config = champions.config
    training, test = training_and_test(config, n_terrains, seed)
    snapshots = learn(config, champions.genomes, range(int(config.duration) + 1), training)
    speeds = act(config, snapshots, test, champions.genomes)
    bound = "" if config.normalize is None else f", normalized ({config.normalize})"
    title = (
        f"{config.shape}, {config.sensors} sensors, damage {config.damage}{bound}, "
        f"{len(champions.genomes)} run(s)"
    )
    return Freezing(title, test.names, speeds.transpose(0, 1))


def freeze_run(folder: Path, n_terrains: int, seed: int, out: Path | None) -> None:
    """Freeze the champions of a run, print a summary, write every speed and a picture.

    Args:
        folder: The folder of the run.
        n_terrains: terrains on which each snapshot is assessed.
        seed: decides noise, damage and the initial weights.
        out: the CSV file; by default freeze.csv in the run's folder, with a longer name for other
            terrains than campaigns have. The picture has the same name, but ends in .png.

    Raises:
        ValueError: an option is wrong, the run cannot be read or is of a static controller;
            nothing was written then.
    """
    require_writable(out, folder)
    out = out or folder / freezing_file(n_terrains, seed)
    if out.suffix == ".png":
        raise ValueError(f"out: expected a CSV file, got the name of a picture, {str(out)!r}")
    picture = out.with_suffix(".png")
    if picture.exists() and not out.exists():
        raise ValueError(
            f"out: expected a name whose picture, {str(picture)!r}, is free or of the same table, "
            f"got {str(out)!r}; choose another name"
        )
    champions = plastic_champions(folder)
    freezing = freeze(champions, n_terrains, seed)
    files = [freezing.write(out), *freezing.draw(picture)]
    freezing.log(folder, champions.config.runs)
    print(f"{freezing.title}, {n_terrains} terrain(s), median over the runs in m/s:")
    for second in (each for each in _SHOWN if each < len(freezing.middle)):
        spread = "" if freezing.spread is None else f" +- {freezing.spread[second]:.2f}"
        print(f"frozen at {second:2} s: {freezing.middle[second]:.2f}{spread}")
    for path in files:
        print(f"wrote {path}")


def plastic_champions(folder: Path) -> Champions:
    """The champions of a run, if their weights change during an episode.

    Raises:
        ValueError: they do not, or the run cannot be read.
    """
    champions = Champions.load(folder)
    if champions.config.controller != "hebbian":
        raise ValueError(
            f"run: expected plastic champions, got the {champions.config.controller} of "
            f"{str(folder)!r}, whose weights never change; name a run of --controller hebbian"
        )
    return champions


def training_and_test(
    config: EvolveConfig, n_terrains: int, seed: int
) -> tuple[Scenarios, Scenarios]:
    """Where champions learn, and the other unseen terrains on which their weights are judged.

    Args:
        config: The options of their evolution. Where its terrain is a full name, or flat, that one
            is met every time, with other noise and damage.
        n_terrains: number of the other terrains.
        seed: decides noise, damage and the initial weights.

    Raises:
        ValueError: n_terrains is less than 1, or too many.
    """
    if n_terrains < 1:
        raise ValueError(f"terrains: expected an integer >= 1, got {n_terrains!r}")
    first, *others = seeds.unseen_terrain_seeds(1 + n_terrains)
    return (
        Scenarios.unseen(config.terrain, [first], seed),
        Scenarios.unseen(config.terrain, others, seed),
    )


@torch.no_grad()
def learn(
    config: EvolveConfig, genomes: Tensor, seconds: range | list[float], training: Scenarios
) -> Weights:
    """Weights of individuals at several times of one episode.

    Args:
        config: The options of their evolution.
        genomes: shape (K, G).
        seconds: B times, ascending [s]; 0 is the start.
        training: the one scenario that all of them meet.

    Returns:
        Per layer, shape (B, K, out, in).
    """
    episode = start_episode(config, genomes, training * len(genomes))
    snapshots = []
    for second in seconds:
        episode.run_until(second)
        snapshots.append(episode.state().weights)
    return tuple(torch.stack(layer) for layer in zip(*snapshots, strict=True))


def act(
    config: EvolveConfig, weights: Weights, test: Scenarios, genomes: Tensor | None = None
) -> Tensor:
    """Speeds of networks whose weights stay as they are.

    Args:
        config: The options of the evolution of the individuals.
        weights: per layer, shape (B, K, out, in).
        test: S scenarios, the same for all.
        genomes: The genomes of the individuals, shape (K, G): they hold whatever besides the
            weights makes a network, such as biases. Needed only for options that have it.

    Returns:
        Speeds [m/s], shape (B, K, S), float64, NaN where the episode failed.
    """
    n_snapshots = len(weights[0])
    shape = (*weights[0].shape[:-2], len(test))
    of_each = None if genomes is None else genomes.repeat(n_snapshots, 1)
    size = max(1, _MOST_WORLDS // len(test))
    speeds = []
    for first in range(0, shape[0] * shape[1], size):
        part = slice(first, first + size)
        individuals = tuple(layer.flatten(0, -3)[part] for layer in weights)
        speeds.append(
            _speeds(config, individuals, test, None if of_each is None else of_each[part])
        )
    return torch.cat(speeds).reshape(shape)


def _speeds(
    config: EvolveConfig, weights: Weights, test: Scenarios, genomes: Tensor | None
) -> Tensor:
    """Speeds of networks with fixed weights, (N, out, in) per layer; shape (N * S,)."""
    n = len(weights[0])
    if not (config.constant_last_input or config.bias or config.fixed):
        # Without plasticity, such a network is a static one with the same weights.
        static = replace(config, controller="mlp")
        return speeds_on(static, torch.cat([w.flatten(1) for w in weights], -1), test).flatten()
    network = controller.build(config, n * len(test))
    if genomes is None:
        genomes = torch.zeros(n, network.n_genes)
    network.set_genomes(genomes.repeat_interleave(len(test), 0))
    learned = tuple(w.repeat_interleave(len(test), 0) for w in weights)
    state = network.initial_state()._replace(weights=learned)
    sim = simulator(config, test * n)
    episode = Episode(sim, network, config.duration, state=state, loop=config.loop)
    episode.freeze()
    return episode.finish().speed.cpu()
