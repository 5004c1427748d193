"""Gradients through a life: a layer learns to memorize patterns that it sees once.

In each life three patterns of 20 bits are shown; then one of them comes with bits missing, and
the layer fills them in. Its rules, and weights that are not plastic, are trained by Adam on the
error after whole lifetimes (as in Miconi et al., arXiv 1804.02464).

python examples/memory_by_gradient.py      # prints the share of missing bits that are wrong

Completion from 0.52 to 0.025 and association from 0.50 to 0.020, in 19 s of one core.
"""

from __future__ import annotations

import torch
from torch import Tensor

import hebbtorch

BITS, PATTERNS, LIFETIMES = 20, 3, 64


def hidden_bits(task: str, draws: torch.Generator) -> Tensor:
    """Which bits the query lacks: any half of them, or those of the value that a key stands for."""
    if task == "association":
        return (torch.arange(BITS) >= BITS // 2).expand(LIFETIMES, BITS)
    return torch.rand(LIFETIMES, BITS, generator=draws).argsort(1) < BITS // 2


def life(layer: hebbtorch.HebbianLinear, task: str, draws: torch.Generator) -> tuple[Tensor, ...]:
    """Answers, right answers and missing bits of a batch of lifetimes, (LIFETIMES, BITS) each."""
    patterns = torch.randint(0, 2, (PATTERNS, LIFETIMES, BITS), generator=draws) * 2.0 - 1.0
    state = layer.initial_state(batch=(LIFETIMES,))
    for pattern in patterns:
        _, state = layer(pattern, state)
    missing = hidden_bits(task, draws)
    which = int(torch.randint(0, PATTERNS, (), generator=draws))
    y, _ = layer(patterns[which].masked_fill(missing, 0.0), state, plastic=False)
    return y, patterns[which], missing


def bit_error(layer: hebbtorch.HebbianLinear, task: str, seed: int) -> float:
    """Share of the missing bits that are filled in wrongly, in new lifetimes."""
    draws = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        y, right, missing = life(layer, task, draws)
    return (y[missing] * right[missing] <= 0).float().mean().item()


def main(task: str = "completion", steps: int = 600, seed: int = 0) -> tuple[float, float]:
    """Bit error before and after training."""
    torch.manual_seed(seed)
    layer = hebbtorch.HebbianLinear(BITS, BITS, eta=0.1, fixed=True)
    before = bit_error(layer, task, seed=1)
    optimizer = torch.optim.Adam(layer.parameters(), lr=0.02)
    draws = torch.Generator().manual_seed(seed + 2)
    for _ in range(steps):
        y, right, missing = life(layer, task, draws)
        loss = (y - right)[missing].square().mean()
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return before, bit_error(layer, task, seed=1)


if __name__ == "__main__":
    for task in ("completion", "association"):
        print("{}: bit error {:.2f} before, {:.3f} after".format(task, *main(task)))
