"""An encoder that counts in coarse steps: seen in the records themselves, and played in the loop.

All recorded positions are then multiples of one step, which no fit has to find. Where the motion
passes many counts, what is rounded away is white noise of variance step^2/12, as `record_noise`
says. A motion that takes many samples for a count has errors that are no white noise: they go with
the motion, and move it in the mean by several times as much. In the loop the rounding decides
chaotically which count comes next, so that no simulation meets it sample by sample; simulations
that round, each with noise of its own, show how far it moves the motion and how far it scatters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fjr_kit.telling import Progress

from ..fits.cell_fits import CellFitter
from ..fits.comparison import NOTHING_LEFT, CellFit
from ..model.evidence import Evidence
from ..model.lapped import lapped
from ..model.rig_model import Model
from ..model.simulated_rig import run_parallel
from ..outcome.verdict_words import ROUNDING
from .found import Found

STEP = f"{ROUNDING}.resolution_rad"
"""Name of the step of the encoder."""
_FEW_COUNTS = 30.0
"""Of the rms motion: rounding that is finer acts as white noise."""
_ROUNDS = 3  # of simulating what rounding adds to the best fit, and fitting it anew
_NEAR = 4.0
"""Misfit by noise and rounding above which a model misses so much that it cannot say what rounding
adds: two standard deviations of rounding, more than half a step."""
_SIMULATED = 8  # simulations of each run that round
_DITHER = 0.05  # of a step: noise that makes the simulations take other counts
_OFF_GRID = 0.01  # of a step: counts of the simulator are multiples of it


@dataclass(frozen=True)
class Rounded:
    """What rounding does to the motion of a model in its loop.

    Attributes:
        added: on the average, to y, u and q of each run, float64 (3, samples).
        power: mean square of how far y scatters about that average, in the bands of the
            motion of each level, (levels * bands,), rad2.
    """

    added: Sequence[np.ndarray]
    power: np.ndarray

    @property
    def finite(self) -> bool:
        """Whether no simulation diverged."""
        return all(np.isfinite(signals).all() for signals in self.added)


def beside_rounding(
    fitter: CellFitter, found: Found, progress: Progress = lambda _: None
) -> tuple[CellFitter, Found]:
    """Return what fits a motion of few counts, and its fits, if these come nearer to the records.

    What rounding adds is simulated with the best fit, and all are fitted anew beside it. The noise
    is then what was seen and what rounding scatters. A model that misses more than about half a
    step cannot say what rounding adds.

    Args:
        fitter: of the fits.
        found: the refit of the base parameters, and perhaps causes.
        progress: told that rounding is simulated.
    """
    chosen = fitter, found
    if not in_few_counts(fitter.evidence) or not _can_be_played(fitter.evidence):
        return chosen
    yardstick = fitter.weights.select_floor  # of all rounds: noise that grows is not nearer
    least = np.sum(_squares(fitter, found.best) / yardstick)
    for number in range(_ROUNDS):
        before, fits = chosen
        if number and before.misfit(fits.best) < NOTHING_LEFT:
            break
        progress("rounding in the loop")
        rounded = in_the_loop(before.evidence, fits.best.model)
        if not rounded.finite:
            break
        after, again = _fitted_anew(before, fits, rounded)
        left = np.sum(_squares(after, again.best) / yardstick)
        if not left < least:
            break
        chosen, least = (after, again), left
    return chosen if chosen[0].misfit(chosen[1].best) < _NEAR else (fitter, found)


def _fitted_anew(fitter: CellFitter, found: Found, rounded: Rounded) -> tuple[CellFitter, Found]:
    """Return what fits beside rounding, and steps fitted anew; rivals stay, and are judged anew."""
    evidence = fitter.evidence
    other = CellFitter(_evidence(evidence, rounded), fitter.nominal, fitter.tolerance)
    steps = [other.refit(), *(other.taken_over(fit) for fit in found.steps[1:])]
    rivals = {
        count: [replace(f, left=other.left_by(f.model, f.variance)) for f in fits]
        for count, fits in found.rivals.items()
    }
    return other, replace(found, steps=steps, rivals=rivals)


def in_few_counts(evidence: Evidence) -> bool:
    """Tell whether a motion is of so few counts that its rounding is not white.

    Only where rounding is more than the noise.
    """
    if evidence.slow or not evidence.noise.rounds:
        return False
    positions = [record.position for record in evidence.records.records]
    return min(float(np.std(p)) for p in positions) < _FEW_COUNTS * step_of(evidence)


def _can_be_played(evidence: Evidence) -> bool:
    """Tell whether the loop is known, and counts lie where those of the simulator do."""
    step = step_of(evidence)
    counts = np.array([record.position[0] for record in evidence.records.records]) / step
    on_grid = float(np.abs(counts - np.rint(counts)).max()) < _OFF_GRID
    return on_grid and None not in evidence.player.loop.laws


def step_of(evidence: Evidence) -> float:
    """Return the step of an encoder that has one, rad."""
    step = evidence.noise.step_rad
    assert step is not None
    return step


def with_step(model: Model, step: float) -> Model:
    """Return a model whose encoder counts in steps (rad)."""
    return model.with_effects({STEP: step})


def in_the_loop(evidence: Evidence, model: Model) -> Rounded:
    """Return what rounding does to the motion of a model whose encoder does not round.

    Args:
        evidence: records whose loop is known, and the step of whose encoder is.
        model: the model.
    """
    rng = np.random.default_rng(0)
    step, simulator = step_of(evidence), evidence.player.adding(None)
    records, levels = evidence.records.records, evidence.records.levels
    smooth = simulator.run([model], range(len(records)))[0]
    added: list[np.ndarray] = []
    scatter: dict[int, list[np.ndarray]] = {level: [] for level in levels}
    for index, record in enumerate(records):  # one by one, for the memory that long runs take
        play = partial(simulator.disturbed, with_step(model, step), index)
        noise = rng.normal(0.0, _DITHER * step, (_SIMULATED, record.samples))
        runs = np.array(run_parallel(play, list(noise)))
        added.append(runs.mean(axis=0) - smooth[index])
        lines = lapped(runs[:, 0], evidence.hop)[..., : evidence.lines]
        scatter[record.level].append(np.var(lines, axis=0, ddof=1))
    by_line = np.array([np.concatenate(scatter[level]).mean(axis=0) for level in levels])
    by_band = evidence.octaves.means(by_line)
    return Rounded(added, (1.0 + 1.0 / _SIMULATED) * by_band.ravel())


def _evidence(evidence: Evidence, rounded: Rounded) -> Evidence:
    """Return the evidence beside simulations to which is added what rounding does."""
    seen = evidence.noise.seen_rad
    white = evidence.noise.std_rad**2  # at the least, where no noise beside it is seen
    power = np.maximum(rounded.power, white) if math.isnan(seen) else rounded.power + seen**2
    player = evidence.player.adding(rounded.added)
    return evidence.played_by(player, evidence.power_beside_twist(power))


def _squares(fitter: CellFitter, fit: CellFit) -> np.ndarray:
    """Return the squared error that a fit leaves on unseen parts, by part and band, rad2."""
    return fitter.weights.counts * (fit.left - fitter.weights.select_floor)
