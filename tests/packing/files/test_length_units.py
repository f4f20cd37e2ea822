"""Units of length and their case."""

import pytest

from porefv.packing.files.length_units import metres


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("mm", 1e-3), ("MM", 1e-3), ("Mm", None), ("Millimetres", 1e-3), ("in", 0.0254), ("Inch", 0.0254), ("Å", 1e-10),
        ("Angstrom", 1e-10), ("µm", 1e-6), ("Micron", 1e-6), ("m", 1.0), ("px", None), ("", None),
    ],
)  # fmt: skip
def test_the_case_of_a_symbol_matters_and_that_of_a_word_does_not(name, size):
    assert metres(name) == size
