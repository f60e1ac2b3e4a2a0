"""Figures over a whole result: all levels together, and the checks of the data."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fjr_kit.check import Check
from fjr_kit.figure_style import (
    EVEN,
    EXCITED,
    NOISE,
    ODD,
    WIDTH_IN,
    Style,
    frequency_axis,
    legend,
    log_axis,
    model_styles,
    stacked_axes,
)

from ..results.result import Result
from ..results.summary import (
    amplitudes_rad,
    decibel,
    level_name,
    magnitude_band_db,
    summarize,
    v_by_model,
)

PASSED, FAILED = "#0072B2", "#D55E00"
SMALLEST_RATIO = 1e-3
"""Ratios of a check's value to its limit are drawn no smaller than this."""


def draw_levels(result: Result) -> Figure:
    """Draw the BLA of all levels, and V and distortion against amplitude (paper Fig. 4).

    Without a reference no amplitude is known, and the BLA stands alone.
    """
    played = bool(np.isfinite(amplitudes_rad(result)).any())
    height, below = (5.4, {"bottom_in": 2.85}) if played else (3.2, {})
    figure, [top] = stacked_axes(1, height, "All levels", (1,), **below)
    for level, shade in zip(result.levels, _shades(len(result.levels)), strict=True):
        if level.bla is not None:
            ends = magnitude_band_db(level.bla.g, level.bla.radius_95)
            top.fill_between(level.bla.frequency_hz, *ends, color=shade, alpha=0.25, lw=0)
            line: Style = {"color": shade, "label": level_name(level)}
            top.plot(level.bla.frequency_hz, decibel(level.bla.g), "-", **line)
    top.set_ylabel("BLA (dB re 1 rad/(N m))")
    frequency_axis([top], result.levels[0].excited.frequency_hz)
    legend(top)
    if not played:
        return figure
    left = figure.add_axes((0.1, 0.085, 0.265, 0.32))
    right = figure.add_axes((0.49, 0.085, 0.265, 0.32))
    _draw_v(left, result)
    _draw_distortion(right, result)
    return figure


def _shades(count: int) -> list[tuple[float, ...]]:
    """Return `count` shades from light to dark of the colour of the excited lines."""
    dark, base, light = np.array([[0, 38, 77], [0, 114, 178], [146, 204, 236]]) / 255.0
    at = np.linspace(0.0, 1.0, count)[:, None]
    shades = np.where(
        at < 0.5, light + 2 * at * (base - light), base + (2 * at - 1) * (dark - base)
    )
    return [tuple(shade) for shade in shades.tolist()]


def _draw_v(axis: Axes, result: Result) -> None:
    """Draw V (mean over lines) of every model against amplitude."""
    found = v_by_model(result)
    amplitude = amplitudes_rad(result)
    for (name, v), (colour, dash) in zip(found.items(), model_styles(), strict=False):
        axis.plot(amplitude, v, dash, marker="o", color=colour, label=name)
    axis.set_ylabel("V (dB²)", labelpad=2)
    axis.set_ylim(bottom=0)
    _amplitude_axis(axis, amplitude)
    if found:
        axis.legend(loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0.2, ncol=2)


def _draw_distortion(axis: Axes, result: Result) -> None:
    """Draw the mean power at each kind of line against amplitude."""
    amplitude = amplitudes_rad(result)
    numbers = [summarize(level) for level in result.levels]
    for name, colour, marker in (
        ("linear", EXCITED, "o"),
        ("odd", ODD, "^"),
        ("even", EVEN, "s"),
        ("noise", NOISE, "."),
    ):
        values = [getattr(number, f"{name}_db") for number in numbers]
        if np.isfinite(values).any():
            label = "excited lines" if name == "linear" else name
            axis.plot(amplitude, values, "-", marker=marker, color=colour, label=label)
    axis.set_ylabel("mean power (dB re 1 rad)", labelpad=2)
    _amplitude_axis(axis, amplitude)
    axis.legend(loc="upper left", bbox_to_anchor=(1.02, 1.02), borderaxespad=0)


def _amplitude_axis(axis: Axes, amplitude: np.ndarray) -> None:
    axis.set_xlabel("amplitude of a line (rad, rms)")
    if amplitude.min() > 0 and amplitude.max() > 3 * amplitude.min():
        log_axis(axis, amplitude.min() / 1.2, amplitude.max() * 1.2)


def draw_checks(result: Result) -> Figure:
    """Draw the worst value of each check at each level as a fraction of its limit."""
    worst = _worst(result.checks)
    height = 0.75 + 0.2 * len(worst)
    figure = Figure(figsize=(WIDTH_IN, height))
    axis = figure.add_axes((0.3, 0.42 / height, 0.62, 1.0 - 0.75 / height))
    ratios = np.array([_ratio(check) for check in worst.values()])
    rows = np.arange(len(worst))
    for passed, colour, marker in ((True, PASSED, "o"), (False, FAILED, "X")):
        chosen = np.array([check.passed is passed for check in worst.values()])
        label = "passed" if passed else "failed"
        if chosen.any():
            axis.plot(ratios[chosen], rows[chosen], marker, color=colour, ms=5, label=label)
    axis.axvline(1.0, color="black", lw=0.8)
    axis.set(yticks=rows, yticklabels=list(worst), ylim=(len(worst) - 0.4, -0.6))
    log_axis(axis, min(ratios.min(), 0.1) / 2, max(ratios.max(), 1.0) * 2)
    axis.set_xlabel(f"worst value / limit (smaller ones are drawn at {SMALLEST_RATIO:g})")
    axis.legend(loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.2, ncol=2)
    figure.text(0.02, 1 - 0.14 / height, "Checks of the data", va="center", fontsize=11)
    return figure


def _worst(checks: tuple[Check, ...]) -> dict[str, Check]:
    """Return the worst check of each name and level, over the realizations; failed ones first."""
    worst: dict[str, Check] = {}
    for check in checks:
        place = "" if check.level is None else f", level {check.level}"
        known = worst.setdefault(f"{check.name}{place}", check)
        if (check.passed, -_ratio(check)) < (known.passed, -_ratio(known)):
            worst[f"{check.name}{place}"] = check
    return dict(sorted(worst.items(), key=lambda item: item[1].passed))


def _ratio(check: Check) -> float:
    """Return value over limit, kept drawable on a logarithmic axis; an unknown one counts as 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = float(np.divide(check.value, check.limit))
    return float(np.clip(np.nan_to_num(ratio, nan=1.0), SMALLEST_RATIO, 1.0 / SMALLEST_RATIO))
