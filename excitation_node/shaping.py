"""Spectrum shaping: the reference whose torque spectrum is as desired (paper algorithm 1).

Each iteration measures |G_ru| = |U|/|R| at the excited lines and asks for R = U_des/|G_ru|. Three
things make the paper's loop end on a rig: the step is damped, it stops within a tolerance (the
paper asks for equality, which no measured spectrum reaches), and the signal is scaled back where
torque or position would leave their limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

LARGEST_STEP_DB = 40.0
"""Greatest change of a line in one iteration: a line without response asks for any amplitude."""


@dataclass(frozen=True)
class ShapingGoal:
    """What the loop aims at.

    Attributes:
        torque_rms_nm: rms of the excited lines of the torque.
        torque_limit_nm: peak torque that must not be exceeded.
        position_limit_rad: peak position that must not be exceeded.
        tolerance_db: rms over lines of the torque spectrum's distance from the desired one.
        damping: exponent of the step, in (0, 1]; 1 is the paper's full step.
    """

    torque_rms_nm: float
    torque_limit_nm: float = math.inf
    position_limit_rad: float = math.inf
    tolerance_db: float = 0.5
    damping: float = 0.8


@dataclass(frozen=True)
class Response:
    """What was measured with one reference.

    Attributes:
        amplitudes_rad: (F,), |R| of the excited lines.
        torque_nm: (F,), |U| of the mean torque spectrum over realizations.
        torque_peak_nm: greatest torque.
        position_peak_rad: greatest position.
    """

    amplitudes_rad: np.ndarray
    torque_nm: np.ndarray
    torque_peak_nm: float
    position_peak_rad: float


def flatness_db(torque_nm: np.ndarray, desired: np.ndarray | float = 1.0) -> float:
    """Return the rms over lines of 20 log10(|U|/U_des) about its mean (dB)."""
    return float(np.std(20.0 * np.log10(torque_nm / desired)))


def within_limits(response: Response, goal: ShapingGoal) -> bool:
    """Tell whether torque and position stay within their limits."""
    return (
        response.torque_peak_nm <= goal.torque_limit_nm
        and response.position_peak_rad <= goal.position_limit_rad
    )


def next_amplitudes(
    response: Response, goal: ShapingGoal, desired: np.ndarray | float = 1.0
) -> np.ndarray:
    """Return the reference amplitudes of the next iteration, float64 of shape (F,), rad.

    Args:
        response: what the present reference gave.
        goal: what to aim at.
        desired: U_des over the excited lines, relative.
    """
    desired = np.broadcast_to(np.asarray(desired, float), response.torque_nm.shape)
    wanted = desired * goal.torque_rms_nm / np.sqrt(np.sum(desired**2) / 2.0)
    most = 10.0 ** (LARGEST_STEP_DB / 20.0)
    step = np.clip(wanted / response.torque_nm, 1.0 / most, most) ** goal.damping
    return response.amplitudes_rad * step * _headroom(response, step, goal)


def _headroom(response: Response, step: np.ndarray, goal: ShapingGoal) -> float:
    """Return the factor (at most 1) that keeps the predicted peaks within 95 % of the limits.

    Peaks are predicted to grow with the rms of the lines: torque with that of U, position with
    that of R, whose low lines the loop follows.
    """
    torque = response.torque_peak_nm * _growth(response.torque_nm, step)
    position = response.position_peak_rad * _growth(response.amplitudes_rad, step)
    return min(1.0, 0.95 * goal.torque_limit_nm / torque, 0.95 * goal.position_limit_rad / position)


def _growth(lines: np.ndarray, step: np.ndarray) -> float:
    return float(np.sqrt(np.sum((lines * step) ** 2) / np.sum(lines**2)))
