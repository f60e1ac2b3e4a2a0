"""Which M, P, amplitude and grid reach a target error, predicted from a pilot.

The variance of a BLA of M realizations and P periods is (s_NL^2 + s_n^2/P)/M, with the nonlinear
variance s_NL^2 of one realization and the noise variance s_n^2 of one period, both measured by the
pilot at each of its amplitudes. A grid of other spacing f0' at the same torque rms has lines of
power f0'/f0 times as strong: s_NL^2 relative to |G|^2 stays (distortion grows along), noise falls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bla_analyzer.bla.robust import confidence_radius, robust_bla
from fjr_kit.errors import InputError
from fjr_records.lines import local_mean

from .measured import MeasuredLevel, read_levels

SMOOTHING = 5
"""Neighbouring lines whose relative variances are averaged: those of one line are too uncertain."""
QUANTILE = 0.95
"""The target holds at this part of the lines of the band."""
LEAST_REALIZATIONS = 7
PERIOD_CHOICES = (2, 3, 4, 6, 8)
SPACINGS = (1.0, 2.0, 4.0, 5.0, 10.0)
"""Line spacings that are considered, relative to the pilot's."""
MOST_REALIZATIONS = 2000


@dataclass(frozen=True)
class Pilot:
    """What a pilot says about one amplitude.

    Attributes:
        amplitude_rad: rms over lines.
        frequency_hz: (F,).
        nonlinear, noise: (F,) variance of one realization, and of one period, over |G|^2, smoothed.
        settle_s: length of the discarded part.
        base_frequency_hz: f0.
        distortion: mean relative distortion, which tells how far the BLA is shifted.
    """

    amplitude_rad: float
    frequency_hz: np.ndarray
    nonlinear: np.ndarray
    noise: np.ndarray
    settle_s: float
    base_frequency_hz: float
    distortion: float


@dataclass(frozen=True)
class Proposal:
    """An experiment and what it is expected to give.

    Attributes:
        amplitude_rad: amplitude of each line on the pilot's grid at the same torque rms.
        realizations, periods: M and P.
        base_frequency_hz: line spacing f0.
        transient_periods: discarded periods.
        time_s: rig time.
        error_db: 95 % bound of the error of 20 log10|G| that holds at 95 % of the band's lines.
    """

    amplitude_rad: float
    realizations: int
    periods: int
    base_frequency_hz: float
    transient_periods: int
    time_s: float
    error_db: float


def read_pilots(folder: Path) -> list[Pilot]:
    """Return what the levels of a folder say at which the response is periodic.

    Raises:
        InputError: bad bags, or no such level.
    """
    pilots = [pilot_of(level) for level in read_levels(folder) if level.is_periodic]
    if not pilots:
        raise InputError(f"{folder}: the response is periodic at no level; record lower ones.")
    return pilots


def pilot_of(level: MeasuredLevel) -> Pilot:
    """Evaluate one level of a pilot.

    Raises:
        InputError: fewer than two realizations or periods, or a response that is not periodic.
    """
    periods = level.grid.periods
    if len(level.realizations) < 2 or periods < 2 or not level.is_periodic:
        raise InputError(
            "A pilot needs two or more realizations of two or more periods, and a response that is "
            "periodic; record it again, at a lower amplitude if it is not."
        )
    bla = robust_bla(level.spectra, level.lines.excited)
    relative = 1.0 / np.abs(bla.g) ** 2
    count = bla.realizations
    nonlinear = local_mean(np.maximum(bla.var_nonlinear, 0.0) * relative, SMOOTHING)
    noise = local_mean(bla.var_noise * count * periods * relative, SMOOTHING)
    return Pilot(
        float(np.sqrt(np.mean(level.amplitudes_rad**2))),
        bla.frequency_hz,
        nonlinear,
        noise,
        level.grid.transient_periods * level.grid.samples_per_period / level.grid.sample_rate_hz,
        level.grid.sample_rate_hz / level.grid.samples_per_period,
        float(np.sqrt(nonlinear).mean()),
    )


