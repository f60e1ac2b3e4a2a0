"""Palette, axes and saving that all figures share.

A colour (and a marker) means the same in every figure and in the report; the palette is that of
Okabe and Ito, which colour-blind readers can tell apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

EXCITED, ODD, EVEN, NOISE = "#0072B2", "#D55E00", "#009E73", "#7A7F87"
NONLINEAR, RADIUS = "#CC79A7", "#56B4E9"
MODELS = (("#000000", "-"), ("#E69F00", "--"), ("#000000", ":"), ("#E69F00", "-."))

STYLE: Any = {
    "font.family": "STIXGeneral",
    "font.size": 9,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "grid.color": "#E3E5E8",
    "grid.linewidth": 0.5,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "legend.handlelength": 1.6,
    "legend.labelspacing": 0.6,
    "lines.linewidth": 1.1,
    "lines.markersize": 2.6,
    "figure.dpi": 200,
    "pdf.fonttype": 42,
    "text.parse_math": False,
}
WIDTH_IN = 6.3

Style = dict[str, Any]


def save(figure: Figure, stem: Path) -> None:
    """Write PNG and PDF; no date in them, so that the same result gives the same files."""
    FigureCanvasAgg(figure).print_png(stem.with_suffix(".png"))
    FigureCanvasPdf(figure).print_pdf(stem.with_suffix(".pdf"), metadata={"CreationDate": None})


def stacked_axes(
    rows: int, height_in: float, title: str, ratios: tuple[float, ...], bottom_in: float = 0.44
) -> tuple[Figure, list[Axes]]:
    """Return a figure and stacked axes: a common frequency axis, room for a legend at the right."""
    figure = Figure(figsize=(WIDTH_IN, height_in))
    figure.text(0.1, 1.0 - 0.14 / height_in, title, va="center", fontsize=11)
    grid = figure.add_gridspec(
        rows,
        1,
        height_ratios=ratios,
        left=0.1,
        right=0.755,
        bottom=bottom_in / height_in,
        top=1.0 - 0.32 / height_in,
        hspace=0.12,
    )
    first = figure.add_subplot(grid[0])
    rest = [figure.add_subplot(grid[i], sharex=first) for i in range(1, rows)]
    return figure, [first, *rest]


def frequency_axis(axes: list[Axes], frequency_hz: np.ndarray) -> None:
    """Scale the common frequency axis: logarithmic if it spans more than a decade."""
    low, high = frequency_hz.min(), frequency_hz.max()
    if low > 0 and high > 10 * low:
        log_axis(axes[-1], low / 1.1, high * 1.1)
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False, which="both")
    axes[-1].set_xlabel("frequency (Hz)")


def log_axis(axis: Axes, low: float, high: float) -> None:
    """Make x logarithmic from `low` to `high`, with plain numbers at the ticks.

    Two decades or less hold one power of ten or two, so that 2 and 5 have numbers as well.
    """
    plain = FuncFormatter(lambda x, _: f"{x:g}")
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0,)))
    axis.xaxis.set_major_formatter(plain)
    axis.xaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
    axis.xaxis.set_minor_formatter(plain if high <= 100 * low else NullFormatter())
    longer = rcParams["xtick.major.size"] - rcParams["xtick.minor.size"]
    axis.tick_params(axis="x", which="minor", pad=rcParams["xtick.major.pad"] + longer)
    axis.set_xlim(low, high)


def log_values(axis: Axes) -> None:
    """Make y logarithmic with plain numbers at the ticks."""
    axis.set_yscale("log")
    plain_values(axis)


def plain_values(axis: Axes) -> None:
    """Write plain numbers at the greater ticks of y; the style draws no formulas."""
    axis.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    axis.yaxis.set_minor_formatter(NullFormatter())


def legend(axis: Axes, *others: Axes) -> None:
    """Put a legend right of `axis`, with what is drawn there and in `others`, each label once."""
    entries: dict[str, Artist] = {}
    for source in (axis, *others):
        for handle, label in zip(*source.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    place: dict[str, Any] = {
        "loc": "upper left",
        "bbox_to_anchor": (1.01, 1.02),
        "borderaxespad": 0,
    }
    axis.legend(list(entries.values()), list(entries), **place)


def model_styles() -> Iterator[tuple[str, str]]:
    """Return colour and dash of the models, in their order, over and over."""
    return cycle(MODELS)
