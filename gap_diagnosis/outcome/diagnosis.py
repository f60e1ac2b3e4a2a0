"""The outcome of a diagnosis: `diagnosis.json`, schema fjr_rig/diagnosis/2."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fjr_kit.result_types import Document, FreeForm, Number, OptionalNumber, ResultModel, Unit

from .cause import Cause, Doubted, Place
from .contender import Contender
from .gap_size import Estimate, Gap, GapFigures, Gaps

Verdict = Literal[
    "no_gap",
    "parameters_only",
    "effect",
    "ambiguous",
    "partly_explained",
    "unexplained",
    "nonstationary",
    "bad_data",
]
ReportedOn = Literal["records", "blocks", "none"]
Stage = Literal["nominal", "refit", "cause"]


class BagTrend(ResultModel):
    """How friction or stiffness changes along the record.

    Attributes:
        change_percent: along a line, over the whole record.
        p_value: how often scatter alone shows such a trend.
    """

    change_percent: Annotated[Number, Unit("%")]
    p_value: Number


class Bags(ResultModel):
    """What changes from bag to bag.

    Attributes:
        trends: of friction and of stiffness.
        scatter_percent: standard deviation of each parameter between bags.
        accounted: share of the misfit of all bags that such changes account for.
        scatter_known: whether scatter_percent counts as the rig's own; if it accounts for too
            little of the misfit, a law that the model lacks may make it instead.
    """

    trends: dict[str, BagTrend]
    scatter_percent: dict[str, Estimate]
    accounted: Number
    scatter_known: bool = True


class Step(ResultModel):
    """The gap that is left after a step of the explanation, on data that no fit has seen.

    Attributes:
        added: what was added: nothing (None) for the nominal and the refit, else the cause.
        stage: nominal, refit, or cause.
        nrmse_position, nrmse_torque: rms error over rms about the mean; where torques were
            compared, over the rms of the torque.
        chi2_per_dof: mean squared error over the noise; None where noise is not known.
    """

    added: str | None
    stage: Stage
    nrmse_position: OptionalNumber
    nrmse_torque: OptionalNumber
    chi2_per_dof: OptionalNumber


class Remainder(ResultModel):
    """What all named causes leave.

    Attributes:
        nrmse_position: rms error over rms of the position; None where torques were compared.
        share: of the squared gap that the refit left.
        looks_like: what it goes with, strongest first; empty where it goes with nothing.
        where: where it lies, strongest first.
    """

    nrmse_position: OptionalNumber
    share: OptionalNumber
    looks_like: list[str] = Field(default_factory=list)
    where: list[Place] = Field(default_factory=list)


class EvidenceKind(ResultModel):
    """What a diagnosis rests on.

    Attributes:
        noise: how the noise is known.
        reported_on: what the figures were computed on: whole records, or blocks of records, that
            no fit has seen; none if the fit has seen all.
        controller: whether the loop was simulated, with gains that were known or fitted, or not.
        excitation: whether steady periods were compared, or records as they came.
        compared: what of rig and model was compared: their motion, or, in motion too slow for
            inertia to count, the torque alone.
        axis: rotary, or linear: then all sizes are in m, N and kg where names end in rad, nm and
            kg_m2, but for phases, and cycles_per_turn are those in 2 pi m.
    """

    noise: Literal["repeats", "standstill", "residual", "none"]
    reported_on: ReportedOn
    controller: Literal["known", "gains_fitted", "unknown"]
    excitation: Literal["periodic", "record"]
    compared: Literal["motion", "torque"] = "motion"
    axis: Literal["rotary", "linear"] = "rotary"


class Candidate(ResultModel):
    """One explanation that the search tried.

    Attributes:
        effects: in the order in which they were added.
        held_out_chi2: misfit on the data that select, which are not those of `steps`.
        delta: log-likelihood that it gains on a block of these data over the step of one effect
            less, nats.
        converged: whether the fit did.
        parameters: of the effects.
    """

    effects: list[str]
    held_out_chi2: OptionalNumber
    delta: OptionalNumber
    converged: bool
    parameters: dict[str, Estimate]


class NextExperiment(ResultModel):
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
    predicted_sigma: Number
    rig_time_s: Annotated[Number, Unit("s")]
    settings: FreeForm = Field(default_factory=dict)


class Diagnosis(Document):
    """The whole diagnosis.

    Attributes:
        verdict: what is said.
        effects: the named causes; empty unless the verdict is effect, ambiguous or
            partly_explained.
        equivalent: one set for each named effect: what the data cannot tell from it.
        confidence: calibrated probability that the verdict is right; capped where nothing was
            held out.
        evidence: what the diagnosis rests on; None where a gate stopped it.
        causes: the named causes, greatest share first.
        doubted: effects that were tested as causes and are not named, likeliest first.
        steps: the gap from step to step: nominal, refit, cause after cause.
        remainder: what is left; None where nothing was fitted.
        gap: the gaps at each stage.
        gap_closed: share of what the refit left that the effect explains; None without an effect,
            and where a share means nothing.
        gap_figures: the gap with intervals; None where nothing was simulated.
        bags: what changes from bag to bag; None where that cannot be tested.
        where: the places of the gap, strongest first.
        contenders: the chosen explanation, then those in which another member of a set stands in
            place of its cause, the best first; where no cause is named, the refit and what was
            tried beside it. Empty where there was nothing to choose.
        ranking: what the search tried, in the order of its steps.
        parameters: base parameters and effect parameters of the best explanation.
        next_experiment: what to do where the set stays ambiguous.
        notes: sentences that a reader must see.
    """

    schema_name: Literal["fjr_rig/diagnosis/2"] = Field("fjr_rig/diagnosis/2", alias="schema")
    verdict: Verdict
    effects: list[str] = Field(default_factory=list)
    equivalent: list[list[str]] = Field(default_factory=list)
    confidence: float = Field(ge=0.0, le=1.0)
    evidence: EvidenceKind | None = None
    causes: list[Cause] = Field(default_factory=list)
    doubted: list[Doubted] = Field(default_factory=list)
    steps: list[Step] = Field(default_factory=list)
    remainder: Remainder | None = None
    gap: Gaps
    gap_closed: OptionalNumber = None
    gap_figures: GapFigures | None = None
    bags: Bags | None = None
    where: list[Place] = Field(default_factory=list)
    contenders: list[Contender] = Field(default_factory=list)
    ranking: list[Candidate] = Field(default_factory=list)
    parameters: dict[str, Estimate] = Field(default_factory=dict)
    next_experiment: NextExperiment | None = None
    notes: list[str] = Field(default_factory=list)

    @property
    def reported_on(self) -> ReportedOn:
        """What all figures were computed on."""
        return "records" if self.evidence is None else self.evidence.reported_on

    @property
    def compared(self) -> Literal["motion", "torque"]:
        """What of rig and model was compared."""
        return "motion" if self.evidence is None else self.evidence.compared

    @property
    def linear(self) -> bool:
        """Whether the axis is linear, with sizes in m, N and kg."""
        return self.evidence is not None and self.evidence.axis == "linear"

    def missed(self, gap: Gap | Step | None) -> float | None:
        """Return the relative error of what was compared; None where it is not known."""
        if gap is None:
            return None
        return gap.nrmse_position if self.compared == "motion" else gap.nrmse_torque

    def with_parameters(self, parameters: dict[str, Estimate]) -> Diagnosis:
        """Return it with other estimates of its parameters, and of those of its causes."""
        causes = [
            cause.model_copy(update={"parameters": {n: parameters[n] for n in cause.parameters}})
            for cause in self.causes
        ]
        return self.model_copy(update={"parameters": parameters, "causes": causes})
