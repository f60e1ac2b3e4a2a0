"""Does the rig change while it is recorded? Between the periods of a bag, without a model.

Between the periods of one bag the reference is the same, so no effect that stays what it is can
change the response. A drift changes it where the response is: on excited lines. Noise and a
decaying transient have smooth spectra, so the even lines between, which carry no excitation, tell
how much of the change is theirs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from fjr_records.periodic import RecordedExperiment

EVEN_LINES_PER_BLOCK = 12
"""The noise falls steeply over few lines only; within a block excited and even lines alternate."""
MAX_Z = 8.0
"""Greatest score of one block: a single one may not decide alone."""
PERIOD_Z_LIMIT = 4.5
"""Of 300 records without a gap, 6 bags of 12 s each, 1 % exceed 2.9 and none 4.2; a drift of all
friction by 1e-4 per second gives 10 or more (`benchmarks/stationarity.py`)."""


@dataclass(frozen=True)
class PeriodDrift:
    """Change of y from period to period on excited lines, beyond that on even lines.

    Attributes:
        z: its significance, standard normal if nothing drifts.
        per_level: the same of each level, (levels,).
        relative: change over one period of the excited lines, rms over rms, beyond noise; the
            greatest of the levels.
    """

    z: float
    per_level: np.ndarray
    relative: float


def period_drift(recorded: RecordedExperiment) -> PeriodDrift | None:
    """Test for a drift between the periods of the bags.

    Blocks of neighbouring lines give independent F ratios of the linear trend's power on excited
    to that on even lines; their p-values are combined by Stouffer's method. None for one period,
    or where no even line is free of excitation.
    """
    if recorded.experiment.periods < 2:
        return None
    found = [_level_drift(recorded, level) for level in recorded.levels]
    z = [scores for scores, _ in found]
    every = np.concatenate(z)
    if not every.size:
        return None
    return PeriodDrift(
        float(every.sum() / np.sqrt(every.size)),
        np.array([scores.sum() / np.sqrt(max(scores.size, 1)) for scores in z]),
        max(relative for _, relative in found),
    )


def _trend(periods: int) -> np.ndarray:
    """Return the contrast of unit norm that is linear over periods, (P,)."""
    slope = np.arange(periods) - 0.5 * (periods - 1)
    return slope / np.sqrt((slope**2).sum())


def _level_drift(recorded: RecordedExperiment, level: int) -> tuple[np.ndarray, float]:
    """Return the scores of the blocks of one level, and the relative change per period."""
    members = [r for r in recorded.realizations if r.level == level]
    kinds, lines = recorded.kinds(), recorded.lines
    contrast = _trend(recorded.experiment.periods)
    spectra = np.array([r.spectrum(r.position, lines) for r in members])
    power = np.mean(np.abs(np.einsum("p,mpk->mk", contrast, spectra)) ** 2, axis=0)
    even = np.flatnonzero(kinds == "even")
    blocks = [b for b in np.array_split(even, max(even.size // EVEN_LINES_PER_BLOCK, 1)) if b.size]
    scores, excess, signal = [], 0.0, 0.0
    for block in blocks:
        excited = np.flatnonzero(kinds == "excited")
        excited = excited[(excited >= block[0] - 1) & (excited <= block[-1])]
        if not excited.size:
            continue
        ratio = power[excited].mean() / power[block].mean() if power[block].any() else 1.0
        p = stats.f.sf(ratio, 2 * len(members) * excited.size, 2 * len(members) * block.size)
        scores.append(np.clip(stats.norm.isf(p), -MAX_Z, MAX_Z))
        excess += excited.size * (power[excited].mean() - power[block].mean())
        signal += float(np.mean(np.abs(spectra.mean(1)[:, excited]) ** 2, axis=0).sum())
    per_period = max(excess, 0.0) * (contrast[1] - contrast[0]) ** 2
    return np.array(scores), float(np.sqrt(per_period / signal)) if signal else 0.0
