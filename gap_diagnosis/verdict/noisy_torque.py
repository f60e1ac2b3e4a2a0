"""Noise of a recorded torque that drives the model: its sensor's, which the rig never felt.

Where nobody knows the loop, the recorded torque moves the model, and so does the noise in it. Its
size cannot be told from the torque alone: a rig does feel what a controller makes of the noise of
its encoder. But noise that the rig did not feel leaves errors which are, as torques, alike at all
frequencies, and no stronger than what the torque holds where it holds least. What friction, a
spring or an inertia leaves is strong in some bands and weak in others. So the errors of the band
in which there is the least for it say how strong the noise may be; where it explains most of what
is left in all bands, it counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.signal import welch

from fjr_records.records import RecordSet

from ..fits.cell_fits import CellFitter
from ..fits.comparison import NOTHING_LEFT, CellFit
from ..how_far.ledger import Ledger
from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..model.simulated_rig import run_parallel
from ..model.steady_runs import SteadyRuns
from ..outcome.diagnosis import Diagnosis
from ..outcome.gap_size import Estimate
from ..which.rounding import in_few_counts

_OCTAVES = 6
_HIGHEST = 0.8
"""Of half the sample rate: above it a filter may have taken the noise away."""
_FEWEST_NUMBERS = 200
"""Independent numbers of the torque in an octave: of fewer, chance makes the least too small."""
_PER_SEGMENT = 1024
_MOST = 0.1
"""Of the torque's variance: where it holds more in all octaves, that is what excites the rig."""
_FEWEST_ERRORS = 60
"""Of a cell, and noise that is more than the position's there: what else shows no noise."""
_NEAR = 4.0
"""Misfit beside the noise above which more than noise is left: that hides how strong noise is."""
_NOT_NEEDED = 0.75
"""How sure a cause is, of what it was, where noise explains what is left without any."""
_SIMULATED = 4  # simulations of each run with noise of its torque
_SEED = 1
_REPEATED = 2  # fits with as much noise again


@dataclass(frozen=True)
class TorqueNoise:
    """Noise of a recorded torque.

    Attributes:
        rms: of the samples of each run, (runs,), N m.
        share: of all runs together, over the rms of their torque about its mean.
        power: mean square of an error that it makes in each cell, (cells,), rad2.
    """

    rms: np.ndarray
    share: float
    power: np.ndarray

    @property
    def note(self) -> str:
        """What a reader must know of it."""
        return (
            f"The recorded torque, which drives the model, holds noise of {self.share:.1%} of its "
            "rms about the mean that did not move the rig, or torques as random moved it that are "
            "not recorded: errors are as such noise makes them, alike as torques in all bands, and "
            "no stronger than what the torque holds where it holds least. It counts as noise. "
            "What is driven by it seems more sluggish than it is, and the intervals reach to "
            "where sizes would be without it."
        )

    def counted(self, evidence: Evidence) -> Evidence:
        """Return the evidence to whose noise it is added."""
        return evidence.played_by(evidence.player, evidence.noise_power + self.power)

    def beside(self, records: RecordSet, seed: int) -> RecordSet:
        """Return the records with as much noise of the torque again."""
        random = np.random.default_rng(seed)
        noisy = [
            replace(r, torque=r.torque + rms * random.standard_normal(r.samples))
            for r, rms in zip(records.records, self.rms.tolist(), strict=True)
        ]
        return replace(records, records=tuple(noisy))


def unfelt_noise(fitter: CellFitter, best: CellFit) -> TorqueNoise | None:
    """Return the noise of the torque that a fit shows; None where it is not most of the rest.

    Fits are not weighed by it: it is alike on all lines, of which the highest bands hold most, and
    these are where a model of a driven rig is least exact.

    Args:
        fitter: that made the fit.
        best: the refit of the base parameters, or that with all causes.
    """
    evidence = fitter.evidence
    if not _driven(evidence) or fitter.left_in_a_band(best) < NOTHING_LEFT:
        return None
    noise = torque_noise(evidence, best.model)
    if noise is None:
        return None
    left = Ledger(noise.counted(evidence), fitter.select_parts).step(best.model, None, "refit")
    return noise if (left.chi2_per_dof or math.inf) < _NEAR else None


