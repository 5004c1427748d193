"""The names of the files in a run's folder: those of its evolution and of its analyses."""

from __future__ import annotations

from pathlib import Path

from experiments.config import EvolveConfig

__all__ = [
    "ARCHIVE",
    "CAMPAIGN",
    "CHAMPIONS",
    "CHECKPOINT",
    "CONDITIONS",
    "CONFIG",
    "ENDURANCE",
    "EVALUATION_TERRAINS",
    "FREEZING",
    "FREEZING_TERRAINS",
    "GAITS",
    "GENERALIZATION",
    "HISTORY",
    "MATRIX",
    "MORE_EVALUATION_TERRAINS",
    "PAIRED",
    "PRUNING",
    "RANDOM_GENOMES",
    "RECORDING",
    "RECORDING_FORMAT",
    "RECORDING_MEASURES",
    "RECOVERY",
    "SETTLING",
    "evaluation_file",
    "freezing_file",
    "present",
]

CONFIG = "config.json"
CAMPAIGN = "campaign.json"  # in the folder of a campaign
CONDITIONS = "conditions"  # folder with the runs of a campaign
CHECKPOINT = "checkpoint.pt"
HISTORY = "history.csv"
ARCHIVE = "archive.safetensors"
CHAMPIONS = "champion.safetensors"

FREEZING = "freeze.csv"
PRUNING = "pruned.csv"
PAIRED = "paired.csv"
GENERALIZATION = "generalization.csv"
ENDURANCE = "endurance.csv"
RECOVERY = "recovery.csv"
GAITS = "gaits.csv"
MATRIX = "matrix.csv"
RECORDING = "recording.npz"
RECORDING_MEASURES = "recording.json"
RANDOM_GENOMES = "random_genomes.json"
RECORDING_FORMAT = 1  # of these three; earlier versions wrote none
SETTLING = "settling.csv"

_FORMER = {RECORDING: "inner_life.npz", RECORDING_MEASURES: "inner_life.json"}
"""What earlier versions called some files."""

EVALUATION_TERRAINS = 10
"""Unseen terrains of a re-assessment, as in the paper (Sec. IV-A)."""
MORE_EVALUATION_TERRAINS = 40
"""Those of `evaluate --terrains 40`, which reports prefer where it was done."""
FREEZING_TERRAINS = 3
"""Unseen terrains on which frozen weights are assessed."""


def present(folder: Path, name: str) -> Path | None:
    """A file of a run under its name, or under that of earlier versions; None: there is none.

    Args:
        folder: The folder of the run.
        name: The present name of the file.
    """
    paths = (folder / each for each in (name, _FORMER.get(name, name)))
    return next((path for path in paths if path.is_file()), None)


def evaluation_file(
    config: EvolveConfig, n_terrains: int = EVALUATION_TERRAINS, seed: int = 0
) -> str:
    """Name of the table of a re-assessment, after its conditions.

    Args:
        config: The conditions: terrain and damage.
        n_terrains: Number of unseen terrains.
        seed: The seed of noise, damage and initial weights.
    """
    other = _other_terrains(n_terrains, EVALUATION_TERRAINS, seed)
    return f"evaluation-{config.terrain}-{config.damage}{other}.csv"


def freezing_file(n_terrains: int = FREEZING_TERRAINS, seed: int = 0) -> str:
    """Name of the table of frozen champions' speeds.

    Args:
        n_terrains: Number of unseen terrains.
        seed: The seed of noise, damage and initial weights.
    """
    other = _other_terrains(n_terrains, FREEZING_TERRAINS, seed)
    return FREEZING.replace(".", f"{other}.")


def _other_terrains(n_terrains: int, usual: int, seed: int) -> str:
    """What the name adds for other terrains than campaigns have: they are another result."""
    return "" if (n_terrains, seed) == (usual, 0) else f"-{n_terrains}-seed{seed}"
