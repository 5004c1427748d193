"""The oracle against the recorded reference simulator and against closed forms."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from physics.scene import material
from physics.scene.morphology import Morphology
from physics.scene.sensors import Apparatus
from physics.scene.terrain import Terrain
from tests.oracle.reference_world import ReferenceWorld
from tests.oracle.sensors import area_ratio, distance, readings, voxel_angle
from tests.oracle.world import OracleWorld, natural_joints, place, recorded_joints
from tests.reference import joint_order, load

FLAT = Terrain.from_name("flat")


def errors(world, run, steps):
    """Largest error of the poses after each step of a recorded run in free flight."""
    worst = []
    for k in range(1, steps + 1):
        world.step(run["actuation"][k - 1])
        worst.append(np.abs(world.poses() - run["state"][k, ..., :3]).max())
    return np.array(worst)


# --- recorded runs ------------------------------------------------------------------------------


@pytest.mark.parametrize(("run", "shape"), [("single", "box-1x1"), ("two", "box-2x1")])
def test_free_flight_follows_the_record_to_rounding(run, shape):
    order = joint_order(shape)
    world = OracleWorld(shape, gravity=0.0, joint_order=order, sleeping=True)
    record = load(f"{run}_voxel_step")
    assert errors(world, record, 360).max() < 1e-13
    assert np.abs(world.velocities() - record["state"][360, ..., 3:]).max() < 1e-12


def test_without_sleep_free_flight_agrees_until_the_robot_would_fall_asleep():
    world = OracleWorld("box-2x1", gravity=0.0, joint_order=joint_order("box-2x1"))
    worst = errors(world, load("two_voxel_step"), 360)
    assert worst[:294].max() < 1e-13
    assert 1e-7 < worst[294:].max() < 1e-4


@pytest.mark.parametrize(
    ("world", "self_collision", "steps", "tolerance"),
    [
        (OracleWorld, False, 4, 1e-8),  # until two squares touch for the first time
        (OracleWorld, False, 360, 5.6e-3),
        (OracleWorld, True, 360, 1e-8),
        (ReferenceWorld, True, 360, 1e-8),
    ],
)
def test_four_voxels_follow_the_record_with_self_collision(world, self_collision, steps, tolerance):
    """In 161 of the 360 steps diagonal neighbours graze each other at the middle. To the digits
    kept of the record; before rounding it is followed to 2e-9, as ReferenceWorld to 5e-10."""
    record, order = load("four_voxel_step"), joint_order("box-2x2")
    settings = {"joint_order": order, "sleeping": True, "self_collision": self_collision}
    four = world("box-2x2", gravity=0.0, **settings)
    assert errors(four, record, steps).max() < tolerance


def test_natural_joint_order_changes_little():
    run = load("single_voxel_step")
    world = OracleWorld("box-1x1", gravity=0.0)
    worst = errors(world, run, 360)
    assert worst.max() < 0.02
    assert worst[175] < 1e-6  # the same steady state at actuation +1
    assert worst[295] < 1e-6  # and at -1


@pytest.mark.parametrize("shape", ["box-1x1", "box-2x1", "box-2x2", "worm-7x1", "biped-4x3"])
def test_natural_joints_are_the_recorded_ones_in_another_order(shape):
    bodies = place(Morphology.of(shape), None)
    number = {id(body): i for i, body in enumerate(bodies)}

    def key(joint):
        ends = [
            (number[id(joint.body1)], *(round(value, 9) for value in joint.anchor1)),
            (number[id(joint.body2)], *(round(value, 9) for value in joint.anchor2)),
        ]
        if type(joint).__name__ != "Weld":  # only a weld tells its first body from its second
            ends.sort()
        return type(joint).__name__, *ends, getattr(joint, "rest", None)

    natural = Counter(key(joint) for joint in natural_joints(Morphology.of(shape), bodies))
    assert natural == Counter(key(joint) for joint in recorded_joints(joint_order(shape), bodies))


def fall(world, run, steps):
    """Follow the recorded fall of a voxel, taking over the poses that false events shoved."""
    followed, touches = [], []
    shoved = np.diff(run["false_events"], prepend=0) > 0
    for k in range(1, steps + 1):
        world.step([0.0])
        if shoved[k]:
            for body, pose in zip(world.bodies, run["state"][k, 0].tolist(), strict=True):
                body.x, body.y, body.angle = pose[:3]
            world.detect()
        else:
            followed.append(np.abs(world.poses() - run["state"][k, ..., :3]).max())
        touches.append(np.array_equal(world.touching(), run["touching"][k]))
    return np.array(followed), np.array(touches)


def test_a_fall_follows_the_record_to_rounding():
    """Impacts at 4 m/s, sliding, one- and two-point contacts; up to step 111, where the
    reference loses the warm start of a square that lies flat."""
    world = ReferenceWorld("box-1x1", FLAT, joint_order=joint_order("box-1x1"))
    worst, same_touch = fall(world, load("single_voxel_drop"), 111)
    assert worst.max() < 1e-12
    assert same_touch.all()


def test_plain_contacts_stay_near_the_recorded_fall():
    world = OracleWorld("box-1x1", FLAT, joint_order=joint_order("box-1x1"), sleeping=True)
    worst, same_touch = fall(world, load("single_voxel_drop"), 300)
    assert worst.max() < 1e-3
    assert same_touch.all()


@pytest.mark.parametrize(
    ("run", "shape", "bouncing", "settled"),
    [("passive_worm", "worm-7x1", 0.08, 0.02), ("passive_biped", "biped-4x3", 0.10, 0.02)],
)
def test_passive_robots_settle_at_the_recorded_heights(run, shape, bouncing, settled):
    record = load(run)
    world = OracleWorld(shape, FLAT)
    worst = []
    for k in range(1, 181):
        world.step(np.zeros(world.morphology.n_voxels))
        worst.append(np.abs(world.centers()[:, 1] - record["centers"][k, :, 1]).max())
    assert max(worst) < bouncing
    assert max(worst[150:]) < settled


@pytest.mark.parametrize("name", ["high", "medium", "low"])
def test_sensors_follow_the_record_to_rounding(name):
    record = load("sensors_biped")
    morphology = Morphology.of("biped-4x3")
    apparatus = Apparatus.named(name, morphology, lidar_angles=(-30, 0, 30))
    ours = readings(
        apparatus,
        record["state"][..., :3],
        record["state"][..., 3:],
        record["touching"],
        Terrain.from_name("hilly-3-30-0"),
    )
    columns = list(record["names_high"])
    recorded = record["readings"][:, [columns.index(c) for c in apparatus.names(morphology)]]
    assert np.abs(ours - recorded).max() < 1e-12


# --- closed forms -------------------------------------------------------------------------------


@pytest.mark.parametrize(("actuation", "ratio"), [(1.0, 0.775), (-1.0, 1.225), (0.0, 1.0)])
def test_unloaded_steady_area(actuation, ratio):
    world = OracleWorld("box-1x1", gravity=0.0)
    for _ in range(120):
        world.step([actuation])
    assert area_ratio(world.poses()[0]) == pytest.approx(ratio, abs=1e-9)


@pytest.mark.parametrize(("shape", "spin_tolerance"), [("box-1x1", 1e-12), ("box-2x2", 0.01)])
def test_free_flight_conserves_momentum_but_for_damping(shape, spin_tolerance):
    """Springs and ropes act along their line: exact. A weld's gap gives it a small lever."""
    world = OracleWorld(shape, gravity=0.0)
    rng = np.random.default_rng(1)
    for body in world.bodies:
        body.vx, body.vy, body.omega = rng.normal(size=3).tolist()

    def momentum():
        mass, inertia = material.SQUARE_MASS, material.SQUARE_INERTIA
        p = sum(np.array([b.vx, b.vy]) for b in world.bodies) * mass
        spin = sum(inertia * b.omega + mass * (b.x * b.vy - b.y * b.vx) for b in world.bodies)
        return np.array([*p, spin])

    before, damping = momentum(), 1.0
    for _ in range(20):
        world.step(rng.uniform(-1, 1, size=world.morphology.n_voxels))
        damping *= 1 - material.DAMPING * material.DT
    assert momentum()[:2] == pytest.approx(before[:2] * damping, abs=1e-12)
    assert momentum()[2] == pytest.approx(before[2] * damping, abs=spin_tolerance)


