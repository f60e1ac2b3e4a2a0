"""How a recorded torque acted between its samples: held from one to the next, or as a signal.

A command is held; a measured current went on between the samples. Which of both drives a model
makes a difference of half a sample, as a delay does, or one that is negative.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from fjr_records.records import RecordSet

from .record_loop import RecordLoop

CONTINUOUS = (
    "Where it drives the model, the recorded torque is taken as a signal that went on between its "
    "samples, by its mean over each of them: so the motion follows it better than if it is held."
)


def mean_over_samples(torque: np.ndarray) -> np.ndarray:
    """Return the mean of a sampled signal over the interval that begins at each sample.

    Args:
        torque: float64 (samples,), a signal below half the sample rate.
    """
    integral = CubicSpline(np.arange(torque.size), torque).antiderivative()
    means = np.diff(integral(np.arange(torque.size)))
    return np.append(means, torque[-1])


def with_continuous_torque(records: RecordSet, loop: RecordLoop) -> RecordSet:
    """Return records whose torque, where it drives the model, acts as a signal and not held."""
    changed = [
        record if law is not None else replace(record, torque=mean_over_samples(record.torque))
        for record, law in zip(records.records, loop.laws, strict=True)
    ]
    return replace(records, records=tuple(changed))
