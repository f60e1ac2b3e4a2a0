"""The torque that a described controller makes, where reference and position were logged alone.

So log legged robots and hobby servos: targets and angles of joints under PD gains that are known.
"""

from __future__ import annotations

import numpy as np

from controller_node.transfer_function import TransferFunction

MADE = (
    "the torque was not recorded: it is what the described controller makes of reference and "
    "position, at rest before the first sample and with an integral of zero"
)
ONCE = "; the law runs once in each sample, unless its file says by rate_hz how fast it ran"
SWINGS_FREE = "no torque acts: the axis swings free"
_REST_S = 1.0


def made_torque(
    law: TransferFunction, reference: np.ndarray, position: np.ndarray, rate_hz: float
) -> np.ndarray:
    """Return the torque of a law, float64 (samples,) in N m.

    Args:
        law: the whole controller.
        reference: r, float64 (samples,) in rad.
        position: y, likewise.
        rate_hz: sample rate.
    """
    rest = int(_REST_S * rate_hz) if not integrates(law) else 1
    r, y = (np.concatenate([np.full(rest, x[0]), x]) for x in (reference, position))
    return law.torque(r, y)[rest:]


def integrates(law: TransferFunction) -> bool:
    """Tell whether a law goes on as long as its input is constant."""
    return bool(np.isclose(law.denominator.sum(), 0.0, atol=1e-9 * np.abs(law.denominator).sum()))
