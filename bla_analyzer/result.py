"""The result of an analysis: plain values, so that all outputs (JSON, CSV, figures) read the same.

Spectra are scaled so that |X| is the peak amplitude of a line (2/N times the DFT; 1/N at DC).
G is motor torque -> motor position in rad/(N m); its variances are in (rad/(N m))^2.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

Method = Literal["robust", "fast"]


@dataclass(frozen=True)
class Check:
    """The outcome of one test of the data.

    Attributes:
        name: identifier, such as periodicity, transient, input_snr.
        level: level index; None if it concerns all.
        realization: realization index; None if it concerns all of a level.
        passed: whether the data passed.
        value: the measured figure.
        limit: the figure that it must not exceed.
        sentence: what was found, for a person.
    """

    name: str
    level: int | None
    realization: int | None
    passed: bool
    value: float
    limit: float
    sentence: str


@dataclass(frozen=True)
class BlaEstimate:
    """BLA at the F excited lines, with variances (paper.md robust and fast method).

    Attributes:
        method: robust (over realizations) or fast (one realization, detection lines).
        realizations: M.
        periods: P kept in each realization.
        frequency_hz: (F,).
        g: complex (F,), G_BLA = Y/U of the reference-phased means.
        var_total: (F,) variance of g from nonlinearity and noise together.
        var_noise: (F,) variance of g from noise alone; NaN where P = 1.
        var_nonlinear: (F,) signed stochastic nonlinear variance of ONE realization,
            M (var_total - var_noise); NaN where unknown.
        nonlinear_p_value: (F,) p-value of var_total/var_noise against F(2(M-1), 2M(P-1)); fast
            method: power of Yc over noise at the K nearest odd detection lines against
            F(2K, 2K(P-1)); NaN where unknown.
        radius_95: (F,) radius of the 95 % confidence disc of g.
        input_relative_variance: (F,) Var(U)/|U|^2 of the mean torque spectrum.
        reliable: bool (F,), False where Var(U)/|U|^2 is not small.
    """

    method: Method
    realizations: int
    periods: int
    frequency_hz: np.ndarray
    g: np.ndarray
    var_total: np.ndarray
    var_noise: np.ndarray
    var_nonlinear: np.ndarray
    nonlinear_p_value: np.ndarray
    radius_95: np.ndarray
    input_relative_variance: np.ndarray
    reliable: np.ndarray


@dataclass(frozen=True)
class LineLevels:
    """Spectral levels at one kind of line: K lines, power averaged over realizations.

    Attributes:
        frequency_hz: (K,).
        reference, torque, position: (K,) rms over realizations of |R|, |U|, |Y|.
        corrected: (K,) rms over realizations of |Yc|, Yc = Y - G U in closed loop (rad); at
            excited lines this is Y itself.
        smoothed: (K,) square root of `corrected` power averaged over neighbouring lines.
        noise: (K,) standard deviation of `corrected` that noise alone explains, of the mean over
            periods of one realization; NaN where P = 1.
    """

    frequency_hz: np.ndarray
    reference: np.ndarray
    torque: np.ndarray
    position: np.ndarray
    corrected: np.ndarray
    smoothed: np.ndarray
    noise: np.ndarray


@dataclass(frozen=True)
class Comparison:
    """Distance of the BLA from a reference model, paper eq. 14 in dB^2.

    Attributes:
        name: name of the model, such as G0_viscous.
        description: what it is, one line.
        g0: complex (F,) model at the excited lines (rad/(N m)).
        v_mean, v_median: V over all excited lines, and its variant with the median.
        v_mean_above_1hz, v_median_above_1hz: the same without the lines below 1 Hz (NaN if none
            is left).
    """

    name: str
    description: str
    g0: np.ndarray
    v_mean: float
    v_median: float
    v_mean_above_1hz: float
    v_median_above_1hz: float


@dataclass(frozen=True)
class TimeSignals:
    """The last period of the first realization of a level, for plots: arrays of shape (N,)."""

    time_s: np.ndarray
    reference_rad: np.ndarray
    torque_nm: np.ndarray
    position_rad: np.ndarray


@dataclass(frozen=True)
class LevelResult:
    """Everything about one excitation level.

    Attributes:
        level: index of the level.
        amplitude_rad: amplitude of each excited line, (F,).
        bla: the BLA by the method asked for; None if the data allow none (not periodic, say).
        excited, odd, even: levels by kind of line (odd and even detection lines; may be empty).
        comparisons: distances from reference models.
        signals: time signals for plots.
        reference_rms_rad, torque_rms_nm, position_rms_rad: rms over all kept periods.
        torque_peak_nm, position_peak_rad: greatest magnitude over all kept periods.
    """

    level: int
    amplitude_rad: np.ndarray
    bla: BlaEstimate | None
    excited: LineLevels
    odd: LineLevels
    even: LineLevels
    comparisons: tuple[Comparison, ...]
    signals: TimeSignals
    reference_rms_rad: float
    torque_rms_nm: float
    position_rms_rad: float
    torque_peak_nm: float
    position_peak_rad: float


@dataclass(frozen=True)
class Result:
    """The whole analysis of one experiment folder.

    Attributes:
        source: the folder as the user gave it.
        sample_rate_hz: rate of the samples.
        samples_per_period: N.
        periods: P kept.
        transient_periods: discarded periods.
        described: whether the bags held an experiment description; if not, everything above was
            found in the reference itself.
        bags: names of the bags in the order (level, realization).
        levels: one entry each level.
        checks: all checks, passed and failed.
        notes: sentences that a reader must see.
        controller: description of the controller, if known.
    """

    source: str
    sample_rate_hz: float
    samples_per_period: int
    periods: int
    transient_periods: int
    described: bool
    bags: tuple[str, ...]
    levels: tuple[LevelResult, ...]
    checks: tuple[Check, ...] = ()
    notes: tuple[str, ...] = ()
    controller: dict | None = field(default=None)
