"""What the compared methods share: one problem for all worlds, its gaps, a Gauss-Newton fit.

Runs are played whole, from their true start. One division serves all methods, that of
`Evidence`: some parts of the runs are fitted, others choose, others report.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from fjr_records.periodic import RecordedExperiment
from gap_diagnosis.any_record import read_any
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.parts import Purpose
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.outcome.cause import Cause
from gap_diagnosis.outcome.diagnosis import Diagnosis, EvidenceKind, Stage, Step, Verdict
from gap_diagnosis.outcome.gap_size import Estimate, Gap, Gaps
from gap_diagnosis.starts.scales import Scales

BUDGET_S = 120.0
"""Processor time of one method for one case, which other work on the machine does not take away;
what is begun then is ended (a simulation, not a fit)."""

MATTERS = 0.1
"""The methods of others name nothing. What one has fitted is named if the error on the validation
parts grows by this share once that value is put back to the datasheet's."""

_STEP = 2e-3

Positions = Mapping[int, np.ndarray]
"""Simulated y of some runs, (samples,) in rad, by the index of the run."""


class Problem:
    """Recorded runs to be met by a model.

    Attributes:
        budget_s: processor time for all of it.
        nominal: nominal bare parameters; those of one body on a rigid axis.
        evidence: the runs, cut and divided; the methods of others are fitted to motion alone.
        scales: what is usual in the record.
        fitted: names of the bare parameters that a refit may change; what the datasheet puts at
            zero stays there.
    """

    def __init__(self, folder: Path, nominal: Mapping[str, float]) -> None:
        """Read the bags, whatever they hold; the budget begins."""
        self.budget_s = BUDGET_S
        self._until = time.process_time() + self.budget_s
        self.nominal = dict(Model.nominal(nominal).plant)
        self.fitted = tuple(name for name, value in self.nominal.items() if value)
        recorded = read_any(folder)
        self._periodic = isinstance(recorded, RecordedExperiment)
        records = recorded.as_records() if isinstance(recorded, RecordedExperiment) else recorded
        self.evidence = Evidence(records, nominal).of_motion_alone()
        self.scales = Scales.of_record(
            [r.position for r in records.records],
            [r.torque for r in records.records],
            records.sample_rate_hz,
            self.evidence.lines * self.evidence.line_hz,
            self.nominal,
        )
        self._fit = self.evidence.parts_for("fit")
        cell = self.evidence.cell_of(self._fit)
        self._sigma = np.sqrt(self.evidence.floor(self._fit))[cell]
        self.equations = self._sigma.size

    @property
    def seconds_left(self) -> float:
        """How much processor time of the budget is left (s)."""
        return max(self._until - time.process_time(), 0.0)

    @property
    def sample_rate_hz(self) -> float:
        """Rate of the samples."""
        return self.evidence.records.sample_rate_hz

    def model(self, values: Mapping[str, float]) -> Model:
        """Return the model of bare and effect parameters by name."""
        return Model(
            {name: values[name] for name in self.nominal},
            {name: value for name, value in values.items() if name not in self.nominal},
        )

    def residual(self, values: Mapping[str, float]) -> np.ndarray:
        """Return the errors of the fitted parts over their noise and 0.1 % of the motion there."""
        errors = self.evidence.errors([self.model(values)], self._fit)[0] / self._sigma
        return np.where(np.isfinite(errors), errors, np.inf)

    def runs(self, *purposes: Purpose) -> list[int]:
        """Return the indices of the runs that hold parts for some purposes."""
        return sorted({self.evidence.parts[i].record for i in self._parts(purposes)})

    def play(self, values: Mapping[str, float], which: Sequence[int]) -> Positions:
        """Return the positions of the simulated rig."""
        runs = self.evidence.simulator.run([self.model(values)], which)[0]
        return {index: run[0] for index, run in zip(which, runs, strict=True)}

    def error(self, positions: Positions, *purposes: Purpose) -> np.ndarray:
        """Return simulated less recorded position on the samples for some purposes (rad)."""
        runs, records = self.runs(*purposes), self.evidence.records.records
        kept = {index: self.samples(index, *purposes) for index in runs}
        return np.concatenate([(positions[i] - records[i].position)[kept[i]] for i in runs])

    def samples(self, index: int, *purposes: Purpose) -> np.ndarray:
        """Return which samples of a run serve some purposes, bool (samples,)."""
        hop, parts = self.evidence.hop, self.evidence.parts
        kept = np.zeros(self.evidence.records.records[index].samples, bool)
        for part in (parts[i] for i in self._parts(purposes)):
            if part.record == index:
                kept[part.windows.start * hop : part.windows.stop * hop] = True
        return kept

    def _parts(self, purposes: Sequence[Purpose]) -> tuple[int, ...]:
        """Return the parts for some purposes; all if there are none for them."""
        return self.evidence.parts_for(*purposes) or tuple(range(len(self.evidence.parts)))

    def within(self, name: str, value: float) -> float:
        """Return the value of a parameter within its range; bare parameters stay positive."""
        low, high = 1e-9, np.inf
        if name not in self.nominal:
            low, high = self.scales.bounds(name)
            low = self.scales.negligible(name) or low
        return float(np.clip(value, low, high))

    def gap(self, positions: Positions) -> Gap:
        """Return the gap on what nothing was fitted to: rms error over rms motion, each part's."""
        evidence, shares = self.evidence, []
        for i in evidence.reporting:
            part = evidence.parts[i]
            motion = evidence.records.records[part.record].position
            error = evidence.lines_of(positions[part.record][None], part.record)[part.windows]
            power = np.sum(error**2) / (evidence.windows(i) * evidence.hop)
            shares.append(power / max(float(np.var(motion)), 1e-300))
        return Gap(
            nrmse_position=float(np.sqrt(np.mean(shares))), nrmse_torque=None, chi2_per_dof=None
        )

    def gap_of(self, values: Mapping[str, float]) -> Gap:
        """Return the gap of the simulated rig with some values."""
        return self.gap(self.play(values, self.reported))

    @property
    def reported(self) -> list[int]:
        """The runs that report."""
        return sorted({self.evidence.parts[i].record for i in self.evidence.reporting})

    def kind(self) -> EvidenceKind:
        """Return what a verdict rests on."""
        shared = set(self.reported) & set(self.runs("fit"))
        return EvidenceKind(
            noise=self.evidence.noise.source,
            reported_on="none" if not self.evidence.parts_for("report")
            else "blocks" if shared else "records",
            controller=self.evidence.simulator.loop.kind,
            excitation="periodic" if self._periodic else "record",
        )  # fmt: skip


