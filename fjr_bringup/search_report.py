"""What `fjr amplitude` says and what `fjr shape` writes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bla_analyzer.figure_style import EVEN, EXCITED, ODD, STYLE, save
from bla_analyzer.summary import ROUND_OFF, decibel
from fjr_interface.errors import InputError
from fjr_interface.parameter_file import save_parameter_file

from .amplitude import Limits, Search
from .campaign import GROUPS
from .measured import MeasuredLevel, read_levels
from .shape import Iteration

KINDS = (("excited", EXCITED, "o"), ("odd", ODD, "^"), ("even", EVEN, "s"))


def bag_levels(folder: Path) -> list[tuple[float, MeasuredLevel]]:
    """Return the levels of a folder by their amplitude (rms over lines, rad), ascending.

    Raises:
        InputError: bad bags, fewer than three levels, or levels of one realization.
    """
    levels = read_levels(folder)
    if len(levels) < 3:
        raise InputError(
            f"{folder}: holds {len(levels)} levels, but three or more show where distortion is "
            "least; record more amplitudes."
        )
    if min(len(level.realizations) for level in levels) < 2:
        raise InputError(f"{folder}: each level needs two or more realizations; record more.")
    rated = [(float(np.sqrt(np.mean(level.amplitudes_rad**2))), level) for level in levels]
    return sorted(rated, key=lambda pair: pair[0])


def within(
    levels: Sequence[tuple[float, MeasuredLevel]], limits: Limits
) -> list[tuple[float, MeasuredLevel]]:
    """Return the levels whose measured peaks keep the limits.

    Raises:
        InputError: fewer than three are left.
    """
    kept = [(amplitude, level) for amplitude, level in levels if limits.allow(level)]
    if len(kept) < 3:
        raise InputError(
            f"Only {len(kept)} of {len(levels)} levels keep the torque and position limits, but "
            "three or more show where distortion is least; record lower amplitudes."
        )
    return kept


def amplitude_sentences(found: Search) -> Iterator[str]:
    """Return what a search found, line by line; the last one is the answer."""
    yield "amplitude (rad)  relative distortion"
    for amplitude, value in zip(found.amplitudes_rad, found.values, strict=True):
        yield f"{amplitude:15.4g}  {value:.4g}"
    for name, other in found.others_rad.items():
        if math.isfinite(other):
            yield f"By {name}: {other:.3g} rad."
    yield f"The measurement ended at {found.ended_by}."
    low, high = found.interval_rad
    answer = f"Best amplitude of a line: {found.best_rad:.3g} rad (95 %: {low:.3g} to {high:.3g})."
    if not found.bracketed:
        side = "falling" if np.argmin(found.values) > 0 else "rising"
        answer += f" Distortion is still {side} there: the true optimum lies beyond."
    yield answer


def write_shaping(passes: Sequence[Iteration], out: Path) -> Path:
    """Write excitation.yaml and spectra.png/.pdf; return the path of the former.

    Raises:
        InputError: the folder cannot be written.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{out} cannot be made: {error.strerror}.") from None
    with rc_context(STYLE):
        save(draw_spectra(passes[0].level, passes[-1].level), out / "spectra")
    file = out / "excitation.yaml"
    save_parameter_file(file, passes[-1].campaign.values, GROUPS)
    return file


def draw_spectra(before: MeasuredLevel, after: MeasuredLevel) -> Figure:
    """Draw reference and torque spectra before and after shaping (paper Fig. 5)."""
    figure = Figure(figsize=(6.3, 4.6))
    axes = figure.subplots(2, 2, sharex=True)
    for row, (level, when) in enumerate(((before, "before"), (after, "after"))):
        for column, (signal, unit) in enumerate((("reference", "rad"), ("torque", "N m"))):
            _draw(axes[row, column], level, signal)
            letter = "abcd"[2 * row + column]
            axes[row, column].set_title(f"({letter}) {signal} {when} (dB re 1 {unit})", fontsize=9)
    for axis in axes[1]:
        axis.set_xlabel("frequency (Hz)")
    axes[0, 1].legend(loc="center right", fontsize=7)
    figure.tight_layout()
    return figure


def line_spectra(level: MeasuredLevel, signal: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return (frequency in Hz, dB) of the first realization's lines by kind.

    Lines of the reference that are mere round-off are NaN.
    """
    spectra = level.spectra[0]
    amplitude = np.abs(getattr(spectra, signal))
    floor = ROUND_OFF * amplitude.max() if signal == "reference" else 0.0
    kinds = {}
    for kind, _, _ in KINDS:
        lines = getattr(level.lines, kind)
        seen = np.where(amplitude[lines] > floor, amplitude[lines], np.nan)
        kinds[kind] = (spectra.frequency_hz[lines], decibel(seen))
    return kinds


def _draw(axis: Axes, level: MeasuredLevel, signal: str) -> None:
    names = {"excited": "excited odd", "odd": "non-excited odd", "even": "non-excited even"}
    spectra = line_spectra(level, signal)
    for kind, colour, marker in reversed(KINDS):
        frequency, values = spectra[kind]
        if np.isfinite(values).any():
            axis.plot(frequency, values, marker, color=colour, ms=2, label=names[kind])
