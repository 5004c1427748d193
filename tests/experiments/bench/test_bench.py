"""The bench: what it makes of given times, and that it times the right work."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch

from experiments.bench import (
    benchmark,
    evolution,
    gpu,
    overhead,
    plasticity,
    profile,
    rates,
    scaling,
    startup,
    timing,
)
from experiments.bench.measurement import Measurement, Target
from experiments.bench.partial_step import STAGES, PartialStep
from experiments.bench.setting import Setting
from experiments.bench.startup import Start, start_process
from experiments.bench.workload import GAITS, ClosedLoop, OpenLoop, OwnModule, Workload
from tests.experiments.bench.benches import ROWS, TINY

# --- figures ------------------------------------------------------------------------------------


def test_figures_of_a_rate() -> None:
    speed = ROWS[0]
    assert (speed.median, speed.best, speed.quartiles) == (2.5, 10.0, (1.75, 4.75))
    assert speed.ratio == 5.0
    assert speed.verdict == "reached"


def test_figures_of_a_cost() -> None:
    cost = Measurement("cost", "us", (3.0, 1.0, 2.0), more_is_better=False, target=Target(2.0, 1.0))
    assert (cost.median, cost.best, cost.ratio) == (2.0, 1.0, None)
    assert cost.verdict == "reached"


@pytest.mark.parametrize(
    ("median", "more_is_better", "verdict"),
    [
        (9.0, True, "MISSED"),
        (10.0, True, "reached"),
        (20.0, True, "aim"),
        (21.0, False, "MISSED"),
        (20.0, False, "reached"),
    ],
)
def test_verdicts(median: float, more_is_better: bool, verdict: str) -> None:
    target = Target(10.0, 20.0) if more_is_better else Target(20.0, 10.0)
    assert Measurement("", "", (median,), more_is_better, target=target).verdict == verdict
    assert Measurement("", "", (median,), more_is_better).verdict is None


def test_a_row_measured_again() -> None:
    row = ROWS[1].joined(replace(ROWS[1], samples=(1.0, 7.0), others=0.5))
    assert row.samples == (4.0, 1.0, 7.0)
    assert row.others == 0.5
    assert row.target == ROWS[1].target
    assert ROWS[0].joined(ROWS[0]).others is None


def test_spread_is_that_of_the_least_disturbed() -> None:
    costs = {40: [2.0, 2.4, 9.0], 400: [1.6, 1.5, 1.7], 4000: [8.0, 1.8, 7.0]}
    assert scaling.spread(costs) == pytest.approx(100 * (2.0 / 1.5 - 1))


def test_share_of_the_closed_loop() -> None:
    # Two cores at 300 robot-steps a second each could do 1,200 in two seconds.
    assert evolution.share(900, seconds=2.0, cores=2, rate=300.0) == pytest.approx(75.0)


def test_a_paper_run_is_a_tenth_of_ten() -> None:
    setting = Setting(cores=2)  # 500 generations of 10 x 40
    assert evolution.paper_run_minutes(2.4, setting) == pytest.approx(500 * 2.4 / 10 / 60)
    half_lives = replace(setting, duration=30.0)
    assert evolution.paper_run_minutes(1.2, half_lives) == pytest.approx(2.0, rel=1e-3)


def test_generations_are_timed_from_the_second_on(tmp_path: Path) -> None:
    history = tmp_path / "history.csv"
    lines = ["run,generation,seconds"]
    lines += [f"{run},{k},{s}" for k, s in enumerate((9.0, 11.5, 13.0)) for run in (0, 1)]
    history.write_text("\n".join(lines))
    assert evolution.generation_seconds(history) == [2.5, 1.5]


# --- clocks -------------------------------------------------------------------------------------


@pytest.fixture
def slow_cpu(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever is timed takes half a second of CPU time."""
    clock = SimpleNamespace(now=0.0)

    def process_time() -> float:
        clock.now += 0.5
        return clock.now

    monkeypatch.setattr(time, "process_time", process_time)


