"""Each example with a fixed seed and a small budget reaches at least half of its improvement."""

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
import torch

EXAMPLES = Path(__file__).parents[2] / "examples"
pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore::UserWarning", "ignore::DeprecationWarning"),
]


@pytest.fixture
def example(
    monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> Iterator[ModuleType]:
    """The example that the test is called after."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    name = request.node.name.removeprefix("test_").split("[")[0]
    yield importlib.import_module(name)
    sys.modules.pop(name, None)
    torch.set_num_threads(threads)


def half(first: float, full: float) -> float:
    return (first + full) / 2


def test_cartpole_es(example: ModuleType) -> None:
    pytest.importorskip("gymnasium")
    first, last = example.main(generations=15)
    assert first < 100
    assert last >= half(49, 500)


@pytest.mark.parametrize("task", ["completion", "association"])
def test_memory_by_gradient(example: ModuleType, task: str) -> None:
    first, last = example.main(task, steps=200)
    assert first > 0.4
    assert last <= half(0.51, 0.02)


def test_own_rule_pca(example: ModuleType) -> None:
    first, last = example.main(steps=3000)
    assert last >= half(first, 1.0)


def test_reward_in_a_life(example: ModuleType) -> None:
    _, before, after = example.main(trials=2000)
    assert before >= half(0.5, 0.97)
    assert after >= half(0.5, 0.9)


def test_damaged_policy(example: ModuleType) -> None:
    trained, without, plastic = example.main(generations=10)
    assert trained > 450
    assert without < 200
    assert plastic >= half(124, 427)


def test_neuron_centric_worm(example: ModuleType) -> None:
    found = example.main(generations=40, duration=15.0)
    (few, first, last), (many, first_full, last_full) = found["neuron"], found["full"]
    assert (few, many) == (55, 150)
    assert last >= half(first, 2.5)
    assert last_full >= half(first_full, 5.6)


@pytest.mark.parametrize(("library", "full"), [("pycma", 2.2), ("evotorch", 2.3), ("pyribs", 1.4)])
def test_other_optimizers(library: str, full: float, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("cma", "evotorch", "ribs"):
        pytest.importorskip(name)
    monkeypatch.syspath_prepend(str(EXAMPLES))
    example = importlib.import_module("other_optimizers")
    only = {"with_pycma", "with_evotorch", "with_pyribs"} - {f"with_{library}"}
    for name in only:
        monkeypatch.setattr(example, name, lambda *args: [0.0])
    course = next(c for c in example.main(generations=25, duration=6.0).values() if len(c) > 1)
    assert max(course[-5:]) >= half(course[0], full)
