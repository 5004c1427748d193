"""Functions on lane vectors, against themselves."""

import torch

from physics import backend
from physics.backend import Kernel, Program, ti
from physics.engine.lane_math import TINY_TURN, sine_cosine, sines_cosines

LANES = 8
ROWS = 4096


def test_tiny_turns_take_less_work_for_the_same_bits() -> None:
    program = Program(torch.float32, LANES, LANES)
    backend.start("cpu")
    T = backend.real(program)

    @ti.kernel
    def both(angles: T.array, full: T.array, short: T.array):  # type: ignore[name-defined]
        for row in range(angles.shape[0]):
            angle = angles[row]
            full[2 * row], full[2 * row + 1] = sine_cosine(angle, T)
            short[2 * row], short[2 * row + 1], _, _ = sines_cosines(angle, angle * T.f(0.0), T)

    # Floats from the largest tiny angle down, one by one, and from zero up to it, of either sign.
    last = torch.tensor(TINY_TURN).view(torch.int32)
    near = (last - torch.arange(ROWS * LANES // 2, dtype=torch.int32)).view(torch.float32)
    far = TINY_TURN * torch.rand(len(near), generator=torch.Generator().manual_seed(0))
    angles = torch.cat([near, far]) * torch.tensor([1.0, -1.0]).repeat(len(near))
    full, short = torch.zeros(2, 2 * ROWS, LANES)
    Kernel(both)(angles.view(ROWS, LANES), full, short)
    assert full.count_nonzero() == full.numel()
    assert torch.equal(full.view(torch.int32), short.view(torch.int32))
