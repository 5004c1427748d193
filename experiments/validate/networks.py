"""The recorded controllers, rebuilt on hebbtorch's networks.

They differ from the paper's text, and so from the package; every difference is undone here:
- both: the genes' order;
- Hebbian: the last input is overwritten by 1, a bias; B weighs the post- and C the pre-synaptic
  activation;
- static: every neuron has a bias, and tanh acts on the inputs too.
"""

from __future__ import annotations

import torch
from torch import Tensor

import hebbtorch

__all__ = ["RecordedHebbian", "RecordedStatic", "build", "n_genes"]

ETA = 0.01  # of all recorded networks that do not say otherwise
_THEIR_COLUMN = {"A": 0, "B": 2, "C": 1, "D": 3}  # of our coefficient
_SATURATING = 40.0  # tanh of it is 1, exactly


class RecordedHebbian(hebbtorch.HebbianMLP):
    """N plastic networks with recorded genomes.

    Args:
        genomes: (N, genes); input by input, A B C D of each synapse or, with sharing
            "presynaptic", of each neuron.
        sizes: neurons per layer.
        sharing: "full" or "presynaptic".
        eta: The learning rate.
        dtype: The data type to compute in.
    """

    def __init__(
        self,
        genomes: Tensor,
        sizes: list[int],
        sharing: str = "full",
        eta: float = ETA,
        dtype: torch.dtype = torch.float64,
    ) -> None:
        super().__init__(sizes, sharing=sharing, eta=eta, population=(len(genomes),), dtype=dtype)
        theirs = genomes.unflatten(1, (-1, 4))
        ours = torch.empty(len(genomes), self.n_genes, dtype=genomes.dtype)
        per_layer = [block.shape[0] * block.shape[1] for block in self.gene_blocks[::4]]
        layers = theirs.split(per_layer, dim=1)
        for block in self.gene_blocks:
            rows, columns = block.shape
            genes = layers[block.layer][..., _THEIR_COLUMN[block.name]]
            ours[:, block.genes] = genes.unflatten(1, (columns, rows)).mT.flatten(1)
        self.set_genomes(ours)

    def forward(
        self,
        x: Tensor,
        state: hebbtorch.State | None = None,
        plastic: bool | Tensor = True,
        *,
        modulation: Tensor | None = None,
    ) -> tuple[Tensor, hebbtorch.State]:
        """As in the base class; the last input does not matter."""
        return super().forward(
            torch.cat([x[..., :-1], torch.ones_like(x[..., :1])], -1), state, plastic
        )


class RecordedStatic(hebbtorch.StaticMLP):
    """N static networks of one hidden layer with recorded genomes.

    Biases are the weights of one more input, and of one more hidden neuron, that are always 1.

    Args:
        genomes: (N, genes); neuron by neuron, the bias first.
        sizes: inputs, hidden neurons, outputs.
        dtype: The data type to compute in.
    """

    def __init__(
        self, genomes: Tensor, sizes: list[int], dtype: torch.dtype = torch.float64
    ) -> None:
        n_in, n_hidden, n_out = sizes
        super().__init__([n_in + 1, n_hidden + 1, n_out], population=(len(genomes),), dtype=dtype)
        counts = [n_hidden * (n_in + 1), n_out * (n_hidden + 1)]
        hidden, output = genomes.split(counts, dim=1)
        one = genomes.new_zeros(len(genomes), 1, n_in + 1)
        one[..., -1] = _SATURATING
        rows = [
            torch.cat([_bias_last(hidden.unflatten(1, (n_hidden, n_in + 1))), one], 1),
            _bias_last(output.unflatten(1, (n_out, n_hidden + 1))),
        ]
        self.set_genomes(torch.cat([weights.flatten(1) for weights in rows], 1))

    def forward(
        self,
        x: Tensor,
        state: hebbtorch.State | None = None,
        plastic: bool | Tensor = True,
        *,
        modulation: Tensor | None = None,
    ) -> tuple[Tensor, hebbtorch.State]:
        """As in the base class, for the inputs of the recorded network."""
        return super().forward(
            torch.cat([torch.tanh(x), torch.ones_like(x[..., :1])], -1), state, plastic
        )


def n_genes(kind: str, sizes: list[int]) -> int:
    """Genes of a recorded network of kind "hlp" or "mlp" with one hidden layer."""
    n_in, n_hidden, n_out = sizes
    if kind == "hlp":
        return 4 * (n_in * n_hidden + n_hidden * n_out)
    return (n_in + 1) * n_hidden + (n_hidden + 1) * n_out


def build(
    kind: str, genomes: Tensor, sizes: list[int], dtype: torch.dtype = torch.float64
) -> RecordedHebbian | RecordedStatic:
    """Networks of kind "hlp" or "mlp"."""
    if kind == "hlp":
        return RecordedHebbian(genomes, sizes, dtype=dtype)
    return RecordedStatic(genomes, sizes, dtype=dtype)


def _bias_last(weights: Tensor) -> Tensor:
    """Moves the first column to the end."""
    return weights.roll(-1, dims=-1)
