"""A trained static policy made plastic, then damaged: evolved rules make up for lost synapses.

python examples/damaged_policy.py      # prints the steps that CartPole's pole stays up

499 of 500 trained, 124 damaged, 427 damaged but plastic, in 80 s of one core.
"""

from __future__ import annotations

from functools import partial

import torch
from cartpole_es import Acting, balance
from torch import Tensor

import hebbtorch

SIZES, N = [4, 8, 1], 40


@torch.no_grad()
def act(net: hebbtorch.StaticMLP, state: hebbtorch.State, x: Tensor) -> Tensor:
    """Outputs of a static network."""
    return net(x, state)[0]


def train(seed: int) -> hebbtorch.StaticMLP:
    """A static network that balances the pole."""
    net = hebbtorch.StaticMLP(SIZES, population=(N,))
    es = hebbtorch.EvolutionStrategy(net.n_genes, population=N, seed=seed)
    while es.generation < 30 and (es.generation == 0 or es.best_fitness < 500):
        net.set_genomes(es.ask())
        acting = partial(act, net, net.initial_state())
        lived = [balance(acting, N, seed=1000 * es.generation + k) for k in range(3)]
        es.tell(torch.stack(lived).mean(0))
    best = hebbtorch.StaticMLP(SIZES)
    best.set_genomes(es.best)
    return best


def damaged(policy: hebbtorch.StaticMLP, net: hebbtorch.HebbianMLP, seed: int) -> Acting:
    """The policy's weights in a plastic network, those out of three quarters of the hidden lost."""
    draws = torch.Generator().manual_seed(seed)
    first, last = (w.expand(N, *w.shape) for w in policy.initial_state().weights)
    lost = torch.rand(N, 1, SIZES[1], generator=draws).argsort(-1) < 3 * SIZES[1] // 4
    acting = Acting(net)
    noise = 0.7 * torch.randn(first.shape, generator=draws)
    acting.state = hebbtorch.State((first + noise, last.masked_fill(lost, 0.0)))
    return acting


def main(generations: int = 40, seed: int = 0) -> tuple[float, float, float]:
    """Mean steps of the trained policy, damaged without plasticity, and with evolved rules."""
    policy = train(seed)
    intact = balance(partial(act, policy, policy.initial_state(batch=(N,))), N, 10**6)
    net = hebbtorch.HebbianMLP(SIZES, eta=0.05, population=(N,))
    net.set_genomes(torch.zeros(N, net.n_genes))
    without = balance(damaged(policy, net, 10**6), N, 10**6)
    es = hebbtorch.EvolutionStrategy(net.n_genes, population=N, seed=seed)
    for generation in range(generations):
        net.set_genomes(es.ask())
        seeds = [1000 * generation + k for k in range(3)]
        es.tell(torch.stack([balance(damaged(policy, net, s), N, s) for s in seeds]).mean(0))
    net.set_genomes(es.best.expand(N, -1))
    plastic = balance(damaged(policy, net, 10**6), N, 10**6)
    return intact.mean().item(), without.mean().item(), plastic.mean().item()


if __name__ == "__main__":
    words = "steps: trained {:.0f}, damaged {:.0f}, damaged but plastic {:.0f} of 500"
    print(words.format(*main()))
