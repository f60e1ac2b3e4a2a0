"""One diagnosis from bags to verdict: gates, where, which, how far."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .attribution import Attribution, Search
from .confidence import confidence
from .diagnosis import Candidate, Diagnosis, Gap, Gaps, NextExperiment, Verdict
from .estimates import estimates
from .fits import Fit, Fitter
from .gap_intervals import gap_figures
from .gates import GateReport, bags_gate, check_gates
from .misfit import Misfit
from .model import Model, Simulator
from .next_experiment import next_experiment
from .noise import NoiseLevels, even_lines_as_noise
from .records import RecordedExperiment, read_experiment
from .residual_map import ResidualMap, residual_map
from .rounding import position_step, widened, with_rounding
from .search_space import TOLERANCE

NO_GAP = 2.0
"""Held-out misfit of the nominal model per degree of freedom below which there is no gap."""
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Investigation:
    """Everything that a diagnosis rests on.

    Attributes:
        recorded: the experiment.
        nominal: the nominal model.
        gates: outcome of the gates.
        noise: noise of the lines; None where only one period was kept.
        held: indices of the held-out realizations.
        maps: residual maps of the models by name: nominal, refit, explained.
        attribution: what the search found; None if the gates forbade it.
        diagnosis: the outcome.
    """

    recorded: RecordedExperiment
    nominal: Model
    gates: GateReport
    noise: NoiseLevels | None
    held: tuple[int, ...]
    maps: Mapping[str, ResidualMap]
    attribution: Attribution | None
    diagnosis: Diagnosis

    @property
    def held_size(self) -> int:
        """Degrees of freedom of the held-out data, as `Misfit.size`."""
        outputs = 2 if self.recorded.has_link else 1
        return len(self.held) * (outputs * (2 * self.recorded.lines - 1) - (outputs - 1))


def diagnose(
    folder: Path,
    nominal: Mapping[str, float],
    *,
    tolerance: float = TOLERANCE,
    progress: Progress = lambda _: None,
) -> Diagnosis:
    """Diagnose the gap between the rig that recorded a folder of bags and its nominal simulation.

    Args:
        folder: experiment folder of bags.
        nominal: datasheet values of the bare plant's parameters (PLANT names).
        tolerance: how far a datasheet value may be off, relative.
        progress: told what is being done.

    Raises:
        InputError: damaged bags, bags of different rigs, or a controller that is not known.
    """
    recorded = read_experiment(folder)
    return investigate(recorded, nominal, tolerance=tolerance, progress=progress).diagnosis


def investigate(
    recorded: RecordedExperiment,
    nominal: Mapping[str, float],
    *,
    tolerance: float = TOLERANCE,
    progress: Progress = lambda _: None,
) -> Investigation:
    """Diagnose a recorded experiment; see `diagnose`. Keeps all the evidence."""
    model = Model.nominal(nominal)
    progress("gates")
    simulator = Simulator(recorded)
    noise = simulator.noise(model)
    gates = check_gates(recorded, model, noise)
    train, held = _split(recorded)
    if gates.hint == "bad_data":
        diagnosis = _stopped("bad_data", gates)
        return Investigation(recorded, model, gates, noise, held, {}, None, diagnosis)
    std, step = _noise_std(recorded, noise), position_step(recorded)
    seen = std if step is None else widened(std, step, recorded.experiment.samples_per_period)
    fitter = Fitter(recorded, simulator, seen, model.plant, train, held, tolerance)
    attribution = Search(fitter, progress).run()
    if step is not None:
        plain = Misfit(recorded, simulator, std, train), Misfit(recorded, simulator, std, held)
        attribution = with_rounding(attribution, plain, step)
    progress("judgement")
    best = attribution.best
    left = best.held_chi2 / fitter.held.size
    bags = bags_gate(recorded, noise, simulator, best.model, left)
    gates = GateReport((*gates.gates, bags), (*gates.notes, *recorded.resampled))
    models = {
        "nominal": model,
        "refit": attribution.refit.model,
        "explained": attribution.best.model,
    }
    signals = {name: simulator.signals(each) for name, each in models.items()}
    maps = {name: residual_map(recorded, noise, *simulated) for name, simulated in signals.items()}
    diagnosis = _judge(recorded, noise, held, gates, fitter, attribution, model, signals, maps)
    return Investigation(recorded, model, gates, noise, held, maps, attribution, diagnosis)


def _split(recorded: RecordedExperiment) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return training and held-out realizations: in turn at each level; all, if a level has one.

    At each level the one with the greatest torque is for training, so that a limit that it reaches
    is known to the fit before others are predicted.
    """
    train, held = [], []
    for level in recorded.levels:
        members = [i for i, r in enumerate(recorded.realizations) if r.level == level]
        members.sort(key=lambda i: -float(np.abs(recorded.realizations[i].torque).max()))
        train += members[0::2]
        held += members[1::2]
    return tuple(sorted(train)), tuple(sorted(held or train))


