"""Where each quantity of a group of worlds lies in the state tensor.

The state of a group is one row of items, each item a vector with a lane per world:

    V voxel blocks (VOXEL_ITEMS each) | header | welds | terrain window | rings | readings
    | self-contacts | self-contacts of the last step | bounds of voxels     (with self-collision)
    | continuous                                                   (with continuous detection)
    | commands that wait                                         (with a control delay)

Inside a voxel block all offsets are constants; a body (one of the four squares of a voxel) is
addressed by the offset of its first item. Velocities are stored so that the mass matrix is the
identity: linear velocity in m/s, angular velocity times GYRATION, impulses divided by the mass.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

from physics.scene import material

GYRATION = math.sqrt(material.SQUARE_INERTIA / material.SQUARE_MASS)  # [m]

# A body: centre [m], angle [rad], its cosine and sine, velocity [m/s], omega * GYRATION [m/s].
X, Y, ANGLE, COS, SIN, VX, VY, W = range(8)
BODY_ITEMS = 8

# A spring: direction and arms times SCALE, bias, impulse / SCALE, SCALE = sqrt(soft mass).
SP_NX, SP_NY, SP_ARM1, SP_ARM2, SP_BIAS, SP_IMPULSE, SP_SCALE = range(7)
SPRING_ITEMS = 7

# A rope: direction, 1 where active in this step else 0, impulse.
RO_NX, RO_NY, RO_ACTIVE, RO_IMPULSE = range(4)
ROPE_ITEMS = 4

# A contact pair: a body on a terrain segment, with up to two points. KEY names segment and
# edge (0: no contact). A point: depth [m] (negative: none), arm in the body's frame, place at
# detection, lever arms / GYRATION along normal and tangent, effective masses, impulses,
# target velocity of the bounce, impulse of the position stage.
PA_NX, PA_NY, PA_KEY = range(3)
PA_POINTS = 3
(
    PT_DEPTH,
    PT_LX,
    PT_LY,
    PT_PX,
    PT_PY,
    PT_RN,
    PT_RT,
    PT_MN,
    PT_MT,
    PT_JN,
    PT_JT,
    PT_TARGET,
    PT_JP,
) = range(13)
POINT_ITEMS = 13
PAIR_ITEMS = PA_POINTS + 2 * POINT_ITEMS
PAIRS_PER_BODY = 2  # even and odd terrain segments

# A self-contact: two squares of the robot that overlap, with up to two points. KEY names the
# edges (0: no contact). A point: depth [m] (negative: none), effective masses and impulses (normal,
# tangential), target velocity of the bounce, impulse of the position stage; for each body the arm
# in its frame [m] and the lever arms / GYRATION along normal and tangent.
SC_NX, SC_NY, SC_KEY = range(3)
SC_POINTS = 3
MP_DEPTH, MP_MN, MP_MT, MP_JN, MP_JT, MP_TARGET, MP_JP = range(7)
MP_ARMS = 7
AR_X, AR_Y, AR_N, AR_T = range(4)
ARM_ITEMS = 4
SELF_CONTACT_POINT_ITEMS = MP_ARMS + 2 * ARM_ITEMS
SELF_CONTACT_ITEMS = SC_POINTS + 2 * SELF_CONTACT_POINT_ITEMS
SELF_CONTACT_ENTRY = 3  # its integers: number of the pair, offsets of its bodies
MEMORY_ITEMS = 5  # of a self-contact of the last step: key, two impulses per point
BOUND_ITEMS = 4  # of a voxel: least x and y, greatest x and y of its squares' centres
# A body before it moved: centre [m], angle [rad], 1 if it touched the ground else 0.
CC_X, CC_Y, CC_ANGLE, CC_STOOD = range(4)
CONTINUOUS_ITEMS = 4

SELF_CONTACTS_PER_VOXEL = 2  # that a world can hold

# A voxel block.
BODIES = 0
SPRINGS = BODIES + 4 * BODY_ITEMS
ROPES = SPRINGS + len(material.SPRINGS) * SPRING_ITEMS
PAIRS = ROPES + len(material.ROPES) * ROPE_ITEMS
COMMAND = PAIRS + 4 * PAIRS_PER_BODY * PAIR_ITEMS  # what the caller asked for
ACTUATION = COMMAND + 1  # in force, in [-1, 1]
BREAKS = ACTUATION + 1  # step from which the voxel is broken: its lower digit, or NEVER
MENDS = BREAKS + 1  # step from which it works again, likewise
# Of a voxel's springs, where they are not the same for all: 1 + g with softness g, -g / (1 + g),
# bias per stretch [1/s] (see `material.spring_constants`); 1 where there is an actuator, else 0.
FIRMNESS, RELAX, BIAS, ACTUATED = range(MENDS + 1, MENDS + 5)
VOXEL_ITEMS = ACTUATED + 1

# The header of a group.
H_STEP, H_FAILED, H_LEFT, H_ALIVE, H_LIVE = range(5)  # LEFT: 1 where beyond the ground's ends
H_LIFE, H_SEED_LOW, H_SEED_HIGH, H_GROUND_START, H_GROUND_END = range(5, 10)  # of an episode
H_WINDOW_LOW, H_WINDOW_HIGH, H_WINDOW_BASE, H_WINDOW_TOP = range(10, 14)
H_PLACE, H_LENGTH = range(14, 16)  # of the sensor window that is averaged just now
H_GRAVITY, H_FRICTION = range(16, 18)  # where they are not the same for all worlds
# Steps are counted in two digits, of which float32 knows both exactly: so many steps make one of
# the higher digit. Those of the end of an episode and of damage stand beside that of the counter.
STEPS_PER_HIGH = 2**23
H_STEP_HIGH, H_LIFE_HIGH, H_BREAKS_HIGH, H_MENDS_HIGH = range(18, 22)
NEVER = 1e30  # a lower digit that no counter reaches
HEADER_ITEMS = 22

# A weld: axis (unit vector from body 2's centre to the anchor), impulse.
WE_UX, WE_UY, WE_PX, WE_PY, WE_PW = range(5)
WELD_ITEMS = 5

# A segment of the terrain window: first point, unit tangent, length, abscissa of the second point.
SE_X, SE_Y, SE_TX, SE_TY, SE_LENGTH, SE_END = range(6)
SEGMENT_ITEMS = 6

# The integer row of a group: three counters, then lists.
L_CONTACTS, L_ROPES, L_SELF_CONTACTS, L_LISTS = range(4)


@dataclass(frozen=True)
class Layout:
    """Offsets that depend on the robot, in items.

    Attributes:
        voxels, welds, segments, ring_items, readings: sizes the offsets follow from.
        self_contacts: contacts of squares of the robot with each other that a world can hold.
        continuous: bodies that continuous collision detection looks at: all or 0.
        delay: control steps for which commands are kept before they act.
    """

    voxels: int
    welds: int
    segments: int
    ring_items: int
    readings: int
    self_contacts: int
    continuous: int
    delay: int = 0

    def union(self, other: Layout) -> Layout:
        """The layout that has room for what either has."""
        sizes = zip(dataclasses.astuple(self), dataclasses.astuple(other), strict=True)
        return Layout(*(max(pair) for pair in sizes))

    @property
    def header(self) -> int:
        """First item of the header."""
        return self.voxels * VOXEL_ITEMS

    @property
    def weld_block(self) -> int:
        """First item of the welds."""
        return self.header + HEADER_ITEMS

    @property
    def window(self) -> int:
        """First item of the terrain window."""
        return self.weld_block + self.welds * WELD_ITEMS

    @property
    def rings(self) -> int:
        """First item of the sensors' rings."""
        return self.window + self.segments * SEGMENT_ITEMS

    @property
    def reading_block(self) -> int:
        """First reading."""
        return self.rings + self.ring_items

    @property
    def self_contact_block(self) -> int:
        """First item of the self_contacts."""
        return self.reading_block + self.readings

    @property
    def self_contact_memory(self) -> int:
        """First item of what is kept of the last step's self_contacts."""
        return self.self_contact_block + self.self_contacts * SELF_CONTACT_ITEMS

    @property
    def self_contact_bounds(self) -> int:
        """First item of the bounds of voxels."""
        return self.self_contact_memory + self.self_contacts * MEMORY_ITEMS

    @property
    def continuous_block(self) -> int:
        """First item of what continuous collision detection keeps."""
        return self.self_contact_bounds + (self.voxels * BOUND_ITEMS if self.self_contacts else 0)

    @property
    def items(self) -> int:
        """Items of a whole group."""
        return self.delay_block + self.voxels * self.delay

    @property
    def delay_block(self) -> int:
        """First item of the commands that wait, the oldest first, voxel by voxel."""
        return self.continuous_block + self.continuous * CONTINUOUS_ITEMS

    @property
    def contact_list(self) -> int:
        """Active contact pairs, two integers each: offsets of the pair and of its body."""
        return L_LISTS

    @property
    def contact_list_new(self) -> int:
        """The list under construction during detection."""
        return self.contact_list + 2 * 4 * PAIRS_PER_BODY * self.voxels

    @property
    def rope_list(self) -> int:
        """Active ropes, three integers each: offsets of the rope and of its two bodies."""
        return self.contact_list_new + 2 * 4 * PAIRS_PER_BODY * self.voxels

    @property
    def self_contact_list(self) -> int:
        """Self-contacts, SELF_CONTACT_ENTRY integers each."""
        return self.rope_list + 3 * len(material.ROPES) * self.voxels

    @property
    def self_contact_list_old(self) -> int:
        """Numbers of the self-contacts of the last step, and one place that may be read in vain."""
        return self.self_contact_list + SELF_CONTACT_ENTRY * self.self_contacts

    @property
    def list_items(self) -> int:
        """Integers of a whole group."""
        return self.self_contact_list_old + self.self_contacts + 1


def body_offset(body: int) -> int:
    """Offset of a body's first item; body = 4 * voxel + corner."""
    return (body // 4) * VOXEL_ITEMS + BODIES + (body % 4) * BODY_ITEMS
