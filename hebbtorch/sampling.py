"""Random numbers: the same ones for an individual alone and in a batch."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import torch
from torch import Tensor, nn

Generators = torch.Generator | Sequence[torch.Generator] | None
Init = str | Tensor | Callable[[tuple[int, ...], torch.Generator | None], Tensor]
INITS = ("zeros", "uniform", "normal", "kaiming", "evolved")


def check_init(init: Init) -> Init:
    """The initial weights as they were named.

    Raises:
        ValueError: an unknown name.
    """
    if not isinstance(init, Tensor) and not callable(init) and init not in INITS:
        raise ValueError(f"init: expected one of {INITS}, a tensor or a callable, got {init!r}")
    return init


def draw_weights(
    init: Init,
    shape: tuple[int, ...],
    generator: Generators,
    *,
    dtype: torch.dtype,
    device: torch.device,
) -> Tensor:
    """Initial weights (*batch, *P, out, in).

    >>> hebbtorch.HebbianLinear(3, 2, init=torch.eye(2, 3)).initial_weights().tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    >>> small = hebbtorch.HebbianLinear(3, 2, init=lambda shape, g: 0.1 * torch.ones(shape))
    >>> small.initial_weights(batch=(5,)).shape
    torch.Size([5, 2, 3])

    Args:
        init: "zeros"; "uniform", U(-1, 1); "normal", N(0, 1); "kaiming", N(0, 2 / in) (He et al.
            2015); a tensor that broadcasts to the shape; or a callable (shape, generator) ->
            tensor.
        shape: The shape of the result.
        generator: as in `draw_uniform`.
        dtype: The data type of the result.
        device: The device of the result.

    Raises:
        ValueError: a wrong number of generators, or weights of another shape.
    """
    if isinstance(init, Tensor):
        return _fitted(init, shape).to(device=device, dtype=dtype, copy=True)
    if callable(init):
        draw = init
    elif init == "zeros":
        return torch.zeros(shape, dtype=dtype, device=device)
    else:
        scale = math.sqrt(2 / shape[-1]) if init == "kaiming" else 1.0
        draw = _uniform if init == "uniform" else _normal(scale)
    return _drawn(draw, shape, generator).to(device=device, dtype=dtype)


def draw_uniform(
    shape: tuple[int, ...],
    generator: Generators,
    *,
    dtype: torch.dtype,
    device: torch.device,
) -> Tensor:
    """Independent draws from U(-1, 1).

    Drawn in float64 on the generator's device and then converted, so that neither precision
    nor device changes the numbers.

    Args:
        shape: shape of the result, (*P, rows, columns).
        generator: one generator for everything, None for torch's default one, or a sequence of
            one generator per entry of the first dimension: each entry is then what its generator
            alone would give, whoever else is in the batch.
        dtype: The data type of the result.
        device: The device of the result.

    Raises:
        ValueError: the sequence's length is not that of the first dimension.
    """
    return _drawn(_uniform, shape, generator).to(device=device, dtype=dtype)


@torch.no_grad()
def redraw(parameters: Iterable[nn.Parameter], generator: Generators) -> None:
    """Fill parameters (*P, rows, columns) with draws from U(-1, 1), one after the other."""
    for parameter in parameters:
        parameter.copy_(
            draw_uniform(
                tuple(parameter.shape), generator, dtype=parameter.dtype, device=parameter.device
            )
        )


def _uniform(shape: tuple[int, ...], generator: torch.Generator | None) -> Tensor:
    return 2 * torch.rand(shape, generator=generator, **_wide(generator)) - 1


def _normal(scale: float) -> Callable[[tuple[int, ...], torch.Generator | None], Tensor]:
    return lambda shape, generator: (
        scale * torch.randn(shape, generator=generator, **_wide(generator))
    )


def _wide(generator: torch.Generator | None) -> dict[str, Any]:
    """Double precision, where the generator is."""
    source = generator.device if generator is not None else torch.device("cpu")
    return {"dtype": torch.float64, "device": source}


def _drawn(
    draw: Callable[[tuple[int, ...], torch.Generator | None], Tensor],
    shape: tuple[int, ...],
    generator: Generators,
) -> Tensor:
    """What one generator gives for all, or each of several for its entry."""
    if generator is None or isinstance(generator, torch.Generator):
        return _fitted(draw(shape, generator), shape)
    generators = list(generator) if isinstance(generator, Iterable) else [generator]
    fits = len(shape) >= 3 and len(generators) == shape[0] > 0
    if not fits or not all(isinstance(source, torch.Generator) for source in generators):
        kinds = sorted({type(source).__name__ for source in generators})
        raise ValueError(
            f"generator: expected one generator per entry of the first population dimension of "
            f"{shape[:-2]}, or one for all, or None, got {len(generators)} {kinds}"
        )
    return torch.stack([_fitted(draw(shape[1:], source), shape[1:]) for source in generators])


def _fitted(weights: Tensor, shape: tuple[int, ...]) -> Tensor:
    """The weights in the wanted shape."""
    try:
        return weights.expand(shape)
    except RuntimeError:
        raise ValueError(
            f"init: expected weights that broadcast to {tuple(shape)}, "
            f"got shape {tuple(weights.shape)}"
        ) from None
