"""The network that controls a robot: readings in, actuation out."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import torch

import hebbtorch
from experiments.config import EvolveConfig
from physics import Apparatus, Morphology

__all__ = ["Controller", "build", "initial_state"]

Controller = hebbtorch.HebbianMLP | hebbtorch.StaticMLP


def build(
    config: EvolveConfig,
    population: int,
    morphology: Morphology | None = None,
    apparatus: Apparatus | None = None,
) -> Controller:
    """The networks of a population, without genomes yet.

    There is one hidden layer, as large as the input (paper, Sec. III-A).

    Args:
        config: The options of the evolution.
        population: Number of individuals.
        morphology: The body; by default that of the options.
        apparatus: Its sensors; by default those of the options.
    """
    morphology = morphology or Morphology.from_name(config.shape)
    apparatus = apparatus or Apparatus.of(config.sensors, morphology)
    inputs = apparatus.n_readings
    sizes = [inputs, inputs, morphology.n_voxels]
    with torch.device(config.device):  # whatever the process has for defaults, here and below
        network = _network(config, sizes, apparatus.kinds, population)
    return network.float()


def _network(
    config: EvolveConfig, sizes: list[int], kinds: Sequence[Hashable], population: int
) -> Controller:
    if config.controller == "hebbian":
        return _plastic(config, sizes, kinds, population)
    static: type[hebbtorch.StaticMLP] = hebbtorch.StaticMLP
    if config.controller == "rnn":
        static = hebbtorch.StaticRNN
        sizes = _recurrent_sizes(sizes, config.bias)
    return static(
        sizes,
        gain=config.gain,
        bias=config.bias,
        input_activation=config.input_activation,
        population=(population,),
    )


def _plastic(
    config: EvolveConfig, sizes: list[int], kinds: Sequence[Hashable], population: int
) -> hebbtorch.HebbianMLP:
    return hebbtorch.HebbianMLP(
        sizes,
        groups=kinds if config.sharing == "grouped" else None,
        population=(population,),
        **config.plastic_options(),
    )


def _recurrent_sizes(sizes: list[int], bias: bool) -> list[int]:
    """Neurons of a recurrent network with no more genes than the plastic one with full sharing."""
    n_in, hidden, n_out = sizes
    n_genes = 4 * (n_in * hidden + hidden * n_out)  # A, B, C and D of every synapse
    hidden = hebbtorch.StaticRNN.largest_hidden(n_in, n_out, n_genes, bias=bias)
    return [n_in, hidden, n_out]


def initial_state(networks: Controller, init: str, seeds: Sequence[int]) -> hebbtorch.State:
    """The state of networks at the beginning of an episode.

    Args:
        networks: A population of N.
        init: How the weights begin, as in EvolveConfig; static networks have the weights of their
            genomes.
        seeds: One for each individual; it alone decides the weights drawn, not the population.
    """
    if init == "zeros" or isinstance(networks, hebbtorch.StaticMLP):
        return networks.initial_state()
    generators = [torch.Generator("cpu").manual_seed(seed) for seed in seeds]
    return networks.initial_state(init, generator=generators)
