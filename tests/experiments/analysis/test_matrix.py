"""The validation matrix is the re-assessment under each of its conditions."""

import csv
from dataclasses import replace

import pytest
import torch

from experiments.analysis.unseen import reassess
from experiments.analysis.validation_matrix import DAMAGES, TERRAINS, validate
from tests.experiments.champions import PLASTIC, STATIC, random_champions


@pytest.mark.parametrize("config", [PLASTIC, STATIC], ids=["plastic", "static"])
def test_every_cell_is_a_reassessment(config, tmp_path) -> None:
    champions = random_champions(config)
    matrix = validate(champions, seed=4)
    assert matrix.terrain_seeds == [0, 1, 2, 3, 4]
    assert matrix.speeds.shape == (2, len(TERRAINS), len(DAMAGES), 5)
    for terrain, damage in (("flat", "half"), ("steppy-1-10", "none"), ("hilly-3-30", "half")):
        condition = replace(config, terrain=terrain, damage=damage)
        expected = reassess(condition, champions.genomes, range(5), seed=4)
        ours = matrix.speeds[:, TERRAINS.index(terrain), DAMAGES.index(damage)]
        assert torch.equal(ours, expected)
    whole = matrix.speeds[0, :, DAMAGES.index("none")].tolist()
    assert len({tuple(speeds) for speeds in whole}) == len(TERRAINS)  # no two are alike

    rows = list(csv.DictReader(matrix.write(tmp_path / "matrix.csv").read_text().splitlines()))
    assert list(rows[0]) == ["run", "terrain", "damage", "seed", "speed"]
    assert len(rows) == matrix.speeds.numel()
    for row in rows:
        at = (
            int(row["run"]),
            TERRAINS.index(row["terrain"]),
            DAMAGES.index(row["damage"]),
            int(row["seed"]),
        )
        assert float(row["speed"]) == matrix.speeds[at].item()
