"""The outcome of a diagnosis: `diagnosis.json`, schema fjr_rig/diagnosis/1."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fjr_interface.errors import InputError
from fjr_interface.experiment import first_problem

Verdict = Literal[
    "no_gap",
    "parameters_only",
    "effect",
    "ambiguous",
    "unexplained",
    "nonstationary",
    "bad_data",
]
LineKind = Literal["excited", "odd", "even", "dc"]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", populate_by_name=True)


class Estimate(_Part):
    """A parameter with its 95 % interval, in the unit that ends its name."""

    value: float
    low: float
    high: float


class Gap(_Part):
    """A distance between rig and simulation on held-out data.

    Attributes:
        nrmse_position: rms of y error over rms of y.
        nrmse_torque: rms of u error over rms of u.
        chi2_per_dof: mean squared line error of y over its noise variance.
    """

    nrmse_position: float | None
    nrmse_torque: float | None
    chi2_per_dof: float | None


class Gaps(_Part):
    """Held-out gaps: as delivered, after the refit, after the effect, and of the noise alone."""

    nominal: Gap | None
    refit: Gap | None
    explained: Gap | None
    noise_floor: Gap | None


class Figure(_Part):
    """A figure with its 95 % interval; the interval is None where one realization is held out."""

    value: float
    low: float | None
    high: float | None


class StageFigures(_Part):
    """One figure at each stage, and the share of it that the effect closes.

    Attributes:
        nominal, refit, explained: of the simulation; None where it diverges.
        noise_floor: what noise alone leaves; None where one period was kept.
        closed: 1 - (explained^2 - floor^2)/(refit^2 - floor^2); None without an effect.
    """

    nominal: Figure | None
    refit: Figure | None
    explained: Figure | None
    noise_floor: Figure | None
    closed: Figure | None


class GapFigures(_Part):
    """The held-out gap with intervals; see `gap_intervals` for what each figure is."""

    position: StageFigures
    torque: StageFigures
    bla_sigma: StageFigures
    distortion_db: StageFigures


class Place(_Part):
    """Where the gap lies: a band of one level, one kind of line, one signal."""

    level: int
    band_hz: tuple[float, float]
    lines: LineKind
    signal: Literal["position", "torque"]
    sigma: float


class Candidate(_Part):
    """One explanation that was fitted."""

    effects: list[str]
    held_out_chi2: float | None
    delta: float | None
    converged: bool
    parameters: dict[str, Estimate]


class NextExperiment(_Part):
    """The experiment that best separates what is still ambiguous.

    Attributes:
        kind: what to do, such as amplitude, dc_offset, added_inertia.
        description: one sentence for the lab.
        separates: the effects that it tells apart.
        predicted_sigma: predicted separation in standard deviations of the noise.
        rig_time_s: what it costs.
        settings: numbers to set, by name with unit.
    """

    kind: str
    description: str
    separates: list[str]
    predicted_sigma: float
    rig_time_s: float
    settings: dict[str, Any] = {}


class Diagnosis(_Part):
    """The whole diagnosis.

    Attributes:
        verdict: what is said.
        effects: the best explanation; empty unless the verdict is effect or ambiguous.
        equivalent: one set for each named effect: what the data cannot tell from it.
        confidence: calibrated probability that the verdict is right.
        gap: held-out gaps.
        gap_closed: share of what the refit left that the effect explains.
        gap_figures: the gap in four figures with intervals; None where nothing was simulated.
        where: the places of the gap, strongest first.
        ranking: all explanations that were fitted, best first.
        parameters: base parameters and effect parameters of the best explanation.
        next_experiment: what to do where the set stays ambiguous.
        notes: sentences that a reader must see.
    """

    schema_name: Literal["fjr_rig/diagnosis/1"] = Field("fjr_rig/diagnosis/1", alias="schema")
    verdict: Verdict
    effects: list[str] = []
    equivalent: list[list[str]] = []
    confidence: float = Field(ge=0.0, le=1.0)
    gap: Gaps
    gap_closed: float | None = None
    gap_figures: GapFigures | None = None
    where: list[Place] = []
    ranking: list[Candidate] = []
    parameters: dict[str, Estimate] = {}
    next_experiment: NextExperiment | None = None
    notes: list[str] = []

    def to_json(self) -> str:
        """Return the JSON text of `diagnosis.json`."""
        return self.model_dump_json(by_alias=True, indent=2) + "\n"

    @classmethod
    def read(cls, path: Path) -> Diagnosis:
        """Read a `diagnosis.json`; raise InputError naming file and field."""
        try:
            return cls.model_validate_json(path.read_text())
        except OSError as error:
            raise InputError(f"{path} cannot be read: {error.strerror}.") from None
        except ValidationError as error:
            raise InputError(f"{path}: {first_problem(error)}") from None
