"""Logarithmic axes of figures have plain numbers: the style draws no formulas."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from fjr_kit.figure_style import STYLE, frequency_axis, log_axis, log_values, stacked_axes


def written(axis) -> list[str]:
    FigureCanvasAgg(axis.figure).draw()
    labels = [*axis.get_xticklabels(which="both"), *axis.get_yticklabels(which="both")]
    return [label.get_text() for label in labels if label.get_text()]


@pytest.mark.parametrize("scaled", [lambda axis: log_axis(axis, 0.5, 24.0), log_values])
def test_ticks_of_logarithmic_axes_are_plain_numbers(scaled):
    with mpl.rc_context(STYLE):
        axis = Figure().add_subplot()
        axis.plot([0.6, 20.0], [0.03, 400.0])
        scaled(axis)
        texts = written(axis)
    assert "10" in texts and not any("$" in text for text in texts), texts


@pytest.mark.parametrize(("high", "also"), [(249.0, {"20", "50", "200"}), (2490.0, set())])
def test_two_decades_or_less_have_numbers_between_the_powers_of_ten(high, also):
    with mpl.rc_context(STYLE):
        axis = Figure().add_subplot()
        axis.set_yticks([])
        log_axis(axis, 13.0, high)
        shown = set(written(axis))
    assert shown & {"20", "50", "200"} == also and "100" in shown


def test_numbers_stand_below_the_last_of_stacked_axes_only_and_on_one_line():
    with mpl.rc_context(STYLE):
        _, axes = stacked_axes(2, 4.0, "t", (1, 1))
        for axis in axes:
            axis.set_yticks([])
        frequency_axis(axes, np.array([13.0, 249.0]))
        assert written(axes[0]) == [] and {"20", "100"} <= set(written(axes[1]))
        ticks = [label for label in axes[1].get_xticklabels(which="both") if label.get_text()]
        tops = [label.get_window_extent().y1 for label in ticks]
    assert max(tops) - min(tops) < 1.0


def test_the_bare_scale_would_show_a_formula():
    with mpl.rc_context(STYLE):
        axis = Figure().add_subplot()
        axis.plot([0.6, 20.0], [0.03, 400.0])
        axis.set_yscale("log")
        assert any("$" in text for text in written(axis))
