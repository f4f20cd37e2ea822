"""Tables of numbers as CSV files read back to the last bit, and what is not such a file is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from porefv.errors import InputError
from porefv.results.csv_table import read_csv, write_csv

COLUMNS = {"id": int, "size": float, "other": float}
ROWS = st.lists(st.tuples(st.integers(-(2**62), 2**62), st.floats(allow_infinity=False), st.floats()), max_size=20)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return tmp_path_factory.mktemp("table") / "table.csv"


@given(ROWS)
def test_any_numbers_read_back_to_the_last_bit(path, rows):
    table = np.array(rows, dtype=list(COLUMNS.items()))
    write_csv(table, path)
    found = read_csv(path, COLUMNS)
    for name in COLUMNS:
        np.testing.assert_array_equal(found[name], table[name])


def test_what_is_not_known_is_an_empty_cell(path):
    write_csv(np.array([(3, np.nan, 0.1)], dtype=list(COLUMNS.items())), path)
    assert path.read_text() == "id,size,other\n3,,0.1\n"


@given(st.text(max_size=60))
def test_any_other_text_is_refused_with_the_name_of_the_file(path, text):
    path.write_text(f"id,size\n{text}\n", encoding="utf-8", errors="replace")
    with pytest.raises(InputError, match=r"table\.csv is damaged: .*Solve again"):
        read_csv(path, COLUMNS)


@pytest.mark.parametrize("line", ["1,2", "1,2,3,4", ",1.0,2.0", "1.5,1.0,2.0", "x,1.0,2.0", "9" * 30 + ",1.0,2.0"])
def test_a_line_that_has_not_one_number_for_each_column_is_refused(path, line):
    path.write_text(f"id,size,other\n{line}\n")
    with pytest.raises(InputError, match="is damaged"):
        read_csv(path, COLUMNS)


def test_what_is_no_text_is_refused(path):
    path.write_bytes(b"id,size,other\n\xff\xfe\n")
    with pytest.raises(InputError, match="is damaged"):
        read_csv(path, COLUMNS)
