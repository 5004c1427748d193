"""Recordings of any robot, ground and controller are replayed: of such as our simulator made."""

import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from experiments.validate import gaits, motion, random_genomes, steps
from experiments.validate.case import Case, Setting
from experiments.validate.recordings import Recordings
from physics import Apparatus, Engine, Morphology, Simulator, Terrain
from physics.scene import clock
from tests.experiments.validate.validations import rows_of, write

SHAPE, PROFILE = "T-5x2", {"xs": [0, 10, 500, 900], "ys": [50, 5, 30, 5]}


def recorded_gaits(folder: Path, speeds: np.ndarray | None = None) -> np.ndarray:
    """Writes three gaits of half a second on two terrains, as our simulator walks them, or with
    the speeds given; returns the speeds (terrains, gaits)."""
    voxels = Simulator(SHAPE, None).n_voxels
    numbers = np.arange(3)
    amplitude = 0.5 + 0.1 * np.add.outer(numbers, np.arange(voxels)) % 0.5
    phase = np.add.outer(numbers, 2.0 * np.arange(voxels))
    frequency = 1.0 + 0.2 * numbers
    names = {"hilly": [f"hilly-3-30-{i}" for i in numbers], "bump": ["bump"] * 3}
    if speeds is None:
        times = clock.times(clock.steps_in(0.5))[:-1]
        angle = 2 * np.pi * frequency[:, None] * times[:, None, None] + phase
        rows = []
        for terrains_met in names.values():
            profile = Terrain.from_profile(PROFILE["xs"], PROFILE["ys"])
            ground = [profile if n == "bump" else Terrain.from_name(n) for n in terrains_met]
            sim = Simulator(SHAPE, ground, 3, dtype=torch.float64)
            rows.append(motion.speeds(sim, torch.from_numpy(amplitude * np.sin(angle))))
        speeds = np.array(rows)
    params = {"i": numbers, "f": frequency}
    params |= {f"amp{v}": amplitude[:, v] for v in range(voxels)}
    params |= {f"phase{v}": phase[:, v] for v in range(voxels)}
    write(folder / f"random_gaits_params_{SHAPE}.csv", params)
    (folder / f"random_gaits_params_{SHAPE}.json").write_text('{"duration": 0.5}')
    (folder / "terrains.json").write_text(json.dumps({"bump": PROFILE}))
    columns = {
        f"vel_{terrain}_{mode}": speeds[index]
        for index, terrain in enumerate(names)
        for mode in gaits.MODES
    }
    write(folder / f"random_gaits_clean_{SHAPE}.csv", {"i": numbers} | columns)
    return speeds


def test_gaits_of_any_shape_ground_and_duration(tmp_path: Path) -> None:
    recorded_gaits(tmp_path)
    f64 = [case for case in gaits.cases(Recordings(tmp_path)) if "f64" in getattr(case, "name", "")]
    rows = rows_of(f64)
    assert {row.case for row in rows} == {f"gaits {SHAPE} hilly f64", f"gaits {SHAPE} bump f64"}
    for row in rows:  # we are the reference, so it agrees with itself: the stricter rule
        assert row.measure.startswith("one start, noccd: ")
        assert row.ours == pytest.approx(row.reference, abs=1e-15)


def test_a_shape_that_does_not_agree_with_itself_gets_the_rule_for_chaos(tmp_path: Path) -> None:
    speeds = recorded_gaits(tmp_path)
    path = tmp_path / f"random_gaits_clean_{SHAPE}.csv"
    table = {"i": np.arange(3)}
    for index, terrain in enumerate(("hilly", "bump")):
        table |= {f"vel_{terrain}_{mode}": speeds[index] for mode in gaits.MODES}
    table["vel_bump_veto_dx"] = -speeds[1]
    write(path, table)
    (case, _) = gaits.cases(Recordings(tmp_path))
    assert isinstance(case, Case)
    measures = {row.measure.split(":")[0] for row in case.replay(Setting()).rows}
    assert measures == {"mean of 4 starts", "one start, veto"}


