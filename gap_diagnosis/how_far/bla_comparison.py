"""Rig and simulations side by side: BLA, distortion levels and one period in time, level by level.

Rig and simulations are analysed by the same estimator on the same lines, so that what differs is
the plant and not the method.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bla_analyzer.bla.fast import fast_bla
from bla_analyzer.bla.robust import robust_bla
from bla_analyzer.distortion.levels import line_levels
from bla_analyzer.results.result import LineLevels
from fjr_records.lines import Lines, classify
from fjr_records.periodic import RecordedExperiment
from fjr_records.spectra import PeriodSums, RealizationSpectra

from ..model.simulated_rig import Signals

Periods = tuple[np.ndarray, np.ndarray, np.ndarray]
"""r (rad), u (N m) and y (rad), float64 (periods, N) each."""


@dataclass(frozen=True)
class Response:
    """What one plant, rig or simulation, does at one level.

    Attributes:
        g: complex (F,), BLA at the excited lines, rad/(N m).
        radius_95: (F,), radius of its 95 % disc; NaN if it cannot be known.
        sigma: (F,), standard deviation of g by nonlinearity and noise; NaN if not known.
        odd, even: levels at the detection lines.
    """

    g: np.ndarray
    radius_95: np.ndarray
    sigma: np.ndarray
    odd: LineLevels
    even: LineLevels


@dataclass(frozen=True)
class LevelComparison:
    """Rig and simulations at one level.

    Attributes:
        level: the level.
        amplitude_rad: rms over lines of the reference amplitude.
        frequency_hz: (F,), of the excited lines.
        rig: its response.
        models: response of each simulation that does not diverge, by name.
        time_s: (N,), of one period.
        realization: name of the bag whose period is shown; a held-out one where there is one.
        position, torque: by name (`rig` and models), (N,), mean period of that bag, rad and N m.
    """

    level: int
    amplitude_rad: float
    frequency_hz: np.ndarray
    rig: Response
    models: Mapping[str, Response]
    time_s: np.ndarray
    realization: str
    position: Mapping[str, np.ndarray]
    torque: Mapping[str, np.ndarray]


def compare(
    recorded: RecordedExperiment, simulated: Mapping[str, Signals], held: tuple[int, ...] = ()
) -> list[LevelComparison]:
    """Compare simulations with the rig level by level.

    Args:
        recorded: the experiment.
        simulated: signals of each model by its name; none leaves the rig alone.
        held: indices of the held-out realizations, of which the time signals are shown.
    """
    return [
        _level(recorded, level, amplitude, simulated, held)
        for level, amplitude in zip(recorded.levels, recorded.amplitudes_rad, strict=True)
    ]


def _level(
    recorded: RecordedExperiment,
    level: int,
    amplitude: float,
    simulated: Mapping[str, Signals],
    held: tuple[int, ...],
) -> LevelComparison:
    description = recorded.experiment
    lines = classify(description.excited_harmonics, description.detection_harmonics)
    members = [i for i, r in enumerate(recorded.realizations) if r.level == level]
    shown = next((i for i in members if i in held), members[0])
    kept = {i: _kept(recorded, i) for i in members}
    models = {}
    for name, (position, torque) in simulated.items():
        periods = [(kept[i][0][:1], torque[i][None], position[i][None]) for i in members]
        if all(np.isfinite(signal).all() for signals in periods for signal in signals):
            models[name] = _response(periods, lines, description.base_frequency_hz)
    means = {"rig": (kept[shown][2].mean(0), kept[shown][1].mean(0))}
    means |= {name: (y[shown], u[shown]) for name, (y, u) in simulated.items() if name in models}
    return LevelComparison(
        level=level,
        amplitude_rad=float(amplitude),
        frequency_hz=lines.excited * description.base_frequency_hz,
        rig=_response([kept[i] for i in members], lines, description.base_frequency_hz),
        models=models,
        time_s=np.arange(description.samples_per_period) / description.sample_rate_hz,
        realization=recorded.realizations[shown].name,
        position={name: y for name, (y, _) in means.items()},
        torque={name: u for name, (_, u) in means.items()},
    )


def _kept(recorded: RecordedExperiment, index: int) -> Periods:
    """Return r, u and y; u stands for a reference that was not recorded, as in an open loop."""
    r = recorded.realizations[index]
    reference = r.torque if r.reference is None else r.reference
    return r.kept(reference), r.kept(r.torque), r.kept(r.position)


def _response(realizations: list[Periods], lines: Lines, base_frequency_hz: float) -> Response:
    """Estimate by the robust method, by the fast one of a single realization, or the bare ratio."""
    spectra = [_spectra(signals, lines, base_frequency_hz) for signals in realizations]
    unknown = np.full(lines.excited.size, np.nan)
    if len(spectra) > 1 or spectra[0].periods > 1:
        robust = len(spectra) > 1
        bla = robust_bla(spectra, lines.excited) if robust else fast_bla(spectra[0], lines)
        g, radius, sigma = bla.g, bla.radius_95, np.sqrt(bla.var_total)
    else:
        g = spectra[0].position[lines.excited] / spectra[0].torque[lines.excited]
        radius = sigma = unknown
    odd, even = (line_levels(spectra, lines, at, g) for at in (lines.odd, lines.even))
    return Response(g, radius, sigma, odd, even)


def _spectra(signals: Periods, lines: Lines, base_frequency_hz: float) -> RealizationSpectra:
    sums = PeriodSums(signals[0].shape[-1])
    for period in zip(*signals, strict=True):
        sums.add(period)
    return sums.spectra(base_frequency_hz, lines.last)


def bla_distance_db(rig: Response, model: Response) -> float:
    """Return the rms over lines of the difference of the BLAs' magnitudes, dB."""
    ratio = 20.0 * np.log10(np.abs(model.g / rig.g))
    return float(np.sqrt(np.mean(ratio**2)))


def bla_distance_sigma(rig: Response, model: Response) -> float:
    """Return the rms over lines of |G_model - G_rig| over the std of G_rig; NaN if not known.

    The same phases make both deviate alike, so this falls below 1 for a good model.
    """
    return float(np.sqrt(np.mean((np.abs(model.g - rig.g) / rig.sigma) ** 2)))
