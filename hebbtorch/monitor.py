"""What plastic layers do while they run, sampled."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Protocol, Self

import torch
from torch import Tensor, nn

from hebbtorch.functional.rules import RULES
from hebbtorch.linear import HebbianLinear

SATURATED = 0.9  # a neuron beyond this is called saturated


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
        activations: of the post-synaptic neurons, one (T, out) per layer.
    """

    steps: Tensor
    weights: tuple[Tensor, ...]
    activations: tuple[Tensor, ...]


class Monitor:
    """Looks at the plastic layers of a module at every so many steps, by forward hooks.

    Measures, each the mean over the individuals and over the samples of a life:

    | measure | of a layer |
    |---|---|
    | weight_mean_abs, weight_max_abs | mean and greatest magnitude of the weights |
    | update_mean_abs | mean magnitude of one step's change |
    | drift_from_start | mean distance of a weight from where it began, in the last sample |
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

    Cost, 29-29-10, 40 individuals, one core: 1.10 times the plain loop at every 60th step, 1.6
    times at every 10th, 5.2 times at every step.

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
            layer.register_forward_hook(self._hook, with_kwargs=True) for layer in self.layers
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
        self._values: list[dict[str, list[float]]] = [defaultdict(list) for _ in range(n_layers)]
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

    def summary(self) -> dict[str, float]:
        """ "measure/layer{k}" -> mean over the samples; empty before the first step."""
        flat = {}
        for k, values in enumerate(self._values):
            for name, course in values.items():
                last = course[-1] if name.startswith("drift") else sum(course) / len(course)
                flat[f"{name}/layer{k}"] = last
        return flat

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
            activations: of the inputs and of every layer, (individuals, neurons).
            before: weights of every layer before the step, (*lead, out, in).
            after: after it.
        """
        for k, (old, new) in enumerate(zip(before, after, strict=True)):
            self._lived[k] += 1
            lead = old.shape[:-2]
            x, y = (activations[k + i].reshape(*lead, -1) for i in (0, 1))
            self._look(k, x, y, old, new)

    def _hook(
        self, layer: nn.Module, args: tuple[Any, ...], kwargs: dict[str, Any], output: Any
    ) -> None:
        k = self.layers.index(layer)  # type: ignore[arg-type]
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
        values = {
            "weight_mean_abs": new.abs().mean(),
            "weight_max_abs": new.abs().flatten(-2).amax(-1).mean(),
            "update_mean_abs": (new - old).abs().mean(),
            "drift_from_start": (new - start).abs().mean(),
            "sign_changes": (new * old < 0).double().mean(),
            "saturated": (y.abs() > SATURATED).double().mean(),
        }
        layer = self.layers[k]
        if layer.rules.rule == RULES["abcd"]:
            values |= _shares(layer, x, y)
        numbers = torch.stack([value.double() for value in values.values()]).tolist()
        for name, number in zip(values, numbers, strict=True):
            if not math.isnan(number) or not name.startswith("share"):
                self._values[k][name].append(number)
        if k == 0:
            self._steps.append(self._lived[0])
        self._weights[k].append(_one(new, 2, self.individual).clone())
        self._activations[k].append(_one(y, 1, self.individual).clone())


def _one(values: Tensor, dims: int, individual: int) -> Tensor:
    """One individual's values, of so many dimensions."""
    return values.detach().reshape(-1, *values.shape[values.dim() - dims :])[individual]


def _shares(layer: HebbianLinear, x: Tensor, y: Tensor) -> dict[str, Tensor]:
    """Share of each term in the size of a change, the mean over the individuals; NaN: no change."""
    eta = layer.learning_rate()
    a, b, c, d = (eta * coefficient for coefficient in layer.coefficients())
    pre, post = x.unsqueeze(-2), y.unsqueeze(-1)
    shape = torch.broadcast_shapes(pre.shape, post.shape, a.shape, d.shape)
    terms = {"A": a * pre * post, "B": b * pre, "C": c * post, "D": d}
    sizes = {name: term.expand(shape).abs().sum((-2, -1)) for name, term in terms.items()}
    total = torch.stack(list(sizes.values())).sum(0)
    return {f"share_{name}": (size / total).nanmean() for name, size in sizes.items()}
