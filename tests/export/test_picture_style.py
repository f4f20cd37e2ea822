import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from porefv.export.picture_style import (
    FONTS,
    Colours,
    in_unit,
    label_in_unit,
    new_figure,
    round_length,
    style,
    unit_for,
)


@pytest.mark.parametrize(("most", "unit", "name"), [
    (1000.0, "Pa", "kPa"), (999.0, "Pa", "Pa"), (1.0, "m", "m"), (0.0999, "m", "mm"), (3e-6, "m", "µm"),
    (0.0014, "N", "mN"), (2e-7, "m³/s", "mm³/s"), (2e-4, "m³/s", "cm³/s"), (0.03, "m/s", "mm/s"), (0.0, "Pa", "Pa"),
])  # fmt: skip
def test_units_have_the_prefix_of_their_size(most, unit, name):
    assert unit_for(most, unit).name == name


@given(st.floats(1e-60, 1e60))
def test_values_in_their_unit_have_few_digits(most):
    scale = unit_for(most, "Pa")
    assert 0.999 <= most * scale.factor < 1000.1


@given(st.floats(1e-30, 1e30))
def test_round_lengths_are_between_two_fifths_and_all_of_the_most(most):
    length = round_length(most)
    assert 0.399 * most < length <= most * (1.0 + 1e-8)
    digit = length / 10.0 ** math.floor(math.log10(length) + 1e-9)
    assert min(abs(digit - step) for step in (1.0, 2.0, 5.0)) < 1e-9


def test_a_value_is_shown_with_its_unit():
    assert in_unit(6.449e-6, "m") == "6.45 µm"


@given(st.floats(-1e6, 1e6), st.floats(0.0, 1e6))
def test_ticks_of_a_scale_are_round(low, span):
    pytest.importorskip("matplotlib")
    scale = Colours.over("pressure", "Pa", low, low + span, "viridis")
    assert scale.high > scale.low
    assert np.isfinite(scale.of(np.array([low, low + span]))).all()


def test_the_scale_of_colours_names_its_unit_and_has_round_ticks():
    pytest.importorskip("matplotlib")
    with style():
        figure = new_figure()
        Colours.over("force on a grain", "N", 0.0, 0.00142, "YlOrRd").draw(figure.add_axes((0.5, 0.1, 0.05, 0.5)))
    axes = figure.axes[0]
    assert axes.get_title(loc="left") == "force on a grain, mN"
    ticks = [tick for tick in axes.get_yticks() if 0.0 <= tick <= 1.42]
    assert ticks == [0.0, 0.5, 1.0]


def test_an_axis_shows_its_numbers_in_a_unit_with_prefix():
    pytest.importorskip("matplotlib")
    with style():
        axes = new_figure().add_subplot()
        axes.plot([0.0, 6.0e-3], [0.0, 4500.0])
        label_in_unit(axes.yaxis, "pressure", 4500.0, "Pa", " (mean)")
        label_in_unit(axes.xaxis, "time", 6.0e-3, "s")
    assert axes.get_ylabel() == "pressure, kPa (mean)" and axes.get_xlabel() == "time, ms"
    shown = axes.yaxis.get_major_formatter()
    assert [shown(value, 0) for value in (0.0, 2500.0, 0.3)] == ["0", "2.5", "0.0003"]


def test_the_style_ends_with_its_block():
    matplotlib = pytest.importorskip("matplotlib")
    before = matplotlib.rcParams["font.size"]
    with style():
        assert matplotlib.rcParams["font.size"] == FONTS["font.size"]
    assert matplotlib.rcParams["font.size"] == before
