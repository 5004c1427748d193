"""How batches are cut for the lanes and the threads of a CPU."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
import torch

from physics import Simulator
from physics.backend import Program
from physics.engine.memory.grouping import Grouping, block_for, lanes_for
from tests.physics.worlds import gaits

SINGLE, DOUBLE = torch.float32, torch.float64


def cut(n_worlds: int, lanes: int, threads: int, dtype: torch.dtype = SINGLE) -> list:
    """Of each part: lanes, first group, number of groups, chunks."""
    parts = Grouping.of(Program(dtype, lanes, lanes), n_worlds, threads).parts
    return [(part.program.lanes, part.first, part.count, part.chunks) for part in parts]


@pytest.mark.parametrize(
    ("n_worlds", "threads", "lanes"),
    [
        (1, 1, 8),
        (8, 1, 8),
        (9, 1, 16),
        (16, 2, 8),  # two threads with a group of 8 each
        (17, 1, 16),
        (40, 1, 16),
        (40, 4, 16),  # one turn of 16, where 8 would take two
        (40, 5, 8),
        (400, 2, 16),
    ],
)
def test_lanes_take_the_least_time(n_worlds, threads, lanes):
    assert lanes_for(n_worlds, SINGLE, threads, "cpu") == lanes


@pytest.mark.parametrize(
    ("n_worlds", "block"),
    [(1, 32), (8_448, 32), (8_449, 64), (48_000, 192), (67_584, 256), (96_000, 384), (10**6, 512)],
)
def test_blocks_let_all_worlds_run_at_once(n_worlds, block, monkeypatch):
    card = SimpleNamespace(multi_processor_count=132)
    monkeypatch.setattr(torch.cuda, "get_device_properties", lambda _: card)
    assert block_for(n_worlds, "cuda") == block
    assert n_worlds <= 2 * 132 * block or block == 512


def test_lanes_of_other_programs():
    assert lanes_for(400, DOUBLE, 1, "cpu") == 8
    assert lanes_for(400, SINGLE, 1, "cuda") == 1


@pytest.mark.parametrize(
    ("n_worlds", "lanes", "threads", "parts"),
    [
        (400, 16, 2, [(16, 0, 25, 2)]),
        (40, 16, 1, [(16, 0, 2, 1), (8, 2, 1, 1)]),
        (40, 16, 2, [(16, 0, 2, 2), (8, 2, 1, 1)]),
        (41, 16, 1, [(16, 0, 3, 1)]),  # more than half a group
        (56, 16, 2, [(16, 0, 4, 2)]),  # the half group runs beside the third one
        (40, 16, 3, [(16, 0, 3, 3)]),
        (8, 16, 1, [(16, 0, 1, 1)]),
        (40, 8, 1, [(8, 0, 5, 1)]),
        (3, 8, 16, [(8, 0, 1, 1)]),
    ],
)
def test_half_a_group_goes_to_a_narrow_program_if_nothing_runs_beside_it(
    n_worlds, lanes, threads, parts
):
    assert cut(n_worlds, lanes, threads) == parts


def test_a_narrow_program_is_compiled_for_long_runs_only():
    batch = Grouping.of(Program(SINGLE, 16, 16), 40, 1)
    assert batch.parts_for(59) == (batch.whole,)
    assert batch.parts_for(60) == batch.parts
    assert (batch.whole.first, batch.whole.count) == (0, 3)


def test_no_narrow_program_in_double_precision():
    assert cut(40, 16, 1, DOUBLE) == [(16, 0, 3, 1)]


def test_every_world_belongs_to_one_part():
    for n_worlds in range(1, 100):
        for threads in range(1, 6):
            lanes = lanes_for(n_worlds, SINGLE, threads, "cpu")
            worlds = [
                group * lanes + lane
                for width, first, count, _ in cut(n_worlds, lanes, threads)
                for group in range(first, first + count)
                for lane in range(width)
            ]
            assert len(set(worlds)) == len(worlds)
            assert set(range(n_worlds)) <= set(worlds)


def test_a_narrow_program_works_in_long_runs_and_single_steps_go_on_from_there():
    actions = gaits(130, 24, 7).float()
    results = []
    for lanes in (8, 16):
        sim = Simulator("worm-7x1", None, 24, sensors="high", noise=0.1, threads=1, lanes=lanes)
        sim.run(actions[:3])
        sim.run(actions[3:100])
        for action in actions[100:]:
            readings = sim.step(action)
        results.append((sim.mass_poses(), sim.mass_velocities(), readings))
    assert all(torch.equal(*pair) for pair in zip(*results, strict=True))
    assert results[0][0].std(0).max() > 0