def _noise_std(recorded: RecordedExperiment, noise: NoiseLevels | None) -> np.ndarray:
    """Return `NoiseLevels.of_outputs`, or an upper bound if no noise is known."""
    return (noise or even_lines_as_noise(recorded)).of_outputs(recorded)


def _stopped(verdict: Verdict, gates: GateReport) -> Diagnosis:
    nothing = Gaps(nominal=None, refit=None, explained=None, noise_floor=None)
    notes = [gate.sentence for gate in gates.failures] + list(gates.notes)
    diagnosis = Diagnosis(verdict=verdict, confidence=0.0, gap=nothing, notes=notes)
    return diagnosis.model_copy(update={"confidence": confidence(diagnosis)})


def _judge(
    recorded: RecordedExperiment,
    noise: NoiseLevels | None,
    held: tuple[int, ...],
    gates: GateReport,
    fitter: Fitter,
    attribution: Attribution,
    nominal: Model,
    signals: Mapping[str, tuple[np.ndarray, np.ndarray]],
    maps: Mapping[str, ResidualMap],
) -> Diagnosis:
    best, refit = attribution.best, attribution.refit
    size = fitter.held.size
    misfits = {
        "nominal": fitter.judge((), nominal)[1] / size,
        "refit": refit.held_chi2 / size,
        "explained": best.held_chi2 / size,
    }
    gap = {name: _gap(recorded, held, *signals[name], misfits[name]) for name in signals}
    floor = _noise_floor(recorded, held)
    verdict = _verdict(attribution, misfits, gates)
    named = list(best.effects) if verdict in ("effect", "ambiguous") else []
    shown = best if named or verdict == "parameters_only" else refit
    groups = fitter.train.groups()
    diagnosis = Diagnosis(
        verdict=verdict,
        effects=named,
        equivalent=_equivalents(attribution) if named else [],
        confidence=0.0,
        gap=Gaps(**gap, noise_floor=floor),
        gap_closed=_closed(gap["refit"], gap["explained"], floor) if best.effects else None,
        gap_figures=gap_figures(recorded, held, signals, closes=bool(best.effects)),
        where=maps["refit" if misfits["refit"] > NO_GAP else "nominal"].places(),
        ranking=[_candidate(fit, size, refit, groups) for fit in attribution.candidates],
        parameters=estimates(shown, groups),
        next_experiment=_next(recorded, noise, attribution, verdict),
        notes=_notes(gates, attribution, misfits, verdict, fitter.nominal, fitter.tolerance),
    )
    return diagnosis.model_copy(update={"confidence": confidence(diagnosis)})


def _next(
    recorded: RecordedExperiment,
    noise: NoiseLevels | None,
    attribution: Attribution,
    verdict: Verdict,
) -> NextExperiment | None:
    """Return the experiment that separates what is tied, or the best where nothing explains."""
    fits: list[Fit] = []
    if verdict == "ambiguous":
        fits = [attribution.best, *attribution.tied]
    elif verdict == "unexplained":
        fits = [fit for fit in attribution.candidates if fit.converged][:2]
    return next_experiment(recorded, _noise_std(recorded, noise), fits)


def _verdict(attribution: Attribution, misfits: Mapping[str, float], gates: GateReport) -> Verdict:
    if gates.hint != "none":
        return gates.hint
    best = attribution.best
    if best.effects:
        if not attribution.explained:
            return "unexplained"
        return "ambiguous" if attribution.tied else "effect"
    if not attribution.explained:
        return "unexplained"
    return "no_gap" if misfits["nominal"] < NO_GAP else "parameters_only"


