"""What comments and lines before the header of a table state: units, and periodic boundaries."""

import numpy as np
import pytest

from porefv.errors import InputError

ROWS = "1,2,3,4\n5,6,7,8\n"


@pytest.mark.parametrize(
    "line",
    [
        "# units mm", "# Units: mm, kg, s", "# units = mm (millimetres)", "# unit of length: mm", "# distance unit: mm",
        "# length unit [mm]", "# lengths in mm", "# all lengths are in mm", "# dimensions in millimetres",
        "## units = mm", "# [mm]", "# mm", "# Unit: mm.", '# units = "mm"', "  # units = mm", "Units: mm",
        "% units = mm", "// units = mm", "; units = mm", "! units = mm", "Length unit,mm", "Units,mm,,", "Unit\tmm",
        "All lengths in mm", "# made by hand, units = mm", "# beads units = mm", "# UnitLength = mm", "# mm mm mm mm",
    ],
)  # fmt: skip
def test_a_unit_in_words_is_converted(read, line):
    packing = read(f"# box_lower = 0 0 0\n# box_upper = 9 9 9\n{line}\nx,y,z,r\n{ROWS}")
    np.testing.assert_allclose(packing.radii, [0.004, 0.008], rtol=1e-15)
    np.testing.assert_allclose(packing.box.upper, 0.009, rtol=1e-15)


@pytest.mark.parametrize(
    "line",
    [
        "# voxel size = 5 um", "# scale = 1e-3", "# lengthscale: 1 mm", "# coordinates: mm", "# x y z radius in mm",
        "# grains of 3 mm", "# units: mm, m/s", "# units = Mm", "# lengths in Mm", "# velocity units = mm/s",
        "# lengths in voxels", "# radius unit: mm", "# length_scale 1e-3", "# spacing = 5e-6",
        "# lengths in units of the diameter", "Voxel size,5,um",
    ],
)  # fmt: skip
def test_words_about_lengths_that_are_not_understood_need_a_scale(read, line):
    content = f"{line}\n{ROWS}" if line == "# x y z radius in mm" else f"{line}\nx,y,z,r\n{ROWS}"
    with pytest.raises(InputError, match=r"grains.csv, line 1: .* scale"):
        read(content)
    np.testing.assert_array_equal(read(content, scale=0.5).radii, [2, 4])


@pytest.mark.parametrize(
    "line",
    ["# made in a minute", "# volume = 3 mm3", "# stiffness_ratio = 0.5", "# units differ", "# units = m", "# k = 2 m"],
)
def test_other_comments_state_no_unit_but_the_metre(read, line):
    assert read(f"{line}\nx,y,z,r\n{ROWS}").radii[0] == 4


def test_statements_must_agree(read):
    with pytest.raises(InputError, match="line 2: the unit is 'cm', and .*line 1 states 'mm'"):
        read(f"# units = mm\n# lengths in cm\nx,y,z,r\n{ROWS}")
    assert read(f"# units = mm\n# voxel size = 5 um\nx,y,z,r\n{ROWS}").radii[0] == 0.004  # the first is clear


@pytest.mark.parametrize(
    ("line", "axes"),
    [
        ("# periodic = true", "x, y, z"), ("# periodic: xy", "x, y"), ("# boundary = periodic", "x, y, z"),
        ("# pbc = T F T", "x, z"), ("#PERIODIC 1 1 1", "x, y, z"), ("# box_periodic = 0 0 1", "z"),
        ("# periodicity = 1 1 1", "x, y, z"), ("# a periodic packing", "x, y, z"), ("Boundary: pp ff ff", "x"),
        ("# isPeriodic = 1", "x, y, z"), ("# periodic_y = true", "y"),
        ("# PERIODIC:: 1 1 1", "x, y, z"), ("## PERIODIC:: 1 1 1", "x, y, z"),
    ],
)  # fmt: skip
def test_periodic_boundaries_in_words_are_refused_or_ignored(read, line, axes):
    content = f"{line}\nx,y,z,r\n{ROWS}"
    with pytest.raises(InputError, match=f'line 1: the packing is periodic along {axes} .*periodic = "ignore"'):
        read(content)
    packing = read(content, periodic="ignore")
    assert packing.reading.periodicity.startswith(f"periodic along {axes} ")
    assert packing.metadata == {}


@pytest.mark.parametrize(
    "line",
    [
        "# periodic = false",
        "# pbc = F F F",
        "# non-periodic",
        "# non_periodic",
        "# periodic_x = 0",
        "# boundary = fixed",
        "# boundary layer",
        "# periodicity: none",
    ],
)
def test_walls_in_words_are_walls(read, line):
    assert read(f"{line}\nx,y,z,r\n{ROWS}").reading.periodicity == ""
