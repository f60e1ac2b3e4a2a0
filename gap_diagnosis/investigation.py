"""One diagnosis from bags to verdict, stage after stage."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fjr_records.encoder_step import position_step
from fjr_records.noise import NoiseLevels, even_lines_as_noise
from fjr_records.periodic import RecordedExperiment

from .gates.bags_gate import with_bags_gate
from .gates.gate_checks import GateReport, check_gates
from .judgement import judge, stopped
from .model.misfit import Misfit
from .model.rig_model import Model
from .model.simulated_rig import Signals, Simulator
from .outcome.diagnosis import Diagnosis
from .outcome.verdict_words import ROUNDING
from .where.residual_map import ResidualMap, residual_map
from .where.residual_torque import ResidualTorque, residual_torque
from .which.attribution import NOTHING_LEFT, Attribution
from .which.catalogue import catalogue
from .which.fits import Fitter
from .which.rounding import coarse, in_the_loop, smooth, widened, with_rounding
from .which.search import Search
from .which.search_space import TOLERANCE

Progress = Callable[[str], None]

_ROUNDS = 3  # of simulating what rounding adds to the refit, and fitting it anew


@dataclass(frozen=True)
class Investigation:
    """Everything that a diagnosis rests on.

    Attributes:
        recorded: the experiment.
        nominal: the nominal model.
        gates: outcome of the gates.
        noise: noise of the lines; None where only one period was kept.
        held: indices of the held-out realizations.
        signals: simulated by each model, by its name: nominal, refit, explained.
        maps: residual maps of the same.
        attribution: what the search found; None if the gates forbade it.
        diagnosis: the outcome.
    """

    recorded: RecordedExperiment
    nominal: Model
    gates: GateReport
    noise: NoiseLevels | None
    held: tuple[int, ...]
    signals: Mapping[str, Signals]
    maps: Mapping[str, ResidualMap]
    attribution: Attribution | None
    diagnosis: Diagnosis

    @property
    def held_size(self) -> int:
        """Degrees of freedom of the held-out data, as `Misfit.size`."""
        outputs = 2 if self.recorded.has_link else 1
        return len(self.held) * (outputs * (2 * self.recorded.lines - 1) - (outputs - 1))

    @cached_property
    def residual_torques(self) -> Mapping[str, ResidualTorque]:
        """Residual torque of the refit and, if it has an effect, of the best explanation."""
        if self.attribution is None:
            return {}
        fits = {"refit": self.attribution.refit}
        if self.attribution.best.effects:
            fits["explained"] = self.attribution.best
        return {k: residual_torque(self.recorded, f.model, self.noise) for k, f in fits.items()}


def investigate(
    recorded: RecordedExperiment,
    nominal: Mapping[str, float],
    *,
    tolerance: float = TOLERANCE,
    effects: Sequence[str] | None = None,
    budget_s: float = math.inf,
    progress: Progress = lambda _: None,
) -> Investigation:
    """Diagnose an experiment of steady periods and keep all the evidence.

    Args:
        recorded: the experiment, from `fjr_records.read_experiment`.
        nominal: datasheet values of the bare plant's parameters in SI units, by the names of
            `fjr_sim_node.plant.PLANT`; `read_nominal` reads them from a parameter file.
        tolerance: how far a datasheet value may be off, relative.
        effects: identifiers to look for; None for all.
        budget_s: time after which no effect is added any more.
        progress: told which stage begins.

    Raises:
        InputError: bags of different rigs, a controller of an unknown kind, or an effect of an
            unknown name.
    """
    until = time.monotonic() + budget_s
    model = Model.nominal(nominal)
    catalogue(model.plant, effects)
    progress("gates")
    simulator = Simulator(recorded)
    noise = simulator.noise(model)
    gates = check_gates(recorded, model, noise)
    train, held = _split(recorded)
    held_out = not set(held) <= set(train)
    if gates.hint == "bad_data":
        diagnosis = stopped("bad_data", gates)
        return Investigation(recorded, model, gates, noise, held, {}, {}, None, diagnosis)
    std = _noise_std(recorded, noise)
    simulator.begin_near(model, std, train)
    step = position_step([r.position for r in recorded.realizations])
    seen = std if step is None else widened(std, step, recorded.experiment.samples_per_period)

    def fitted_by(simulator: Simulator, std: np.ndarray) -> Fitter:
        return Fitter(recorded, simulator, std, model.plant, train, held, tolerance, effects)

    fitter, bare = fitted_by(simulator, seen), simulator
    if step is not None and simulator.repeats and coarse(recorded, step):
        progress("rounding in the loop")
        simulator, fitter = _rounding_in_the_loop(simulator, fitter, fitted_by, step, std)
    attribution = Search(fitter, progress, until).run()
    if step is not None and (effects is None or ROUNDING in effects):
        plain = Misfit(recorded, bare, std, train), Misfit(recorded, bare, std, held)
        attribution = with_rounding(attribution, plain, step)
    progress("judgement")
    gates = with_bags_gate(gates, recorded, noise, simulator, attribution.best.model)
    best = attribution.best
    named = ROUNDING in best.effects  # then only the explanation holds what rounding adds
    rounded = simulator.signals(best.model) if named else None
    without, alone = (
        (bare, Misfit(recorded, bare, std, held)) if named else (simulator, fitter.held)
    )
    explained = smooth(best.model) if len(best.effects) > 1 else best.model
    signals = {
        "nominal": without.signals(model),
        "refit": without.signals(attribution.refit.model),
        "explained": simulator.signals(explained),
    }
    maps = {name: residual_map(recorded, noise, *simulated) for name, simulated in signals.items()}
    diagnosis = judge(
        recorded, std, gates, fitter, attribution, signals, maps, held_out=held_out,
        known_noise=noise is not None, nominal_misfit=alone.chi2(model), rounded=rounded,
    )  # fmt: skip
    return Investigation(recorded, model, gates, noise, held, signals, maps, attribution, diagnosis)


def _rounding_in_the_loop(
    simulator: Simulator,
    fitter: Fitter,
    fitted_by: Callable[[Simulator, np.ndarray], Fitter],
    step: float,
    std: np.ndarray,
) -> tuple[Simulator, Fitter]:
    """Return what simulates and fits a motion of few counts, if that comes nearer to the record.

    What rounding adds is simulated with the refit, which is fitted anew beside it.

    Args:
        simulator: of models whose encoder does not round.
        fitter: for which rounding is white noise.
        fitted_by: makes a fitter that simulates by one, with such noise of the lines.
        step: of the encoder, rad.
        std: noise of the lines, see `NoiseLevels.of_outputs`.
    """
    refit = fitter.refit()
    least, chosen = refit.held_chi2, (simulator, fitter)
    for _ in range(_ROUNDS):
        if least < NOTHING_LEFT * fitter.held.size:
            break
        rounded = in_the_loop(simulator, refit.model, step, std.shape)
        other = simulator.adding(rounded.added)
        fitter = fitted_by(other, np.hypot(std, rounded.std))
        refit = fitter.refit()
        if not refit.held_chi2 < least:
            break
        least, chosen = refit.held_chi2, (other, fitter)
    return chosen


def _split(recorded: RecordedExperiment) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return `split` of the realizations."""
    runs = recorded.realizations
    return split([r.level for r in runs], [float(np.abs(r.torque).max()) for r in runs])


def split(
    levels: Sequence[int], greatest_torques: Sequence[float]
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return training and held-out realizations: in turn at each level; all, if a level has one.

    At each level the one with the greatest torque is for training, so that a limit that it reaches
    is known to the fit before others are predicted.

    Args:
        levels: level of each realization.
        greatest_torques: greatest |u| of each.
    """
    train, held = [], []
    for level in sorted(set(levels)):
        members = [i for i, mine in enumerate(levels) if mine == level]
        members.sort(key=lambda i: -greatest_torques[i])
        train += members[0::2]
        held += members[1::2]
    return tuple(sorted(train)), tuple(sorted(held or train))


def _noise_std(recorded: RecordedExperiment, noise: NoiseLevels | None) -> np.ndarray:
    """Return `NoiseLevels.of_outputs`, or an upper bound if no noise is known."""
    return (noise or even_lines_as_noise(recorded)).of_outputs(recorded)
