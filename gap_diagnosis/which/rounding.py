"""An encoder that counts in coarse steps: seen in the record itself, and judged as noise.

All recorded positions are then multiples of one step, which no fit has to find. In the loop the
rounding decides chaotically which count comes next: it repeats with the periods, so that their
scatter does not show it, but no simulation meets it sample by sample. So it widens the variance of
the lines, step^2/12 a sample, and is named where the refit, or the effects beside it, leave nothing
but that.

A motion that takes many samples for a count has errors that are no white noise: they go with the
motion, and move it in the mean by several times as much. Simulations that round, each with noise of
its own, show both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.ndimage import uniform_filter1d

from fjr_records.periodic import RecordedExperiment
from fjr_records.spectra import line_spectrum

from ..model.misfit import Misfit
from ..model.rig_model import Model
from ..model.simulated_rig import Simulator, run_parallel
from ..outcome.verdict_words import ROUNDING
from .attribution import CERTAIN, PLAIN, SECOND_GAIN, SMALL_GAIN, Attribution
from .fits import Fit

_FEW_COUNTS = 30.0
"""Of the rms motion: rounding that is finer acts as white noise."""
_SIMULATED = 8  # simulations of each realization that round
_ALIKE = 9  # neighbouring lines that rounding scatters alike
_DITHER = 0.05  # of a step: noise that makes the simulations take other counts


def widened(noise_std: np.ndarray, step: float, samples: int) -> np.ndarray:
    """Return the noise of the lines of y with that of rounding, as `NoiseLevels.of_outputs`."""
    out = noise_std.copy()
    rounding = np.full(noise_std.shape[-1], step / np.sqrt(3.0 * samples))
    rounding[0] *= 0.5
    out[:, 0] = np.hypot(out[:, 0], rounding)
    return out


@dataclass(frozen=True)
class Rounded:
    """What rounding does to the motion of a model in its loop.

    Attributes:
        added: on the average, to y, u and q, float64 (realizations, 3, N).
        std: how far it scatters about that average, by the lines of the outputs as
            `NoiseLevels.of_outputs`, (realizations, outputs, lines), rad.
    """

    added: np.ndarray
    std: np.ndarray


def coarse(recorded: RecordedExperiment, step: float) -> bool:
    """Tell whether a motion is of so few counts that its rounding may be no white noise."""
    return min(float(np.std(r.position)) for r in recorded.realizations) < _FEW_COUNTS * step


def in_the_loop(simulator: Simulator, model: Model, step: float, shape: tuple[int, ...]) -> Rounded:
    """Return what rounding does to the motion of a model whose encoder does not round.

    Args:
        simulator: of a loop that is known.
        model: the model.
        step: of the encoder, rad.
        shape: realizations, outputs and lines.
    """
    rng = np.random.default_rng(0)
    rounds = model.with_effects({f"{ROUNDING}.resolution_rad": step})
    realizations, outputs, lines = shape
    smooth = np.stack(simulator.motion(model, range(realizations)), axis=1)
    added, scatter = np.empty_like(smooth), np.empty(shape)
    for index in range(realizations):  # one by one, for the memory that runs of hours take
        noise = rng.normal(0.0, _DITHER * step, (_SIMULATED, simulator.samples))
        runs = np.array(run_parallel(partial(simulator.disturbed, rounds, index), list(noise)))
        added[index] = runs.mean(axis=0) - smooth[index]
        spectra = line_spectrum(runs[:, [0, 2][:outputs]], lines)
        scatter[index] = np.var(spectra, axis=0, ddof=1)
    scatter = uniform_filter1d(scatter, _ALIKE, mode="nearest")
    return Rounded(added, np.sqrt((1.0 + 1.0 / _SIMULATED) * scatter))


def with_rounding(
    attribution: Attribution, plain: tuple[Misfit, Misfit], step: float
) -> Attribution:
    """Return an attribution that names the rounding, if its best explanation leaves that alone.

    Args:
        attribution: from misfits whose variance is widened by the rounding.
        plain: misfits of the training and of the held-out data whose variance is not.
        step: of the encoder, rad.
    """
    best = attribution.best
    if not attribution.explained or best.held_chi2 > PLAIN * plain[1].size:
        return attribution

    def costs(fit: Fit) -> tuple[float, float]:
        train, held = (misfit.chi2(fit.model) * misfit.size for misfit in plain)
        return train, held

    held = costs(best)[1]
    gain = SECOND_GAIN if best.effects else SMALL_GAIN
    if held - best.held_chi2 < CERTAIN or held < gain * best.held_chi2:
        return attribution
    found = _rounded(best, step)
    tied = tuple(_rounded(fit, step) for fit in attribution.tied)
    more = held - best.held_chi2
    others = [
        replace(f, held_chi2=f.held_chi2 + more)
        for f in attribution.candidates
        if ROUNDING not in f.effects
    ]
    train, held = costs(attribution.refit)
    return Attribution(
        replace(attribution.refit, train_chi2=train, held_chi2=held), (found, *tied, *others),
        found, tied, True, attribution.complete, (more + best.held_chi2) / plain[1].size,
    )  # fmt: skip


def smooth(model: Model) -> Model:
    """Return a model whose encoder does not round."""
    left = {name: value for name, value in model.effects.items() if not name.startswith(ROUNDING)}
    return replace(model, effects=left)


def _rounded(fit: Fit, step: float) -> Fit:
    """Return a fit with the encoder's step, which is known and not fitted."""
    name = f"{ROUNDING}.resolution_rad"
    space, solution = fit.space, fit.solution
    return replace(
        fit,
        effects=tuple(sorted((*fit.effects, ROUNDING))),
        model=fit.model.with_effects({name: step}),
        space=replace(space, effects=(*space.effects, name), units=(*space.units, step)),
        solution=replace(
            solution,
            x=np.append(solution.x, 1.0),
            jacobian=np.hstack([solution.jacobian, np.zeros((solution.residuals.size, 1))]),
        ),
    )
