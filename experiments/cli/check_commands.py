"""The commands that look at this program itself: validate, bench, soak."""

from __future__ import annotations

import sys
from pathlib import Path

from experiments.cli.arguments import one_thread

__all__ = ["COMMANDS"]


def validate(
    reference: Path | None = None,
    json: Path | None = None,
    out: Path | None = None,
    seed: int = 0,
    trajectory: tuple[Path, ...] = (),
    device: str = "cpu",
) -> None:
    """Compare the simulator with recorded runs; exit code 1 if any case fails.

    For example:
        hebbtorch validate
        hebbtorch validate --out pictures --json validation.json

    Args:
        reference: Folder of recorded runs; by default the project's own copy.
        json: File for the table in JSON.
        out: Folder for pictures of recorded runs and ours; by default none are drawn.
        seed: Decides the motions in the cases that need no recorded run.
        trajectory: Files that `record` wrote: replay their actuation, and only that.
        device: Where to simulate: cpu, or cuda where PyTorch finds a GPU.
    """
    from experiments.validate import validate as run_validation

    one_thread()
    code = run_validation(
        reference, json, out, seed=seed, device=device, trajectories_of=trajectory
    )
    sys.exit(code)


def bench(
    json: Path | None = None,
    out: Path | None = None,
    quick: bool = False,
    profile: bool = False,
    seed: int = 0,
    threads: int | None = None,
    against: Path | None = None,
    environments: int = 0,
    evogym: str | None = None,
    resets: bool = False,
) -> None:
    """Measure how fast everything runs here, and compare it with recorded baselines.

    For example:
        hebbtorch bench --quick
        hebbtorch bench --profile --out bench
        hebbtorch bench --environments 16384 --out bench

    Args:
        json: File for the table in JSON.
        out: Folder for the table in JSON and in Markdown; by default it is only printed.
        quick: Measure less, in one to two minutes; by default it takes three to five.
        profile: Tell where the time of a robot-step goes, too.
        seed: Decides gaits, genomes and terrains.
        threads: The number of threads of the evolution; all cores if not given. All else is
            measured on one.
        against: Another checkout of this project: measure both in turns, and only that.
        environments: Measure vector environments, 1, 4, 16, ... up to so many, and only that.
        evogym: A Python that has EvoGym, which is measured beside them; by default this one.
        resets: Measure what resets of worlds cost beside their steps, and only that.
    """
    from experiments.bench import bench as run_bench

    one_thread()
    run_bench(
        json, out, quick=quick, profile=profile, seed=seed, threads=threads, against=against,
        environments=environments, evogym=evogym, only_resets=resets,
    )  # fmt: skip


def soak(
    minutes: float = 10.0,
    seed: int = 0,
    json: Path | None = None,
    out: Path | None = None,
) -> None:
    """Try the promises for some minutes at random: worlds, kills, damaged files; print counts.

    The exit code is 1 if one did not hold. It runs in one process, on one core.

    Args:
        minutes: About how long it takes.
        seed: Decides every trial.
        json: File for the counts in JSON.
        out: Folder for the runs; by default a temporary one.
    """
    from experiments.io.outputs import make_room
    from experiments.soak.trials import soak as run_soak

    one_thread()
    if not 0 < minutes < 1e6:
        raise ValueError(f"minutes: expected a number > 0, got {minutes}")
    make_room(json, out)
    sys.exit(run_soak(minutes, seed, json, out))


COMMANDS = (validate, bench, soak)