def predicted_error_db(
    pilot: Pilot,
    realizations: int,
    periods: int,
    band_hz: tuple[float, float],
    spacing: float = 1.0,
) -> float:
    """Return the 95 % bound of the error of 20 log10|G| that 95 % of the band's lines keep.

    Args:
        pilot: at the amplitude asked for.
        realizations: M.
        periods: P.
        band_hz: lowest and highest frequency.
        spacing: line spacing relative to the pilot's, at the same torque rms.

    Raises:
        InputError: the band holds no line of the pilot.
    """
    chosen = (pilot.frequency_hz >= band_hz[0]) & (pilot.frequency_hz <= band_hz[1])
    if not chosen.any():
        raise InputError(
            f"The band {band_hz[0]:g} to {band_hz[1]:g} Hz holds no line of the pilot, which has "
            f"{pilot.frequency_hz[0]:g} to {pilot.frequency_hz[-1]:g} Hz; choose another band."
        )
    noise = pilot.noise[chosen] / (periods * spacing)
    variance = (pilot.nonlinear[chosen] + noise) / realizations
    radius = confidence_radius(variance, realizations - 1)
    return error_db(radius)


def error_db(relative_radius: np.ndarray) -> float:
    """Return the error in dB that QUANTILE of lines with these 95 % radii over |G| keep."""
    worst = 20.0 * np.log10(1.0 + relative_radius)
    return float(np.quantile(worst, QUANTILE))


def propose(
    pilots: Sequence[Pilot],
    target_db: float,
    band_hz: tuple[float, float],
    rig_time_s: float,
    *,
    resolution_hz: float | None = None,
) -> Proposal:
    """Return the quickest experiment that reaches a target, or the best one within the rig time.

    The amplitude is that of the pilot with the least distortion, which is also where the BLA is
    nearest to the linear plant; a stronger one could be quicker but measures another plant.

    Args:
        pilots: one for each amplitude of the pilot bags.
        target_db: 95 % bound of the error that 95 % of the band's lines shall keep.
        band_hz: lowest and highest frequency.
        rig_time_s: time that the rig can be used.
        resolution_hz: coarsest line spacing allowed; None for the pilot's.

    Raises:
        InputError: no experiment fits into the rig time.
    """
    pilot = min(pilots, key=lambda one: one.distortion)
    coarsest = max(resolution_hz or pilot.base_frequency_hz, pilot.base_frequency_hz)
    found = []
    for spacing in SPACINGS:
        base = pilot.base_frequency_hz * spacing
        if base > coarsest * (1.0 + 1e-9):
            break
        for periods in PERIOD_CHOICES:
            found += _candidates(pilot, target_db, band_hz, rig_time_s, spacing, periods)
    if not found:
        raise InputError(
            f"No experiment of {LEAST_REALIZATIONS} realizations fits into {rig_time_s:g} s; give "
            "more rig time or a coarser resolution."
        )
    reached = [one for one in found if one.error_db <= target_db]
    if reached:
        return min(reached, key=lambda one: one.time_s)
    return min(found, key=lambda one: one.error_db)


def _candidates(
    pilot: Pilot,
    target_db: float,
    band_hz: tuple[float, float],
    rig_time_s: float,
    spacing: float,
    periods: int,
) -> list[Proposal]:
    """Return the fewest realizations that reach the target, or the most that the time allows."""
    base = pilot.base_frequency_hz * spacing
    transient = int(np.ceil(pilot.settle_s * base - 1e-9))
    each_s = (periods + transient) / base
    most = min(int(rig_time_s / each_s), MOST_REALIZATIONS)
    if most < LEAST_REALIZATIONS:
        return []

    def error(count: int) -> float:
        return predicted_error_db(pilot, count, periods, band_hz, spacing)

    low, high = LEAST_REALIZATIONS, most
    while low < high:  # the error falls with M
        middle = (low + high) // 2
        low, high = (low, middle) if error(middle) <= target_db else (middle + 1, high)
    amplitude = pilot.amplitude_rad * np.sqrt(spacing)
    return [Proposal(amplitude, low, periods, base, transient, low * each_s, error(low))]
