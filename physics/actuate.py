"""From a controller's command to the actuation in force: clipping and damage."""

from physics import layout as lay
from physics import noise
from physics.backend import ti

REST, FROZEN, RANDOM = range(3)


@ti.func
def command(S: ti.template(), g, m: ti.template(), voxel, value, T: ti.template()):
    """Sets the actuation of a voxel for the next step, unless the voxel is broken by now."""
    block = voxel * lay.VOXEL_ITEMS
    one = T.vec(1.0)
    clipped = ti.select(value > one, one, ti.select(value < -one, -one, value))
    step = S[g, m.header + lay.H_STEP]
    broken = (step >= S[g, block + lay.BREAKS]) & (step < S[g, block + lay.MENDS])
    if broken.any():
        stuck = T.vec(0.0)
        if m.damage_mode == FROZEN:
            stuck = S[g, block + lay.ACTUATION]
        elif m.damage_mode == RANDOM:
            # Voxels count from 1 here: number 0 would share its bits with the noise's first pair.
            number = ti.cast(voxel + 1, ti.u32)
            bits = noise.mix(noise.key(S, g, m, T) ^ (number * ti.u32(0xC2B2AE35)))
            stuck = ti.cast(noise.uniform(bits), T.f) * T.f(2.0) - one
        clipped = ti.select(broken, stuck, clipped)
    S[g, block + lay.ACTUATION] = clipped
