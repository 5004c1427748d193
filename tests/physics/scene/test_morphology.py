import numpy as np
import pytest

from physics.scene.morphology import Morphology
from tests.reference import joint_order


def drawing(shape):
    return ["".join(".#"[int(cell)] for cell in row) for row in shape.grid]


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("box-3x2", ["###", "###"]),
        ("worm-7x1", ["#######"]),
        ("biped-4x3", ["####", "####", "#..#"]),
        ("biped-3x4", ["###", "###", "..#", "..#"]),
        ("tripod-5x2", ["#####", "#.#.#"]),
        ("tripod-6x3", ["######", "######", "#..#.#"]),
        ("biped-5x3", ["#####", "#####", "#..##"]),
        ("biped-8x2", ["########", "##....##"]),
        ("comb-5x3", ["#####", "#####", "#.#.#"]),
        ("comb-4x2", ["####", "#.#."]),
        ("T-5x3", ["#####", "..#..", "..#.."]),
        ("T-4x2", ["####", ".##."]),
        ("ball-1", ["#"]),
        ("ball-3", ["###", "###", "###"]),
        ("ball-5", [".###.", "#####", "#####", "#####", ".###."]),
    ],
)
def test_named_shapes(name, rows):
    shape = Morphology.from_name(name)
    assert drawing(shape) == rows
    assert shape.name == name
    assert (shape.height, shape.width) == (len(rows), len(rows[0]))


def test_voxels_go_row_by_row_from_the_bottom():
    shape = Morphology.from_name("biped-4x3")
    assert shape.cells == (
        *((0, 0), (3, 0)),
        *((0, 1), (1, 1), (2, 1), (3, 1)),
        *((0, 2), (1, 2), (2, 2), (3, 2)),
    )
    assert shape.n_voxels == 10
    assert shape.voxel_names[:3] == ("v0_0", "v3_0", "v0_1")


@pytest.mark.parametrize("name", ["box-2x1", "box-2x2", "worm-7x1", "biped-4x3"])
def test_welds_are_the_recorded_ones(name):
    recorded = [(one, two) for kind, one, two, *_ in joint_order(name) if kind == "weld"]
    assert sorted(Morphology.from_name(name).welds) == sorted(recorded)


def test_welds_go_voxel_by_voxel_left_then_below():
    # Voxels: 0 and 1 below, 2 and 3 above. Squares: 0 NW, 1 NE, 2 SE, 3 SW.
    assert Morphology.from_name("box-2x2").welds == (
        *((4, 1), (7, 2)),  # 1 to its left neighbour 0
        *((11, 0), (10, 1)),  # 2 to 0 below
        *((12, 9), (15, 10), (15, 4), (14, 5)),  # 3 to 2 on its left, then to 1 below
    )


def test_grids_may_be_lists_arrays_and_bools():
    rows = [[0, 1, 0], [1, 1, 1]]
    for grid in (rows, np.array(rows), np.array(rows, float), np.array(rows, bool)):
        shape = Morphology.from_grid(grid)
        assert drawing(shape) == [".#.", "###"]
        assert shape.name == "custom-3x2"


def test_empty_margins_are_cut_off():
    shape = Morphology.from_grid([[0, 0, 0], [0, 1, 1], [0, 0, 0]], name="two")
    assert drawing(shape) == ["##"]
    assert shape.cells == ((0, 0), (1, 0))
    assert shape.name == "two"


def test_of_takes_anything_that_stands_for_a_shape():
    shape = Morphology.of("box-2x2")
    assert Morphology.of(shape) is shape
    assert Morphology.of([[1, 1], [1, 1]]).cells == shape.cells


def test_a_shape_cannot_be_changed():
    grid = np.ones((2, 2), bool)
    shape = Morphology.from_grid(grid)
    grid[0, 0] = False
    assert shape.n_voxels == 4
    with pytest.raises(ValueError, match="read-only"):
        shape.grid[0, 0] = False


@pytest.mark.parametrize(
    ("grid", "message"),
    [
        ([1, 1], "expected a 2-D 0/1 array, top row first, got 1 dim"),
        ([[1, 1], [1]], "rows of equal length"),
        ([[1, 2]], "0 .empty. and 1 .voxel. only"),
        ([["1", "0"]], "0 .empty. and 1 .voxel. only"),
        ([[float("nan")]], "0 .empty. and 1 .voxel. only"),
        ([[0, 0]], "at least one voxel"),
        ([[]], "at least one voxel"),
        ([[1, 0], [0, 1]], "joined side to side, got custom-2x2 with 1 voxel"),
    ],
)
def test_odd_grids_are_refused(grid, message):
    with pytest.raises(ValueError, match=message):
        Morphology.from_grid(grid)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("bipod-4x3", "expected one of box-WxH, worm-WxH.* got 'bipod-4x3'"),
        ("biped", "expected one of"),
        ("biped-0x3", "expected one of"),
        ("biped-4x3x2", "expected one of"),
        ("biped-4x3\n", "expected one of"),
        ("biped-\u0664x3", "expected one of"),  # another script's four
        ("biped-4", "expected biped-WxH"),
        ("ball-3x3", "expected ball-D"),
        ("biped-2x3", "biped needs at least 3x2"),
        ("tripod-5x1", "tripod needs at least 5x2"),
    ],
)
def test_unknown_names_are_refused(name, message):
    with pytest.raises(ValueError, match=message):
        Morphology.of(name)