@pytest.mark.parametrize("ratio", [0.95, 1.05])
def test_friction_holds_up_to_its_angle(ratio):
    """A square on a slope slides from tan(angle) = friction on, and not before."""
    angle = math.degrees(math.atan(ratio * material.FRICTION))
    slope = Terrain.from_profile([0.0, 100.0], [0.0, 100.0 * math.tan(math.radians(angle))])
    world = OracleWorld("box-1x1", slope)
    square = world.bodies[0]
    world.bodies, world.joints = [square], []
    square.inertia = math.inf  # friction is above 1: a free square would tip before it slides
    square.angle = math.radians(angle)
    c, s = math.cos(square.angle), math.sin(square.angle)
    lift = material.SQUARE_HALF - material.LINEAR_TOLERANCE
    square.x, square.y = c * 60.0 - s * lift, s * 60.0 + c * lift
    world.detect()
    start = square.x
    for _ in range(60):
        world.step([0.0])
    slid = (start - square.x) / c
    pull = 9.8 * (s - material.FRICTION * c)  # along the slope, downwards; damping takes 3 %
    assert slid == pytest.approx(0.5 * max(pull, 0.0), rel=0.05, abs=0.002)


def test_restitution_of_a_fast_impact_only():
    for speed, bounce in ((3.0, 0.3), (0.8, 0.0)):
        world = OracleWorld("box-1x1", FLAT, gravity=0.0)
        world.joints = []
        square = world.bodies[0]
        square.inertia = math.inf  # no rocking: one velocity iteration settles both points
        square.y, square.vy = 5.0 + material.SQUARE_HALF - 0.001, -speed
        world.detect()
        world.step([0.0])
        damping = 1 - material.DAMPING * material.DT
        assert square.vy == pytest.approx(bounce * damping, abs=1e-12)


