"""Random numbers: the same ones for an individual alone and in a batch."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import torch
from torch import Tensor, nn

Generators = torch.Generator | Sequence[torch.Generator] | None
INITS = ("zeros", "uniform")


def check_init(init: str) -> None:
    """Check the name of the weights at birth.

    Raises:
        ValueError: unknown.
    """
    if init not in INITS:
        raise ValueError(f"init: expected one of {INITS}, got {init!r}")


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
        dtype: of the result.
        device: of the result.

    Raises:
        ValueError: the sequence's length is not that of the first dimension.
    """
    if generator is None or isinstance(generator, torch.Generator):
        source = generator.device if generator is not None else torch.device("cpu")
        draw = torch.rand(shape, generator=generator, dtype=torch.float64, device=source)
        return (2 * draw - 1).to(device=device, dtype=dtype)
    generators = list(generator) if isinstance(generator, Iterable) else [generator]
    fits = len(shape) >= 3 and len(generators) == shape[0] > 0
    if not fits or not all(isinstance(source, torch.Generator) for source in generators):
        kinds = sorted({type(source).__name__ for source in generators})
        raise ValueError(
            f"generator: expected one generator per entry of the first population dimension of "
            f"{shape[:-2]}, or one for all, or None, got {len(generators)} {kinds}"
        )
    return torch.stack([draw_uniform(shape[1:], g, dtype=dtype, device=device) for g in generators])


@torch.no_grad()
def redraw(parameters: Iterable[nn.Parameter], generator: Generators) -> None:
    """Fill parameters (*P, rows, columns) with draws from U(-1, 1), one after the other."""
    for parameter in parameters:
        parameter.copy_(
            draw_uniform(
                tuple(parameter.shape), generator, dtype=parameter.dtype, device=parameter.device
            )
        )
