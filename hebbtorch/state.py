"""Plastic weights as explicit state: created by a network, passed in, returned anew."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch.utils import _pytree

Memory = dict[str, Tensor]  # of one layer; every entry is (*batch, *P, rows, columns)
_INTERVENTIONS = ("frozen", "keep_", "swap_")  # how the names of such entries begin


class State(NamedTuple):
    """What one plastic step changes: the synaptic weights, and what a rule remembers.

    A tuple, hence a pytree: it passes through `torch.func` as it is. No method writes into it, and
    whatever is done to an individual in the midst of an episode is a call that gives a new state:

    >>> net = hebbtorch.HebbianMLP([3, 4, 2], init="uniform", population=(2,))
    >>> y, state = net(torch.rand(2, 3))
    >>> first = torch.tensor([True, False])
    >>> y, after = net(torch.rand(2, 3), state.freeze(first).drop("A"))
    >>> [torch.equal(after.weights[0][k], state.weights[0][k]) for k in (0, 1)]
    [True, False]
    >>> again = state.reset(first, net.initial_state("zeros"))
    >>> [bool(w.any()) for w in again.weights[0]]
    [False, True]
    >>> others = hebbtorch.HebbianMLP([3, 4, 2], population=(2,))
    >>> y, after = net(torch.rand(2, 3), state.shuffle().swap_rules(others))

    Attributes:
        weights: one tensor (*batch, *P, out, in) per layer, from the inputs on, no unit.
        memory: one dict per layer of what its rule remembers (running averages, eligibility
            traces, the activations of a recurrent cell), each (*batch, *P, rows, columns);
            empty for layers that remember nothing but their weights.
    """

    weights: tuple[Tensor, ...]
    memory: tuple[Memory, ...] = ()

    def reset(self, mask: Tensor, fresh: State) -> State:
        """The state in which the individuals in `mask` start again and the others go on.

        Args:
            mask: bool, (*batch, *P); True takes the individual from `fresh`.
            fresh: the state to start from, as `initial_state()` of the network gives it, with
                all of this state's `batch` dimensions or the last ones.

        Raises:
            ValueError: the mask is not bool or not of that shape, or `fresh` is of another
                network, batch or dtype.
        """
        expected = self.weights[0].shape[:-2]
        if mask.dtype != torch.bool or mask.shape != expected:
            raise ValueError(
                f"mask: expected a bool tensor of shape {tuple(expected)}, "
                f"got {mask.dtype} of shape {tuple(mask.shape)}"
            )
        check_state(fresh, len(self.weights))
        for new, old in zip(fresh.weights, self.weights, strict=True):
            if not _fits(new, old):
                raise ValueError(
                    f"fresh: expected {old.dtype} weights of shape {tuple(old.shape)}, as this "
                    f"state has them, got {new.dtype} of shape {tuple(new.shape)}; "
                    f"take it from initial_state(batch=...) of the same network"
                )
        starts = fresh.memory or tuple({} for _ in fresh.weights)
        runs = self.memory or tuple({} for _ in self.weights)
        ours, theirs = ([_own(memory) for memory in each] for each in (runs, starts))
        if ours != theirs:
            raise ValueError(
                f"fresh: expected a memory of {ours}, as this state has it, got {theirs}; "
                f"take it from initial_state(batch=...) of the same network"
            )
        chosen = mask[..., None, None]
        return State(
            tuple(
                torch.where(chosen, new, old)
                for new, old in zip(fresh.weights, self.weights, strict=True)
            ),
            tuple(
                {**old, **{name: torch.where(chosen, new[name], old[name]) for name in _own(old)}}
                for new, old in zip(starts, self.memory or (), strict=bool(self.memory))
            ),
        )

    def freeze(self, mask: Tensor | None = None) -> State:
        """The state from which on the individuals in `mask` no longer learn.

        Args:
            mask: bool, (*batch, *P); True stops learning, False (re)starts it. None stops all.
        """
        stop = self._mask(mask)
        return self._with(lambda memory: {"frozen": stop})

    def drop(self, term: str, mask: Tensor | None = None) -> State:
        """The state from which on a term of the rule is left out.

        Args:
            term: name of a coefficient, such as "A".
            mask: bool, (*batch, *P); whose rule loses it. None: everyone's.
        """
        keep = (~self._mask(mask)).to(self.weights[0].dtype)
        name = f"keep_{term}"
        return self._with(lambda memory: {name: keep * memory.get(name, torch.ones_like(keep))})

    def swap_rules(self, network: Any) -> State:
        """The state from which on the rules of another network of the same kind are followed.

        Args:
            network: plastic layer or network with as many layers; for rules exchanged between
                the individuals of a population, a copy that was given their genomes in another
                order.

        Raises:
            ValueError: another number of layers.
        """
        layers = list(getattr(network, "layers", [network]))
        if len(layers) != len(self.weights):
            raise ValueError(f"network: expected {len(self.weights)} layers, got {len(layers)}")
        memory = self.memory or tuple({} for _ in layers)
        swapped = []
        for layer, weights, old in zip(layers, self.weights, memory, strict=True):
            rules = {f"swap_{name}": c for name, c in layer.named_coefficients().items()}
            rules["swap_eta"] = torch.as_tensor(layer.learning_rate(), device=weights.device)
            lead = weights.shape[:-2]
            made = {}
            for name, c in rules.items():
                shape = c.shape[-2:] if c.dim() >= 2 else (1, 1)
                made[name] = c.detach().to(weights.dtype).expand(*lead, *shape)
            swapped.append({**old, **made})
        return State(self.weights, tuple(swapped))

    def shuffle(
        self, generator: torch.Generator | None = None, mask: Tensor | None = None
    ) -> State:
        """The state in which each layer's weights are permuted, for each individual differently.

        Args:
            generator: source of the permutations; None: torch's default one.
            mask: bool, (*batch, *P); whose weights. None: everyone's.
        """
        chosen = self._mask(mask)
        return State(tuple(_shuffled(w, chosen, generator) for w in self.weights), self.memory)

    def _mask(self, mask: Tensor | None) -> Tensor:
        """A mask of individuals, (*batch, *P, 1, 1)."""
        lead = self.weights[0].shape[:-2]
        if mask is None:
            return torch.ones(*lead, 1, 1, dtype=torch.bool, device=self.weights[0].device)
        if mask.dtype != torch.bool or mask.shape != lead:
            raise ValueError(
                f"mask: expected a bool tensor of shape {tuple(lead)}, "
                f"got {mask.dtype} of shape {tuple(mask.shape)}"
            )
        return mask[..., None, None]

    def _with(self, entries: Callable[[Memory], Memory]) -> State:
        """The same state with further entries in every layer's memory."""
        memory = self.memory or tuple({} for _ in self.weights)
        return State(self.weights, tuple({**m, **entries(m)} for m in memory))

    def detach(self) -> State:
        """The same state without its autograd history, usable outside of inference mode."""
        return self._map(_detached)

    def to(
        self, device: torch.device | str | None = None, dtype: torch.dtype | None = None
    ) -> State:
        """The same state on another device or in another precision."""
        return self._map(
            lambda t: t.to(device=device, dtype=dtype if t.is_floating_point() else None)
        )

    def _map(self, function: Callable[[Tensor], Tensor]) -> State:
        return State(
            tuple(function(weights) for weights in self.weights),
            tuple({name: function(item) for name, item in m.items()} for m in self.memory),
        )