def two_squares(gap, angle=0.0):
    """Two squares side by side that nothing joins, the second one turned."""
    world = OracleWorld("box-1x1", gravity=0.0)
    world.bodies, world.joints, world.may_meet = world.bodies[:2], [], [(0, 1)]
    (left, right), half = world.bodies, material.SQUARE_HALF
    reach = half * (math.cos(angle) + math.sin(angle)) if angle else half
    left.x, left.y, right.x, right.y, right.angle = 0.0, 0.0, half + reach + gap, 0.0, angle
    world.detect()
    return world, left, right


@pytest.mark.parametrize(("speed", "bounce"), [(3.0, 0.3), (0.8, 0.0)])
@pytest.mark.parametrize("angle", [0.0, math.pi / 4])
def test_squares_share_their_momentum_and_part(speed, bounce, angle):
    """An edge, or a corner, meets an edge head on."""
    world, left, right = two_squares(-0.001, angle)
    assert len(world.contacts[0]) == (2 if angle == 0.0 else 1)
    left.inertia = right.inertia = math.inf  # no rocking: one iteration settles both points
    left.vx = speed
    world.step([0.0])
    damping = 1 - material.DAMPING * material.DT
    assert left.vx + right.vx == pytest.approx(speed * damping, abs=1e-12)
    assert right.vx - left.vx == pytest.approx(bounce * damping, abs=1e-12)


def test_friction_of_squares_is_ten():
    """Pressed at 0.1 m/s they stop a slip of up to 10 * 0.1 m/s, and no more."""
    for slip, left_over in ((0.9, 0.0), (1.4, 0.4)):
        world, left, right = two_squares(-0.001)
        left.inertia = right.inertia = math.inf
        left.vx, left.vy = 0.1, slip
        world.step([0.0])
        damping = 1 - material.DAMPING * material.DT
        assert left.vy - right.vy == pytest.approx(left_over * damping, abs=1e-12)
        assert left.vy + right.vy == pytest.approx(slip * damping, abs=1e-12)


def test_squares_in_each_other_part_up_to_the_tolerance():
    world, left, right = two_squares(-0.3, 0.2)
    middle = left.x + right.x
    for _ in range(200):
        world.step([0.0])
    assert left.x + right.x == pytest.approx(middle, abs=1e-12)
    depth = max(point.depth for contact in world.contacts for point in contact)
    assert depth == pytest.approx(material.LINEAR_TOLERANCE, abs=1e-4)


def test_lidar_sees_slopes_and_ignores_the_ground_it_is_in():
    assert distance(50.0, 8.0, -math.pi / 2, 10.0, FLAT) == pytest.approx(3.0)
    assert distance(50.0, 8.0, -math.pi / 6, 10.0, FLAT) == pytest.approx(6.0)
    assert distance(50.0, 8.0, 0.0, 10.0, FLAT) == 10.0
    assert distance(50.0, 4.0, -math.pi / 2, 10.0, FLAT) == 10.0
    # The left wall falls from (0, 100) to (10, 5): at y = 8 it is at x = 10 - 3 / 9.5.
    assert distance(12.0, 8.0, math.pi, 10.0, FLAT) == pytest.approx(2.0 + 3.0 / 9.5)


def test_voxel_angle_has_no_seam():
    for angle in (-3.1, 0.5, math.pi, 3.2):
        squares = [
            (
                *(
                    np.array(
                        [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
                    )
                    @ np.array(signs)
                    * 0.9
                ),
                angle,
            )
            for signs in material.CORNER_SIGNS
        ]
        turn = voxel_angle(np.array(squares)) - angle
        assert math.remainder(turn, 2 * math.pi) == pytest.approx(0.0, abs=1e-12)
