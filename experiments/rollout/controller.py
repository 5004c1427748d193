"""The brain of a robot: readings in, actuation out, one hidden layer as large as the input."""

from __future__ import annotations

from collections.abc import Sequence

import torch

import hebbtorch
from experiments.config import EvolveConfig
from physics import Apparatus, Morphology

__all__ = ["Controller", "birth", "build"]

Controller = hebbtorch.HebbianMLP | hebbtorch.StaticMLP


def build(config: EvolveConfig, population: int) -> Controller:
    """The networks of a population, without genomes yet.

    Args:
        config: the options of the evolution.
        population: number of individuals.
    """
    morphology = Morphology.from_name(config.shape)
    apparatus = Apparatus.of(config.sensors, morphology)
    inputs = apparatus.n_readings
    sizes = [inputs, inputs, morphology.n_voxels]  # paper, Sec. III-A
    network: Controller
    with torch.device(config.device):  # whatever the process has for defaults
        if config.controller == "mlp":
            network = hebbtorch.StaticMLP(sizes, population=(population,))
        else:
            network = hebbtorch.HebbianMLP(
                sizes,
                sharing=config.sharing,
                groups=apparatus.kinds if config.sharing == "grouped" else None,
                eta=config.eta,
                normalize=None if config.normalize == "none" else config.normalize,
                terms=config.terms,
                population=(population,),
            )
    return network.float()


def birth(networks: Controller, init: str, seeds: Sequence[int]) -> hebbtorch.State:
    """The state of networks at the beginning of a life.

    Args:
        networks: a population of N.
        init: "zero" or "uniform", as in EvolveConfig; static networks have the weights of their
            genomes.
        seeds: one for each individual; it alone decides the weights drawn, not the population.
    """
    if init == "zero" or isinstance(networks, hebbtorch.StaticMLP):
        return networks.initial_state()
    generators = [torch.Generator("cpu").manual_seed(seed) for seed in seeds]
    return networks.initial_state("uniform", generator=generators)
