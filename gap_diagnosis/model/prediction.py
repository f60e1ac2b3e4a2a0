"""Local closed-loop prediction, where the rig's loop cannot be repeated.

Without the controller, or without the reference, the recorded torque drives the model, and a known
observer holds the motion to the recorded position:

    u_sim = u + L(z) (y - y_sim)

The true model then has y_sim = y without noise, whatever the controller was; a wrong one has the
prediction error (1 + G L)^-1 (y - G u). The observer keeps open-loop drift and sticking from
growing, at a price: below its crossover it hides part of what a wrong model does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from controller_node.transfer_function import TransferFunction
from fjr_records.periodic import RecordedExperiment
from fjr_sim_node.simulation.closed_loop import Trajectory

CROSSOVER_SHARE = 0.1
"""Crossover of the observer relative to the highest excited frequency, never below the lowest."""
LEAD = 10.0
"""Ratio of pole to zero of the observer: 55 degrees of lead where the loop gain is one."""
_NEAR = 1.5  # lines within this factor of the crossover give the plant's gain there


def crossover_hz(recorded: RecordedExperiment) -> float:
    """Return the crossover frequency of the observer."""
    excited = np.array(recorded.experiment.excited_harmonics)
    lines = max(excited.min(), CROSSOVER_SHARE * excited.max())
    return float(lines * recorded.experiment.base_frequency_hz)


def observer(recorded: RecordedExperiment) -> TransferFunction:
    """Return a lead that crosses over with the measured response of torque to position.

    Its gain comes from the record itself, |U/Y| near the crossover, median over lines and
    realizations; so it depends on no parameter that is yet to be fitted.
    """
    description = recorded.experiment
    crossover = crossover_hz(recorded)
    lines = np.array(description.excited_harmonics)
    frequency = lines * description.base_frequency_hz
    apart = np.abs(np.log(frequency / crossover))
    near = lines[apart <= max(np.log(_NEAR), apart.min())]
    ratios = [
        np.abs(r.spectrum(r.torque, recorded.lines).mean(0)[near])
        / np.abs(r.spectrum(r.position, recorded.lines).mean(0)[near])
        for r in recorded.realizations
    ]
    return lead(float(np.median(ratios)), crossover, description.sample_rate_hz)


def lead(gain: float, crossover_hz: float, sample_rate_hz: float) -> TransferFunction:
    """Return a discretised lead (bilinear, exact at the crossover) with a gain there.

    Args:
        gain: magnitude at the crossover, N m/rad.
        crossover_hz: frequency of the greatest lead.
        sample_rate_hz: rate of the samples.
    """
    centre = np.tan(np.pi * crossover_hz / sample_rate_hz)  # w/w0 = (z-1)/(z+1)/(j centre)
    zero, pole = centre / np.sqrt(LEAD), centre * np.sqrt(LEAD)
    high = gain * np.sqrt(LEAD)
    return TransferFunction.of([high * (1.0 + zero), high * (zero - 1.0)], [1.0 + pole, pole - 1.0])


def loses(recorded: RecordedExperiment) -> str:
    """Return what a diagnosis by prediction cannot say, for a reader."""
    missing = "reference" if recorded.experiment.controller is not None else "controller"
    return (
        f"The {missing} is not known, so the loop is not repeated: the recorded torque drives the "
        f"model and an observer of {crossover_hz(recorded):.3g} Hz holds it to the recorded "
        "position. Lost are the check of controller and logging, the gap in torque (it shows what "
        f"the observer adds) and sensitivity below {crossover_hz(recorded):.3g} Hz; a torque that "
        "is logged wrong, late or scaled looks like a fault of the plant."
    )


def errors(recorded: RecordedExperiment, runs: Sequence[Trajectory]) -> RecordedExperiment:
    """Return the record with its signals replaced by prediction errors.

    Args:
        recorded: the experiment.
        runs: simulation of all recorded samples of each realization.
    """
    changed = []
    for r, run in zip(recorded.realizations, runs, strict=True):
        shape = r.position.shape
        less = {"position": r.position - run.position.reshape(shape)}
        less["torque"] = r.torque - run.torque.reshape(shape)
        if r.link is not None:
            less["link"] = r.link - run.link.reshape(shape)
        changed.append(replace(r, **less))
    return replace(recorded, realizations=tuple(changed))
