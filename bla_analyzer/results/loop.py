"""The loop of a level: its sensitivity peak, and why there is none where there is none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from controller_node.law import acts_on_error

from .result import BlaEstimate, LevelResult, Result, Sensitivity


@dataclass(frozen=True)
class Peak:
    """The greatest sensitivity over the reliable lines, with the 95 % interval of that line."""

    ms: float
    low: float
    high: float
    frequency_hz: float


def peak(bla: BlaEstimate) -> Peak | None:
    """Return the peak Ms of |S|; None without sensitivity, or without a reliable line."""
    if bla.sensitivity is None:
        return None
    size = np.where(bla.reliable, np.abs(bla.sensitivity.s), np.nan)
    if not np.isfinite(size).any():
        return None
    at = int(np.nanargmax(size))
    radius = float(bla.sensitivity.s_radius_95[at])
    ms = float(size[at])
    return Peak(ms, max(ms - radius, 0.0), ms + radius, float(bla.frequency_hz[at]))


def peak_sentence(bla: BlaEstimate) -> str:
    """Return the peak in a sentence; empty where there is none."""
    found = peak(bla)
    if found is None:
        return ""
    disc = f" (95 %: {found.low:.3g} to {found.high:.3g})" if np.isfinite(found.low) else ""
    edge = ""
    if found.frequency_hz in (bla.frequency_hz[0], bla.frequency_hz[-1]):
        edge = "; it lies at the edge of the band, so the loop's own peak may be greater"
    return f"Sensitivity peak Ms = {found.ms:.3g}{disc} at {found.frequency_hz:.3g} Hz{edge}."


def loop_discs(found: Sensitivity, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the loop L = G C = 1/S - 1, complex (F,), and the outlines of its discs.

    Args:
        found: the sensitivity.
        corners: complex (K,), of a circle of radius 1.

    Returns:
        L, and (F, K) of the discs of S inverted; NaN where a disc of S holds zero.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        outlines = 1.0 / (found.s[:, None] + found.s_radius_95[:, None] * corners) - 1.0
        curve = 1.0 / found.s - 1.0
    outlines[~(found.s_radius_95 < np.abs(found.s))] = np.nan
    return curve, outlines


def what_lacks(result: Result, level: LevelResult) -> list[str]:
    """Return which views of a level cannot be had, and why, in sentences."""
    bla = level.bla
    if bla is None:
        return [
            "There is no BLA at this level, so neither band, coherence, Nyquist nor sensitivity."
        ]
    lacks = []
    if np.isnan(bla.radius_95).all():
        lacks.append("No 95 % band: the total variance of this estimate is unknown.")
    if np.isnan(bla.coherence).all():
        lacks.append(
            "No coherence: distortion and noise at the excited lines are unknown; record several "
            "realizations, or a multisine with odd detection lines."
        )
    if bla.sensitivity is None:
        lacks.append(f"No sensitivity: {_no_sensitivity(result)}")
    return lacks


def _no_sensitivity(result: Result) -> str:
    if acts_on_error(result.controller, result.sample_rate_hz) is False:
        return (
            "the controller does not act on the error alone (feed-forward, or a path of the "
            "position of its own), so the response from reference to error is not 1/(1 + G C)."
        )
    return (
        "no reference was recorded that moves apart from the torque; record the reference too, and "
        "the response from reference to error tells it."
    )