def verdict_of(
    problem: Problem,
    gaps: Mapping[Stage, Gap],
    values: Mapping[str, float],
    present: Mapping[str, float],
    without_effect: Verdict = "parameters_only",
    notes: Sequence[str] = (),
) -> Diagnosis:
    """Return the verdict of a method that knows no intervals.

    Args:
        problem: what was met.
        gaps: by stage, as far as it went.
        values: what was fitted, by name.
        present: the named effects, each with how surely it is said to be there.
        without_effect: what is said if none is named.
        notes: what a reader must see.
    """
    names = list(present)
    return Diagnosis(
        verdict="effect" if names else without_effect,
        effects=names,
        equivalent=[[name] for name in names],
        confidence=min(present.values(), default=1.0),
        evidence=problem.kind(),
        causes=[Cause(effect=name, present=sure) for name, sure in present.items()],
        steps=[
            Step(
                added=" + ".join(names) if stage == "cause" else None,
                stage=stage,
                nrmse_position=gap.nrmse_position,
                nrmse_torque=None,
                chi2_per_dof=None,
            )
            for stage, gap in gaps.items()
        ],
        gap=Gaps(
            nominal=gaps.get("nominal"),
            refit=gaps.get("refit"),
            explained=gaps.get("cause"),
            noise_floor=None,
        ),
        parameters={n: Estimate(value=v, low=np.nan, high=np.nan) for n, v in values.items()},
        notes=list(notes),
    )


def jacobian(
    problem: Problem, values: Mapping[str, float], free: Sequence[str], residual: np.ndarray
) -> np.ndarray:
    """Return d residual / d (value over scale), float64 (equations, free)."""
    columns = []
    for name in free:
        step = _STEP * scale(name, values)
        columns.append((problem.residual({**values, name: values[name] + step}) - residual) / _STEP)
    return np.array(columns).T


def scale(name: str, values: Mapping[str, float]) -> float:
    """Return what a free value is measured in: itself, or 1 rad of a phase."""
    return 1.0 if name.endswith(("phase_rad", "angle_rad")) else abs(values[name]) or 1e-3


def fit(
    problem: Problem, start: Mapping[str, float], free: Sequence[str], iterations: int = 8
) -> tuple[dict[str, float], np.ndarray]:
    """Return fitted values and their residual: Levenberg-Marquardt within the parameters' ranges.

    Args:
        problem: what to meet; no step is begun after its budget.
        start: all values.
        free: the names that may change.
        iterations: most steps accepted.
    """
    values, residual = dict(start), problem.residual(start)
    damping = 1e-3
    for _ in range(iterations):
        if not problem.seconds_left:
            break
        matrix = jacobian(problem, values, free, residual)
        if not np.isfinite(matrix).all():
            break
        better = _step(problem, values, residual, free, matrix, damping)
        if better is None:
            break
        gain = residual @ residual - better[1] @ better[1]
        values, residual, damping = better
        if gain < 1e-3 * (residual @ residual):
            break
    return values, residual


def _step(
    problem: Problem,
    values: dict[str, float],
    residual: np.ndarray,
    free: Sequence[str],
    matrix: np.ndarray,
    damping: float,
) -> tuple[dict[str, float], np.ndarray, float] | None:
    """Return values, residual and damping after a step that helps; None if there is none."""
    normal, slope = matrix.T @ matrix, matrix.T @ residual
    for _ in range(8):
        step = -np.linalg.lstsq(normal + damping * np.diag(np.diag(normal)), slope, rcond=None)[0]
        trial = dict(values)
        for name, change in zip(free, step, strict=True):
            trial[name] = problem.within(name, values[name] + change * scale(name, values))
        after = problem.residual(trial)
        if after @ after < residual @ residual:
            return trial, after, max(0.1 * damping, 1e-8)
        damping *= 10.0
    return None
