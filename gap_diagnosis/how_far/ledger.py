"""Figures of models on the parts of records that neither fitted nor selected anything."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..outcome.cause import MOST_SHARE, Place
from ..outcome.diagnosis import Remainder, Stage, Step
from ..outcome.gap_size import Figure, Gap, StageFigures
from ..where.remainder import looks_like
from .bootstrap import Choice, ratio, stage_figures

_MOST_PLACES = 4


class Ledger:
    """Figures of models on some parts."""

    def __init__(self, evidence: Evidence, parts: Sequence[int] | None = None) -> None:
        """Take the evidence and the parts, by default those that report or stand in for them."""
        self.evidence = evidence
        self.parts = tuple(evidence.reporting if parts is None else parts)
        self.runs = sorted({evidence.parts[p].record for p in self.parts})
        self._played: list[tuple[Model, np.ndarray, list[np.ndarray]]] = []
        self._part = evidence.part_of(self.parts)
        energy = [self._energy(i) for i in range(len(evidence.records.records))]
        of_part = np.array([energy[part.record] for part in evidence.parts])
        of_motion = np.concatenate(
            [np.tile(evidence.of_motion, evidence.windows(p)) for p in self.parts]
        )
        self._scale = np.where(of_motion, of_part[self._part] * evidence.hop, math.inf)
        self._floor = evidence.floor(self.parts)[evidence.cell_of(self.parts)]

    def _energy(self, index: int) -> float:
        """Return the mean square of what is compared of a run (rad^2), of a motion about its mean.

        A constant torque is a torque.
        """
        record = self.evidence.records.records[index]
        if not self.evidence.slow:
            return max(float(np.var(record.position)), 1e-300)
        held = np.abs(self.evidence.simulator.response(np.zeros(1), index))
        return max(float(np.mean(record.torque**2) / held[0] ** 2), 1e-300)

    def _errors_and_runs(self, model: Model) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return the errors of a model on the parts, and its runs; what was played is kept."""
        for played, errors, runs in self._played:
            if played is model:
                return errors, runs
        evidence = self.evidence
        runs = evidence.simulator.run([model], self.runs)[0]
        lines = {i: evidence.lines_of(run, i) for i, run in zip(self.runs, runs, strict=True)}
        cut = (evidence.parts[p] for p in self.parts)
        errors = np.concatenate([lines[part.record][part.windows].ravel() for part in cut])
        self._played.append((model, errors, runs))
        return errors, runs

    def squares(self, model: Model) -> np.ndarray:
        """Return the squared error over the squared motion of each part, (parts,)."""
        return self._by_part(self._errors_and_runs(model)[0] ** 2 / self._scale)

    def _by_part(self, squares: np.ndarray) -> np.ndarray:
        place = {part: k for k, part in enumerate(self.parts)}
        part = np.array([place[p] for p in self._part])
        windows = np.array([self.evidence.windows(p) for p in self.parts])
        return np.bincount(part, squares) / windows

    def torque_squares(self, model: Model) -> np.ndarray:
        """Return the squared error of the torque over its variance of each part, (parts,).

        Over the mean variance of all runs where a drive was switched off or only holds.
        """
        evidence = self.evidence
        usual = np.mean([np.var(record.torque) for record in evidence.records.records])
        runs = dict(zip(self.runs, self._errors_and_runs(model)[1], strict=True))
        found = []
        for part in (evidence.parts[p] for p in self.parts):
            torque = evidence.records.records[part.record].torque
            at = slice(part.windows.start * evidence.hop, (part.windows.stop + 1) * evidence.hop)
            error = float(np.mean((runs[part.record][1][at] - torque[at]) ** 2))
            found.append(error / float(np.var(torque) or usual or 1.0))
        return np.array(found)

    def step(self, model: Model, added: str | None, stage: Stage) -> Step:
        """Return the gap of a model."""
        evidence = self.evidence
        chi2 = math.nan
        if evidence.noise.known:
            chi2 = float(np.mean(self._errors_and_runs(model)[0] ** 2 / self._floor))
        missed = float(np.sqrt(np.mean(self.squares(model))))
        torque = None
        if not evidence.records.swings_free:
            torque = float(np.sqrt(np.mean(self.torque_squares(model))))
        return Step(
            added=added,
            stage=stage,
            nrmse_position=None if evidence.slow else missed,
            nrmse_torque=missed if evidence.slow else torque,
            chi2_per_dof=chi2,
        )

    def figures(self, stages: Mapping[str, Model], closes: bool) -> dict[str, StageFigures]:
        """Return position and torque at each stage, with 95 % intervals.

        Args:
            stages: model by stage: nominal, refit, explained.
            closes: whether a cause was added, so that a share of the gap closed can be stated.
        """
        levels = np.array([self.evidence.parts[p].level for p in self.parts])
        choice = Choice.among(range(levels.size), levels)
        squares = {stage: self.squares(model) for stage, model in stages.items()}
        if self.evidence.slow:
            return {"torque": stage_figures(squares, None, choice, closes)}
        noise = self._noise() if self.evidence.noise.known else None
        found = {"position": stage_figures(squares, noise, choice, closes)}
        if not self.evidence.records.swings_free:
            torque = {stage: self.torque_squares(model) for stage, model in stages.items()}
            found["torque"] = stage_figures(torque, None, choice, closes)
        return found

    def _noise(self) -> np.ndarray:
        """Return the squared position that noise alone leaves of each part, (parts,)."""
        power = self.evidence.noise_power[self.evidence.cell_of(self.parts)]
        return self._by_part(power / self._scale)

    def noise(self) -> Gap | None:
        """Return the gap that noise alone leaves; None where it is not known."""
        evidence = self.evidence
        if not evidence.noise.known:
            return None
        return Gap(
            nrmse_position=float(np.sqrt(np.mean(self._noise()))),
            nrmse_torque=None,
            chi2_per_dof=1.0,
        )

    def places(self, sigma: np.ndarray) -> list[Place]:
        """Return the strongest cells of (cells,) deviations as places."""
        evidence = self.evidence
        known = evidence.noise.known
        order = np.argsort(-sigma)[:_MOST_PLACES]
        found = []
        for cell in order.tolist():
            if not sigma[cell] > 1.0:
                continue
            level, band = divmod(cell, evidence.bands)
            twist, band = divmod(band, len(evidence.octaves))
            low, high = evidence.octaves.edges[band : band + 2]
            found.append(
                Place(
                    level=evidence.records.levels[level],
                    band_hz=(float(low * evidence.line_hz), float(high * evidence.line_hz)),
                    lines="slow" if band == 0 else "all",
                    signal="torque" if evidence.slow else "twist" if twist else "position",
                    sigma=float(sigma[cell]) if known else math.nan,
                )
            )
        return found

    def places_of_error(self, model: Model) -> list[Place]:
        """Return where a model errs."""
        errors = self._errors_and_runs(model)[0]
        squares = self.evidence.mean_squares(errors, self.parts)
        return self.places(np.sqrt(squares / self.evidence.floor(self.parts)))

    def share(self, without: Model, best: Model, refit: Model) -> Figure:
        """Return how much of what the refit left comes back without a cause, with its interval."""
        lost, gap = self.squares(without) - self.squares(best), self.squares(refit)
        found = ratio(lost, gap, Choice.among(range(gap.size), np.zeros(gap.size)))
        ends = found.model_dump().items()
        return Figure(**{k: None if v is None else min(v, MOST_SHARE) for k, v in ends})

    def remainder(self, best: Model, refit: Model) -> Remainder:
        """Return what a model leaves, and what that looks like."""
        left, gap = self.squares(best), self.squares(refit)
        evidence = self.evidence
        records = [evidence.records.records[i] for i in self.runs]
        missing = evidence.simulator.missing_torque(best, self.runs)
        smooth = max(int(evidence.records.sample_rate_hz / (evidence.lines * evidence.line_hz)), 1)
        finite = all(np.isfinite(m).all() for m in missing)
        return Remainder(
            nrmse_position=None if evidence.slow else float(np.sqrt(left.mean())),
            share=float(left.sum() / max(gap.sum(), 1e-300)),
            looks_like=looks_like(records, missing, smooth) if finite else [],
            where=self.places_of_error(best),
        )
