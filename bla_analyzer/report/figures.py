"""Figures for papers, PNG and PDF: one set for each level and one over all levels."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fjr_kit.figure_style import (
    EVEN,
    EXCITED,
    NOISE,
    NONLINEAR,
    ODD,
    RADIUS,
    STYLE,
    Style,
    frequency_axis,
    legend,
    model_styles,
    save,
    stacked_axes,
)
from fjr_kit.number_text import SIGMA

from ..results.result import BlaEstimate, LevelResult, LineLevels, Result
from ..results.summary import (
    bla_phase_deg,
    decibel,
    level_name,
    magnitude_band_db,
    phase_deg,
    phase_reach_deg,
    shown_signals,
    signal_at,
    significant,
    total_distortion,
)
from .figures_loop import BAND, draw_loop, draw_nyquist
from .figures_overview import draw_checks, draw_levels

Draw = Callable[[], Figure]


def write_figures(
    result: Result, folder: Path, progress: Callable[[str], None] | None = None
) -> None:
    """Draw all figures of a result into `folder` (which exists), each as PNG and PDF."""
    with rc_context(STYLE):
        for name, draw in _figures(result):
            if progress is not None:
                progress(f"figure {name}")
            save(draw(), folder / name)


def _figures(result: Result) -> Iterator[tuple[str, Draw]]:
    """Yield the name and the drawing of every figure of the result."""
    for level in result.levels:
        stem = f"level_{level.level}"
        if level.bla is not None:
            yield f"{stem}_bla", partial(draw_bla, level, level.bla)
            yield f"{stem}_loop", partial(draw_loop, level, level.bla)
            yield f"{stem}_nyquist", partial(draw_nyquist, level, level.bla)
        if level.excited.frequency_hz.size:
            yield f"{stem}_spectra", partial(draw_spectra, level)
            yield f"{stem}_distortion", partial(draw_distortion, level)
    if len(result.levels) > 1:
        yield "levels", partial(draw_levels, result)
    if result.checks:
        yield "checks", partial(draw_checks, result)


def draw_bla(level: LevelResult, bla: BlaEstimate) -> Figure:
    """Draw magnitude (dB) and phase of the BLA with its uncertainties and the models."""
    figure, axes = stacked_axes(2, 4.6, f"BLA, {level_name(level)}", (2.2, 1))
    magnitude, phase = axes
    f = bla.frequency_hz
    turn = bla_phase_deg(level, bla)
    reach = phase_reach_deg(bla.g, bla.radius_95)
    band: Style = {"color": EXCITED, "alpha": BAND, "lw": 0, "zorder": 1.5}
    if np.isfinite(bla.radius_95).any():
        ends = magnitude_band_db(bla.g, bla.radius_95)
        magnitude.fill_between(f, *ends, label="95 % band", **band)
        phase.fill_between(f, turn - reach, turn + reach, **band)
    _draw_bla_points(magnitude, bla, decibel(bla.g))
    _draw_bla_points(phase, bla, turn)
    for comparison, (colour, dash) in zip(level.comparisons, model_styles(), strict=False):
        line: Style = {"color": colour, "ls": dash, "lw": 0.9, "zorder": 3}
        label = f"{comparison.name}\nV = {comparison.v_mean:.3g} dB²"
        magnitude.plot(f, decibel(comparison.g0), label=label, **line)
        phase.plot(f, phase_deg(comparison.g0), **line)
    _draw_uncertainties(magnitude, bla)
    if bla.link is not None:
        link: Style = {"color": EVEN, "marker": "s", "ls": "", "ms": 2}
        magnitude.plot(f, decibel(bla.link.g), label="BLA,\nlink position", **link)
        radius: Style = {"color": RADIUS, "ls": ":", "label": "95 % disc,\nlink position"}
        if np.isfinite(bla.link.radius_95).any():
            magnitude.plot(f, decibel(bla.link.radius_95), **radius)
        phase.plot(f, phase_deg(bla.link.g), **link)
    magnitude.set_ylabel("magnitude (dB re 1 rad/(N m))")
    phase.set_ylabel("phase (degrees)")
    frequency_axis(axes, f)
    legend(magnitude)
    return figure


def _draw_bla_points(axis: Axes, bla: BlaEstimate, values: np.ndarray) -> None:
    """Draw the BLA; hollow where the line is unreliable."""
    style: Style = {"marker": "o", "ls": "", "color": EXCITED, "zorder": 4}
    good, bad = bla.reliable, ~bla.reliable
    if good.any():
        axis.plot(bla.frequency_hz[good], values[good], label="BLA", **style)
    if bad.any():
        style |= {"mfc": "white", "mew": 0.7, "label": f"BLA, unreliable\n({bad.sum()} lines)"}
        axis.plot(bla.frequency_hz[bad], values[bad], **style)


def _draw_uncertainties(axis: Axes, bla: BlaEstimate) -> None:
    """Draw disc radius, noise and nonlinear standard deviation; unknown ones are left out."""
    f = bla.frequency_hz
    if np.isfinite(bla.radius_95).any():
        axis.plot(f, decibel(bla.radius_95), "-", color=RADIUS, label="radius of the 95 % disc")
    if np.isfinite(bla.var_nonlinear).any():
        keep = significant(bla)
        sigma = decibel(np.sqrt(bla.var_nonlinear[keep]))
        label = (
            f"{SIGMA} nonlinear,\none realization\n(significant at {keep.sum()}\nof {len(f)} lines)"
        )
        axis.plot(f[keep], sigma, "D", ms=2.2, color=NONLINEAR, label=label)
    if np.isfinite(bla.var_noise).any():
        axis.plot(
            f, decibel(np.sqrt(bla.var_noise)), "-", color=NOISE, label=f"{SIGMA} noise of the BLA"
        )


def draw_spectra(level: LevelResult) -> Figure:
    """Draw reference, torque and position at excited, odd and even lines (paper Figs. 5, 7-9)."""
    rows = shown_signals(level)
    count = len(rows)
    figure, axes = stacked_axes(count, 2.0 * count, f"Spectra, {level_name(level)}", (1,) * count)
    for axis, (name, unit) in zip(axes, rows, strict=True):
        for lines, label, style in _kinds(level):
            values = decibel(signal_at(level, lines, name))
            if np.isfinite(values).any():
                axis.plot(lines.frequency_hz, values, label=label, **style)
        axis.set_ylabel(f"{name} (dB re 1 {unit})")
    _draw_noise(axes[-1], (level.excited,))
    frequency_axis(axes, level.excited.frequency_hz)
    legend(axes[0], *axes[1:])
    return figure


def _kinds(level: LevelResult) -> tuple[tuple[LineLevels, str, Style], ...]:
    """Return lines, label and style of each kind of line; excited ones lie on top."""
    excited: Style = {"color": EXCITED, "marker": "o", "ls": "", "zorder": 4}
    odd: Style = {"color": ODD, "marker": "^", "ls": "", "zorder": 3}
    even: Style = {"color": EVEN, "marker": "s", "ls": "", "zorder": 2, "ms": 2}
    return (
        (level.excited, "excited lines", excited),
        (level.odd, "odd detection lines", odd),
        (level.even, "even lines", even),
    )


def _draw_noise(axis: Axes, kinds: tuple[LineLevels, ...]) -> None:
    """Draw the noise at the given kinds of lines."""
    frequency = np.concatenate([lines.frequency_hz for lines in kinds])
    noise = np.concatenate([lines.noise for lines in kinds])
    if np.isfinite(noise).any():
        style: Style = {"marker": ".", "ls": "", "ms": 1.5, "zorder": 1.8}
        axis.plot(frequency, decibel(noise), color=NOISE, label=f"noise ({SIGMA})", **style)


def draw_distortion(level: LevelResult) -> Figure:
    """Draw the output: linear part, odd and even distortion (corrected in closed loop), noise."""
    figure, [axis] = stacked_axes(1, 3.2, f"Output distortion, {level_name(level)}", (1,))
    excited, *detection = _kinds(level)
    f = level.excited.frequency_hz
    axis.plot(f, decibel(level.excited.position), label=excited[1], **excited[2])
    for lines, label, style in detection:
        if len(lines.frequency_hz):
            name = f"{label.split()[0]} distortion\n(mean over neighbours)"
            axis.plot(lines.frequency_hz, decibel(lines.corrected), **(style | {"alpha": 0.35}))
            smooth: Style = {"color": style["color"], "zorder": style["zorder"] + 1.5}
            axis.plot(lines.frequency_hz, decibel(lines.smoothed), label=name, **smooth)
    total = decibel(total_distortion(level))
    if np.isfinite(total).any():
        name = "distortion and noise\nat excited lines"
        axis.plot(f, total, "D", ms=2.2, color=NONLINEAR, label=name)
    _draw_noise(axis, (level.excited, level.odd, level.even))
    axis.set_ylabel("position (dB re 1 rad)")
    frequency_axis([axis], f)
    legend(axis)
    return figure
