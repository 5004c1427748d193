"""What the kernel knows of a network, and which parts of the program a network needs."""

from __future__ import annotations

from dataclasses import dataclass

import hebbtorch
from experiments.rollout.controller import Controller
from hebbtorch.state import memory_of

__all__ = ["Features", "features_of", "plastic_layers", "why_not"]

NORMALIZATIONS = (None, "l2", "minmax", "max")
_MEMORY = {"step", "pre_window", "post_window", "hidden"}  # that the kernel goes on with
_INTERVENTIONS = ("frozen", "keep_", "swap_")


@dataclass(frozen=True)
class Features:
    """Parts of the program beyond a plain network; each is compiled in only where it is used.

    Attributes:
        average: Means of the activations over the last steps.
        every: Updates in some steps only.
        decay: Whether a share of the weights is lost in each update.
        clip: Weights are cut.
        maximum: Layers are divided by their greatest weight.
        fixed: Weights that are not plastic are added.
        bias: Neurons have a bias.
        recurrent: Hidden neurons see their last activations.
        constant_last_input: The last reading is replaced by 1.
        input_tanh: tanh acts on the readings.
        mask: Some individuals do not learn.
    """

    average: bool = False
    every: bool = False
    decay: bool = False
    clip: bool = False
    maximum: bool = False
    fixed: bool = False
    bias: bool = False
    recurrent: bool = False
    constant_last_input: bool = False
    input_tanh: bool = False
    mask: bool = False


def plastic_layers(network: Controller) -> list[hebbtorch.HebbianLinear]:
    """The plastic layers of a network; none of a static one."""
    return list(network.layers) if isinstance(network, hebbtorch.HebbianMLP) else []


def features_of(network: Controller, state: hebbtorch.State, masked: bool) -> Features:
    """The parts that a network needs.

    Args:
        network: One of which `why_not` says nothing.
        state: The network's state.
        masked: Whether who learns was said.
    """
    recurrent = isinstance(network, hebbtorch.HebbianRNN | hebbtorch.StaticRNN)
    layers = plastic_layers(network)
    if not layers:
        assert isinstance(network, hebbtorch.StaticMLP)
        return Features(
            bias=bool(network.biases),
            recurrent=recurrent,
            input_tanh=network.input_activation == "tanh",
        )
    assert isinstance(network, hebbtorch.HebbianMLP)
    first = layers[0]
    frozen = any("frozen" in memory for memory in state.memory)
    return Features(
        average=first.plasticity.average > 1,
        every=first.plasticity.every > 1,
        decay=first.plasticity.decay > 0,
        clip=first.plasticity.clip is not None,
        maximum=first.normalize == "max",
        fixed=first.fixed is not None,
        bias=first.bias is not None,
        recurrent=recurrent,
        constant_last_input=network.constant_last_input,
        mask=masked or frozen,
    )


def why_not(network: Controller, state: hebbtorch.State) -> str | None:
    """Why the kernel cannot run a network: what it does not know; None where it can.

    Args:
        network: The network that is asked about, of any kind.
        state: The network's state.
    """
    kind = type(network)
    if kind in (hebbtorch.StaticMLP, hebbtorch.StaticRNN):
        return _why_not_static(network)
    if kind not in (hebbtorch.HebbianMLP, hebbtorch.HebbianRNN):
        return f"a network that is not hebbtorch's own, {kind.__name__}"
    layers = plastic_layers(network)
    for layer in layers:
        if reason := _why_not_layer(layer):
            return reason
    if len({_plan(layer) for layer in layers}) > 1:
        return "layers that differ in their options"
    return _why_not_state(state)


def _why_not_static(network: Controller) -> str | None:
    assert isinstance(network, hebbtorch.StaticMLP)
    if {network.activation, network.output_activation} != {"tanh"}:
        return "activations other than tanh"
    if network.input_activation not in ("identity", "tanh"):
        return f"input activation {network.input_activation}"
    return None


def _why_not_layer(layer: hebbtorch.HebbianLinear) -> str | None:
    """What there is in a layer that the kernel does not know."""
    if type(layer) is not hebbtorch.HebbianLinear:
        return f"a layer that is not hebbtorch's own, {type(layer).__name__}"
    if layer.rules.rule != hebbtorch.RULES["abcd"]:
        return f"rule {layer.rules.rule.name}"
    if layer.normalize not in NORMALIZATIONS:
        return "a bound of one's own"
    if layer.activation != "tanh":
        return "activations other than tanh"
    if layer.plasticity.trace_decay > 0:
        return "eligibility traces"
    return None


def _why_not_state(state: hebbtorch.State) -> str | None:
    """What there is in a state that the kernel cannot go on from."""
    for memory in state.memory:
        own = {name for name in memory if not name.startswith(_INTERVENTIONS)}
        if own - _MEMORY:
            return f"a state with {sorted(own - _MEMORY)}"
        step = memory.get("step")
        if step is not None and step.numel() and bool((step != step.flatten()[0]).any()):
            return "individuals whose lifetimes began at different steps"
    return None


def _plan(layer: hebbtorch.HebbianLinear) -> tuple[object, ...]:
    """Options that all layers must have in common."""
    parts = (layer.bias is None, layer.fixed is None, layer.normalize)
    return (*parts, *layer.plasticity.options().values())


def step_of(state: hebbtorch.State) -> int:
    """Control steps that the individuals of a state have lived, as far as it counts them."""
    steps = [memory_of(state, k).get("step") for k in range(len(state.weights))]
    return next((int(s.flatten()[0]) for s in steps if s is not None and s.numel()), 0)
