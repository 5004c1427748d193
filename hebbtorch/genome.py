"""Genomes: flat vectors of genes, and the parameters they stand for."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from numbers import Integral
from typing import NamedTuple

import torch
from torch import Tensor, nn


class GeneBlock(NamedTuple):
    """A run of consecutive genes that make up one parameter of one layer.

    Attributes:
        layer: index of the layer (0 leaves the inputs).
        name: "A", "B", "C", "D", "eta", "bias", or "weight" for a static network.
        genes: where they stand in the genome.
        shape: that they fill, row-major; of a plastic layer's rules (rows, columns): rows are
            post-synaptic neurons, columns pre-synaptic ones, either of them 1 (or the number of
            groups) where shared.
    """

    layer: int
    name: str
    genes: slice
    shape: tuple[int, ...]


def check_population(population: Iterable[int]) -> tuple[int, ...]:
    """The population's dimensions as a tuple.

    Raises:
        ValueError: not a sequence of positive integers.
    """
    dims = _integers(population, 1)
    if dims is None:
        raise ValueError(
            f"population: expected a tuple of positive sizes such as () or (40,), "
            f"got {population!r}"
        )
    return dims


def check_batch(batch: Iterable[int]) -> tuple[int, ...]:
    """The dimensions of a batch of lifetimes as a tuple.

    Raises:
        ValueError: not a sequence of sizes.
    """
    dims = _integers(batch, 0)
    if dims is None:
        raise ValueError(f"batch: expected a tuple of sizes such as () or (64,), got {batch!r}")
    return dims


def check_sizes(sizes: Iterable[int]) -> tuple[int, ...]:
    """The number of neurons in each layer of a network as a tuple.

    Raises:
        ValueError: not a sequence of at least two positive integers.
    """
    layers = _integers(sizes, 1)
    if layers is None or len(layers) < 2:
        raise ValueError(
            f"sizes: expected the neurons of two or more layers such as [29, 29, 10], got {sizes!r}"
        )
    return layers


def recurrent_sizes(sizes: tuple[int, ...]) -> list[tuple[int, int]]:
    """(in, out) of the two layers of synapses of an Elman network [in, hidden, out], whose hidden
    neurons see themselves too.

    Raises:
        ValueError: another number of layers.
    """
    if len(sizes) != 3:
        raise ValueError(f"sizes: expected [in, hidden, out] for a recurrent network, got {sizes}")
    n_in, hidden, n_out = sizes
    return [(n_in + hidden, hidden), (hidden, n_out)]


def _integers(numbers: object, least: int) -> tuple[int, ...] | None:
    """The numbers as a tuple if they are a sequence of integers of at least that, else None."""
    if not isinstance(numbers, Iterable):
        return None
    items = tuple(numbers)
    if not all(isinstance(n, Integral) and not isinstance(n, bool) for n in items):
        return None
    sizes = tuple(int(n) for n in items)  # numpy's become Python's
    return sizes if all(n >= least for n in sizes) else None


class Evolvable(nn.Module, ABC):
    """A module whose parameters, of shape (*P, rows, columns), are one genome per individual.

    Gene order: layer by layer from the inputs on; within a layer block by block, for a Hebbian
    one A, B, C, D and, if evolved, eta; within a block row-major, rows (post-synaptic) first.
    Rules that several layers share appear once, in the first of them. `gene_blocks` states the
    order as data, so that a genome in any other order can be rearranged:

        for block in net.gene_blocks:
            genome[block.genes] = foreign[block.layer][block.name].reshape(-1)

    Attributes:
        population: P, the population dimensions; () for one individual.
    """

    population: tuple[int, ...]

    @abstractmethod
    def gene_parameters(self) -> list[tuple[int, str, nn.Parameter]]:
        """(layer, name, parameter) in the order of the genes."""

    @property
    def gene_blocks(self) -> tuple[GeneBlock, ...]:
        """What each gene stands for, in the order of the genome."""
        blocks = []
        start = 0
        for layer, name, parameter in self.gene_parameters():
            depth = len(self.population)
            if tuple(parameter.shape[:depth]) != self.population:
                raise ValueError(
                    f"gene_parameters: expected {name} of layer {layer} of shape "
                    f"(*{self.population}, ...), got {tuple(parameter.shape)}"
                )
            shape = tuple(parameter.shape[depth:])
            genes = slice(start, start + math.prod(shape))
            blocks.append(GeneBlock(layer, name, genes, shape))
            start = genes.stop
        return tuple(blocks)

    @property
    def n_genes(self) -> int:
        """G, the number of genes of one individual."""
        blocks = self.gene_blocks
        return blocks[-1].genes.stop if blocks else 0

    def genomes(self) -> Tensor:
        """The genomes (*P, G) that the parameters stand for: a copy, without gradients."""
        blocks = [p.detach().reshape(*self.population, -1) for _, _, p in self.gene_parameters()]
        return torch.cat(blocks, -1)

    def decode(self, genomes: Tensor) -> dict[str, Tensor]:
        """Genomes as the parameters they stand for, by name: gradients reach the genomes.

        >>> net = hebbtorch.HebbianMLP([3, 2])
        >>> genome = torch.zeros(net.n_genes, requires_grad=True)
        >>> call = torch.func.functional_call
        >>> _, state = call(net, net.decode(genome), (torch.ones(3),))
        >>> y, _ = call(net, net.decode(genome), (torch.ones(3), state))
        >>> y.sum().backward()
        >>> genome.grad.shape
        torch.Size([24])

        Args:
            genomes: (*lead, G), where `lead` are the population dimensions, or under
                `torch.func.vmap` what they are there; of any floating dtype.

        Returns:
            Full name -> (*lead, *shape), to be given to `torch.func.functional_call`.

        Raises:
            ValueError: another number of genes.
        """
        if genomes.shape[-1:] != (self.n_genes,):
            raise ValueError(
                f"genomes: expected {self.n_genes} genes in the last dimension, "
                f"got shape {tuple(genomes.shape)}"
            )
        name_of = {id(parameter): name for name, parameter in self.named_parameters()}
        lead = genomes.shape[:-1]
        return {
            name_of[id(parameter)]: genomes[..., block.genes]
            .reshape(*lead, *block.shape)
            .to(parameter.dtype)
            for block, (_, _, parameter) in zip(
                self.gene_blocks, self.gene_parameters(), strict=True
            )
        }

    @torch.no_grad()
    def set_genomes(self, genomes: Tensor) -> None:
        """Take the parameters from genomes.

        Args:
            genomes: (*P, G), finite, of any real floating dtype and on any device; converted to
                those of the network.

        Raises:
            ValueError: wrong type, shape or dtype, or a gene that is NaN or infinite.
        """
        expected = (*self.population, self.n_genes)
        if not isinstance(genomes, Tensor) or not genomes.is_floating_point():
            kind = genomes.dtype if isinstance(genomes, Tensor) else type(genomes).__name__
            raise ValueError(f"genomes: expected a tensor of a floating dtype, got {kind}")
        if tuple(genomes.shape) != expected:
            raise ValueError(
                f"genomes: expected shape {expected}, the population {self.population} and "
                f"{self.n_genes} genes, got {tuple(genomes.shape)}"
            )
        parameters = [parameter for _, _, parameter in self.gene_parameters()]
        converted = [
            genomes[..., block.genes].to(parameter.dtype).reshape(parameter.shape)
            for block, parameter in zip(self.gene_blocks, parameters, strict=True)
        ]
        dtype = min((genes.dtype for genes in converted), key=lambda d: torch.finfo(d).max)
        # A sum is finite only if all its terms are, and is had for a fifth of the time.
        suspects = [genes for genes in converted if not genes.sum().isfinite()]
        if bad := sum(int((~genes.isfinite()).sum()) for genes in suspects):
            raise ValueError(
                f"genomes: expected genes that are finite in {dtype}, got {bad} NaN or infinite"
            )
        for parameter, genes in zip(parameters, converted, strict=True):
            parameter.copy_(genes)
