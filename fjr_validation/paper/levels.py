"""The task behind most parts: one amplitude, measured and compared with everything known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bla_analyzer.bla.robust import robust_bla, turned
from bla_analyzer.checks import periodicity
from bla_analyzer.compare.metrics import LOW_LINES_HZ, squared_error_db
from fjr_bringup.campaign.plan import Campaign
from fjr_bringup.design.measured import MeasuredLevel, simulate_level
from fjr_kit.errors import InputError
from fjr_sim_node.theory.linear import g0
from fjr_sim_node.theory.statistical_linearisation import linearise_experiment

RESAMPLES = 200
VARIANTS = tuple(
    (model, statistic, band)
    for model in ("viscous", "paper")
    for band in ("all", "1hz")
    for statistic in ("mean", "median")
)
"""(model, statistic, band) of the columns of V."""


def variant(model: str = "viscous", statistic: str = "mean", band: str = "1hz") -> int:
    """Return the column of a variant of V."""
    return VARIANTS.index((model, statistic, band))


def campaign_of(
    amplitude_rad: float,
    realizations: int,
    periods: int,
    *,
    rate_hz: float = 1000.0,
    transient_periods: int = 1,
    simulator: Mapping[str, float] | None = None,
    excitation: Mapping[str, Any] | None = None,
) -> Campaign:
    """Return a campaign of one level on the paper's rig, or on one that differs from it."""
    given = {
        "amplitudes_rad": (amplitude_rad,),
        "realizations": realizations,
        "periods": periods,
        "transient_periods": transient_periods,
        "sample_rate_hz": rate_hz,
        **(excitation or {}),
    }
    return Campaign.create(
        None,
        {
            "excitation": given,
            "controller": {"sample_rate_hz": rate_hz},
            "simulator": {"sample_rate_hz": rate_hz, **(simulator or {})},
        },
    )


def models(campaign: Campaign, frequency_hz: np.ndarray) -> dict[str, np.ndarray]:
    """Return both versions of G0 with zero-order hold, complex (F,) each."""
    values = campaign.values["simulator"]
    rate = values["sample_rate_hz"]
    return {
        "viscous": g0(values, frequency_hz, rate, "viscous"),
        "paper": g0(values, frequency_hz, rate, "paper"),
    }


def distances(
    g: np.ndarray, references: Mapping[str, np.ndarray], frequency_hz: np.ndarray
) -> np.ndarray:
    """Return V in all VARIANTS (dB^2), (..., 8), of BLAs of shape (..., F)."""
    above = frequency_hz >= LOW_LINES_HZ * (1.0 - 1e-9)
    statistics: dict[str, Any] = {"mean": np.mean, "median": np.median}
    columns = []
    for model, statistic, band in VARIANTS:
        error = squared_error_db(g, references[model])
        chosen = error[..., above] if band == "1hz" else error
        columns.append(statistics[statistic](chosen, axis=-1))
    return np.stack(columns, axis=-1)


def measure(first_realization: int = 0, **campaign: Any) -> dict[str, Any]:
    """Simulate one level and estimate its BLA by the robust method.

    Args:
        first_realization: index of the first one; further ones draw other phases.
        campaign: arguments of `campaign_of`.

    Returns:
        frequency_hz, g, radius (95 %), var_total, var_noise, var_nonlinear, input_variance,
        g_viscous, g_paper, predicted: (F,); v: (8,) and v_resampled: (200, 8) in VARIANTS;
        periodic: fraction of the realizations; rms, peak: (3,).
    """
    count = campaign["realizations"]
    whole = campaign_of(**{**campaign, "realizations": first_realization + count})
    level = simulate_level(whole, 0, range(first_realization, first_realization + count))
    bla = robust_bla(level.spectra, level.lines.excited)
    references = models(whole, bla.frequency_hz)
    return {
        "frequency_hz": bla.frequency_hz,
        "g": bla.g,
        "radius": bla.radius_95,
        "var_total": bla.var_total,
        "var_noise": bla.var_noise,
        "var_nonlinear": bla.var_nonlinear,
        "input_variance": bla.input_relative_variance,
        "g_viscous": references["viscous"],
        "g_paper": references["paper"],
        "predicted": predicted(whole, bla.frequency_hz),
        "v": distances(bla.g, references, bla.frequency_hz),
        "v_resampled": _resampled(level, references, bla.frequency_hz),
        "periodic": np.mean([periodicity(one).passed for one in level.realizations]),
        "rms": level.rms,
        "peak": level.peak,
    }


def predicted(campaign: Campaign, frequency_hz: np.ndarray) -> np.ndarray:
    """Return the BLA by statistical linearisation, complex (F,); NaN where it does not settle."""
    try:
        found = linearise_experiment(campaign.values["simulator"], campaign.experiment(0, 0))
    except InputError:
        return np.full(frequency_hz.shape, np.nan + 0j)
    return found.frf(frequency_hz)


def _resampled(
    level: MeasuredLevel, references: Mapping[str, np.ndarray], frequency_hz: np.ndarray
) -> np.ndarray:
    """Return V of resampled realizations, the same draws at every amplitude."""
    torque, position = turned(level.spectra, level.lines.excited)
    count = len(torque)
    draws = np.random.default_rng(0).integers(0, count, (RESAMPLES, count))
    weights = np.stack([np.bincount(draw, minlength=count) for draw in draws]).astype(float)
    return distances((weights @ position) / (weights @ torque), references, frequency_hz)
