"""What the tests of packing files share."""

import re

import pytest

from porefv.errors import InputError
from porefv.packing.packing import Packing


@pytest.fixture
def read(tmp_path):
    """Read a file of this name, with this content."""

    def reader(content, name="grains.csv", **options):
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        return Packing.read(tmp_path / name, **options)

    return reader


@pytest.fixture
def error(read):
    """The error of reading a file with this content, by `read`; without the directory and the name."""

    def reader(content):
        with pytest.raises(InputError) as caught:
            read(content)
        return re.split(r"grains\.\w+", str(caught.value), maxsplit=1)[1]

    return reader
