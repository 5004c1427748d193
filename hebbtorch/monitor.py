"""What plastic layers do while they run, sampled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import TracebackType
from typing import Any, Protocol, Self

import torch
from torch import Tensor, nn

from hebbtorch.functional.rules import RULES
from hebbtorch.linear import HebbianLinear
from hebbtorch.measures import step_measures, term_shares

_LAST = "drift_from_birth"  # of this measure the last sample counts, of the others the mean


class Writer(Protocol):
    """What `Monitor.log` writes to, such as TensorBoard's SummaryWriter."""

    def add_scalar(self, tag: str, scalar_value: float, global_step: int) -> Any:
        """Take one number."""

    def add_histogram(self, tag: str, values: Tensor, global_step: int) -> Any:
        """Take a set of numbers."""


@dataclass(frozen=True)
class Course:
    """Weights and activations of one individual over a life, at the sampled steps.

    Attributes:
        steps: numbers of the steps, from 1, (T,).
        weights: after each step, one (T, out, in) per layer.
        activations: The activations of the post-synaptic neurons, one (T, out) per layer.
    """

    steps: Tensor
    weights: tuple[Tensor, ...]
    activations: tuple[Tensor, ...]


class Monitor:
    """Looks at the plastic layers of a module at every so many steps, by forward hooks.

    Measures, each the mean over the samples of an episode and over the individuals:

    | measure | of a layer |
    |---|---|
    | weight_mean_abs, weight_max_abs | mean and greatest magnitude of the weights |
    | update_mean_abs | mean magnitude of one step's change |
    | drift_from_birth | mean distance of a weight from where it began, in the last sample |
    | sign_changes | share of the weights that change their sign in one step |
    | saturated | share of the neurons beyond +-0.9 |
    | share_A ... share_D | parts of the terms of the ABCD rule in the size of a change |

    >>> net = hebbtorch.HebbianMLP([3, 4, 2])
    >>> with Monitor(net, every=10) as monitor, torch.no_grad():
    ...     state = net.initial_state()
    ...     for _ in range(25):
    ...         y, state = net(torch.rand(3), state)
    >>> monitor.life.steps.tolist(), tuple(monitor.life.weights[0].shape)
    ([1, 11, 21], (3, 4, 3))
    >>> 0 < monitor.summary()["update_mean_abs/layer0"] < 0.1
    True

    Cost, 29-29-10, 40 individuals, processor time of one shared core, medians of 15 pairs: 1.11 to
    1.15 times the plain loop at every 60th step, of which the hooks alone are 1.05, 1.5 times at
    every 10th, 4.5 to 5 times at every step.

    Args:
        module: anything that holds `HebbianLinear`s; they are numbered in the order of
            `module.modules()`.
        every: steps from sample to sample; the first step is one.
        individual: whose course `life` keeps, an index into the flattened (*batch, *P).

    Raises:
        ValueError: the module holds no plastic layers, or `every` is not positive.
    """

    def __init__(self, module: nn.Module, every: int = 60, *, individual: int = 0) -> None:
        self.layers = [m for m in module.modules() if isinstance(m, HebbianLinear)]
        if not self.layers:
            raise ValueError(
                f"module: expected one with plastic layers, got {type(module).__name__} without"
            )
        if not isinstance(every, int) or isinstance(every, bool) or every < 1:
            raise ValueError(f"every: expected a number of steps >= 1, got {every!r}")
        self.every = every
        self.individual = individual
        self._handles = [
            layer.register_forward_hook(partial(self._hook, k), with_kwargs=True)
            for k, layer in enumerate(self.layers)
        ]
        self.reset()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Look no longer; what was seen stays."""
        for handle in self._handles:
            handle.remove()

    def reset(self) -> None:
        """Forget what was seen: the next step begins a life."""
        n_layers = len(self.layers)
        self._lived = [0] * n_layers
        self._start: list[Tensor | None] = [None] * n_layers
        self._measures = [_Means() for _ in range(n_layers)]
        self._shares = [_Means() for _ in range(n_layers)]
        self._weights: list[list[Tensor]] = [[] for _ in range(n_layers)]
        self._activations: list[list[Tensor]] = [[] for _ in range(n_layers)]
        self._steps: list[int] = []

    @property
    def life(self) -> Course:
        """The course of one individual so far."""
        seen = [k for k, weights in enumerate(self._weights) if weights]
        return Course(
            torch.tensor(self._steps),
            tuple(torch.stack(self._weights[k]) for k in seen),
            tuple(torch.stack(self._activations[k]) for k in seen),
        )

    def summary(self, individual: int | None = None) -> dict[str, float]:
        """ "measure/layer{k}" -> its value so far; empty before the first step.

        Args:
            individual: whose, an index into the flattened (*batch, *P); None: the mean over all.
                What was never known is NaN, as the shares where weights never change.
        """
        means = {
            f"{name}/layer{k}": value.nanmean() if individual is None else value[individual]
            for k in range(len(self.layers))
            for name, value in (self._measures[k].values() | self._shares[k].values()).items()
        }
        numbers = torch.stack(list(means.values())).tolist() if means else []
        return dict(zip(means, numbers, strict=True))

    def log(self, writer: Writer, step: int) -> None:
        """Write the summary and the last weights.

        Args:
            writer: anything with `add_scalar` and `add_histogram`.
            step: where on the writer's axis.
        """
        for name, value in self.summary().items():
            writer.add_scalar(f"plasticity/{name}", value, step)
        for k, weights in enumerate(self._weights):
            if weights:
                writer.add_histogram(f"plasticity/weights/layer{k}", weights[-1], step)

    def until_sample(self) -> int:
        """Steps that are not looked at before the next one that is."""
        return -self._lived[0] % self.every

    def skip(self, steps: int) -> None:
        """Count steps that were made where hooks do not see them, as in the fused loop."""
        self._lived = [lived + steps for lived in self._lived]

    @torch.no_grad()
    def record(
        self, activations: Sequence[Tensor], before: Sequence[Tensor], after: Sequence[Tensor]
    ) -> None:
        """Look at one step that was made where hooks do not see it.

        Args:
            activations: The activations of the inputs and of every layer, (individuals, neurons).
            before: weights of every layer before the step, (*lead, out, in).
            after: The weights after the step.
        """
        for k, (old, new) in enumerate(zip(before, after, strict=True)):
            self._lived[k] += 1
            lead = old.shape[:-2]
            x, y = (activations[k + i].reshape(*lead, -1) for i in (0, 1))
            self._look(k, x, y, old, new)

    def _hook(
        self,
        k: int,
        layer: nn.Module,
        args: tuple[Any, ...],
        kwargs: dict[str, Any],
        output: Any,
    ) -> None:
        self._lived[k] += 1
        state = args[1] if len(args) > 1 else kwargs.get("state")
        if self._start[k] is None and state is not None:
            self._start[k] = state.weights[0].detach()
        if (self._lived[k] - 1) % self.every == 0:
            y, after = output
            new = after.weights[0]
            old = new if state is None else state.weights[0]
            x = args[0] if args else kwargs["x"]
            with torch.no_grad():
                self._look(k, x.to(new.dtype), y, old, new)

    def _look(self, k: int, x: Tensor, y: Tensor, old: Tensor, new: Tensor) -> None:
        """Take the measures of one layer in one step."""
        start = self._start[k]
        if start is None or start.shape != new.shape:
            start = self._start[k] = old.detach().clone()
        self._measures[k].add(step_measures(y, old, new, start))
        if self.layers[k].rules.rule == RULES["abcd"]:
            self._shares[k].add(term_shares(self.layers[k], x, y))
        if k == 0:
            self._steps.append(self._lived[0])
        self._weights[k].append(_one(new, 2, self.individual).clone())
        self._activations[k].append(_one(y, 1, self.individual).clone())


class _Means:
    """Means over the samples of measures of each individual; what is NaN does not count."""

    def __init__(self) -> None:
        self._names: list[str] = []
        self._last = self._sum = self._count = torch.empty(0)

    def add(self, measures: Mapping[str, Tensor]) -> None:
        """One sample, (*lead,) each."""
        now = torch.stack(list(measures.values())).reshape(len(measures), -1).double()
        known = ~now.isnan()
        if now.shape != self._last.shape:  # the first, or that of another batch
            self._names = list(measures)
            self._sum, self._count = torch.zeros_like(now), torch.zeros_like(now)
        self._last = now
        self._sum = self._sum + torch.where(known, now, 0.0)
        self._count = self._count + known

    def values(self) -> dict[str, Tensor]:
        """Name -> mean of each individual, (individuals,); of the drift, the last sample."""
        means = self._sum / self._count
        return {
            name: self._last[k] if name == _LAST else means[k] for k, name in enumerate(self._names)
        }


def _one(values: Tensor, dims: int, individual: int) -> Tensor:
    """One individual's values, of so many dimensions."""
    return values.detach().reshape(-1, *values.shape[values.dim() - dims :])[individual]
