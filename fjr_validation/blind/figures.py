"""Figures of a blind check: what is named by how far it shows; whether what is present is there."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fjr_kit.figure_style import EVEN, EXCITED, ODD, STYLE, WIDTH_IN, legend, log_axis, save

from .answers import WORLDS, World
from .outcome import CLEAR, Outcome
from .score import rate

_LOOKS = dict(zip(WORLDS, ((EXCITED, "o"), (ODD, "s"), (EVEN, "D")), strict=True))
_SIZES = (0.0, 1.5, 3.0, 4.5, 7.0, 12.0, np.inf)
_LAST_SIZE = 20.0
_PRESENT = (0.0, 0.2, 0.5, 0.8, 0.9, 0.95, 1.0)
_HEIGHT_IN = 2.6


def draw_all(outcomes: Sequence[Outcome], folder: Path) -> None:
    """Draw all figures of one method's outcomes into a folder, PNG and PDF."""
    with mpl.rc_context(STYLE):
        _named(outcomes, folder / "named")
        _present(outcomes, folder / "present")


def _figure() -> tuple[Figure, Axes]:
    figure = Figure(figsize=(WIDTH_IN, _HEIGHT_IN))
    return figure, figure.add_axes((0.1, 0.44 / _HEIGHT_IN, 0.7, 1.0 - 0.7 / _HEIGHT_IN))


def _points(axis: Axes, world: World, pairs: Sequence[tuple[float, bool]],
            edges: Sequence[float]) -> None:  # fmt: skip
    """Draw the share of hits in each bin with its interval, at the mean of the bin."""
    colour, marker = _LOOKS[world]
    x, y, bars = [], [], []
    for low, high in itertools.pairwise(edges):
        last = high == edges[-1]
        inside = [(at, hit) for at, hit in pairs if low <= at and (last or at < high)]
        if not inside:
            continue
        share = rate(hit for _, hit in inside)
        value, bottom, top = (float(part or 0.0) for part in (share.value, share.low, share.high))
        x.append(min(float(np.mean([at for at, _ in inside])), _LAST_SIZE))
        y.append(value)
        bars.append((value - bottom, top - value))
    if x:
        axis.errorbar(x, y, np.transpose(bars), color=colour, marker=marker, capsize=2,
                      label=f"{world} ({len(pairs)})")  # fmt: skip


def _named(outcomes: Sequence[Outcome], stem: Path) -> None:
    """Draw the share of dominant causes that are named over how far they show."""
    figure, axis = _figure()
    for world in WORLDS:
        pairs = [
            (cause.relative if world == "closed" else cause.over_remainder or 0.0, o.found(cause))
            for o in outcomes
            if o.answer.world == world
            for cause in o.asked
        ]
        _points(axis, world, pairs, _SIZES)
    axis.axvline(CLEAR, color="0.6", linewidth=0.8, linestyle="--")
    log_axis(axis, min(0.5, 0.8 * axis.dataLim.minposx), 1.2 * _LAST_SIZE)
    axis.set_ylim(-0.02, 1.02)
    axis.set_xlabel("shows, over detection limit (closed) or remainder")
    axis.set_ylabel("share named")
    axis.set_title("Dominant causes that are named, with numbers of causes", loc="left")
    _finish(figure, axis, stem)


def _present(outcomes: Sequence[Outcome], stem: Path) -> None:
    """Draw the share of right claims over how surely they are said to be present."""
    figure, axis = _figure()
    for world in WORLDS:
        pairs = [
            (claim.present, o.is_right(claim))
            for o in outcomes
            if o.answer.world == world
            for claim in o.claims
        ]
        _points(axis, world, pairs, _PRESENT)
    axis.plot([0.0, 1.0], [0.0, 1.0], color="0.6", linewidth=0.8, linestyle="--")
    axis.set_xlim(-0.02, 1.02)
    axis.set_ylim(-0.02, 1.02)
    axis.set_xlabel("present, as stated")
    axis.set_ylabel("share that is there")
    axis.set_title("Is what is said to be present there? with numbers of claims", loc="left")
    _finish(figure, axis, stem)


def _finish(figure: Figure, axis: Axes, stem: Path) -> None:
    if axis.get_legend_handles_labels()[0]:
        legend(axis)
    else:
        axis.text(0.5, 0.5, "no case to show", ha="center", transform=axis.transAxes)
    save(figure, stem)
