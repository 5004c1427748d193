"""CartPole balanced by a plastic network whose rules evolve; its weights start at zero each time.

python examples/cartpole_es.py       # prints the mean steps of the best rules on new starts

From 49 steps with random rules to all 500, in 7 s of one core.
"""

from __future__ import annotations

from collections.abc import Callable

import gymnasium
import torch
from torch import Tensor

import hebbtorch

STEPS = 500  # at most, in an episode
SCALE = torch.tensor([2.0, 2.0, 0.2, 2.0])  # of position, velocity, angle, angular velocity


def balance(act: Callable[[Tensor], Tensor], n: int, seed: int, steps: int = STEPS) -> Tensor:
    """Steps that n individuals keep their poles up; act: (n, 4) -> (n, 1)."""
    env = gymnasium.make_vec("CartPole-v1", n, vectorization_mode="vector_entry_point")
    observation, _ = env.reset(seed=seed)
    alive, lived = torch.ones(n, dtype=torch.bool), torch.zeros(n)
    for _ in range(steps):
        y = act(torch.as_tensor(observation, dtype=torch.float32) / SCALE)
        observation, _, fallen, ended, _ = env.step((y[:, 0] > 0).long().numpy())
        lived += alive
        alive &= ~torch.as_tensor(fallen | ended)
        if not alive.any():
            break
    env.close()
    return lived


class Acting:
    """A network that learns while it acts."""

    def __init__(self, net: hebbtorch.HebbianMLP) -> None:
        self.net = net
        self.state = net.initial_state()

    @torch.no_grad()
    def __call__(self, x: Tensor) -> Tensor:
        """Outputs, and one step of learning."""
        y, self.state = self.net(x, self.state)
        return y


def main(generations: int = 40, seed: int = 0) -> tuple[float, float]:
    """Mean steps of the first population, and of the best rules on 20 starts never met."""
    net = hebbtorch.HebbianMLP([4, 4, 1], eta=0.1, population=(40,))
    es = hebbtorch.EvolutionStrategy(net.n_genes, population=40, seed=seed)
    first = 0.0
    for generation in range(generations):
        net.set_genomes(es.ask())
        lived = torch.stack([balance(Acting(net), 40, 1000 * generation + k) for k in range(3)])
        es.tell(lived.mean(0))
        first = first or lived.mean().item()
        if es.best_fitness == STEPS:
            break
    best = hebbtorch.HebbianMLP([4, 4, 1], eta=0.1, population=(20,))
    best.set_genomes(es.best.expand(20, -1))
    return first, balance(Acting(best), 20, seed=10**6).mean().item()


if __name__ == "__main__":
    print(
        "steps that the pole stays up: random rules {:.0f}, evolved {:.0f} of 500".format(*main())
    )
