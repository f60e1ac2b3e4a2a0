"""Controller identity: is the recorded torque the one that the known controller computes?

u - C(z)(r - y) splits faults of the controller and of the logging from those of the plant: in a
plant fault, whatever it is, the controller still does what it is said to do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from controller_node.transfer_function import Law, TransferFunction, as_transfer_function, law_of
from fjr_records.recorded import RecordedRealization

FORGOTTEN = 1e-9
"""What may be left of the unknown state with which the controller entered the record."""
SINGLE_ROUNDING = 4.0 * float(np.finfo(np.float32).eps)
"""Tolerance relative to signals: they may have been stored in single precision."""


@dataclass(frozen=True)
class ControllerCheck:
    """Deviation of u from the control law in one bag.

    Attributes:
        deviation_nm: greatest magnitude of it.
        limit_nm: what rounding explains.
        sample: where it first exceeds that; None if nowhere.
        cause: what the deviation looks like, a clause; empty if there is none.
    """

    deviation_nm: float
    limit_nm: float
    sample: int | None
    cause: str

    @property
    def passed(self) -> bool:
        """Tell whether the torque follows the law."""
        return self.sample is None


def check_controller(realization: RecordedRealization) -> ControllerCheck:
    """Compare the torque of one bag with its control law; raise InputError for an unknown law."""
    description = realization.experiment
    described = law_of(description.controller, description.sample_rate_hz)
    law = as_transfer_function(described)
    error = (realization.played - realization.position).ravel()
    torque = realization.torque.ravel()
    unlimited = _unlimited(described, error)
    start = _forgotten(law.slowest_pole, error.size)
    if start is None:
        start = 0
        unlimited += _entered(law, torque - unlimited, np.abs(torque) < law.limit_nm)
    expected = np.clip(unlimited, -law.limit_nm, law.limit_nm)
    size = max(np.abs(realization.played).max(), np.abs(realization.position).max())
    impulse = lfilter(law.numerator, law.denominator, np.eye(1, error.size)[0])
    gain = float(np.abs(impulse).max() + np.abs(np.diff(impulse)).sum())
    tolerance = float(SINGLE_ROUNDING * (np.abs(torque).max() + gain * size))
    deviation = torque - expected
    deviation[:start] = 0.0
    broken = np.flatnonzero(~(np.abs(deviation) <= tolerance))
    if not broken.size:
        return ControllerCheck(float(np.abs(deviation).max()), tolerance, None, "")
    cause = _cause(torque[start:], expected[start:], unlimited[start:], tolerance)
    return ControllerCheck(float(np.abs(deviation).max()), tolerance, int(broken[0]), cause)


def _unlimited(law: Law, error: np.ndarray) -> np.ndarray:
    """Return the torque of a law from zero state without its limit, to the last bit where it can.

    The default law is computed in the order of its own step, which no transfer function keeps.
    """
    if isinstance(law, TransferFunction):
        return lfilter(law.numerator, law.denominator, error)
    p, dn, decay, _ = law
    return p * error + dn * (error - lfilter([0.0, 1.0 - decay], [1.0, -decay], error))


def _forgotten(decay: float, samples: int) -> int | None:
    """Return after how many samples an unknown initial state no longer counts; None if too late."""
    if decay <= 0.0:
        return 1
    needed = np.inf if decay >= 1.0 else np.log(FORGOTTEN) / np.log(decay)
    return int(needed) if needed < samples // 2 else None


def _entered(law: TransferFunction, deviation: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Return the part of a deviation that an unknown initial state explains, (samples,).

    Args:
        law: the control law.
        deviation: u less the law's response from zero state, (samples,) in N m.
        free: bool (samples,), where the torque is not clamped.
    """
    states = np.eye(law.denominator.size - 1)
    nothing = np.zeros(deviation.size)
    columns = np.stack(
        [lfilter(law.numerator, law.denominator, nothing, zi=x)[0] for x in states], axis=1
    )
    solution = np.linalg.lstsq(columns[free], deviation[free], rcond=None)[0]
    return columns @ solution


def _cause(
    torque: np.ndarray, expected: np.ndarray, unlimited: np.ndarray, tolerance: float
) -> str:
    """Return what a broken identity looks like."""
    peak = float(np.abs(torque).max())
    clamped = np.clip(unlimited, -peak, peak)
    at_peak = int((np.abs(torque) >= peak - tolerance).sum())
    if at_peak > 2 and np.abs(torque - clamped).max() <= tolerance:
        return (
            f"the torque is clamped at {peak:.4g} N m in {at_peak} samples, which the description "
            "doesn't say; set controller.torque_limit_nm"
        )
    for shift in (1, 2, 3, -1, -2, -3):
        if np.abs(np.roll(expected, shift) - torque)[3:-3].max() <= tolerance:
            what = "late" if shift > 0 else "early"
            return f"the torque is logged {abs(shift)} sample(s) {what}; correct its stamps"
    gain = float(torque @ expected / (expected @ expected)) if expected.any() else 0.0
    offset = float(np.mean(torque - expected))
    if np.abs(torque - gain * expected).max() <= 10 * tolerance:
        return f"the torque is {gain:.6g} times that of the law; correct the gains or the unit"
    if np.abs(torque - expected - offset).max() <= 10 * tolerance:
        return f"the torque is offset by {offset:.4g} N m; log the torque that is applied"
    share = float(np.mean(np.abs(torque - expected) > tolerance))
    if share < 0.01:
        return f"only {share:.2%} of the samples break it, so look at the logging there"
    return "the controller is another than described, or logs other signals than it uses"
