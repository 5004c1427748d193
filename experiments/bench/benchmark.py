"""The command: measures one thing after the other, shows and writes the table."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from rich.console import Console

from experiments.bench import (
    comparison,
    display,
    evolution,
    overhead,
    plasticity,
    rates,
    resets,
    scaling,
    startup,
)
from experiments.bench.environments import bench_environments
from experiments.bench.gpu import gpu
from experiments.bench.machine import Machine, available_cores
from experiments.bench.measurement import Measurement, Stage
from experiments.bench.profile import step_stages
from experiments.bench.setting import Setting
from experiments.bench.timing import OtherProcesses
from experiments.io.outputs import make_room
from physics import checks

__all__ = ["Benchmark", "bench", "measurements", "processes"]

Benchmark = Callable[[Setting], list[Measurement]]
_ROUND, _QUICK_ROUND = 1.0, 0.2  # of the throughput curve [s]
_PLAIN_WIDTH = 150  # of a table that does not go to a terminal


def bench(
    json: Path | None = None,
    out: Path | None = None,
    *,
    quick: bool = False,
    profile: bool = False,
    seed: int = 0,
    threads: int | None = None,
    against: Path | None = None,
    environments: int = 0,
    evogym: str | None = None,
    only_resets: bool = False,
) -> None:
    """Measures how fast everything runs and prints a table.

    Args:
        json: file for the table in JSON.
        out: folder for the table in JSON and in Markdown, bench.json and bench.md.
        quick: whether to take fewer and shorter measurements.
        profile: whether to tell where the time of a step goes, too.
        seed: The seed of gaits, genomes and terrains.
        threads: The number of threads of the evolution; all cores if not given. All else runs on
            one.
        against: another checkout of this project; only how the two compare is measured then.
        environments: The largest number of environments of the throughput curve; only that is
            measured then.
        evogym: An interpreter that has EvoGym, for that curve; by default this one.
        only_resets: whether to measure what resets cost beside steps; only that is measured then.

    Raises:
        ValueError: an option is wrong; nothing was measured then.
    """
    checks.positive_integer("threads", available_cores() if threads is None else threads)
    if seed < 0:
        raise ValueError(f"seed: expected an integer >= 0, got {seed}")
    if against is not None and profile:
        raise ValueError("profile: expected no profile with against, got both; run bench twice")
    if against is not None:
        comparison.check(against)
    make_room(json, out)
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=_PLAIN_WIDTH)
    if environments != 0:
        seconds = _QUICK_ROUND if quick else _ROUND
        bench_environments(console, environments, out, seconds, evogym)
        return
    setting = Setting.of(quick=quick, cores=threads or available_cores(), seed=seed)
    machine = Machine.here()
    if against is not None:
        _compare(console, machine, against, setting, json, out)
        return
    rows = _measure(console, setting, only_resets)
    parts: list[Stage] = []
    if profile:
        parts = [*step_stages(setting), *overhead.generation_stages(setting)]
    display.show_rows(console, rows)
    if parts:
        display.show_stages(console, parts)
    files = [json] if json else []
    if out is not None:
        files.append(out / "bench.json")
        tables = display.markdown(machine, rows, parts)
        (out / "bench.md").write_text(tables, encoding="utf-8")
        console.print(f"wrote {out / 'bench.md'}")
    for path in files:
        display.write_json(path, machine, seed, quick, rows, parts)
        console.print(f"wrote {path}")


def _compare(
    console: Console,
    machine: Machine,
    checkout: Path,
    setting: Setting,
    json: Path | None,
    out: Path | None,
) -> None:
    """Measures this program and another checkout in turns, shows and writes the table."""
    rows = comparison.compare_all(console, checkout, setting)
    comparison.show(console, checkout, rows)
    files = [json] if json else []
    if out is not None:
        files.append(out / "against.json")
        table = comparison.markdown(machine, checkout, rows)
        (out / "against.md").write_text(table, encoding="utf-8")
        console.print(f"wrote {out / 'against.md'}")
    for path in files:
        comparison.write_json(path, machine, checkout, setting.seed, rows)
        console.print(f"wrote {path}")


def measurements() -> dict[str, Benchmark]:
    """What is measured within this process, in this order."""
    found: dict[str, Benchmark] = {
        f"open loop, {shape}": partial(rates.open_loop, shape=shape)
        for shape in (rates.BIPED, rates.WORM)
    }
    for controller in rates.CONTROLLERS:
        for shape in (rates.BIPED, rates.WORM):
            found[f"closed loop, {shape}, {controller}"] = partial(
                rates.closed_loop, shape=shape, controller=controller
            )
    return found | {
        "own torch module": rates.own_module,
        "plastic network in torch": plasticity.networks,
        "batches": scaling.over_worlds,
        "boxes": scaling.over_voxels,
        "memory": scaling.memory,
        "a generation besides the episodes": overhead.besides_episodes,
    }


def of_resets() -> dict[str, Benchmark]:
    """What is measured of resets, in this order."""
    return {"environments": resets.environments, "single worlds": resets.single_worlds}


def processes() -> dict[str, Benchmark]:
    """What is measured in processes of its own, in this order."""
    return {"evolve": evolution.evolve, "starts": startup.starts, "GPU": gpu}


def _measure(console: Console, setting: Setting, only_resets: bool) -> list[Measurement]:
    """All rows; tells how far it is."""
    rounds = [*measurements().items()] * setting.passes + [*processes().items()]
    if only_resets:
        rounds = [*of_resets().items()] * setting.passes
    rows: dict[str, Measurement] = {}
    for number, (name, measure) in enumerate(rounds, start=1):
        started, other_processes = time.perf_counter(), OtherProcesses()
        measured = measure(setting)
        others = other_processes.cores()
        for row in measured:
            row = replace(row, others=others)
            rows[row.what] = rows[row.what].joined(row) if row.what in rows else row
        seconds = time.perf_counter() - started
        console.print(f"{number}/{len(rounds)} {name}: {seconds:.1f} s")
    return list(rows.values())
