"""A campaign on a local Ray cluster of two workers, against the same one in a single process."""

import csv
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from experiments.campaign.grid import Scale
from experiments.campaign.launch import run_campaign
from experiments.campaign.options import CampaignOptions
from experiments.campaign.study import read_study
from experiments.runs.champions import Champions
from tests.experiments.held import held, lines, wait_for_lock

pytest.importorskip("ray")

SCALE = Scale(runs=2, generations=4, population=8, duration=0.5)
NAMES = ("worm-2x1-low-hebbian", "worm-2x1-low-mlp")

# Ray's clusters, and its warnings, belong to a process of their own. One of its workers is held.
ON_RAY = """
import sys
import ray
from experiments.cli import main

hook = None
if sys.argv[1] != "campaign":
    arguments = [sys.argv.pop(1) for _ in range(4)]

    def hook():
        from tests.experiments.held import hold_as

        hold_as(arguments)

environment = {"worker_process_setup_hook": hook} if hook else None
quiet = {"include_dashboard": False, "log_to_driver": False}
ray.init(address="local", num_cpus=2, runtime_env=environment, **quiet)
main()
"""


TRIAL = """
import ray
from experiments.campaign.cluster import connect

connect()
assert ray.get(ray.remote(lambda: 7).remote()) == 7
print(ray.get_runtime_context().gcs_address)
"""


@pytest.fixture
def address(monkeypatch: pytest.MonkeyPatch) -> str:
    """Of a cluster that was started without naming one.

    Some machines let no process start servers of its own.
    """
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    try:
        command = [sys.executable, "-c", TRIAL]
        done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=600)
    except (subprocess.SubprocessError, OSError) as error:
        pytest.skip(f"Ray does not start here: {error}")
    return done.stdout.splitlines()[-1]


def results(root: Path, name: str) -> list[list[str]]:
    """History without the seconds."""
    with (root / "conditions" / name / "history.csv").open(newline="") as file:
        return [row[:-1] for row in csv.reader(file)]


def finished_conditions(out: str) -> dict[str, str]:
    """What was told of conditions that came to their end: names by labels, such as "[1/2]"."""
    lines = (line.split() for line in out.splitlines() if line.endswith(" finished"))
    return {label: name for label, name, _ in lines}


@pytest.mark.long
def test_a_killed_campaign_on_ray_ends_as_one_without(tmp_path: Path, address: str) -> None:
    assert address.startswith("127.0.0.1:")  # which no other machine reaches
    grid = tmp_path / "grid.toml"
    grid.write_text('[base]\nshape = "worm-2x1"\n[axes]\ncontroller = ["hebbian", "mlp"]\n')
    expected, root = tmp_path / "expected", tmp_path / "root"
    options = CampaignOptions(out=expected, scale=SCALE, threads=1)
    assert run_campaign([read_study(grid)], options) == 0

    arguments = f"campaign --grid {grid} --out {root} --cluster ray --runs 2 --population 8"
    arguments += " --generations 4 --duration 0.5"
    folder = root / "conditions" / NAMES[0]
    with held(arguments, folder, 2, code=ON_RAY) as process:
        process.kill()
        process.communicate()
        wait_for_lock(folder)  # its worker ends when it misses its cluster
    assert len(lines(folder)) == 1 + 2 * 2
    assert not (folder / "champion.safetensors").exists()

    command = [sys.executable, "-c", ON_RAY, *arguments.split()]
    finished = subprocess.run(command, capture_output=True, text=True)
    assert finished.returncode == 0, finished.stderr
    told = finished_conditions(finished.stdout)
    assert NAMES[0] in told.values()
    assert list(told)[-1] == "[2/2]"
    assert "did not complete" not in finished.stderr  # for Ray, too, every trial ended well
    for name in NAMES:
        assert results(root, name) == results(expected, name)
        ours = Champions.load(root / "conditions" / name)
        theirs = Champions.load(expected / "conditions" / name)
        assert ours.config == theirs.config
        assert torch.equal(ours.genomes, theirs.genomes)
        assert torch.equal(ours.fitness, theirs.fitness)
