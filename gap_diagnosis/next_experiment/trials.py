"""Feasible experiments beyond the recorded one: other references, or a rig that is loaded."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from excitation_node.multisine import one_period
from fjr_records.periodic import RecordedExperiment

from ..model.rig_model import Model

SETUP_S = 600.0
"""Time that a change of the rig's mechanics costs."""
_REALIZATIONS = 2


@dataclass(frozen=True)
class Trial:
    """One experiment that could be run next, on the recorded grid.

    Attributes:
        kind: what to do.
        description: one sentence for the lab.
        settings: numbers to set, with their unit in the name.
        periods_rad: one period of r for each realization, (n, N), without offset.
        offset_rad: constant part of r, reached by a smooth rise over the first period.
        lines: how many DFT lines the response is looked at, DC included.
        inertia: relative inertia added to the link (to the axis, if it is rigid).
        load_nm: torque of a weight on a horizontal arm of the link.
    """

    kind: str
    description: str
    settings: Mapping[str, float]
    periods_rad: np.ndarray
    lines: int
    offset_rad: float = 0.0
    inertia: float = 0.0
    load_nm: float = 0.0

    def references(self, periods: int) -> np.ndarray:
        """Return r from rest over some periods, the rise included, float64 (n, periods * N)."""
        samples = self.periods_rad.shape[1]
        rise = np.ones(periods * samples)
        rise[:samples] = 0.5 - 0.5 * np.cos(np.pi * np.arange(samples) / samples)
        return np.tile(self.periods_rad, periods) + self.offset_rad * rise

    def loaded(self, model: Model) -> Model:
        """Return a model with what the trial adds to the rig."""
        plant, effects = dict(model.plant), dict(model.effects)
        body = "j" if model.link_moves else "jm"
        plant[body] *= 1.0 + self.inertia
        if self.load_nm:
            there = effects.get("gravity.torque_nm", 0.0) * cmath.exp(
                1j * effects.get("gravity.angle_rad", 0.0)
            )
            size, angle = cmath.polar(there + self.load_nm * cmath.exp(0.5j * math.pi))
            effects |= {"gravity.torque_nm": size, "gravity.angle_rad": angle}
        return replace(model, plant=plant, effects=effects)

    @property
    def setup_s(self) -> float:
        """Time to prepare the rig (s)."""
        return SETUP_S if self.inertia or self.load_nm else 0.0


def trials(recorded: RecordedExperiment, rigid: bool = False) -> list[Trial]:
    """Return all trials for a rig, by what it has already done.

    Args:
        recorded: the experiment so far; its references are known.
        rigid: whether the axis is rigid, so that nothing can be hung on a link.
    """
    base = _Base.of(recorded)
    found = [*_amplitudes(base), *_offsets(base), *_triangles(base), _higher_band(base)]
    return found + ([_added_inertia(base)] if rigid else [_added_inertia(base), _static_load(base)])


@dataclass(frozen=True)
class _Base:
    """What the trials vary: periods of the lowest and highest level (n, N), and their sizes."""

    low: np.ndarray
    high: np.ndarray
    low_rad: float
    high_rad: float
    lines: int
    recorded: RecordedExperiment = field(repr=False)

    @classmethod
    def of(cls, recorded: RecordedExperiment) -> _Base:
        amplitudes = recorded.amplitudes_rad
        rows = [int(np.argmin(amplitudes)), int(np.argmax(amplitudes))]
        low, high = (_periods(recorded, recorded.levels[row]) for row in rows)
        low_rad, high_rad = (float(amplitudes[row]) for row in rows)
        return cls(low, high, low_rad, high_rad, recorded.lines, recorded)


def _periods(recorded: RecordedExperiment, level: int) -> np.ndarray:
    members = [r.played[-1] for r in recorded.realizations if r.level == level]
    return np.array(members[:_REALIZATIONS])


def _amplitudes(base: _Base) -> Iterator[Trial]:
    for factor, periods, size in (
        (0.1, base.low, base.low_rad),
        (0.3, base.low, base.low_rad),
        (2.0, base.high, base.high_rad),
    ):
        level = factor * size
        yield Trial(
            "amplitude",
            f"Record one level more, of {level:.2g} rad per line, {factor:g} times the "
            f"{'lowest' if factor < 1 else 'highest'} one.",
            {"amplitude_rad": level},
            factor * periods,
            base.lines,
        )


def _offsets(base: _Base) -> Iterator[Trial]:
    for offset in (0.1, 0.3, 1.0):
        yield Trial(
            "dc_offset",
            f"Record the highest level about a position of {offset:g} rad: add it to the "
            "reference.",
            {"offset_rad": offset, "amplitude_rad": base.high_rad},
            base.high,
            base.lines,
            offset_rad=offset,
        )


def _triangles(base: _Base) -> Iterator[Trial]:
    description = base.recorded.experiment
    samples = description.samples_per_period
    time = np.arange(samples) / samples
    shape = 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * time))
    duration = samples / description.sample_rate_hz
    peak = float(np.abs(base.high).max())
    for kind, travel in (("slow_triangle", peak), ("constant_velocity", max(1.0, 3.0 * peak))):
        speed = 4.0 * travel / duration
        yield Trial(
            kind,
            f"Play a triangle of {travel:.2g} rad and {duration:g} s as the reference: "
            f"{speed:.2g} rad/s to and fro.",
            {"travel_rad": travel, "period_s": duration, "velocity_rad_s": speed},
            np.array([travel * shape] * len(base.high)),
            base.lines,
        )


def _higher_band(base: _Base) -> Trial:
    description = base.recorded.experiment
    old = max(description.excited_harmonics)
    top = min(3 * old, description.samples_per_period // 3)
    lines = np.array([k for k in range(old + 1, top + 1) if k % 2 == 1 and k % 3])
    phases = np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, (len(base.high), lines.size))
    periods = [
        one_period(lines, np.full(lines.size, base.high_rad), row, description.samples_per_period)
        for row in phases
    ]
    f0 = description.base_frequency_hz
    return Trial(
        "higher_band",
        f"Excite odd lines from {lines[0] * f0:g} to {lines[-1] * f0:g} Hz at "
        f"{base.high_rad:.2g} rad per line.",
        {
            "f_min_hz": float(lines[0] * f0),
            "f_max_hz": float(lines[-1] * f0),
            "amplitude_rad": base.high_rad,
        },
        np.array(periods),
        top + 1,
    )


def _added_inertia(base: _Base) -> Trial:
    return Trial(
        "added_inertia",
        "Mount half the link's inertia more on the link and record all again, in a folder of its "
        "own with j raised in the nominal file.",
        {"relative_inertia": 0.5},
        base.high,
        base.lines,
        inertia=0.5,
    )


def _static_load(base: _Base) -> Trial:
    peak = max(float(np.abs(r.torque).max()) for r in base.recorded.realizations)
    load = 0.1 * peak
    return Trial(
        "static_load",
        f"Hang a weight of {load:.2g} N m on a horizontal arm of the link and record the highest "
        "level again.",
        {"load_nm": load},
        base.high,
        base.lines,
        load_nm=load,
    )
