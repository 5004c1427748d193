"""The ground under a group of worlds: a window of terrain segments.

Each world stands on its own terrain. The segments around its robot are kept as lane vectors,
so that detection needs no gathers; the window is filled anew when a robot nears its edge.
"""

from physics.backend import ti
from physics.engine.lane_math import any_lane
from physics.engine.memory import layout as lay
from physics.engine.memory.tables import F_EXTENT, F_REACH

MARGIN = 2.0  # ground kept ready beyond what is within reach [m]
_FAR = 1e30


@ti.func
def update(S: ti.template(), terrain: ti.template(), m: ti.template(), T: ti.template()):
    """Keeps the segments within reach of every square of each robot in the window."""
    if m.segments > 0:
        reach = m.numbers[m.own_numbers + F_REACH]
        low = T.vec(_FAR)
        high = T.vec(-_FAR)
        for v in range(m.voxels):
            for k in range(4):
                x = S[v * lay.VOXEL_ITEMS + k * lay.BODY_ITEMS + lay.X]
                low = ti.select(x < low, x, low)
                high = ti.select(x > high, x, high)
        low = low - reach
        high = high + reach
        leaves = (low < S[m.header + lay.H_WINDOW_LOW]) | (high > S[m.header + lay.H_WINDOW_HIGH])
        if any_lane(leaves, T):
            marks = ti.select(leaves, T.vec(1.0), T.vec(0.0))
            for lane in range(T.lanes):
                if marks[lane] > T.f(0.0):
                    start = low[lane] - T.f(MARGIN)
                    end = start + m.numbers[m.own_numbers + F_EXTENT]
                    _fill_lane(S, terrain, m, lane, start, end, T)


@ti.func
def _fill_lane(
    S: ti.template(), terrain: ti.template(), m: ti.template(), lane, low, high, T: ti.template()
):
    """Fills one lane of the window with the segments between the abscissas ``low`` and ``high``.

    It holds no others, though it may have place for more: how many depends on the terrains of
    other worlds. The first segment has an even number, so that a segment keeps its parity, which
    is what names a contact pair, as the window moves.
    """
    world = S.number * T.places + lane
    points = terrain.shape[1]
    first = ti.cast(S[m.header + lay.H_WINDOW_BASE][lane], ti.i32)
    while first > 0 and terrain[world, first, 0] > low:
        first -= 1
    while first < points - 2 and terrain[world, first + 1, 0] <= low:
        first += 1
    first -= first % 2
    top = T.f(-_FAR)
    end = T.f(_FAR)
    if first + m.segments < points - 1:  # at the latest, it ends where its last place does
        end = terrain[world, first + m.segments, 0]
    for k in range(m.segments):
        segment = S.at[m.window + lay.SEGMENT_ITEMS * k]
        index = ti.min(first + k, points - 2)
        x0, y0 = terrain[world, index, 0], terrain[world, index, 1]
        dx = terrain[world, index + 1, 0] - x0
        dy = terrain[world, index + 1, 1] - y0
        length = ti.sqrt(dx * dx + dy * dy)
        for y in ti.static((y0, y0 + dy)):
            if y > top:  # which no point without height is
                top = y
        last = first + k > points - 2
        if last or x0 > high:  # nothing to stand on
            y0 = T.f(-_FAR)
        if not last and x0 > high and x0 < end:
            end = x0
        segment[lay.SE_X][lane] = x0
        segment[lay.SE_Y][lane] = y0
        segment[lay.SE_TX][lane] = dx / length
        segment[lay.SE_TY][lane] = dy / length
        segment[lay.SE_LENGTH][lane] = length
        segment[lay.SE_END][lane] = terrain[world, index + 1, 0]
    S[m.header + lay.H_WINDOW_TOP][lane] = top
    S[m.header + lay.H_WINDOW_BASE][lane] = ti.cast(first, T.f)
    S[m.header + lay.H_WINDOW_LOW][lane] = terrain[world, first, 0] if first > 0 else T.f(-_FAR)
    S[m.header + lay.H_WINDOW_HIGH][lane] = end
