"""Neuron-centric rules: the genes are the neurons', a synapse combines those of its two ends.

    dw_ij = (eta_i + eta_j) / 2 * [a_i x_i + b_j y_j + c_i c_j x_i y_j + d_i d_j]

for the synapse from neuron i to neuron j, eta_i = 0.01 * 10**gene_i (or fixed). In the letters of
this package, where A weighs x y, B weighs x and C weighs y: A = c_i c_j, B = a_i, C = b_j,
D = d_i d_j. The genes are named by these letters: "pre.B" of a layer is a_i, "post.C" is b_j.
Inputs need no b, outputs no a; a hidden neuron's genes serve the layers on both its sides.

>>> net = hebbtorch.HebbianMLP([8, 8, 10], sharing="neuron", eta="evolved")
>>> net.n_genes, hebbtorch.HebbianMLP([8, 8, 10], eta="evolved").n_genes
(112, 720)
>>> pre, post = net.layers[0].rules.pre, net.layers[0].rules.post
>>> bool((net.layers[0].coefficients().A == post.A.mT * pre.A).all())
True

Source: Ferigo, Cunegatti, Iacca, "Neuron-centric Hebbian learning", arXiv 2403.12076 (2024). (In
the authors' code layers read overlapping genes; this is the equation.)
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from hebbtorch.functional.rules import RULES
from hebbtorch.rule_bank import ETA, TERMS, Bank, check_eta, check_terms, rate_of
from hebbtorch.sampling import Generators, redraw
from hebbtorch.sharing import SHARINGS


class NeuronGenes(nn.Module):
    """The genes of n neurons, each (*P, 1, n): A, B, C, D (as far as needed) and eta_gene.

    Args:
        n: number of neurons.
        outgoing: whether synapses leave them: only then they have B.
        incoming: whether synapses reach them: only then they have C.
        terms: which of the rule's terms exist.
        eta: learning rate; "evolved" gives each neuron a gene.
        population: P, dimensions of the population.
        dtype: The data type of the genes.
        device: where they live.
    """

    A: Tensor
    B: Tensor
    C: Tensor
    D: Tensor
    eta_gene: Tensor

    def __init__(
        self,
        n: int,
        *,
        outgoing: bool,
        incoming: bool,
        terms: str = TERMS,
        eta: float | str = ETA,
        population: tuple[int, ...] = (),
        dtype: torch.dtype | None = None,
        device: torch.device | str | None = None,
    ) -> None:
        super().__init__()
        absent = {"B": not outgoing, "C": not incoming}
        self.names = [t for t in check_terms(terms) if not absent.get(t, False)]
        for name in [*self.names, *(["eta_gene"] if eta == "evolved" else [])]:
            values = torch.empty((*population, 1, n), dtype=dtype, device=device)
            self.register_parameter(name, nn.Parameter(values))
        self.reset_parameters()

    def reset_parameters(self, generator: Generators = None) -> None:
        """Draw every gene from U(-1, 1)."""
        redraw(self.parameters(), generator)

    def named_genes(self) -> list[tuple[str, nn.Parameter]]:
        """(name, parameter) in the order A, B, C, D, eta."""
        return [(name.removesuffix("_gene"), p) for name, p in self.named_parameters()]


class NeuronBank(Bank):
    """The rules of a layer of synapses, from the genes of its neurons.

    Args:
        pre: genes of the pre-synaptic neurons.
        post: genes of the post-synaptic neurons.
        terms: which of the rule's terms exist.
        eta: learning rate, or "evolved".
    """

    def __init__(
        self, pre: NeuronGenes, post: NeuronGenes, *, terms: str = TERMS, eta: float | str = ETA
    ) -> None:
        super().__init__()
        self.pre = pre
        self.post = post
        self.rule = RULES["abcd"]
        self.terms = check_terms(terms)
        self.eta = check_eta(eta)

    @property
    def like(self) -> Tensor:
        """See `Bank`."""
        return next(self.parameters())

    def named_genes(self) -> list[tuple[str, nn.Parameter]]:
        """See `Bank`; the pre-synaptic neurons' genes come first."""
        ends = (("pre", self.pre), ("post", self.post))
        return [(f"{end}.{name}", p) for end, genes in ends for name, p in genes.named_genes()]

    def values(self) -> list[Tensor]:
        """See `Bank`; zero for a term that does not exist."""
        pre, post = self.pre, self.post
        zero = self.like.new_zeros(1, 1)
        return [
            post.A.mT * pre.A if "A" in self.terms else zero,
            pre.B if "B" in self.terms else zero,
            post.C.mT if "C" in self.terms else zero,
            post.D.mT * pre.D if "D" in self.terms else zero,
        ]

    def learning_rate(self) -> float | Tensor:
        """See `Bank`; the mean of both neurons' rates."""
        if self.eta != "evolved":
            return float(self.eta)
        return (rate_of(self.pre.eta_gene) + rate_of(self.post.eta_gene.mT)) / 2


def check_neuron_rule(rule: object, exchange_bc: bool) -> None:
    """Check what a layer with sharing="neuron" cannot have.

    Raises:
        ValueError: another rule than "abcd", or B and C exchanged.
    """
    if rule not in ("abcd", RULES["abcd"]) or exchange_bc:
        raise ValueError(
            f"sharing: expected another one of {SHARINGS[:-1]} with rule={rule!r} and "
            f"exchange_bc={exchange_bc!r}; 'neuron' is for 'abcd' alone"
        )
