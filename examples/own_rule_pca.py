"""A rule of one's own: Oja's, in one line, finds the first principal component of its inputs.

python examples/own_rule_pca.py      # prints the cosine between the weights and the component

From 0.153 to 0.9997 in 6 s of one core.
"""

from __future__ import annotations

import torch
from torch import Tensor

import hebbtorch


def my_rule(w: Tensor, x: Tensor, y: Tensor, rate: float = 1.0) -> Tensor:
    """Hebb's rule with forgetting: the weights stay near norm 1."""
    return rate * (x * y - y * y * w)


def main(steps: int = 8000, seed: int = 0) -> tuple[float, float]:
    """Cosine with the first principal component at the start and at the end."""
    draws = torch.Generator().manual_seed(seed)
    directions = torch.linalg.qr(torch.randn(8, 8, generator=draws))[0]
    spread = torch.tensor([3.0, 1.5, 1.0, 0.8, 0.6, 0.5, 0.4, 0.3])
    inputs = torch.randn(steps, 8, generator=draws) * spread @ directions.T / 3
    component = torch.linalg.eigh(inputs.T @ inputs)[1][:, -1]
    layer = hebbtorch.HebbianLinear(8, 1, rule=my_rule, activation="identity", eta=0.003)
    state = layer.initial_state("uniform", generator=draws)
    cosine = torch.nn.functional.cosine_similarity
    before = cosine(state.weights[0][0], component, dim=0).abs().item()
    with torch.no_grad():
        for x in inputs:
            _, state = layer(x, state)
    return before, cosine(state.weights[0][0], component, dim=0).abs().item()


if __name__ == "__main__":
    print(
        "cosine with the first principal component: {:.3f} at first, {:.5f} at last".format(*main())
    )
