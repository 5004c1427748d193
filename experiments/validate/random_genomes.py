"""The first generation of an evolution: random genomes in closed loop.

They were recorded with self-collision and with the true events of continuous collision detection,
so they are replayed with both. Without them, as the simulator is by default, the mean speed of the
Hebbian ones is some 0.02 m/s higher.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import torch
from scipy.stats import ks_2samp

from experiments.rollout.episode import Episode
from experiments.validate import networks
from experiments.validate.case import Case, Check, Outcome, Panel, Picture, Setting, Skip, Tolerance
from experiments.validate.motion import STARTS, disturbed
from experiments.validate.recordings import Recordings
from experiments.validate.sensors import RECORDED_RAYS
from physics import Apparatus, Morphology, Terrain

__all__ = ["cases"]

_DURATION = 60.0  # [s]
# The motions are chaotic: one start alone moves the mean of 40 speeds by some 0.02 m/s.
_DTYPE = torch.float64  # the reference's
_KS = Tolerance("at least", 0.01)
_MEAN = Tolerance("within", 0.06)


@dataclass(frozen=True)
class _Generation:
    """The recorded episodes of random genomes.

    Attributes:
        name: The name of the table.
        kind: The kind of the networks, "hlp" or "mlp".
        morphology, apparatus: The robot's shape and sensors.
        duration: The duration of an episode [s].
        genomes: The genomes of the N networks, (N, genes).
        terrains: one per genome.
        speeds: recorded [m/s], (N,).
    """

    name: str
    kind: str
    morphology: Morphology
    apparatus: Apparatus
    duration: float
    genomes: np.ndarray
    terrains: list[Terrain]
    speeds: np.ndarray


def cases(recordings: Recordings) -> list[Case | Skip]:
    """One for every table ``gen0_<shape>_<level>_<kind>``."""
    found: list[Case | Skip] = []
    for match in recordings.names(r"gen0_([^_]+)_(low|medium|high)_(hlp|mlp)"):
        name, shape, level, kind = match[0], match[1], match[2], match[3]
        table = recordings.table(name)
        morphology = recordings.robot(shape, name)
        apparatus = Apparatus.named(level, morphology, RECORDED_RAYS)
        n_genes = networks.n_genes(kind, _sizes(apparatus, morphology))
        genomes = recordings.genomes(name, len(table), n_genes)
        if genomes is None:
            found.append(Skip(name, f"no file {name}_genomes.f64.gz"))
            continue
        generation = _Generation(
            name,
            kind,
            morphology,
            apparatus,
            recordings.duration(name, _DURATION),
            genomes,
            [
                recordings.terrain(terrain, f"{table.path.name}: column terrain")
                for terrain in table.text("terrain")
            ],
            table.numbers("velocity"),
        )
        found.append(Case(name, partial(_replay, generation)))
    return found


def _sizes(apparatus: Apparatus, morphology: Morphology) -> list[int]:
    return [apparatus.n_readings, apparatus.n_readings, morphology.n_voxels]


def _replay(generation: _Generation, setting: Setting) -> Outcome:
    ours = _speeds(generation, setting)
    recorded = generation.speeds
    case = f"{generation.name} {'f64' if torch.float64 == _DTYPE else 'f32'}"
    likeness = float(ks_2samp(ours.ravel(), recorded).pvalue)
    means = float(recorded.mean()), float(ours.mean())
    rows = (
        Check(case, f"{STARTS} starts: Kolmogorov-Smirnov p of the speeds", 1.0, likeness, _KS),
        Check(case, f"mean of {STARTS} starts: mean speed [m/s]", *means, _MEAN),
    )
    scatter = Panel(
        f"mean of {STARTS} starts",
        "recorded speed [m/s]",
        "our speed [m/s]",
        "points",
        recorded,
        ours.mean(axis=0),
    )
    share = Panel("all starts", "speed [m/s]", "share of robots", "share", recorded, ours.ravel())
    return Outcome(rows, (Picture(generation.name, (scatter, share)),))


def _speeds(generation: _Generation, setting: Setting) -> np.ndarray:
    """Our speeds, (starts, N), all as worlds of one simulator."""
    genomes = torch.from_numpy(generation.genomes)
    shifted = disturbed(genomes, 0)
    sizes = _sizes(generation.apparatus, generation.morphology)
    sim = setting.simulator(
        generation.morphology,
        generation.terrains * STARTS,
        len(shifted),
        sensors=generation.apparatus,
        dtype=_DTYPE,
        engine=replace(setting.engine, self_collision=True, continuous=True),  # as recorded
    )
    network = networks.build(generation.kind, shifted, sizes, _DTYPE).to(sim.device)
    outcome = Episode(sim, network, generation.duration).finish()
    return outcome.speed.cpu().numpy().reshape(STARTS, -1)