torch.serialization.add_safe_globals([State])  # torch.load reads one without further ado
_pytree._register_namedtuple(State, serialized_type_name="hebbtorch.State")  # torch.export.save


def memory_of(state: State, layer: int) -> Memory:
    """What a layer remembers; nothing where the state holds no memory."""
    return state.memory[layer] if state.memory else {}


def batch_of(x: Tensor, population: tuple[int, ...]) -> tuple[int, ...]:
    """The dimensions of inputs (*batch, *P, in) to the left of the population's."""
    return tuple(x.shape[: max(0, x.dim() - 1 - len(population))])


def check_state(state: State, n_layers: int) -> None:
    """Check that a state has the weights of as many layers as the network.

    Raises:
        ValueError: it has not, or is something else.
    """
    came = f"those of {len(state.weights)}" if isinstance(state, State) else type(state).__name__
    if not isinstance(state, State) or len(state.weights) != n_layers:
        raise ValueError(
            f"state: expected the weights of {n_layers} layers, got {came}; "
            f"take the state from this network's initial_state()"
        )


def intervened(
    memory: Memory, coefficients: Mapping[str, Tensor], eta: float | Tensor
) -> tuple[Mapping[str, Tensor], float | Tensor, Tensor | None]:
    """Coefficients, learning rate and who is frozen, after what was done to the state."""
    if not any(name.startswith(_INTERVENTIONS) for name in memory):
        return coefficients, eta, None
    changed = {}
    for name, own in coefficients.items():
        value = memory.get(f"swap_{name}", own)
        keep = memory.get(f"keep_{name}")
        changed[name] = value if keep is None else keep * value
    return changed, memory.get("swap_eta", eta), memory.get("frozen")


def _own(memory: Memory) -> list[str]:
    """Names of what a rule remembers, without interventions."""
    return sorted(name for name in memory if not name.startswith(_INTERVENTIONS))


def _shuffled(weights: Tensor, chosen: Tensor, generator: torch.Generator | None) -> Tensor:
    """Each individual's weights in an order of its own."""
    flat = weights.flatten(-2)
    source = torch.device("cpu") if generator is None else generator.device
    keys = torch.rand(flat.shape, generator=generator, dtype=torch.float64, device=source)
    mixed = flat.gather(-1, keys.argsort(-1).to(flat.device)).reshape(weights.shape)
    return torch.where(chosen, mixed, weights)


def _detached(tensor: Tensor) -> Tensor:
    """Cut from autograd; a copy where a tensor of inference mode would refuse later training."""
    cut = tensor.detach()
    return cut.clone() if cut.is_inference() and not torch.is_inference_mode_enabled() else cut


def _fits(new: Tensor, old: Tensor) -> bool:
    """Whether weights can take the place of others, perhaps of several alike."""
    return new.dtype == old.dtype and new.shape == old.shape[old.dim() - new.dim() :]
