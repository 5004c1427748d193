"""From a learning rule to the next weights: averages, traces, decay, bounds, who learns.

In each step of a life, in this order:

    x, y   <- their means over the last min(M, steps lived) steps, this one included
    dw     <- eta * change(w, x, y)                    the rule, see `functional.rules`
    in steps K, 2 K, ... only:
    e      <- trace_decay e + dw
    w      <- (1 - decay) w + modulation e
    w      <- clip, then normalize

Weights that change in every fourth step, from means over the last ten:

>>> net = hebbtorch.HebbianMLP([3, 4, 2], normalize="max", average=10, every=4, init="uniform")
>>> state = net.initial_state()
>>> changed = []
>>> for step in range(1, 9):
...     before = state.weights[0]
...     y, state = net(torch.rand(3), state)
...     if not torch.equal(before, state.weights[0]):
...         changed.append(step)
>>> changed
[4, 8]

Three factors: what happened leaves a trace, a later reward makes it a change of weights:

>>> layer = hebbtorch.HebbianLinear(3, 2, rule="hebb", trace_decay=0.9, init="uniform")
>>> y, state = layer(torch.ones(3), plastic=False)
>>> y, rewarded = layer(torch.zeros(3), state, modulation=torch.tensor(1.0))
>>> y, ignored = layer(torch.zeros(3), state, modulation=torch.tensor(0.0))
>>> torch.equal(ignored.weights[0], state.weights[0])
True
>>> torch.equal(rewarded.weights[0], state.weights[0])
False

Sources: averages and intervals, Dittrich et al., arXiv 2603.22512 (2026); three factors, Gerstner
et al., Frontiers in Neural Circuits 12 (2018).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any

import torch
from torch import Tensor

from hebbtorch.functional.bounds import Bound
from hebbtorch.functional.rules import LearningRule
from hebbtorch.state import Memory, intervened


@dataclass(frozen=True)
class Plasticity:
    """How a rule's changes become weights; the arguments are those of `HebbianLinear`.

    Attributes:
        average: M, steps that the rule's activations are averaged over.
        every: K, steps from update to update.
        decay: share of the weights lost in an update.
        clip: bound on |w|, or None.
        trace_decay: share of the eligibility trace that stays.
        bound: applied to the weights last, or None.

    Raises:
        ValueError: an argument out of its range.
    """

    average: int = 1
    every: int = 1
    decay: float = 0.0
    clip: float | None = None
    trace_decay: float = 0.0
    bound: Bound | None = None

    def __post_init__(self) -> None:
        for name, steps in (("average", self.average), ("every", self.every)):
            if not isinstance(steps, Integral) or isinstance(steps, bool) or steps < 1:
                raise ValueError(f"{name}: expected a number of steps >= 1, got {steps!r}")
        for name, share in (("decay", self.decay), ("trace_decay", self.trace_decay)):
            if not _is_number(share) or not 0 <= share <= 1:
                raise ValueError(f"{name}: expected a number from 0 to 1, got {share!r}")
        if self.clip is not None and not (_is_number(self.clip) and self.clip > 0):
            raise ValueError(f"clip: expected a positive number or None, got {self.clip!r}")

    def options(self) -> dict[str, Any]:
        """The arguments but the bound, by name."""
        names = ("average", "every", "decay", "clip", "trace_decay")
        return {name: getattr(self, name) for name in names}

    def initial_memory(self, weights: Tensor, rule: LearningRule) -> Memory:
        """What a layer remembers when an episode begins; nothing by default.

        Args:
            weights: (*batch, *P, out, in).
            rule: The layer's learning rule.
        """
        *lead, n_out, n_in = weights.shape
        shapes = {
            "pre": (*lead, 1, n_in),
            "post": (*lead, n_out, 1),
            "synapse": (*lead, n_out, n_in),
            "individual": (*lead, 1, 1),
        }
        zeros = weights.detach().new_zeros
        memory = {name: zeros(shapes[place]) for name, place in rule.memory.items()}
        if self.average > 1 or self.every > 1:
            memory["step"] = zeros(shapes["individual"], dtype=torch.int64)
        if self.average > 1:
            memory["pre_window"] = zeros((*lead, self.average, n_in))
            memory["post_window"] = zeros((*lead, n_out, self.average))
        if self.trace_decay > 0:
            memory["trace"] = zeros(shapes["synapse"])
        return memory

    def step(
        self,
        rule: LearningRule,
        coefficients: Mapping[str, Tensor],
        eta: float | Tensor,
        weights: Tensor,
        memory: Memory,
        x: Tensor,
        y: Tensor,
        plastic: bool | Tensor,
        modulation: Tensor | None,
    ) -> tuple[Tensor, Memory]:
        """The weights and the memory after one step of a life; nothing given is written into.

        Args:
            rule: what changes the weights.
            coefficients: The coefficients of the rule, by name, each broadcastable to the weights.
            eta: learning rate, a number or broadcastable to the weights.
            weights: (*batch, *P, out, in).
            memory: see `initial_memory`.
            x: (*batch, *P, 1, in).
            y: (*batch, *P, out, 1).
            plastic: whether the weights change, or who learns, bool (*batch, *P).
            modulation: third factor, (*batch, *P), or None for 1.

        Raises:
            ValueError: a mask or modulation of another shape, or a memory of another layer.
        """
        self._check(rule, memory)
        memory = dict(memory)
        learns = _who(plastic, weights)
        if "step" in memory:
            memory["step"] = memory["step"] + 1
        if self.average > 1:
            x = self._mean(memory, "pre_window", x, -2)
            y = self._mean(memory, "post_window", y, -1)
        coefficients, eta, frozen = intervened(memory, coefficients, eta)
        learns = _both(learns, None if frozen is None else ~frozen)
        dw = eta * self._change(rule, coefficients, weights, memory, x, y)
        due = memory["step"] % self.every == 0 if self.every > 1 else None
        if self.trace_decay > 0:
            trace = self.trace_decay * memory["trace"] + dw
            memory["trace"] = trace if due is None else torch.where(due, trace, memory["trace"])
            dw = trace
        if modulation is not None:
            dw = _factor(modulation, weights) * dw
        if plastic is False:
            return weights, memory
        kept = weights if self.decay == 0 else (1.0 - self.decay) * weights
        updated = self._bounded(kept + dw)
        changes = _both(learns, due)
        return updated if changes is None else torch.where(changes, updated, weights), memory

    def _bounded(self, weights: Tensor) -> Tensor:
        if self.clip is not None:
            weights = weights.clamp(-self.clip, self.clip)
        return weights if self.bound is None else self.bound(weights)

    def _change(
        self,
        rule: LearningRule,
        coefficients: Mapping[str, Tensor],
        weights: Tensor,
        memory: Memory,
        x: Tensor,
        y: Tensor,
    ) -> Tensor:
        """The rule's change; what the rule remembers goes into `memory`."""
        values = [coefficients[name] for name in rule.coefficients]
        remembered = {name: memory[name] for name in rule.memory}
        result = rule.change(weights, x, y, *values, **remembered)
        if not rule.memory:
            change: Tensor = result
            return change
        change, remembered = result
        memory.update(remembered)
        return change

    def _mean(self, memory: Memory, name: str, now: Tensor, steps: int) -> Tensor:
        """The mean over the last steps; the window moves on by one, oldest first."""
        old = memory[name]
        memory[name] = torch.cat([old.narrow(steps, 1, self.average - 1), now], steps)
        lived = memory["step"].clamp(max=self.average).to(now.dtype)
        # One after the other: a sum over a dimension may take another order in another batch.
        total, *others = memory[name].unbind(steps)
        for activations in others:
            total = total + activations
        return total.unsqueeze(steps) / lived

    def _check(self, rule: LearningRule, memory: Memory) -> None:
        expected = set(rule.memory)
        expected |= {"step"} if self.average > 1 or self.every > 1 else set()
        expected |= {"pre_window", "post_window"} if self.average > 1 else set()
        expected |= {"trace"} if self.trace_decay > 0 else set()
        if missing := sorted(expected - set(memory)):
            raise ValueError(
                f"state: expected a memory with {missing}, got {sorted(memory)}; "
                f"take the state from this network's initial_state()"
            )


