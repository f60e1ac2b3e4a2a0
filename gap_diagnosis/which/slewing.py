"""How long a limited rate holds a torque back: less than two samples may be any other lateness.

What a drive does between two samples of its command is not recorded. A limit that every step of the
command has caught up with by the next sample but one changes the motion as a lag or a delay does
that is longer for greater steps, and as cogging that moves the axis between samples may.
"""

from __future__ import annotations

import math

import numpy as np

from fjr_records.records import RecordSet
from fjr_sim_node import effects as fx

from ..model.rig_model import Model

_BETWEEN, _SEEN = 1.0, 3.0  # samples in a row: of what is between samples, and of a rate
_IF_BETWEEN = 0.5  # of its presence, what is left to a limit that acts between samples only


def samples_behind(model: Model, effect: str, records: RecordSet) -> float:
    """Return how many samples in a row an effect holds a torque back, infinite for other effects.

    Args:
        model: with the effect.
        effect: its identifier.
        records: with the torques that it holds back.
    """
    limits = [n for n in fx.EFFECTS[effect].size_names if fx.parameter(n).unit == "N m/s"]
    if not limits:
        return math.inf
    most = min(model.effects[name] for name in limits) / records.sample_rate_hz
    return float(max(_longest(r.torque, most) for r in records.records))


def doubt_of_rate(behind: float) -> float:
    """Return the factor of the presence of an effect by how many samples in a row it acts."""
    return float(np.interp(behind, (_BETWEEN, _SEEN), (_IF_BETWEEN, 1.0)))


def _longest(torque: np.ndarray, most: float) -> int:
    """Return for how many samples in a row a torque that changes by a step at most is behind."""
    held, behind, longest = float(torque[0]), 0, 0
    for asked in torque[1:].tolist():
        held += min(max(asked - held, -most), most)
        behind = behind + 1 if held != asked else 0
        longest = max(longest, behind)
    return longest
