"""How cost grows with the batch and with the robot, and how much memory a world takes."""

from __future__ import annotations

from collections.abc import Mapping

from experiments.bench.measurement import Measurement, Target
from experiments.bench.rates import BIPED
from experiments.bench.setting import Setting
from experiments.bench.timing import cpu_seconds
from experiments.bench.workload import GAITS, ClosedLoop, OpenLoop, warm_up

__all__ = ["memory", "over_voxels", "over_worlds", "spread"]

_BATCHES = (1, 3, 10, 30, 100)  # times GAITS
_BOXES = (2, 3, 5, 7, 10)  # voxels along a side
_GROUP = 16  # worlds; a smaller batch would waste lanes, whatever the robot
_OVER_WORLDS, _OVER_VOXELS = Target(15.0), Target(25.0)
_MEMORY = Target(100.0, 64.0)


def over_worlds(setting: Setting) -> list[Measurement]:
    """Cost of a robot-step in batches of 40 to 4,000 worlds, open loop."""
    sizes = [k * GAITS for k in _BATCHES if k * GAITS <= setting.most_worlds]
    batches = {
        n: [OpenLoop(BIPED, n, setting.seed) for _ in range(max(1, setting.worlds // n))]
        for n in sizes
    }
    costs = _costs(batches, {n: n for n in sizes}, setting)
    rows = [
        Measurement(
            f"cost of a robot-step, {n} worlds", "us", tuple(costs[n]), more_is_better=False
        )
        for n in sizes
    ]
    what = f"spread of the cost from {sizes[0]} to {sizes[-1]} worlds"
    return [*rows, Measurement(what, "%", (spread(costs),), False, target=_OVER_WORLDS)]


def over_voxels(setting: Setting) -> list[Measurement]:
    """Cost of a voxel in boxes of 4 to 100, as many voxels in every batch, open loop."""
    voxels = setting.worlds * 10  # a biped has 10
    boxes = {
        side**2: OpenLoop(
            f"box-{side}x{side}", max(1, voxels // side**2 // _GROUP) * _GROUP, setting.seed
        )
        for side in _BOXES
    }
    batches = {n: [box] for n, box in boxes.items()}
    costs = _costs(batches, {n: n * box.sim.n_worlds for n, box in boxes.items()}, setting)
    rows = [
        Measurement(
            f"cost of a voxel-step, {boxes[n].sim.morphology.name}",
            "us",
            tuple(costs[n]),
            more_is_better=False,
        )
        for n in boxes
    ]
    what = f"spread of the cost from {min(boxes)} to {max(boxes)} voxels"
    return [*rows, Measurement(what, "%", (spread(costs),), False, target=_OVER_VOXELS)]


def memory(setting: Setting) -> list[Measurement]:
    """Bytes of all tensors that grow with the batch, over its worlds."""
    robots = ClosedLoop(BIPED, "hebbian", setting.worlds, setting.seed)
    state, lists, ground, _, _ = robots.sim.kernel_tensors(robots.sim.program)
    tensors = (state, lists, ground, robots.loop.items)
    total = sum(tensor.numel() * tensor.element_size() for tensor in tensors)
    what = f"memory of a world, {BIPED}, high, hebbian"
    return [Measurement(what, "kB", (total / setting.worlds / 1e3,), False, target=_MEMORY)]


def spread(costs: Mapping[int, list[float]]) -> float:
    """By how much the highest of some costs exceeds the lowest [%].

    Each is taken at its least disturbed: differences between medians would be those between
    disturbances, too.
    """
    least = [min(samples) for samples in costs.values()]
    return 100 * (max(least) / min(least) - 1)


def _costs(
    batches: Mapping[int, list[OpenLoop]], units: Mapping[int, int], setting: Setting
) -> dict[int, list[float]]:
    """CPU time of a step per unit of work [us].

    Batches are timed in turns, so that a disturbance by another job meets all, over the same
    seconds of their episodes: how much there is to do changes as robots walk on. Of small batches
    there are several. Units are those of one batch of each size.
    """
    warm_up([robots for batch in batches.values() for robots in batch], setting)
    costs: dict[int, list[float]] = {size: [] for size in batches}
    for _ in range(setting.repetitions):
        for size, batch in batches.items():
            seconds = sum(cpu_seconds(robots.stretch(setting.steps)) for robots in batch)
            costs[size].append(1e6 * seconds / (len(batch) * units[size] * setting.steps))
    return costs
