"""Metadata as comments: what is written says the same of the spheres when it is read."""

import numpy as np
import pytest

from porefv.errors import InputError
from porefv.packing.packing import Packing


@pytest.mark.parametrize("extension", ["csv", "txt"])
def test_metadata_that_names_a_unit_changes_no_length(tmp_path, extension):
    packing = Packing([[1, 2, 3]], [0.5], metadata={"origin": "glass beads of 3 mm"})
    packing.write(tmp_path / f"a.{extension}")
    again = Packing.read(tmp_path / f"a.{extension}")
    np.testing.assert_array_equal(again.radii, [0.5])


@pytest.mark.parametrize("metadata", [{"units": "mm"}, {"periodic": "true"}])
def test_metadata_that_would_be_read_as_a_statement_are_refused(tmp_path, metadata):
    with pytest.raises(InputError, match="would be read as a statement about the spheres"):
        Packing([[1, 2, 3]], [0.5], metadata=metadata).write(tmp_path / "a.csv")
    assert not (tmp_path / "a.csv").exists()


def test_a_unit_that_was_converted_is_not_stated_again(tmp_path):
    (tmp_path / "a.csv").write_text("# units = mm\n# made_by = hand\nx,y,z,r\n1,2,3,4\n")
    packing = Packing.read(tmp_path / "a.csv")
    assert packing.metadata == {"made_by": "hand"}
    packing.write(tmp_path / "b.csv")
    np.testing.assert_array_equal(Packing.read(tmp_path / "b.csv").radii, packing.radii)
