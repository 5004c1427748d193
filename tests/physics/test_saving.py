"""Worlds that are saved and gone on from, and policies that drive them."""

from __future__ import annotations

import io
from typing import Any

import pytest
import torch

from physics import Simulator, Terrain
from tests.physics.test_batch import actuations, batch, state
from tests.physics.test_reset import CHOSEN, ROUGH, SOME, WORLDS

FLAT = Terrain.from_name("flat")


@pytest.mark.parametrize("wider", ["saved", "loading"])
def test_saved_worlds_go_on_exactly(wider: str) -> None:
    """In a simulator with another past and other terrains, whose windows are smaller or larger."""
    sim, other = batch(WORLDS), batch(WORLDS, seed=3)
    rough = sim if wider == "saved" else other
    rough.reset(SOME, terrains=ROUGH)
    first, rest = actuations(WORLDS).split(30)
    sim.run(first)
    sim.reset(torch.tensor([world == 5 for world in WORLDS]))
    other.run(rest)
    file = io.BytesIO()
    torch.save(sim.state_dict(), file)
    file.seek(0)
    other.load_state_dict(torch.load(file, weights_only=True))
    assert torch.equal(state(other), state(sim))
    assert [t.name for t in other.terrains] == [t.name for t in sim.terrains]
    for _ in range(2):
        assert torch.equal(other.run(rest), sim.run(rest))
        assert torch.equal(state(other), state(sim))
        assert torch.equal(other.reset(SOME), sim.reset(SOME))
    assert other.time == sim.time


def test_a_saved_state_is_a_copy() -> None:
    sim = batch(CHOSEN)
    saved = sim.state_dict()
    before = saved["items"].clone()
    sim.run(actuations(CHOSEN)[:5])
    torch.testing.assert_close(saved["items"], before, rtol=0, atol=0, equal_nan=True)


def small(**settings: Any) -> Simulator:
    return Simulator(**{"shape": "worm-2x1", "terrain": FLAT, "n_worlds": 2, **settings})


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"shape": "box-1x1"}, r"state_dict: expected worlds with body \[\[1\]\]"),
        ({"sensors": "low"}, "state_dict: expected worlds with sensors"),
        ({"n_worlds": 3}, "state_dict: expected worlds with n_worlds 3, got 2"),
        ({"terrain": None}, "state_dict: expected worlds with ground False"),
        ({"lanes": 16}, "state_dict: expected worlds with lanes 16"),
    ],
)
def test_other_worlds_are_refused(settings: dict[str, Any], message: str) -> None:
    saved, sim = small().state_dict(), small(**settings)
    before = sim.mass_poses()
    with pytest.raises(ValueError, match=message):
        sim.load_state_dict(saved)
    assert torch.equal(sim.mass_poses(), before)


def test_what_is_no_state_is_refused() -> None:
    with pytest.raises(ValueError, match="expected what Simulator.state_dict"):
        small().load_state_dict({})
    with pytest.raises(ValueError, match="it is of a newer version"):
        small().load_state_dict(small().state_dict() | {"format": 99})


@pytest.mark.parametrize("every", [1, 3])
def test_a_policy_is_called_at_its_interval(every: int) -> None:
    calls = []

    def policy(readings: torch.Tensor) -> torch.Tensor:
        calls.append(readings)
        return torch.sin(len(calls) + readings)

    sim, stepped = small(sensors="low"), small(sensors="low")
    way = sim.rollout(policy, 7, every=every)
    assert way.shape == (7, 2, 2)
    readings, count = stepped.readings(), 0
    for step in range(7):
        if step % every == 0:
            assert torch.equal(readings, calls[count])
            count += 1
            actuation = torch.sin(count + readings)
        readings = stepped.step(actuation)
        assert torch.equal(way[step], stepped.center_of_mass())
    assert len(calls) == count


def test_a_policy_needs_sensors() -> None:
    with pytest.raises(ValueError, match="sensors: expected some for a policy, got none"):
        small().rollout(lambda readings: readings, 1)
