"""The result of an analysis, from which all outputs (JSON, CSV, figures) are made.

Spectra are scaled so that |X| is the peak amplitude of a line (2/N times the DFT; 1/N at DC).
G is motor torque -> motor position in rad/(N m); its variances are in (rad/(N m))^2.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from fjr_kit.check import Check
from fjr_kit.result_types import Array, Document, EqualArrays, FreeForm, Number, ResultModel, Unit
from fjr_records.realization import TimeSignals

Method = Literal["robust", "fast", "local"]
Excitation = Literal["periodic", "repeated", "arbitrary"]


class OutputBla(EqualArrays):
    """BLA from motor torque to one output, at the F excited lines.

    Attributes:
        g: complex (F,), G_BLA = Y/U of the reference-phased means.
        var_total: (F,) variance of g from nonlinearity and noise together.
        var_noise: (F,) variance of g from noise alone; NaN where P = 1.
        var_nonlinear: (F,) signed stochastic nonlinear variance of ONE realization,
            M (var_total - var_noise); NaN where unknown. Method local: of one run, as smooth as g.
        nonlinear_p_value: (F,) p-value of var_total/var_noise against F(2(M-1), 2M(P-1)); fast
            method: power of Yc over noise at the K nearest odd detection lines against
            F(2K, 2K(P-1)); NaN where unknown.
        radius_95: (F,) radius of the 95 % confidence disc of g.
        coherence: (F,) share of the power of Y in one realization that is G U; the rest is
            distortion and noise, the answer of the loop to them taken away. NaN where unknown.
    """

    g: Annotated[np.ndarray, Array("rad/(N m)", complex)]
    var_total: Annotated[np.ndarray, Array("(rad/(N m))^2")]
    var_noise: Annotated[np.ndarray, Array("(rad/(N m))^2")]
    var_nonlinear: Annotated[np.ndarray, Array("(rad/(N m))^2")]
    nonlinear_p_value: Annotated[np.ndarray, Array("1")]
    radius_95: Annotated[np.ndarray, Array("rad/(N m)")]
    coherence: Annotated[np.ndarray, Array("1")]


class LinkBla(OutputBla):
    """BLA of a second output, motor torque to link position, at the lines of the first one.

    Attributes:
        cov_total: complex (F,), covariance E{e_link e_motor*} of the errors of both estimates;
            with the two var_total it is their joint covariance.
        cov_noise: complex (F,), the part of it that is noise; NaN where P = 1.
    """

    cov_total: Annotated[np.ndarray, Array("(rad/(N m))^2", complex)]
    cov_noise: Annotated[np.ndarray, Array("(rad/(N m))^2", complex)]

    @classmethod
    def of(cls, bla: OutputBla, cov_total: np.ndarray, cov_noise: np.ndarray) -> LinkBla:
        """Return the estimate of the link position with its covariance with that of the motor's."""
        own = {name: getattr(bla, name) for name in OutputBla.model_fields}
        return cls(**own, cov_total=cov_total, cov_noise=cov_noise)


class Sensitivity(EqualArrays):
    """Response of the loop from reference to error, at the lines of the BLA.

    Attributes:
        s: complex (F,), (R - Y)/R; it is S = 1/(1 + G C) where the controller C acts on the error.
        s_radius_95: (F,) radius of its 95 % confidence disc; NaN where unknown.
    """

    s: Annotated[np.ndarray, Array("1", complex)]
    s_radius_95: Annotated[np.ndarray, Array("1")]


class BlaEstimate(OutputBla):
    """BLA of the motor position, with variances (paper.md robust and fast method).

    Attributes:
        method: robust (over realizations), fast (one realization, detection lines) or local (local
            polynomials over neighbouring lines, any excitation).
        realizations: M, how many references were played.
        periods: P, periods kept in each realization, or records that repeat a reference.
        frequency_hz: (F,).
        input_relative_variance: (F,) Var(U)/|U|^2 of the mean torque spectrum.
        reliable: bool (F,), False where Var(U)/|U|^2 is not small.
        link: BLA of the link position; None without a second encoder, or by the local method.
        sensitivity: of the loop; None without a reference, or where the controller does not act on
            the error alone.
    """

    method: Method
    realizations: Annotated[int, Unit("1")]
    periods: Annotated[int, Unit("1")]
    frequency_hz: Annotated[np.ndarray, Array("Hz")]
    input_relative_variance: Annotated[np.ndarray, Array("1")]
    reliable: Annotated[np.ndarray, Array("bool", bool)]
    link: LinkBla | None = None
    sensitivity: Sensitivity | None = None

    @model_validator(mode="after")
    def _parts_at_the_lines(self) -> BlaEstimate:
        if self.link is not None and self.link.g.size != self.g.size:
            raise ValueError(f"link: g must hold {self.g.size} values")
        if self.sensitivity is not None and self.sensitivity.s.size != self.g.size:
            raise ValueError(f"sensitivity: s must hold {self.g.size} values")
        return self


