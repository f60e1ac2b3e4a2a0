"""What `fjr shape` writes: the shaped excitation, and the spectra before and after."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bla_analyzer.results.summary import ROUND_OFF, decibel
from fjr_interface.parameter_file import save_parameter_file
from fjr_kit.atomic import result_folder
from fjr_kit.figure_style import EVEN, EXCITED, ODD, STYLE, save

from ..campaign.plan import GROUPS
from .measured import MeasuredLevel
from .shape import Iteration

SHAPED = "excitation.yaml"
KINDS = (("excited", EXCITED, "o"), ("odd", ODD, "^"), ("even", EVEN, "s"))


def write_shaping(passes: Sequence[Iteration], out: Path) -> Path:
    """Write excitation.yaml and spectra.png/.pdf; return the path of the former.

    Raises:
        InputError: the folder cannot be written.
    """
    with result_folder(out, (SHAPED, "spectra.p[nd][gf]")) as folder, rc_context(STYLE):
        save(draw_spectra(passes[0].level, passes[-1].level), folder / "spectra")
        save_parameter_file(folder / SHAPED, passes[-1].campaign.values, GROUPS)
    return out / SHAPED


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
