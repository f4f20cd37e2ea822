import numpy as np
import pytest

from porefv.errors import InputError
from porefv.flow.walls import Wall, Walls
from porefv.packing.box import WALLS


def test_walls_are_impervious_and_drag_unless_said_otherwise():
    walls = Walls()
    assert np.isnan(walls.pressures).all() and not walls.slip.any() and walls.axis is None


@pytest.mark.parametrize("axis", "xyz")
def test_along_an_axis_the_lower_wall_has_the_drop_and_the_upper_none(axis):
    walls = Walls.along(axis, 3.0, slip=True)
    k = "xyz".index(axis)
    expected = np.full(6, np.nan)
    expected[2 * k : 2 * k + 2] = 3.0, 0.0
    np.testing.assert_array_equal(walls.pressures, expected)
    np.testing.assert_array_equal(walls.slip, np.isnan(expected))  # the lateral ones
    assert walls.axis == k


def test_along_an_unknown_axis_is_refused():
    with pytest.raises(InputError, match="axis must be"):
        Walls.along("w")


def test_walls_stand_in_the_order_of_their_names():
    walls = Walls(**{name: Wall(pressure=float(k)) for k, name in enumerate(WALLS)})
    np.testing.assert_array_equal(walls.pressures, np.arange(6.0))
    assert [wall.pressure for wall in walls] == list(range(6))


@pytest.mark.parametrize(
    ("pressures", "axis"),
    [
        ({"x_min": 1, "x_max": 0}, 0),
        ({"z_min": 1, "z_max": 1}, 2),
        ({"y_min": 1}, None),
        ({"x_min": 1, "y_max": 0}, None),
        ({"x_min": 1, "x_max": 0, "y_max": 0}, None),
        ({"x_min": 1, "x_max": 0, "y_min": 0, "y_max": 0}, None),
    ],
)
def test_the_axis_is_that_of_the_one_pair_of_opposite_pressure_walls(pressures, axis):
    assert Walls(**{name: Wall(pressure=p) for name, p in pressures.items()}).axis == axis


def test_lateral_stands_for_all_walls_not_named():
    walls = Walls.from_mapping(
        {"y_min": {"pressure": 2}, "y_max": {"pressure": 0.5}, "x_max": {"slip": False}, "lateral": {"slip": True}}
    )
    np.testing.assert_array_equal(walls.slip, [True, False, False, False, True, True])
    np.testing.assert_array_equal(walls.pressures[2:4], [2.0, 0.5])


def test_no_mapping_means_plain_walls():
    assert Walls.from_mapping({}) == Walls()


@pytest.mark.parametrize(
    ("mapping", "said"),
    [
        ({"top": {"pressure": 1.0}}, "unknown wall 'top'.*x_min"),
        ({"y_min": 1.0}, "wall y_min: expected a table"),
        ({"y_min": {"presure": 1.0}}, "wall y_min: unknown key 'presure'"),
        ({"y_min": {"pressure": "high"}}, "wall y_min: .*must be a number"),
        ({"y_min": {"pressure": True}}, "wall y_min: .*must be a number"),
        ({"y_min": {"pressure": float("nan")}}, "wall y_min: .*finite"),
        ({"y_min": {"pressure": float("inf")}}, "wall y_min: .*finite"),
        ({"x_min": {"slip": 1}}, "wall x_min: .*true or false"),
        ({"lateral": {"pressure": 1.0}}, "lateral: .*wall by wall"),
    ],
)
def test_bad_walls_are_refused_by_name(mapping, said):
    with pytest.raises(InputError, match=said):
        Walls.from_mapping(mapping)
