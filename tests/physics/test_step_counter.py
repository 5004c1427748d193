"""Worlds that count further than float32: lifetimes, damage, noise and sensors up to 2^31 steps.

No world takes so many steps here: their counters are set close to where something could break.
"""

from __future__ import annotations

from typing import Any

import pytest
import torch
from torch import Tensor

from physics import Damage, Simulator, Terrain
from physics.engine.memory.layout import STEPS_PER_HIGH
from physics.scene import clock

FLAT = Terrain.from_name("flat")
EDGES = [STEPS_PER_HIGH, 2**24, 37 * STEPS_PER_HIGH, 2**31 - 50]
ACTUATIONS = torch.linspace(-1, 1, 24 * 3 * 2).reshape(24, 3, 2)


def worms(**settings: Any) -> Simulator:
    return Simulator(
        **{"shape": "worm-2x1", "terrain": FLAT, "n_worlds": 3, "threads": 1} | settings
    )


def count_from(sim: Simulator, steps: int | list[int]) -> Simulator:
    """As if these worlds had taken so many steps."""
    sim._state.set_steps(torch.tensor(steps).expand(sim.n_worlds))
    sim.load_state_dict(sim.state_dict())
    return sim


def motion(sim: Simulator, name: str = "mass_poses") -> Tensor:
    """What is observed after each of 24 steps."""
    frames = []
    for actuation in ACTUATIONS[:, : sim.n_worlds]:
        sim.step(actuation)
        frames.append(getattr(sim, name)())
    return torch.stack(frames)


@pytest.mark.parametrize("edge", EDGES)
def test_worlds_move_past_an_edge_of_the_counter_as_from_the_start(edge: int) -> None:
    sim = count_from(worms(), edge - 7)
    assert torch.equal(motion(sim), motion(worms()))
    assert sim.time == clock.time_after(edge + 17)
    assert sim.times.tolist() == [sim.time] * 3
    assert sim.alive().all()


@pytest.mark.parametrize("edge", EDGES)
def test_averages_run_on_past_an_edge(edge: int) -> None:
    """Their rings go round at other steps, which changes the order of a sum."""
    early, late = (
        count_from(worms(sensors="high"), first)
        for first in (20_000, edge - 31)  # windows are as long there
    )
    motion(early), motion(late)  # which fills them
    near = motion(early, "readings")
    torch.testing.assert_close(motion(late, "readings"), near, rtol=0, atol=1e-6)
    assert near.std() > 0.1


def test_noise_does_not_repeat() -> None:
    noise = torch.cat(
        [
            motion(count_from(worms(sensors="low", noise=0.5), first), "readings")
            for first in (0, STEPS_PER_HIGH - 12, 2**24 - 12, 2**31 - 24)
        ]
    )[:, 0]
    differences = (noise[:, None] - noise).abs().amax(-1) + torch.eye(len(noise))
    assert differences.min() > 1e-3


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_damage_begins_and_ends_at_its_steps_beyond_the_edges(dtype: torch.dtype) -> None:
    begin, end = STEPS_PER_HIGH + 2, 2**24 + 5
    times = [clock.time_after(step) for step in (begin, end)]
    mask = torch.tensor([True, False])
    damage = Damage(time=times[0], until=times[1], mask=mask)
    for edge, broken in ((begin, slice(9, None)), (end, slice(None, 9))):
        sim = count_from(worms(damage=damage, dtype=dtype), edge - 10)
        found = motion(sim, "broken")
        expected = torch.zeros(24, dtype=torch.bool)
        expected[broken] = True
        assert torch.equal(found[:, 0, 0], expected)
        assert not found[..., 1].any()
        at_rest = count_from(worms(damage=damage, dtype=dtype), edge - 10)
        obeyed = motion(at_rest, "actuation")[:, :, 0] == ACTUATIONS[..., 0].to(dtype)
        # The actuation of a step is decided before it is counted.
        assert torch.equal(obeyed[1:, 0], ~expected[:-1])


def test_damage_without_end_holds() -> None:
    damage = Damage(time=0.0, mask=torch.tensor([True, False]))
    for edge in EDGES:
        found = motion(count_from(worms(damage=damage), edge - 7), "broken")
        assert found[..., 0].all()
        assert not found[..., 1].any()


@pytest.mark.parametrize("edge", [*EDGES[:3], 2**31])
def test_a_world_stands_still_when_its_lifetime_is_over(edge: int) -> None:
    sim = count_from(worms(lifetime=clock.time_after(edge)), edge - 11)
    sim.run(ACTUATIONS[:11])
    assert sim.alive().all()
    before = sim.mass_poses()
    if edge < 2**31:
        sim.run(ACTUATIONS[:2])
        assert not sim.alive().any()
        assert torch.equal(sim.mass_poses(), before)
    assert sim.times.tolist() == [clock.time_after(edge)] * 3


def test_a_world_is_the_same_alone_and_among_others_that_count_elsewhere() -> None:
    starts = [5, STEPS_PER_HIGH - 3, 2**24 - 9]
    together = count_from(worms(sensors="high", noise=0.1, seed=[1, 2, 3]), starts)
    readings = motion(together, "readings")
    for world, start in enumerate(starts):
        alone = worms(sensors="high", noise=0.1, seed=[world + 1], n_worlds=1)
        frames = []
        for actuation in ACTUATIONS[:, world : world + 1] if count_from(alone, start) else ():
            alone.step(actuation)
            frames.append(alone.readings()[0])
        assert torch.equal(torch.stack(frames), readings[:, world])


def test_no_world_is_asked_to_count_too_far() -> None:
    sim = count_from(worms(), 2**31 - 24)
    sim.run(ACTUATIONS)
    before = sim.mass_poses()
    with pytest.raises(ValueError, match="steps: expected at most 0 more, .* reset the worlds"):
        sim.step(ACTUATIONS[0])
    assert torch.equal(sim.mass_poses(), before)
    sim.reset()
    sim.step(ACTUATIONS[0])
    with pytest.raises(ValueError, match="lifetime: expected at most 35791393 s"):
        worms(lifetime=3.6e7)
