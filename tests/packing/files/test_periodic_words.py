"""Periodic axes by the value of a key."""

import pytest

from porefv.packing.files.periodic_words import periodic_axes


@pytest.mark.parametrize(
    ("value", "axes"),
    [
        ("T T T", "xyz"), ("1 0 1", "xz"), ("pp ff fs", "x"), ("[true, false, false]", "x"), ("periodic", "xyz"),
        ("x and y", "xy"), ("F F F", ""), ("none", ""), ("non-periodic", ""), ("2 2", None), ("smooth", None),
    ],
)  # fmt: skip
def test_axes_of_a_value(value, axes):
    assert periodic_axes(value) == axes