class LineLevels(EqualArrays):
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

    frequency_hz: Annotated[np.ndarray, Array("Hz")]
    reference: Annotated[np.ndarray, Array("rad")]
    torque: Annotated[np.ndarray, Array("N m")]
    position: Annotated[np.ndarray, Array("rad")]
    corrected: Annotated[np.ndarray, Array("rad")]
    smoothed: Annotated[np.ndarray, Array("rad")]
    noise: Annotated[np.ndarray, Array("rad")]


class Comparison(ResultModel):
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
    g0: Annotated[np.ndarray, Array("rad/(N m)", complex)]
    v_mean: Annotated[Number, Unit("dB^2")]
    v_median: Annotated[Number, Unit("dB^2")]
    v_mean_above_1hz: Annotated[Number, Unit("dB^2")]
    v_median_above_1hz: Annotated[Number, Unit("dB^2")]


class LevelResult(ResultModel):
    """Everything about one excitation level.

    Attributes:
        level: index of the level.
        amplitude_rad: amplitude of each excited line, (F,).
        bla: the BLA by the method asked for; None if the data allow none (not periodic, say).
        excited, odd, even: levels by kind of line (odd and even detection lines; may be empty).
        left_out_hz: (L,) frequencies of the estimate's grid at which the torque does not follow the
            reference beyond noise, so that nothing is known there; records only.
        comparisons: distances from reference models.
        signals: time signals for plots.
        reference_rms_rad, torque_rms_nm, position_rms_rad: rms over all kept periods.
        torque_peak_nm, position_peak_rad: greatest magnitude over all kept periods.
    """

    level: Annotated[int, Unit("1")]
    amplitude_rad: Annotated[np.ndarray, Array("rad")]
    bla: BlaEstimate | None
    excited: LineLevels
    odd: LineLevels
    even: LineLevels
    left_out_hz: Annotated[np.ndarray, Array("Hz")]
    comparisons: tuple[Comparison, ...]
    signals: TimeSignals
    reference_rms_rad: Annotated[Number, Unit("rad")]
    torque_rms_nm: Annotated[Number, Unit("N m")]
    position_rms_rad: Annotated[Number, Unit("rad")]
    torque_peak_nm: Annotated[Number, Unit("N m")]
    position_peak_rad: Annotated[Number, Unit("rad")]

    @model_validator(mode="after")
    def _models_at_the_lines(self) -> LevelResult:
        lines = None if self.bla is None else self.bla.g.size
        for model in self.comparisons:
            if lines is not None and model.g0.size != lines:
                raise ValueError(f"comparisons: {model.name}: g0 must hold {lines} values")
        return self


class Result(Document):
    """The whole analysis of one experiment folder.

    Attributes:
        source: the folder as the user gave it.
        sample_rate_hz: rate of the samples.
        excitation: periodic; or arbitrary, repeated where a reference was played again.
        samples_per_period: N; the samples of the longest record if it is not periodic.
        periods: P kept; 1 if not periodic.
        transient_periods: discarded periods.
        described: whether the bags held an experiment description; if not, everything above was
            found in the reference itself.
        bags: names of the bags in the order (level, realization).
        levels: one entry each level.
        checks: all checks, passed and failed.
        notes: sentences that a reader must see.
        controller: description of the controller, if known.
    """

    schema_name: Literal["fjr_rig/result/2"] = Field("fjr_rig/result/2", alias="schema")
    source: str
    excitation: Excitation
    sample_rate_hz: Annotated[Number, Unit("Hz")]
    samples_per_period: int
    periods: int
    transient_periods: int
    described: bool
    bags: tuple[str, ...]
    levels: tuple[LevelResult, ...]
    checks: tuple[Check, ...] = ()
    notes: tuple[str, ...] = ()
    controller: FreeForm | None = None


def load_result(path: str | Path) -> Result:
    """Read a result.json; raise InputError if it is missing or no result."""
    return Result.read(path)
