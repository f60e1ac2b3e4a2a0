"""Stage 0: is the record fit for a diagnosis? A fault that fails a gate is named, not fitted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from bla_analyzer.checks import PERIODICITY_LIMIT, TRANSIENT_LIMIT
from fjr_kit.check import Check, failed
from fjr_records.encoder_step import position_step
from fjr_records.lines import classify
from fjr_records.noise import NoiseLevels, noise_levels
from fjr_records.periodic import RecordedExperiment, RecordedRealization
from fjr_records.realization import FALSE_ALARM, period_mismatch, unsettled
from fjr_records.spectra import PeriodSums

from ..model.controller_check import check_controller
from ..model.discretisation import discretisation_error
from ..model.rig_model import Model
from .data_notes import data_notes
from .stationarity import PERIOD_Z_LIMIT, period_drift

Hint = Literal["bad_data", "nonstationary", "none"]

REFERENCE_LIMIT = 1e-4
"""Greatest difference of the reference between periods, relative rms."""
DISCRETISATION_LIMIT = 1e-3
"""Greatest error of the simulation itself, relative to y."""
_DISCRETISATION = "discretisation"
UNSTABLE = 0.1
"""Such an error is that of a loop in which small differences grow, not of the integration."""


class Gate(Check):
    """A check of the record without which no diagnosis is made; passed also where it is not tested.

    Attributes:
        hint: the verdict that a failure suggests.
        of_periods: whether it asks for periods that repeat, which records need not do.
    """

    hint: Hint = "bad_data"
    of_periods: bool = False


@dataclass(frozen=True)
class GateReport:
    """All gates of an experiment, and what its data cannot say.

    Attributes:
        gates: in the order in which they were tested.
        notes: sentences on what is missing for stronger statements.
    """

    gates: tuple[Gate, ...]
    notes: tuple[str, ...]

    @property
    def hint(self) -> Hint:
        """The verdict that the gates suggest: bad data before a drift, none if all pass."""
        hints = [gate.hint for gate in self.failures]
        for hint in ("bad_data", "nonstationary"):
            if hint in hints:
                return hint
        return "none"

    @property
    def failures(self) -> tuple[Gate, ...]:
        """The gates that do not pass."""
        return failed(self.gates)

    @property
    def only_unsteady(self) -> bool:
        """Whether nothing is wrong but that periods do not repeat."""
        return bool(self.failures) and all(gate.of_periods for gate in self.failures)

    @property
    def only_by_nominal(self) -> bool:
        """Whether nothing is wrong but that the nominal loop cannot be simulated well."""
        return [gate.name for gate in self.failures] == [_DISCRETISATION]


def check_gates(
    recorded: RecordedExperiment, nominal: Model, noise: NoiseLevels | None = None
) -> GateReport:
    """Test all gates that need no fit.

    Args:
        recorded: the experiment; its reader has refused damaged bags and bags of several grids.
        nominal: the nominal model.
        noise: from `noise_levels`, if already at hand.

    Raises:
        InputError: the controller is described, but of a kind that is not known.
    """
    whole = _whole(recorded)
    if not whole.passed:
        return GateReport((whole,), ())
    drift = _stationary_over_periods(recorded)
    # A drift does not repeat or settle either.
    same = {"of_periods": True} | ({} if drift.passed else {"hint": drift.hint})
    steady = (_periodic(recorded), _settled(recorded), drift)
    gates = [
        whole,
        _one_grid(recorded),
        _reference(recorded).model_copy(update={"of_periods": True}),
        *(gate.model_copy(update=same) for gate in steady),
    ]
    if recorded.repeatable:
        gates += [_controller(recorded), _discretisation(recorded, nominal)]
    noise = noise if noise is not None else noise_levels(recorded)
    return GateReport(tuple(gates), tuple(data_notes(recorded, noise)))


def untested(name: str, needs: str) -> Gate:
    """Return a gate that passes because nothing could be tested, and says what it needs."""
    return _gate(name, float("nan"), float("nan"), f"not tested: it needs {needs}.", True)


def _gate(
    name: str, value: float, limit: float, sentence: str, passed: bool, hint: Hint = "bad_data"
) -> Gate:
    return Gate(name=name, passed=passed, value=value, limit=limit, sentence=sentence, hint=hint)


def _limited(
    name: str, value: float, limit: float, well: str, ill: str, hint: Hint = "bad_data"
) -> Gate:
    """Return a gate that passes up to a limit, with the sentence for what came of it."""
    passed = bool(value <= limit)
    return _gate(name, value, limit, well if passed else ill, passed, hint)


def _whole(recorded: RecordedExperiment) -> Gate:
    bad = [
        f"{r.name}: {name}"
        for r in recorded.realizations
        for name in ("reference", "torque", "position", "link")
        if getattr(r, name) is not None and not np.isfinite(getattr(r, name)).all()
    ]
    sentence = (
        f"{bad[0]} holds values that are not finite; record it again."
        if bad
        else f"{len(recorded.realizations)} bags are whole, all values finite."
    )
    return _gate("whole bags", len(bad), 0.0, sentence, not bad)


def _one_grid(recorded: RecordedExperiment) -> Gate:
    description = recorded.experiment
    played = [(r.level, r.experiment.realization) for r in recorded.realizations]
    twice = len(played) - len(set(played))
    sentence = (
        f"{len(recorded.levels)} levels on one grid: {len(description.excited_harmonics)} excited "
        f"lines, {description.periods} periods of "
        f"{description.samples_per_period / description.sample_rate_hz:g} s after "
        f"{description.transient_periods}."
    )
    if twice:
        sentence = "two bags claim the same level and realization; keep one experiment in a folder."
    return _gate("one grid", twice, 0.0, sentence, not twice)


def _worst(recorded: RecordedExperiment, measure) -> tuple[float, RecordedRealization]:
    """Return the greatest value of a measure over the bags and its bag; NaN only if all are."""
    values = np.array([measure(r) for r in recorded.realizations])
    index = 0 if np.isnan(values).all() else int(np.nanargmax(values))
    return float(values[index]), recorded.realizations[index]


def _reference(recorded: RecordedExperiment) -> Gate:
    if any(r.reference is None for r in recorded.realizations):
        return untested("reference repeats", "a recorded reference")

    def mismatch(r: RecordedRealization) -> float:
        kept = r.kept(r.played)
        scale = np.std(kept[-1])
        return float(np.std(kept - kept[-1]) / scale) if scale else np.inf

    value, worst = _worst(recorded, mismatch)
    return _limited(
        "reference repeats",
        value,
        REFERENCE_LIMIT,
        "the reference repeats in every period.",
        f"{worst.name}: the reference differs between periods by {value:.2g} of its rms; correct "
        "samples_per_period or transient_periods.",
    )


def _periodic(recorded: RecordedExperiment) -> Gate:
    description = recorded.experiment
    lines = classify(description.excited_harmonics, description.detection_harmonics)

    def unexplained(r: RecordedRealization) -> float:
        sums = PeriodSums(description.samples_per_period)
        reference = r.torque if r.reference is None else r.reference
        for period in zip(*(r.kept(s) for s in (reference, r.torque, r.position)), strict=True):
            sums.add(period)
        return period_mismatch(sums, lines).unexplained

    if description.periods < 2:
        return untested("periodic response", "two periods or more")
    value, worst = _worst(recorded, unexplained)
    return _limited(
        "periodic response",
        value,
        PERIODICITY_LIMIT,
        f"the response repeats from period to period; at most {value:.2g} of it is beyond noise.",
        f"{worst.name}: the response is not periodic, {value:.2g} of its rms in the band differs "
        f"from period to period beyond noise (false-alarm probability {FALSE_ALARM:g}); lower the "
        "amplitude.",
    )


def _settled(recorded: RecordedExperiment) -> Gate:
    step = position_step([r.position for r in recorded.realizations]) or 0.0

    def left(r: RecordedRealization) -> float:
        kept = r.kept(r.position)
        before = r.position[r.experiment.transient_periods - 1]
        discarded = before if r.experiment.transient_periods else None
        return unsettled(discarded, kept[0], kept[-2], kept[-1], step)

    if recorded.experiment.periods < 2:
        return untested("transient decayed", "two periods or more")
    value, worst = _worst(recorded, left)
    return _limited(
        "transient decayed",
        value,
        TRANSIENT_LIMIT,
        "the transient has decayed before the kept periods begin.",
        f"{worst.name}: {value:.2g} of y is still transient where the kept periods begin; discard "
        "more periods.",
    )


def _stationary_over_periods(recorded: RecordedExperiment) -> Gate:
    name = "stationary over periods"
    drift = period_drift(recorded)
    if drift is None:
        return untested(name, "two periods or more, and even lines that are not excited")
    level = recorded.levels[int(np.argmax(drift.per_level))]
    return _limited(
        name,
        drift.z,
        PERIOD_Z_LIMIT,
        "the response does not drift from period to period within a bag.",
        f"the response drifts within bags ({drift.z:.0f} sigma, most at level {level}): its "
        f"excited lines change by {drift.relative:.2g} of themselves per period, lines without "
        "excitation don't; let the rig warm up before recording.",
        "nonstationary",
    )


def _controller(recorded: RecordedExperiment) -> Gate:
    checks = [(check_controller(r), r) for r in recorded.realizations]
    check, worst = max(checks, key=lambda pair: pair[0].deviation_nm / pair[0].limit_nm)
    sentence = (
        f"the torque is that of the controller in every sample, to {check.deviation_nm:.1g} N m."
        if check.passed
        else f"{worst.name}: the torque is not what the controller makes of r - y from sample "
        f"{check.sample} on (by up to {check.deviation_nm:.3g} N m): {check.cause}."
    )
    deviation_nm, limit_nm = check.deviation_nm, check.limit_nm
    return _gate("controller identity", deviation_nm, limit_nm, sentence, check.passed)


def _discretisation(recorded: RecordedExperiment, nominal: Model) -> Gate:
    errors = discretisation_error(recorded, nominal)
    value = float(np.max(errors))
    passed = bool(value <= DISCRETISATION_LIMIT)
    sentence = (
        f"the simulation's own discretisation error is {value:.1g} of y."
        if passed
        else "the nominal simulation diverges; check parameters, units and controller."
        if np.isnan(value)
        else f"the nominal loop is not stable: finer integration steps change y by {value:.2g} of "
        "itself; check parameters, units and controller, or lower the amplitude."
        if value > UNSTABLE
        else f"the simulation's own discretisation error is {value:.2g} of y; record at a higher "
        "sample_rate_hz or a lower amplitude."
    )
    return _gate(_DISCRETISATION, value, DISCRETISATION_LIMIT, sentence, passed)