def _is_number(value: object) -> bool:
    is_real = isinstance(value, Real) and not isinstance(value, bool)
    return is_real and math.isfinite(value)  # type: ignore[arg-type]


def _who(plastic: bool | Tensor, weights: Tensor) -> Tensor | None:
    """Who learns, (*batch, *P, 1, 1), or None for all."""
    if isinstance(plastic, bool):
        return None
    if plastic.dtype != torch.bool or plastic.shape != weights.shape[:-2]:
        raise ValueError(
            f"plastic: expected True, False or a bool tensor of shape "
            f"{tuple(weights.shape[:-2])}, got {plastic.dtype} of shape {tuple(plastic.shape)}"
        )
    return plastic[..., None, None]


def _factor(modulation: Tensor, weights: Tensor) -> Tensor:
    """The third factor, (*batch, *P, 1, 1)."""
    if modulation.shape != weights.shape[:-2] or not modulation.is_floating_point():
        raise ValueError(
            f"modulation: expected a floating tensor of shape {tuple(weights.shape[:-2])}, "
            f"got {modulation.dtype} of shape {tuple(modulation.shape)}"
        )
    return modulation.to(weights.dtype)[..., None, None]


def _both(one: Tensor | None, other: Tensor | None) -> Tensor | None:
    """Where both hold; None stands for everywhere."""
    if one is None or other is None:
        return other if one is None else one
    return one & other
