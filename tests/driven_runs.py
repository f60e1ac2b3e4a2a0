"""Records of a rig whose loop nobody knows, so that the recorded torque drives any model of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from controller_node import pd_filtered
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects, plant
from fjr_sim_node.simulation import closed_loop

RATE = 200.0
SAMPLES = 4000
NOMINAL = {name: float(value) for name, value in plant.PLANT.defaults().items()}


def driven_runs(
    causes: Mapping[str, float] | None = None,
    rig: Mapping[str, float] = NOMINAL,
    logged: Callable[[np.ndarray, np.random.Generator], np.ndarray] = lambda torque, _: torque,
    finer: int = 1,
) -> RecordSet:
    """Return four runs of 20 s that a reference of 0.5 to 40 Hz moves.

    Args:
        causes: effects of the rig.
        rig: its bare parameters.
        logged: what the log holds of a torque.
        finer: samples of the controller to a sample of the log.
    """
    made = []
    rate, samples = RATE * finer, SAMPLES * finer
    law = pd_filtered.coefficients(pd_filtered.CONTROLLER.check({"sample_rate_hz": rate}))
    e = effects.coefficients(dict(causes)) if causes else None
    for number in range(4):
        rng = np.random.default_rng(number)
        lines = np.fft.rfftfreq(samples, 1.0 / rate)
        band = (lines > 0.5) & (lines < 40.0)
        spectrum = np.where(band, np.exp(2j * np.pi * rng.uniform(size=lines.size)), 0.0)
        signal = np.fft.irfft(spectrum, samples)
        r = 0.03 * signal / signal.std() * np.minimum(1.0, np.arange(samples) / (0.5 * rate))
        run = closed_loop.simulate(r, rate, plant.coefficients(dict(rig)), law, None, e)
        position = run.position[::finer] + 1e-6 * rng.standard_normal(SAMPLES)
        torque = logged(run.torque, rng)[::finer].copy()
        described = RecordDescription.of(
            "test", sample_rate_hz=RATE, level=0, levels=1, realization=number, realizations=4
        )
        made.append(Record(f"run_{number}", described, None, torque, position, None))
    return RecordSet("test", RATE, tuple(made))
