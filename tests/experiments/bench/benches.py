"""A tiny bench, and rows of a table, for the tests of the bench."""

from experiments.bench.machine import Machine
from experiments.bench.measurement import Measurement, Target
from experiments.bench.setting import Setting
from experiments.bench.workload import GAITS

TINY = Setting(
    cores=1,
    worlds=16,
    steps=2,
    warm_up=2,
    repetitions=2,
    most_worlds=GAITS,
    runs=2,
    population=8,
    generations=3,
    duration=0.5,
    cold_starts=2,
    warm_starts=3,
    pairs=2,
)
MACHINE = Machine("Abacus", 2, "3.11.7", "2.13.0", "1.7.4", "2026-01-02T03:04:05+00:00", "bench")
ROWS = [
    Measurement("speed", "steps/s", (10.0, 1.0, 3.0, 2.0), baseline=0.5, target=Target(2.0, 3.0)),
    Measurement("cost", "us", (4.0,), more_is_better=False, target=Target(3.0), others=0.25),
]
