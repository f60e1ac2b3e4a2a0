"""Controller identity: is the recorded torque the one that the known controller computes?

u - (C_r(z) r - C_y(z) y) splits faults of the controller and of the logging from those of the
plant: in a plant fault, whatever it is, the controller still does what it is said to do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space
from scipy.signal import lfilter

from controller_node.law import Law, as_transfer_function, law_of
from controller_node.transfer_function import TransferFunction
from fjr_kit.errors import InputError
from fjr_records.periodic import RecordedRealization

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
    """Compare the torque of one bag with its control law.

    Args:
        realization: the bag.

    Raises:
        InputError: the law is not known.
    """
    description = realization.experiment
    law = law_of(description.controller, description.sample_rate_hz)
    signals = realization.played, realization.position, realization.torque
    return check_law(law, *(signal.ravel() for signal in signals))


def check_law(
    law: Law, reference: np.ndarray, position: np.ndarray, torque: np.ndarray
) -> ControllerCheck:
    """Compare a recorded torque with a control law that entered the record in any state.

    Args:
        law: the law.
        reference: r, (samples,) in rad.
        position: y, likewise.
        torque: u, likewise in N m.

    Raises:
        InputError: the signals differ in length.
    """
    if not reference.shape == position.shape == torque.shape:
        raise InputError(
            f"Reference, position and torque have {reference.size}, {position.size} and "
            f"{torque.size} samples; a control law is checked on records of one length."
        )
    linear = as_transfer_function(law)
    unlimited, known = _computed(law, reference, position, torque)
    expected = linear.clamped(unlimited)
    tolerance = _rounding(linear, reference, position, torque)
    deviation = np.where(known, torque - expected, 0.0)
    broken = np.flatnonzero(~(np.abs(deviation) <= tolerance))
    if not broken.size:
        return ControllerCheck(float(np.abs(deviation).max()), tolerance, None, "")
    cause = (
        _clamped(torque[known], unlimited[known], tolerance)
        or _shifted(law, reference, position, torque, tolerance)
        or _scaled(torque[known], expected[known], tolerance)
    )
    return ControllerCheck(float(np.abs(deviation).max()), tolerance, int(broken[0]), cause)


def _computed(
    law: Law, reference: np.ndarray, position: np.ndarray, torque: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the torque of the law before its limit, and where it is known, (samples,) each.

    The state with which the law entered is forgotten after some samples, or estimated.
    """
    linear = as_transfer_function(law)
    unlimited = _unlimited(law, reference, position)
    start = _forgotten(linear.slowest_pole, torque.size)
    if start is not None:
        return unlimited, np.arange(torque.size) >= start
    free = np.abs(torque) < clamp_nm(torque, linear.limit_nm)
    responses = linear.free_responses(torque.size)
    unlimited += responses @ linear.entering_state(reference, position, torque, free)
    hidden = null_space(np.linalg.qr(responses[free], mode="r"))
    return unlimited, np.abs(responses @ hidden).max(axis=1, initial=0.0) <= FORGOTTEN


def clamp_nm(torque: np.ndarray, limit_nm: float = math.inf) -> float:
    """Return at which torque a record is clamped (N m): as described, or where it often ends."""
    peak = float(np.abs(torque).max(initial=0.0))
    ends = int((np.abs(torque) >= peak * (1.0 - SINGLE_ROUNDING)).sum())
    return min(limit_nm, peak * (1.0 - SINGLE_ROUNDING) if 2 < ends < torque.size else math.inf)


def _rounding(
    law: TransferFunction, reference: np.ndarray, position: np.ndarray, torque: np.ndarray
) -> float:
    """Return what rounding of the stored signals may change of the torque (N m)."""
    size = max(float(np.abs(reference).max()), float(np.abs(position).max()))
    one = np.eye(1, torque.size)[0]
    impulses = [lfilter(part, law.denominator, one) for part in (law.reference, law.position)]
    gain = max(float(np.abs(h).max() + np.abs(np.diff(h)).sum()) for h in impulses)
    return SINGLE_ROUNDING * (float(np.abs(torque).max()) + gain * size)


def _unlimited(law: Law, reference: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Return the torque of a law from zero state without its limit, to the last bit where it can.

    The default law is computed in the order of its own step, which no transfer function keeps.
    """
    if isinstance(law, TransferFunction):
        return law.unlimited(reference, position)
    p, dn, decay, _ = law
    error = reference - position
    return p * error + dn * (error - lfilter([0.0, 1.0 - decay], [1.0, -decay], error))


def _forgotten(decay: float, samples: int) -> int | None:
    """Return after how many samples an unknown initial state no longer counts; None if too late."""
    if decay <= 0.0:
        return 1
    needed = np.inf if decay >= 1.0 else np.log(FORGOTTEN) / np.log(decay)
    return int(needed) if needed < samples // 2 else None


def _clamped(torque: np.ndarray, unlimited: np.ndarray, tolerance: float) -> str:
    """Return that a limit clamps the torque which is not described; empty if none does."""
    peak = float(np.abs(torque).max())
    at_peak = int((np.abs(torque) >= peak - tolerance).sum())
    if at_peak < 3 or np.abs(torque - np.clip(unlimited, -peak, peak)).max() > tolerance:
        return ""
    return (
        f"the torque is clamped at {peak:.4g} N m in {at_peak} samples, which the description "
        "doesn't say; set controller.torque_limit_nm"
    )


def _shifted(
    law: Law, reference: np.ndarray, position: np.ndarray, torque: np.ndarray, tolerance: float
) -> str:
    """Return that the torque is logged some samples off; empty if it is not."""
    linear = as_transfer_function(law)
    for shift in (1, 2, 3, -1, -2, -3):
        before = slice(max(-shift, 0), min(-shift, 0) or None)
        after = slice(max(shift, 0), min(shift, 0) or None)
        r, y, u = reference[before], position[before], torque[after]
        unlimited, known = _computed(law, r, y, u)
        if np.abs(linear.clamped(unlimited) - u)[known].max(initial=0.0) <= tolerance:
            what = "late" if shift > 0 else "early"
            return f"the torque is logged {abs(shift)} sample(s) {what}; correct its stamps"
    return ""


def _scaled(torque: np.ndarray, expected: np.ndarray, tolerance: float) -> str:
    """Return what a torque that does not follow its law looks like."""
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