def beside_the_noise(
    diagnosis: Diagnosis, fitter: CellFitter, fit: CellFit, noise: TorqueNoise
) -> Diagnosis:
    """Return a diagnosis whose intervals reach to where sizes would be without the noise.

    Where noise explains what the refit leaves, no cause is needed, and each is less sure. Noise of
    what drives a model biases its fit (errors in variables). As much noise again moves the fit by
    as much again, to first order (simulation extrapolation: Cook, Stefanski 1994, JASA 89).

    Args:
        diagnosis: of the fit.
        fitter: that made the fit.
        fit: the best one.
        noise: of the torque.
    """
    moved = np.zeros(fit.solution.x.size)
    for seed in range(_REPEATED):
        records = noise.beside(fitter.evidence.records, seed)
        twice = fitter.with_runs(records).taken_over(fit)
        moved += (twice.solution.x - fit.solution.x) / _REPEATED
    space = fit.space
    without = space.model(np.clip(fit.solution.x - moved, *space.bounds()))
    values = {**without.plant, **without.effects}
    parameters = {n: _reaching(e, values.get(n)) for n, e in diagnosis.parameters.items()}
    reaching = diagnosis.with_parameters(parameters)
    left = diagnosis.steps[1].chi2_per_dof
    sure = _NOT_NEEDED if left is not None and left < NOTHING_LEFT else 1.0
    causes = [
        cause.model_copy(update={"present": sure * cause.present}) for cause in reaching.causes
    ]
    confidence = min((c.present for c in causes), default=diagnosis.confidence)
    return reaching.model_copy(update={"causes": causes, "confidence": confidence})


def _reaching(found: Estimate, without: float | None) -> Estimate:
    """Return an interval that reaches as much further as its value would be moved."""
    if without is None or found.value is None or found.low is None or found.high is None:
        return found
    by = without - found.value
    return found.model_copy(
        update={"low": found.low + min(by, 0.0), "high": found.high + max(by, 0.0)}
    )


def _driven(evidence: Evidence) -> bool:
    """Tell whether the recorded torque drives the model in all runs, and nothing shows its noise.

    Mean periods show what scatters between them, of the torque as well. What an encoder of coarse
    steps leaves is not its torque's.
    """
    if evidence.slow or evidence.records.swings_free or not evidence.noise.known:
        return False
    if in_few_counts(evidence):
        return False
    steady = isinstance(evidence.records, SteadyRuns)
    return not steady and not any(evidence.player.loop.laws)


def torque_noise(evidence: Evidence, model: Model) -> TorqueNoise | None:
    """Return the noise of the torque that the errors of a model show; None where they show none.

    Args:
        evidence: records whose torque drives the model.
        model: the best one.
    """
    torques = [record.torque for record in evidence.records.records]
    powers = [float(np.var(torque)) for torque in torques]
    most = [most_noise(torque) for torque in torques]
    if np.sum(np.square(most)) > _MOST * np.sum(powers):
        return None
    parts = evidence.parts_for("fit", "select")
    cells = evidence.cell_of(parts)
    numbers = np.bincount(cells, minlength=evidence.cells)
    made = _made(evidence, model, most)
    if made is None:
        return None
    known = evidence.floor(parts)
    left = evidence.mean_squares(evidence.errors([model], parts)[0], parts)
    band = np.arange(evidence.cells) % evidence.bands
    shows = (numbers >= _FEWEST_ERRORS) & (made > known) & (band > 0)
    if not shows.any():
        return None
    share = min(float(((left - known)[shows] / made[shows]).min()), 1.0)
    power = share * made
    if not np.any(power[shows] > known[shows]):
        return None
    rms = np.sqrt(share) * np.array(most)
    return TorqueNoise(rms, float(np.sqrt(np.sum(rms**2) / np.sum(powers))), power)


def most_noise(torque: np.ndarray) -> float:
    """Return the rms of the strongest white noise that a recorded torque can hold, N m.

    Args:
        torque: float64 (samples,), N m.
    """
    frequency, density = welch(torque, nperseg=min(_PER_SEGMENT, torque.size))
    frequency = 2.0 * frequency  # over half the sample rate
    found = []
    for octave in range(_OCTAVES):
        high = _HIGHEST / 2**octave
        inside = density[(frequency > high / 2.0) & (frequency <= high)]
        if inside.size and 0.25 * high * torque.size >= _FEWEST_NUMBERS:
            found.append(float(np.mean(inside)))
    return float(np.sqrt(min(found) / 2.0)) if found else 0.0


def _made(evidence: Evidence, model: Model, rms: list[float]) -> np.ndarray | None:
    """Return the mean square of the errors that noise of each torque makes in each cell, rad2.

    None where the motion diverges.
    """
    random = np.random.default_rng(_SEED)
    player = evidence.player
    smooth = player.run([model], range(len(rms)))[0]
    squares: list[np.ndarray] = [np.empty(0)] * len(rms)
    for index, size in enumerate(rms):
        samples = evidence.records.records[index].samples
        noises = size * random.standard_normal((_SIMULATED, samples))
        runs = run_parallel(partial(player.disturbed, model, index, None), list(noises))
        if not all(np.isfinite(run[0]).all() for run in (*runs, smooth[index])):
            return None
        lines = evidence.lines_of(smooth[index], index)
        moved = [evidence.lines_of(run, index) - lines for run in runs]
        squares[index] = np.mean(np.square(moved), axis=0)
    every = range(len(evidence.parts))
    cuts = (squares[evidence.parts[p].record][evidence.parts[p].windows].ravel() for p in every)
    return evidence.mean_squares(np.sqrt(np.concatenate(list(cuts))), every)
