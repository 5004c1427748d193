"""The plastic layers through PyTorch: what one step of one network costs."""

from __future__ import annotations

from collections.abc import Callable

import torch

import hebbtorch
from experiments.bench.measurement import Measurement
from experiments.bench.setting import Setting
from experiments.bench.timing import cpu_seconds_each

__all__ = ["networks"]

_SIZES = (29, 29, 10)  # those of a biped with the high apparatus
_POPULATIONS = (40, 400)
_STEPS = 50


def networks(setting: Setting) -> list[Measurement]:
    """Forward pass and update, full sharing, in populations of 40 and 400."""
    return [
        Measurement(
            f"plastic network in torch, {'-'.join(map(str, _SIZES))}, {population} individuals",
            "us/step/individual",
            tuple(1e6 * s / (_STEPS * population) for s in _seconds(population, setting)),
            more_is_better=False,
        )
        for population in _POPULATIONS
    ]


def _seconds(population: int, setting: Setting) -> list[float]:
    draws = torch.Generator().manual_seed(setting.seed)
    network = hebbtorch.HebbianMLP(_SIZES, population=(population,))
    network.set_genomes(2 * torch.rand(population, network.n_genes, generator=draws) - 1)
    state = network.initial_state("uniform", generator=draws)
    inputs = torch.rand(_STEPS, population, _SIZES[0], generator=draws)

    @torch.no_grad()
    def live() -> None:
        now = state
        for x in inputs:
            _, now = network(x, now)

    live()  # once for the caches

    def prepare() -> Callable[[], None]:
        return live

    return cpu_seconds_each(prepare, setting.repetitions)
