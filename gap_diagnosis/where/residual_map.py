"""Where the gap lies: every line of real minus simulated, tested against the noise alone.

Reference and phases are the same in rig and simulation, so nonlinear distortion is reproducible and
only noise may differ. Residuals of the realizations of a level are pooled line by line; the
Benjamini-Hochberg procedure (1995, J. R. Stat. Soc. B 57) over all levels and lines keeps the share
of false discoveries below a limit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

from fjr_records.noise import NoiseLevels
from fjr_records.periodic import RecordedExperiment
from fjr_records.spectra import line_spectrum

from ..outcome.cause import LineKind, Place

Signal = Literal["position", "torque"]

FALSE_DISCOVERY_RATE = 0.01
KINDS: tuple[LineKind, ...] = ("excited", "odd", "even", "dc")
_BRIDGE = 2  # insignificant lines of a kind that do not end a band


@dataclass(frozen=True)
class SignalMap:
    """Residual of one signal, pooled over realizations.

    Attributes:
        residual: float64 (levels, lines), rms over realizations of |real - simulated|, rad or N m.
        noise: (levels, lines), standard deviation of the mean spectrum; NaN if not known.
        sigma: (levels, lines), residual over noise: about 1 without a gap, inf if the simulation
            diverged, NaN if noise is not known.
        p: (levels, lines), probability of such a residual from noise alone.
        significant: bool (levels, lines), discoveries.
    """

    residual: np.ndarray
    noise: np.ndarray
    sigma: np.ndarray
    p: np.ndarray
    significant: np.ndarray


@dataclass(frozen=True)
class ResidualMap:
    """The residual over levels, lines and kinds of line.

    Attributes:
        frequency_hz: (lines,), from DC on.
        kinds: str (lines,): excited, odd, even or dc.
        levels: the levels.
        amplitudes_rad: (levels,), rms over excited lines of the reference amplitude.
        signals: position, and torque if it was simulated.
        false_discovery_rate: the limit that the discoveries keep.
    """

    frequency_hz: np.ndarray
    kinds: np.ndarray
    levels: tuple[int, ...]
    amplitudes_rad: np.ndarray
    signals: Mapping[Signal, SignalMap]
    false_discovery_rate: float

    @property
    def discoveries(self) -> int:
        """Number of significant lines, over levels and signals."""
        return int(sum(part.significant.sum() for part in self.signals.values()))

    def places(self, limit: int | None = None) -> list[Place]:
        """Return contiguous bands of discoveries, strongest first, at most `limit` of them.

        The sigma of a place is the rms over its significant lines.
        """
        found = [place for name in self.signals for place in self._places_of(name)]
        found.sort(key=lambda place: -place.sigma)
        return found[:limit]

    def _places_of(self, name: Signal) -> Iterator[Place]:
        part = self.signals[name]
        for row, level in enumerate(self.levels):
            for kind in KINDS:
                of_kind = np.flatnonzero(self.kinds == kind)
                for band in bands(part.significant[row, of_kind]):
                    lines = of_kind[band]
                    lines = lines[part.significant[row, lines]]
                    ends = self.frequency_hz[lines[0]], self.frequency_hz[lines[-1]]
                    yield Place(
                        level=level,
                        band_hz=(float(ends[0]), float(ends[1])),
                        lines=kind,
                        signal=name,
                        sigma=float(np.sqrt(np.mean(part.sigma[row, lines] ** 2))),
                    )


def residual_map(
    recorded: RecordedExperiment,
    noise: NoiseLevels | None,
    position: np.ndarray,
    torque: np.ndarray | None = None,
    false_discovery_rate: float = FALSE_DISCOVERY_RATE,
) -> ResidualMap:
    """Compare a simulation with the record, line by line.

    Args:
        recorded: the experiment.
        noise: from `noise_levels`; None (one period) leaves residuals without significance.
        position: simulated steady period of y of each realization, (n, N), rad.
        torque: the same of u, N m; None to leave it out.
        false_discovery_rate: limit of the share of false discoveries, for each signal.
    """
    simulated: dict[Signal, np.ndarray] = {"position": position}
    if torque is not None:
        simulated["torque"] = torque
    signals = {
        name: _signal_map(recorded, noise, name, periods, false_discovery_rate)
        for name, periods in simulated.items()
    }
    return ResidualMap(
        np.arange(recorded.lines) * recorded.experiment.base_frequency_hz,
        recorded.kinds(),
        recorded.levels,
        recorded.amplitudes_rad,
        signals,
        false_discovery_rate,
    )


def line_residuals(recorded: RecordedExperiment, name: Signal, simulated: np.ndarray) -> np.ndarray:
    """Return mean spectrum minus simulated spectrum, complex (n, lines); NaN where it diverged."""
    lines = recorded.lines
    means = [r.spectrum(getattr(r, name), lines).mean(0) for r in recorded.realizations]
    return np.array(means) - line_spectrum(simulated, lines)


def _signal_map(
    recorded: RecordedExperiment,
    noise: NoiseLevels | None,
    name: Signal,
    simulated: np.ndarray,
    rate: float,
) -> SignalMap:
    power = np.abs(line_residuals(recorded, name, simulated)) ** 2
    power[np.isnan(power)] = np.inf
    level_of = np.array([r.level for r in recorded.realizations])
    mean = np.array([power[level_of == level].mean(0) for level in recorded.levels])
    if noise is None:
        unknown = np.full(mean.shape, np.nan)
        none = np.zeros(mean.shape, bool)
        return SignalMap(np.sqrt(mean), unknown, unknown, unknown, none)
    deviation = getattr(noise, name)
    counts = np.array([(level_of == level).sum() for level in recorded.levels])
    p = p_values(mean / deviation**2, counts, noise.dof)
    return SignalMap(np.sqrt(mean), deviation, np.sqrt(mean) / deviation, p, discoveries(p, rate))


def p_values(ratio: np.ndarray, counts: np.ndarray, dof: np.ndarray) -> np.ndarray:
    """Return the probability that noise alone gives a mean squared ratio as large, or larger.

    Args:
        ratio: (levels, lines), mean over realizations of |residual|^2 / noise variance.
        counts: (levels,), number of realizations in that mean.
        dof: (levels, lines), degrees of freedom of the noise variance.

    A ratio of independent chi-squares: F with 2 n (n at DC, which is real) and `dof` degrees.
    """
    numerator = np.broadcast_to(2.0 * counts[:, None], ratio.shape).copy()
    numerator[:, 0] *= 0.5
    return stats.f.sf(ratio, numerator, dof)


def discoveries(p: np.ndarray, rate: float) -> np.ndarray:
    """Return which of the p-values, of any shape, the Benjamini-Hochberg procedure rejects."""
    return stats.false_discovery_control(p, axis=None).reshape(p.shape) <= rate


def bands(significant: np.ndarray) -> list[slice]:
    """Return runs of significant lines, bridging short gaps; each begins and ends in one."""
    found: list[slice] = []
    for index in np.flatnonzero(significant):
        if found and index - found[-1].stop <= _BRIDGE:
            found[-1] = slice(found[-1].start, int(index) + 1)
        else:
            found.append(slice(int(index), int(index) + 1))
    return found