def _gap(
    recorded: RecordedExperiment,
    held: tuple[int, ...],
    position: np.ndarray,
    torque: np.ndarray,
    chi2: float,
) -> Gap:
    return Gap(
        nrmse_position=_nrmse(recorded, held, "position", position),
        nrmse_torque=_nrmse(recorded, held, "torque", torque),
        chi2_per_dof=chi2,
    )


def _nrmse(
    recorded: RecordedExperiment, held: tuple[int, ...], name: str, simulated: np.ndarray
) -> float | None:
    """Return rms of the error of the mean period over rms of the signal, held-out realizations."""
    errors, sizes = [], []
    for index in held:
        realization = recorded.realizations[index]
        mean = realization.kept(getattr(realization, name)).mean(axis=0)
        errors.append(np.mean((simulated[index] - mean) ** 2) / np.mean(mean**2))
        sizes.append(1.0)
    value = float(np.sqrt(np.average(errors, weights=sizes)))
    return value if np.isfinite(value) else None


def _noise_floor(recorded: RecordedExperiment, held: tuple[int, ...]) -> Gap | None:
    """Return the gap that a perfect simulation would have: the noise of the mean period."""
    periods = recorded.experiment.periods
    if periods < 2:
        return None
    floors = []
    for name in ("position", "torque"):
        shares = []
        for index in held:
            realization = recorded.realizations[index]
            kept = realization.kept(getattr(realization, name))
            scatter = kept.var(axis=0, ddof=1).mean() / periods
            shares.append(scatter / np.mean(kept**2))
        floors.append(float(np.sqrt(np.mean(shares))))
    return Gap(nrmse_position=floors[0], nrmse_torque=floors[1], chi2_per_dof=1.0)


def _closed(before: Gap, after: Gap, floor: Gap | None) -> float | None:
    """Return 1 - (E_after^2 - N^2)/(E_before^2 - N^2) of the position."""
    if before.nrmse_position is None or after.nrmse_position is None:
        return None
    noise = floor.nrmse_position**2 if floor and floor.nrmse_position else 0.0
    left, there = after.nrmse_position**2 - noise, before.nrmse_position**2 - noise
    return 1.0 - max(left, 0.0) / there if there > 0.0 else None


def _equivalents(attribution: Attribution) -> list[list[str]]:
    """Return for each effect of the best explanation what may stand in its place."""
    sets = []
    for effect in attribution.best.effects:
        rest = set(attribution.best.effects) - {effect}
        others = {
            name
            for fit in attribution.tied
            if rest <= set(fit.effects)
            for name in set(fit.effects) - rest
        }
        sets.append([effect, *sorted(others - {effect})])
    return sets


def _candidate(fit: Fit, size: int, refit: Fit, groups: np.ndarray) -> Candidate:
    found = estimates(fit, groups)
    return Candidate(
        effects=list(fit.effects),
        held_out_chi2=fit.held_chi2 / size if fit.converged else None,
        delta=refit.held_chi2 - fit.held_chi2 if fit.converged else None,
        converged=fit.converged,
        parameters={name: found[name] for name in fit.space.effects},
    )


def _notes(
    gates: GateReport,
    attribution: Attribution,
    misfits: Mapping[str, float],
    verdict: Verdict,
    nominal: Mapping[str, float],
    tolerance: float,
) -> list[str]:
    notes = [gate.sentence for gate in gates.failures] + list(gates.notes)
    failed = [" + ".join(fit.effects) for fit in attribution.candidates if not fit.converged]
    if failed:
        notes.append(f"Dropped or not converged, so not ranked: {', '.join(failed)}.")
    if verdict == "unexplained":
        notes.append(
            f"The best explanation, {' + '.join(attribution.candidates[0].effects) or 'none'}, "
            f"leaves a misfit of {misfits['explained']:.1f} per degree of freedom; none of the "
            "catalogue's effects accounts for the data."
        )
    if verdict == "parameters_only":
        notes.append("A torque-constant error is equivalent to scaling all parameters.")
        found = attribution.refit.model.plant
        far = [n for n, v in found.items() if abs(v - nominal[n]) > tolerance * abs(nominal[n])]
        if len(far) > len(found) // 2:
            notes.append(
                f"{', '.join(far)} lie beyond the tolerance of the nominal file: look for a gain, "
                "of the torque or of the encoder (an eccentric one has one about its zero)."
            )
    return notes
