"""Stage 0: is the record fit for a diagnosis? What fails a gate is named, not fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from bla_analyzer.checks import PERIODICITY_LIMIT, TRANSIENT_LIMIT
from bla_analyzer.lines import classify
from bla_analyzer.realization import period_mismatch, unsettled
from bla_analyzer.spectra import PeriodSums

from .controller_check import check_controller
from .discretisation import discretisation_error
from .model import Model, Simulator
from .noise import ONE_PERIOD, NoiseLevels, noise_levels
from .prediction import loses
from .records import Realization, RecordedExperiment
from .rounding import position_step
from .stationarity import (
    BAG_Z_LIMIT,
    MISFIT_WITHOUT_STRUCTURE,
    PERIOD_Z_LIMIT,
    bag_drift,
    period_drift,
)

Hint = Literal["bad_data", "nonstationary", "none"]

REFERENCE_LIMIT = 1e-4
"""Greatest difference of the reference between periods, relative rms."""
DISCRETISATION_LIMIT = 1e-3
"""Greatest error of the simulation itself, relative to y."""
UNSTABLE = 0.1
"""Such an error is that of a loop in which small differences grow, not of the integration."""


@dataclass(frozen=True)
class Gate:
    """One condition of a diagnosis.

    Attributes:
        name: short name.
        passed: whether it holds; also where it cannot be tested, which the sentence says.
        value: what was measured; NaN if it cannot be tested.
        limit: greatest value that passes.
        sentence: the finding with its evidence.
        hint: the verdict that a failure suggests.
    """

    name: str
    passed: bool
    value: float
    limit: float
    sentence: str
    hint: Hint = "bad_data"


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
        hints = [gate.hint for gate in self.gates if not gate.passed]
        for hint in ("bad_data", "nonstationary"):
            if hint in hints:
                return hint
        return "none"

    @property
    def failures(self) -> tuple[Gate, ...]:
        """The gates that do not pass."""
        return tuple(gate for gate in self.gates if not gate.passed)


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
    settled = _settled(recorded)
    if not drift.passed:
        settled = replace(settled, hint=drift.hint)  # a drift doesn't settle either
    gates = [
        whole,
        _one_grid(recorded),
        _reference(recorded),
        _periodic(recorded),
        settled,
        drift,
    ]
    if recorded.repeatable:
        gates += [_controller(recorded), _discretisation(recorded, nominal)]
    noise = noise if noise is not None else noise_levels(recorded)
    return GateReport(tuple(gates), tuple(_notes(recorded, noise)))


def bags_gate(
    recorded: RecordedExperiment,
    noise: NoiseLevels | None,
    simulator: Simulator,
    model: Model,
    misfit: float = 1.0,
) -> Gate:
    """Test whether friction or stiffness drift from bag to bag, with a refit or explained model.

    The better the model fits, the smaller the drift that it shows; an unmodelled effect hides
    drifts below its own misfit, and is itself not taken for a drift: the limit grows with the
    misfit per degree of freedom, and one level among several does not decide.
    """
    drifts = bag_drift(recorded, noise, simulator, model) if noise is not None else None
    if not drifts:
        return _untested("stationary over realizations", "levels of two bags, two periods each")
    worst = max(drifts, key=lambda drift: (drift.levels_agree, drift.z))
    elapsed_s = [r.experiment.elapsed_s for r in recorded.realizations]
    change = worst.slope_per_s * (max(elapsed_s) - min(elapsed_s))
    limit = BAG_Z_LIMIT * max(misfit / MISFIT_WITHOUT_STRUCTURE, 1.0) ** 0.5
    passed = worst.z <= limit or not worst.levels_agree
    if passed:
        sentence = "friction and stiffness do not change from bag to bag beyond what is uncertain."
    else:
        sentence = (
            f"{worst.group} changes from bag to bag ({worst.z:.0f} sigma), along a line by "
            f"{change:+.2%} over the record; let the rig warm up, or record levels interleaved."
        )
    return Gate("stationary over realizations", passed, worst.z, limit, sentence, "nonstationary")


def _untested(name: str, needs: str) -> Gate:
    return Gate(name, True, float("nan"), float("nan"), f"not tested: it needs {needs}.")


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
    return Gate("whole bags", not bad, float(len(bad)), 0.0, sentence)


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
    return Gate("one grid", not twice, float(twice), 0.0, sentence)


def _worst(recorded: RecordedExperiment, measure) -> tuple[float, Realization]:
    """Return the greatest value of a measure over the bags and its bag; NaN only if all are."""
    values = np.array([measure(r) for r in recorded.realizations])
    index = 0 if np.isnan(values).all() else int(np.nanargmax(values))
    return float(values[index]), recorded.realizations[index]


def _reference(recorded: RecordedExperiment) -> Gate:
    if any(r.reference is None for r in recorded.realizations):
        return _untested("reference repeats", "a recorded reference")

    def mismatch(r: Realization) -> float:
        kept = r.kept(r.played)
        scale = np.std(kept[-1])
        return float(np.std(kept - kept[-1]) / scale) if scale else np.inf

    value, worst = _worst(recorded, mismatch)
    passed = value <= REFERENCE_LIMIT
    sentence = (
        "the reference repeats in every period."
        if passed
        else f"{worst.name}: the reference differs between periods by {value:.2g} of its rms; "
        "correct samples_per_period or transient_periods."
    )
    return Gate("reference repeats", passed, value, REFERENCE_LIMIT, sentence)


def _periodic(recorded: RecordedExperiment) -> Gate:
    description = recorded.experiment
    lines = classify(description.excited_harmonics, description.detection_harmonics)

    def unexplained(r: Realization) -> float:
        sums = PeriodSums(description.samples_per_period)
        reference = r.torque if r.reference is None else r.reference
        for period in zip(*(r.kept(s) for s in (reference, r.torque, r.position)), strict=True):
            sums.add(period)
        return period_mismatch(sums, lines).unexplained

    if description.periods < 2:
        return _untested("periodic response", "two periods or more")
    value, worst = _worst(recorded, unexplained)
    passed = value <= PERIODICITY_LIMIT
    sentence = (
        f"the response repeats from period to period; at most {value:.2g} of it is not noise."
        if passed
        else f"{worst.name}: the response is not periodic, {value:.2g} of its rms in the band "
        "differs from period to period beyond noise; lower the amplitude."
    )
    return Gate("periodic response", passed, value, PERIODICITY_LIMIT, sentence)


def _settled(recorded: RecordedExperiment) -> Gate:
    step = position_step(recorded) or 0.0

    def left(r: Realization) -> float:
        kept = r.kept(r.position)
        before = r.position[r.experiment.transient_periods - 1]
        discarded = before if r.experiment.transient_periods else None
        return unsettled(discarded, kept[0], kept[-2], kept[-1], step)

    if recorded.experiment.periods < 2:
        return _untested("transient decayed", "two periods or more")
    value, worst = _worst(recorded, left)
    passed = value <= TRANSIENT_LIMIT
    sentence = (
        "the transient has decayed before the kept periods begin."
        if passed
        else f"{worst.name}: {value:.2g} of y is still transient where the kept periods begin; "
        "discard more periods."
    )
    return Gate("transient decayed", passed, value, TRANSIENT_LIMIT, sentence)


def _stationary_over_periods(recorded: RecordedExperiment) -> Gate:
    name = "stationary over periods"
    drift = period_drift(recorded)
    if drift is None:
        return _untested(name, "two periods or more, and even lines that are not excited")
    passed = drift.z <= PERIOD_Z_LIMIT
    level = recorded.levels[int(np.argmax(drift.per_level))]
    sentence = (
        "the response does not drift from period to period within a bag."
        if passed
        else f"the response drifts within bags ({drift.z:.0f} sigma, most at level {level}): its "
        f"excited lines change by {drift.relative:.2g} of themselves per period, lines without "
        "excitation don't; let the rig warm up before recording."
    )
    return Gate(name, passed, drift.z, PERIOD_Z_LIMIT, sentence, "nonstationary")


def _controller(recorded: RecordedExperiment) -> Gate:
    checks = [(check_controller(r), r) for r in recorded.realizations]
    check, worst = max(checks, key=lambda pair: pair[0].deviation_nm / pair[0].limit_nm)
    sentence = (
        f"the torque is that of the controller in every sample, to {check.deviation_nm:.1g} N m."
        if check.passed
        else f"{worst.name}: the torque is not what the controller makes of r - y from sample "
        f"{check.sample} on (by up to {check.deviation_nm:.3g} N m): {check.cause}."
    )
    return Gate("controller identity", check.passed, check.deviation_nm, check.limit_nm, sentence)


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
    return Gate("discretisation", passed, value, DISCRETISATION_LIMIT, sentence)


def _notes(recorded: RecordedExperiment, noise: NoiseLevels | None) -> list[str]:
    """Return what cannot be said with these data."""
    notes = []
    counts = [sum(r.level == level for r in recorded.realizations) for level in recorded.levels]
    if noise is None:
        notes.append(ONE_PERIOD)
    elif not noise.measurable.all():
        which = [str(v) for v, seen in zip(noise.levels, noise.measurable, strict=True) if not seen]
        notes.append(
            f"Level {', '.join(which)} shows no noise, so significance is stated against the "
            "numerical floor of the simulation and cannot be trusted as such."
        )
    if min(counts) < 2:
        notes.append(
            "A level has one realization only: nothing of it can be held out, and drift between "
            "bags cannot be seen there; record two or more with other phases."
        )
    if len(counts) < 2:
        notes.append(
            "There is one level only: effects that differ by how they grow with amplitude cannot "
            "be told apart, and no amplitude can be held out; record three levels."
        )
    kinds = recorded.kinds()
    if "even" not in kinds or "odd" not in kinds:
        notes.append(
            "The grid has no free odd or even lines: distortion cannot be told from the linear "
            "response; excite an odd random grid."
        )
    if not recorded.repeatable:
        notes.append(loses(recorded))
    if recorded.experiment.transient_periods == 0:
        notes.append("No transient period was discarded; the first period may hold a transient.")
    return notes
