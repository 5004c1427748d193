import pytest

from physics.scene.morphology import Morphology
from physics.scene.sensors import Apparatus, Sensor
from tests.reference import load

BIPED, WORM = Morphology.of("biped-4x3"), Morphology.of("worm-7x1")


@pytest.mark.parametrize(
    ("shape", "sizes"), [(BIPED, (29, 20, 8)), (WORM, (31, 28, 3))], ids=["biped", "worm"]
)
def test_sizes_of_the_named_apparatus(shape, sizes):
    names = ("high", "medium", "low")
    assert tuple(Apparatus.named(name, shape).n_readings for name in names) == sizes


@pytest.mark.parametrize("name", ["high", "medium", "low"])
def test_names_are_those_of_the_recorded_readings(name):
    recorded = load("sensors_biped")[f"names_{name}"].tolist()
    assert list(Apparatus.named(name, BIPED).names(BIPED)) == recorded


def test_a_worm_touches_and_moves_everywhere_and_looks_ahead():
    names = Apparatus.named("high", WORM).names(WORM)
    assert names[:4] == ("v0_0_area", "v0_0_touch", "v0_0_vel_x", "v0_0_vel_y")
    assert names[-3:] == ("v6_0_lidar_0", "v6_0_lidar_1", "v6_0_lidar_2")


@pytest.mark.parametrize(
    ("shape", "sensing"),
    [
        ("worm-7x1", {"v2_0", "v3_0", "v4_0"}),
        ("worm-6x1", {"v1_0", "v2_0", "v3_0"}),
        ("worm-2x1", {"v0_0", "v1_0"}),
        ("box-1x4", {"v0_2", "v0_3"}),
        ("T-3x2", {"v1_0", "v0_1", "v1_1", "v2_1"}),
    ],
)
def test_where_the_low_apparatus_has_sensors(shape, sensing):
    morphology = Morphology.of(shape)
    names = Apparatus.named("low", morphology).names(morphology)
    assert set(names) == {f"{voxel}_area" for voxel in sensing}


def test_kinds_label_each_reading_for_rule_sharing():
    apparatus = Apparatus.named("high", BIPED)
    kinds = dict(zip(apparatus.names(BIPED), apparatus.kinds, strict=True))
    assert len(apparatus.kinds) == apparatus.n_readings == 29
    assert {name: kinds[name] for name in ("v0_0_area", "v3_0_touch", "v0_2_vel_y")} == {
        "v0_0_area": "area",
        "v3_0_touch": "touch",
        "v0_2_vel_y": "velocity",
    }
    assert apparatus.kinds.count("lidar") == 9


def test_lidar_angles_are_a_choice():
    apparatus = Apparatus.named("high", WORM, lidar_angles=(-30, 0, 30, 60))
    assert apparatus.n_readings == 32
    assert apparatus.sensors[-1][-1] == Sensor("lidar", angles=(-30.0, 0.0, 30.0, 60.0))
    assert Sensor("lidar").angles == (-45.0, 0.0, 45.0)


def test_defaults_are_the_papers():
    assert (Sensor("touch").interval, Sensor("velocity").interval) == (0.25, 0.5)
    assert (Sensor("area").interval, Sensor("lidar").range) == (0.0, 10.0)
    assert [Sensor(kind).n_readings for kind in ("area", "touch", "velocity", "lidar")] == [
        *(1, 1, 2, 3)
    ]


def test_of_takes_names_apparatus_and_none():
    two = Morphology.of("box-2x1")
    own = Apparatus(((Sensor("lidar", angles=[0]), Sensor("area")), (Sensor("touch", 0.1),)))
    assert Apparatus.of(own, two) is own
    assert own.names(two) == ("v0_0_area", "v0_0_lidar_0", "v1_0_touch")
    assert Apparatus.of("high", two) == Apparatus.named("high", two)
    assert Apparatus.of(None, two).n_readings == 0


def test_wrong_apparatus_are_refused():
    with pytest.raises(ValueError, match="one of low, medium, high, got 'huge'"):
        Apparatus.of("huge", BIPED)
    with pytest.raises(ValueError, match="each of the 7 voxels of worm-7x1, got 10"):
        Apparatus.of(Apparatus.named("low", BIPED), WORM)
    with pytest.raises(ValueError, match="at most one of a kind"):
        Apparatus(((Sensor("area"), Sensor("area")),))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"kind": "sonar"}, "kind in area, touch, velocity, lidar, got 'sonar'"),
        ({"kind": "area", "interval": 0.5}, "area sensor: expected interval none"),
        ({"kind": "touch", "interval": 0.0}, "touch sensor: expected interval > 0 s"),
        ({"kind": "velocity", "angles": (1,)}, "velocity sensor: expected no angles"),
        ({"kind": "lidar", "angles": ()}, "lidar sensor: expected at least one angle"),
        ({"kind": "lidar", "range": 0.0}, "lidar sensor: expected range > 0 m"),
    ],
)
def test_wrong_sensors_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        Sensor(**settings)
