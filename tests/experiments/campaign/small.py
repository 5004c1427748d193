"""A small study, and how tests run it."""

from pathlib import Path

from experiments.campaign.grid import Grid, Scale
from experiments.campaign.launch import run_campaign
from experiments.campaign.options import CampaignOptions
from experiments.campaign.study import Study
from experiments.config import EvolveConfig

SCALE = Scale(runs=2, generations=2, population=8, duration=0.5, seed=3)
WORM = EvolveConfig(shape="worm-2x1")
BOTH = Study("both", "which?", (Grid(WORM, {"controller": ("hebbian", "mlp")}),))
HEBBIAN, MLP = "worm-2x1-low-hebbian", "worm-2x1-low-mlp"


def run(*studies: Study, out: Path, scale: Scale = SCALE, **options: object) -> int:
    return run_campaign(studies, CampaignOptions(out=out, scale=scale, threads=1, **options))


def snapshot(folder: Path) -> dict[str, tuple[int, int]]:
    """Which files there are, and whether they were written anew."""
    found = {}
    for path in folder.rglob("*"):
        status = path.stat()
        found[str(path.relative_to(folder))] = (status.st_ino, status.st_mtime_ns)
    return found
