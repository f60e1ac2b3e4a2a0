"""How large the gap is, and the parameters of what explains it, with their intervals."""

from __future__ import annotations

from fjr_kit.result_types import Number, OptionalNumber, ResultModel


class Estimate(ResultModel):
    """A parameter with its 95 % interval, in the unit that ends its name."""

    value: Number
    low: Number
    high: Number


class Gap(ResultModel):
    """A distance between rig and simulation, on the data of `Diagnosis.reported_on`.

    Attributes:
        nrmse_position: rms of y error over rms of y.
        nrmse_torque: rms of u error over rms of u.
        chi2_per_dof: mean squared line error of y over its noise variance.
    """

    nrmse_position: OptionalNumber
    nrmse_torque: OptionalNumber
    chi2_per_dof: OptionalNumber


class Gaps(ResultModel):
    """The gaps: as delivered, after the refit, after the effect, and of the noise alone."""

    nominal: Gap | None
    refit: Gap | None
    explained: Gap | None
    noise_floor: Gap | None


class Figure(ResultModel):
    """A figure with its 95 % interval, which is None where a single part was looked at."""

    value: Number
    low: OptionalNumber
    high: OptionalNumber


class StageFigures(ResultModel):
    """One figure at each stage, and the share of it that the effect closes.

    Attributes:
        nominal, refit, explained: of the simulation; None where it diverges.
        noise_floor: what noise alone leaves; None where that is not known.
        closed: 1 - (explained^2 - floor^2)/(refit^2 - floor^2); None without an effect, where the
            refit leaves nothing that differs from noise, where the effect brings the simulation no
            nearer, and for an effect that acts like noise.
    """

    nominal: Figure | None
    refit: Figure | None
    explained: Figure | None
    noise_floor: Figure | None
    closed: Figure | None


class GapFigures(ResultModel):
    """The gap with intervals, see `ledger` and `bla_gap` for what each figure is.

    Attributes:
        position: rms error over rms; None where torques were compared.
        torque: rms error over rms; None where no run has a torque.
        bla_sigma, distortion_db: of steady periods; None for records.
    """

    position: StageFigures | None = None
    torque: StageFigures | None = None
    bla_sigma: StageFigures | None = None
    distortion_db: StageFigures | None = None