def test_rate_is_robot_steps_over_cpu_time(slow_cpu: None) -> None:
    robots = OpenLoop(rates.BIPED, 8, seed=0)
    assert rates.rates(robots, TINY) == [8 * 2 / 0.5] * 2


def test_cost_is_cpu_time_over_work(slow_cpu: None) -> None:
    costs = {row.what: row.median for row in scaling.over_worlds(TINY)}
    assert costs["cost of a robot-step, 40 worlds"] == pytest.approx(0.5e6 / (40 * 2))
    boxes = {row.what: row.median for row in scaling.over_voxels(TINY)}
    assert boxes["cost of a voxel-step, box-10x10"] == pytest.approx(0.5e6 / (16 * 100 * 2))


def test_cost_of_a_plastic_network(slow_cpu: None) -> None:
    forty, four_hundred = plasticity.networks(TINY)
    assert forty.samples == pytest.approx([0.5e6 / (50 * 40)] * 2)
    assert four_hundred.samples == pytest.approx([0.5e6 / (50 * 400)] * 2)


def test_others_are_what_the_machine_did_and_this_process_did_not(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    stat, walls, owns = tmp_path / "stat", iter((10.0, 14.0)), iter((1.0, 3.0))
    monkeypatch.setattr(timing, "_STAT", stat)
    monkeypatch.setattr(timing.os, "sysconf", lambda name: {"SC_CLK_TCK": 100}[name])
    monkeypatch.setattr(timing.os, "times", lambda: (next(owns), 0.0, 0.0, 0.0, 0.0))
    monkeypatch.setattr(time, "perf_counter", lambda: next(walls))
    stat.write_text("cpu 100 0 100 9999 77 0 0 0 0 0\ncpu0 1 1 1 1 1 1 1 1 1 1\n")
    other_processes = timing.OtherProcesses()
    stat.write_text("cpu 500 100 100 19999 88 50 50 0 0 0\n")
    assert other_processes.cores() == pytest.approx((6.0 - 2.0) / 4.0)


# --- workloads ----------------------------------------------------------------------------------


def test_batches_repeat_the_same_robots() -> None:
    robots = OpenLoop(rates.BIPED, 2 * GAITS, seed=3)
    robots.stretch(20)()
    robots.stretch(20)()
    poses = robots.sim.mass_poses()
    assert torch.equal(poses[:GAITS], poses[GAITS:])
    assert len(poses[:GAITS].flatten(1).unique(dim=0)) == GAITS


@pytest.mark.parametrize(
    "make",
    [
        lambda: OpenLoop(rates.BIPED, 8, seed=0),
        lambda: ClosedLoop(rates.BIPED, "hebbian", 8, seed=0),
        lambda: ClosedLoop(rates.BIPED, "mlp", 8, seed=0),
        lambda: OwnModule(rates.BIPED, 8, seed=0),
    ],
)
def test_robots_live_and_act(make: Callable[[], Workload]) -> None:
    robots = make()
    robots.stretch(90)()
    assert robots.sim.time == pytest.approx(1.5, abs=1e-3)
    assert robots.sim.touching().any()
    assert not robots.sim.failed().any()
    assert (robots.sim.actuation().abs() > 0.01).any(1).all()


def test_memory_counts_every_tensor_that_grows() -> None:
    one, two = (
        scaling.memory(replace(TINY, worlds=worlds))[0].median * worlds for worlds in (16, 32)
    )
    assert two == 2 * one  # whole groups: nothing but them
    robots = ClosedLoop(rates.BIPED, "hebbian", 16, seed=0)
    bodies, synapses = 40 * 8, 5 * (29 * 29 + 29 * 10)
    assert one * 1e3 > 16 * 4 * (bodies + synapses + robots.sim.n_readings)


def test_partial_step_with_all_stages_is_the_simulators() -> None:
    robots = OpenLoop(rates.BIPED, 16, seed=0)
    robots.stretch(120)()
    now = robots.sim.actuation()[None]
    robots.sim.run(now)
    step = PartialStep(robots)
    taken = step.run(sum(STAGES.values()), times=2)
    robots.sim.run(now)
    assert torch.equal(taken, PartialStep(robots).run(0))


@pytest.mark.long
def test_every_stage_does_something() -> None:
    robots = ClosedLoop(rates.BIPED, "hebbian", 16, seed=0)
    robots.stretch(120)()
    step = PartialStep(robots)
    whole = sum(STAGES.values())
    states = [step.run(whole - stage).clone() for stage in {0, *STAGES.values()}]
    states.append(step.run(whole, noise=False).clone())
    different = {state.numpy().tobytes() for state in states}
    assert len(different) == len(states)


# --- measurements -------------------------------------------------------------------------------


def test_baselines_are_those_of_the_same_task() -> None:
    found = benchmark.measurements()
    rows = [row for measure in found.values() for row in measure(TINY)]
    baselines = {row.what: row.baseline for row in rows if row.baseline is not None}
    assert baselines == {
        "open loop, biped-4x3, 16 worlds": 4859,
        "open loop, worm-7x1, 16 worlds": 6865,
        "closed loop, biped-4x3, high, hebbian 29-29-10, 16 worlds": 4073,
        "closed loop, worm-7x1, high, hebbian 31-31-7, 16 worlds": 5969,
        "closed loop, biped-4x3, high, mlp 29-29-10, 16 worlds": 4653,
        "closed loop, worm-7x1, high, mlp 31-31-7, 16 worlds": 6732,
    }
    targets = [row.what for row in rows if row.target and row.baseline is None]
    assert targets == [
        "the same, as a share of the open loop",
        "spread of the cost from 40 to 40 worlds",
        "spread of the cost from 4 to 100 voxels",
        "memory of a world, biped-4x3, high, hebbian",
    ]


def test_own_module_is_held_against_the_open_loop(slow_cpu: None) -> None:
    rate, share = rates.own_module(TINY)
    assert rate.samples == (16 * 2 / 0.5,) * 2
    assert share.samples == (100.0, 100.0)


def test_profile_names_every_part() -> None:
    stages = [*profile.step_stages(TINY), *overhead.generation_stages(TINY)]
    names = [stage.name for stage in stages]
    assert names == [*STAGES, "network and rest", *overhead.PARTS]


def test_a_generation_besides_its_lives() -> None:
    (row,) = overhead.besides_episodes(TINY)
    assert len(row.samples) == 2
    assert row.best > 0


@pytest.mark.long
def test_evolution_in_a_process_of_its_own() -> None:
    wall, share, paper = evolution.evolve(TINY)
    assert len(wall.samples) == TINY.generations - 1
    robot_steps = 16 * 31  # 0.5 s are 31 steps
    minutes = [robot_steps / rate * (3601 / 31) * 2500 / 2 / 60 for rate in wall.samples]
    assert paper.samples == pytest.approx(minutes)
    assert all(sample > 0 for sample in share.samples)


def test_cold_starts_find_empty_caches_and_warm_ones_a_full_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    caches: list[Path] = []

    def start(cache: Path) -> Start:
        caches.append(cache)
        return Start(1.0, 1.5 + len(caches), 2.0 + 2 * len(caches))

    monkeypatch.setattr(startup, "start_process", start)
    rows = {row.what: row.samples for row in startup.starts(TINY)}
    assert len(set(caches)) == TINY.cold_starts == 2
    assert caches[2:] == [caches[0]] * 3
    assert rows["cold start: first step, with imports"] == (2.5, 3.5)
    assert rows["warm start: closed loop, in addition"] == (3.5, 4.5, 5.5)
    assert rows["warm start: of which imports"] == (1.0,) * 3


def test_a_process_tells_its_times() -> None:
    filled = Path.home() / ".cache" / "taichi" / "ticache"  # Taichi's own, where it is quickest
    start = start_process(filled)
    assert 0 < start.imported < start.stepped < start.closed


@pytest.mark.parametrize("driver", ["mlp", "own module"])
def test_a_gpu_is_measured_where_there_is_one(
    driver: gpu.Driver, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert gpu.gpu(TINY) == []
    measured = gpu.wall_rates(driver, TINY.worlds, TINY, "cpu")  # as on a GPU, but for the device
    assert len(measured) == TINY.repetitions
    assert min(measured) > 0
