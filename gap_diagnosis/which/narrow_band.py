"""How broad the band of a motion is: at one frequency all linear laws are a stiffness and damping.

Linear laws differ by how their torque changes with frequency. A motion that keeps to an octave
hardly shows that: there a spring or a cable stands for whatever else moves the axis at its own
pace, such as the leg of a human, as long as it leaves more than noise. Viscous friction could stand
for that as well, but every machine has some.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from fjr_records.records import RecordSet

LINEAR = ("external_spring", "cable")
"""Laws whose torque on the axis is linear in its motion, and which few machines have."""
_BEYOND = 0.05  # of the power of the motion, that lies below its band, and as much above it
_NARROW, _BROAD = 1.0, 2.0  # octaves, between which a law is less and less doubted
_IF_NARROW = 0.5  # of its presence, what is left to a linear law in a narrow band


def octaves_moved(records: RecordSet) -> float:
    """Return the octaves in which nine tenths of the power of the motion about its means lie.

    Of the angle or of the velocity, whichever takes more: moves from place to place go on for long
    at either end, and are quick between.
    """
    frequencies, powers = [], []
    for record in records.records:
        motion = (record.position - record.position.mean()) * np.hanning(record.samples)
        frequencies.append(np.fft.rfftfreq(record.samples, 1.0 / records.sample_rate_hz)[1:])
        powers.append(np.abs(np.fft.rfft(motion)[1:]) ** 2)
    every, power = np.concatenate(frequencies), np.concatenate(powers)
    order = np.argsort(every, kind="stable")
    every, power = every[order], power[order]
    return max(_octaves(every, power), _octaves(every, power * every**2))


def _octaves(frequency: np.ndarray, power: np.ndarray) -> float:
    below = np.cumsum(power)
    ends = np.searchsorted(below, below[-1] * np.array([_BEYOND, 1.0 - _BEYOND]))
    low, high = frequency[ends]
    return math.log2(high / low)


def doubt_of_band(octaves: float) -> float:
    """Return the factor of the presence of a linear law that leaves more than noise.

    Args:
        octaves: in which the motion lies.
    """
    return float(np.interp(octaves, (_NARROW, _BROAD), (_IF_NARROW, 1.0)))


def narrow(effects: Sequence[str], octaves: float) -> list[str]:
    """Return what to think of linear laws that leave more than noise of a motion in a narrow band.

    Args:
        effects: that are named.
        octaves: in which the motion lies.
    """
    doubted = [effect for effect in effects if effect in LINEAR]
    if not doubted or octaves >= _BROAD:
        return []
    return [
        f"Nine tenths of the power of the motion lie within {octaves:.1f} octaves. There all that "
        f"is linear looks like a stiffness and a damping, so {' and '.join(doubted)} may stand for "
        "another law, or for what else moves the axis (a human, a machine beside it): record a "
        "motion of a broader band."
    ]
