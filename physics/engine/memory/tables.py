"""How the model lies in its two tables, of numbers and of integers, and how kernels read it."""

from typing import Any

from physics.backend import ti
from physics.scene import material

# Places in the table of numbers.
F_GRAVITY, F_DAMPING, F_FRICTION, F_NOISE, F_REACH, F_EXTENT, F_LOWPASS = range(7)
F_SPRINGS = 7  # rows of: anchors x1 y1 x2 y2 [m], rest length, its slopes for a >= 0 and a < 0
FS_X1, FS_Y1, FS_X2, FS_Y2, FS_REST, FS_SHRINK, FS_GROW = range(7)
F_SPRING_ROW = 7
F_RAYS = F_SPRINGS + F_SPRING_ROW * len(material.SPRINGS)  # rows of: cos, sin, range [m]
F_RAY_ROW = 3

# Places in the table of integers: the fields of Sizes, then the rows below.
SIZES = (
    "voxels",
    "welds",
    "segments",
    "readings",
    "header",
    "weld_block",
    "window",
    "rings",
    "reading_block",
    "contact_list",
    "contact_list_new",
    "rope_list",
    "velocity_iterations",
    "position_iterations",
    "control_interval",
    "delay",
    "delay_block",
    "ropes",
    "damage_mode",
    "weld_table",
    "reading_table",
    "interval_table",
    "interval_steps",
    "interval_row",
    "noise_table",
    "self_contact_block",
    "self_contact_memory",
    "self_contact_bounds",
    "self_contact_list",
    "self_contact_list_old",
    "self_contact_limit",
    "pair_table",
    "voxel_pairs",
    "continuous_block",
    "group_items",
    "own_numbers",  # first of this robot's in the table of numbers
    "next_group",  # first group that does not have this robot
    "next_sizes",  # place of the sizes of that group's robot
)
Sizes = ti.types.struct(**dict.fromkeys(SIZES, ti.i32))

I_SPRINGS = len(SIZES)  # rows of: items of body 1 and of body 2 in the voxel block
I_SPRING_ROW = 2
I_ROPES = I_SPRINGS + I_SPRING_ROW * len(material.SPRINGS)
I_ROPE_ROW = 2
I_WELDS = I_ROPES + I_ROPE_ROW * len(material.ROPES)
I_WELD_ROW = 3  # items of body 1 and of body 2; 1 where body 1 lies above body 2, else 0

# A row of voxels that may collide: numbers of both; bit 4 i + j is set where square i of the first
# is welded to square j of the second.
PAIR_ROW = 3

# A reading row: kind, voxel block, slots of its ring (0: no average), ring, interval number, ray.
RE_KIND, RE_VOXEL, RE_SLOTS, RE_RING, RE_INTERVAL, RE_RAY = range(6)
READING_ROW = 6
AREA, TOUCH, VELOCITY_X, VELOCITY_Y, RAY = range(5)


@ti.func
def load_sizes(integers: ti.template(), first):
    """The sizes of a robot's model, which stand from ``first`` on."""
    return Sizes(*[integers[first + k] for k in ti.static(range(len(SIZES)))])


@ti.func
def sizes_of_group(sizes: ti.template(), integers: ti.template(), group):
    """Turns to the robot of a group, from that of a group before it."""
    while group >= sizes.next_group:
        sizes = load_sizes(integers, sizes.next_sizes)


class Tables:
    """The model in a kernel, where it is called m: a size by its name, such as `m.voxels`.

    It exists while a kernel is compiled only, and leaves no trace in it.

    Attributes:
        integers: the table of I_*, an argument of the kernel.
        numbers: the table of F_*, likewise.
        stages: mask of the stages of `engine.step` that are taken.
    """

    _data_oriented = True  # lets Taichi pass it on as it is

    def __init__(self, sizes: Any, integers: Any, numbers: Any, stages: Any = -1) -> None:
        """What a kernel was given.

        Args:
            sizes: what `load_sizes` found.
            integers: the table of I_*.
            numbers: the table of F_*.
            stages: see the attribute; all by default, which the compiler knows.
        """
        self._sizes = sizes
        self.stages = stages
        self.integers = integers
        self.numbers = numbers

    def __getattr__(self, name: str) -> Any:
        return getattr(self._sizes, name)
