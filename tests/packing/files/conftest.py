"""What the tests of packing files share."""

import re

import pytest

from porefv.errors import InputError


@pytest.fixture
def error(read):
    """The error of reading a file with this content, by the module's own `read`; without the directory and the name."""

    def reader(content):
        with pytest.raises(InputError) as caught:
            read(content)
        return re.split(r"grains\.\w+", str(caught.value), maxsplit=1)[1]

    return reader