def test_steps_of_any_shape_plain_or_compressed(tmp_path: Path) -> None:
    sim = Simulator("worm-4x1", None, gravity=0.0, dtype=torch.float64)
    actuations = np.sin(np.add.outer(0.1 * np.arange(21), np.arange(sim.n_voxels)))
    track = motion.follow(sim, actuations[:-1])
    columns: dict[str, np.ndarray] = {"t": np.concatenate([[0.0], clock.times(20)])}
    for v, voxel in enumerate(sim.morphology.voxel_names):
        columns |= {f"a{v}": actuations[:, v], f"area{v}": track.areas[:, v]}
        for c, square in enumerate(("NW", "NE", "SE", "SW")):
            for i, item in enumerate(("x", "y", "angle")):
                columns[f"{voxel}_{square}_{item}"] = track.poses[:, v, c, i]
            columns |= {f"{voxel}_{square}_{item}": np.zeros(21) for item in ("vx", "vy", "omega")}
    path = tmp_path / "my_voxel_step.csv"
    write(path, columns)
    plain = rows_of(list(steps.cases(Recordings(tmp_path))))
    (tmp_path / "my_voxel_step.csv.gz").write_bytes(gzip.compress(path.read_bytes()))
    path.unlink()
    assert rows_of(list(steps.cases(Recordings(tmp_path)))) == plain
    for row in plain:  # no squares of this body share a corner, where rounding would decide
        assert row.ours < (1e-15 if "f64" in row.case else 1e-5)


# --- closed loop --------------------------------------------------------------------------------


def plastic(genome: np.ndarray, sizes: tuple[int, int, int]) -> Callable[[np.ndarray], np.ndarray]:
    """The reference's plastic controller as its record describes it: the last input is a bias,
    B weighs the post- and C the pre-synaptic activation, genes run input by input."""
    n_in, hidden, out = sizes
    first, second = genome[: 4 * n_in * hidden], genome[4 * n_in * hidden :]
    rules = [first.reshape(n_in, hidden, 4), second.reshape(hidden, out, 4)]
    weights = [np.zeros((n_in, hidden)), np.zeros((hidden, out))]

    def act(readings: np.ndarray) -> np.ndarray:
        layers = [np.append(readings[:-1], 1.0)]
        for weight in weights:
            layers.append(np.tanh(layers[-1] @ weight))
        for layer, rule in enumerate(rules):
            pre, post = layers[layer][:, None], layers[layer + 1][None]
            a, b, c, d = np.moveaxis(rule, -1, 0)
            weights[layer] += 0.01 * (a * post * pre + b * post + c * pre + d)
        return layers[-1]

    return act


def static(genome: np.ndarray, sizes: tuple[int, int, int]) -> Callable[[np.ndarray], np.ndarray]:
    """The reference's static controller: biases come first, tanh acts on the inputs too."""
    n_in, hidden, out = sizes
    cut = hidden * (n_in + 1)
    weights = [genome[:cut].reshape(hidden, n_in + 1), genome[cut:].reshape(out, hidden + 1)]

    def act(readings: np.ndarray) -> np.ndarray:
        values = np.tanh(readings)
        for weight in weights:
            values = np.tanh(weight[:, 0] + weight[:, 1:] @ values)
        return values

    return act


@pytest.mark.parametrize(
    ("kind", "network", "genes"), [("hlp", plastic, 4524), ("mlp", static, 1170)]
)
def test_the_first_generation_is_replayed(
    tmp_path: Path, kind: str, network: Callable[..., Any], genes: int
) -> None:
    """The record is two episodes of 0.6 s (longer ones are chaotic) under the controllers above."""
    name, terrains_met = f"gen0_biped-4x3_high_{kind}", ["hilly-3-30-1", "flat"]
    genomes = np.random.default_rng(5).uniform(-1, 1, (2, genes))
    speeds = []
    for genome, ground in zip(genomes, terrains_met, strict=True):
        apparatus = Apparatus.named("high", Morphology.from_name("biped-4x3"), (-30, 0, 30))
        sim = Simulator(
            "biped-4x3",
            Terrain.from_name(ground),
            sensors=apparatus,
            dtype=torch.float64,
            engine=Engine(self_collision=True, continuous=True),  # as the real ones were recorded
        )
        act = network(genome, (29, 29, 10))
        readings = sim.step(torch.zeros(1, 10))
        start = sim.center_of_mass()[0, 0].item()
        for _ in range(clock.steps_in(0.6) - 1):
            assert readings is not None
            readings = sim.step(torch.from_numpy(act(readings[0].numpy()))[None])
        path = sim.center_of_mass()[0, 0].item() - start
        speeds.append(path / (sim.time - clock.times(1)[0]))
    write(tmp_path / f"{name}.csv", {"terrain": terrains_met, "velocity": np.array(speeds)})
    (tmp_path / f"{name}_genomes.f64").write_bytes(genomes.astype("<f8").tobytes())
    (tmp_path / f"{name}.json").write_text('{"duration": 0.6}')
    likeness, mean = rows_of(random_genomes.cases(Recordings(tmp_path)))
    assert mean.reference == pytest.approx(np.mean(speeds))
    assert mean.ours == pytest.approx(mean.reference, abs=1e-6)
    assert likeness.ours > 0.1
    assert abs(mean.reference) > 1e-3
