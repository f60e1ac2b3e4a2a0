"""A recorded torque that was held from sample to sample, and one that went on between them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller_node import pd_filtered
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node import plant
from fjr_sim_node.simulation import closed_loop
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.record_torque import (
    CONTINUOUS,
    mean_over_samples,
    with_continuous_torque,
)
from gap_diagnosis.which.torque_timing import Timing, timed

RATE, FINER = 200.0, 10
NOMINAL = {name: float(value) for name, value in plant.PLANT.defaults().items()}


@given(st.floats(0.0, 0.2), st.floats(0.0, 6.28))
def test_the_mean_of_a_sine_over_each_sample_is_that_of_the_sine(cycles, phase):
    k = np.arange(200)
    omega = 2.0 * np.pi * cycles
    sampled = np.cos(omega * k + phase)
    exact = np.real(np.exp(1j * (omega * (k + 0.5) + phase))) * np.sinc(cycles)
    assert np.abs(mean_over_samples(sampled) - exact)[5:-5].max() < 0.02


def runs(finer: int) -> RecordSet:
    """Return runs of unknown loops whose controllers work at a multiple of the rate of the bags."""
    made = []
    for number in range(4):
        rate, rng = RATE * finer, np.random.default_rng(number)
        samples = 4000 * finer
        lines = np.fft.rfftfreq(samples, 1.0 / rate)
        band = (lines > 0.5) & (lines < 40.0)
        spectrum = np.where(band, np.exp(2j * np.pi * rng.uniform(size=lines.size)), 0.0)
        signal = np.fft.irfft(spectrum, samples)
        r = 0.03 * signal / signal.std() * np.minimum(1.0, np.arange(samples) / (0.5 * rate))
        law = pd_filtered.coefficients(pd_filtered.CONTROLLER.check({"sample_rate_hz": rate}))
        run = closed_loop.simulate(r, rate, plant.coefficients(NOMINAL), law)
        position = run.position[::finer] + 1e-6 * rng.standard_normal(4000)
        described = RecordDescription.of(
            "test", sample_rate_hz=RATE, level=0, levels=1, realization=number, realizations=4
        )
        made.append(
            Record(f"run_{number}", described, None, run.torque[::finer].copy(), position, None)
        )
    return RecordSet("test", RATE, tuple(made))


@pytest.mark.parametrize(("finer", "told"), [(1, ()), (FINER, (CONTINUOUS,))])
def test_a_torque_that_went_on_between_its_samples_is_told_from_one_that_was_held(finer, told):
    timing = timed(runs(finer), NOMINAL, 0.1, lambda _: None)
    assert timing.notes == told
    assert timing.refit.model.plant["jm"] == pytest.approx(NOMINAL["jm"], rel=0.05)
    assert timing.held == (not told)


@pytest.mark.parametrize(("finer", "held"), [(1, True), (FINER, False)])
def test_half_a_sample_of_delay_of_a_signal_is_a_torque_that_was_held(finer, held):
    """What a search ends with that began with a signal, since a missing cause made it do better."""
    recorded = runs(finer)
    by_hold = CellFitter(Evidence(recorded, NOMINAL), NOMINAL, 0.1)
    flowing = with_continuous_torque(recorded, by_hold.evidence.simulator.loop)
    by_signal = CellFitter(Evidence(flowing, NOMINAL), NOMINAL, 0.1)
    refit = by_signal.refit()
    timing = Timing(by_signal, refit, (CONTINUOUS,), False, Timing(by_hold, by_hold.refit()))
    assert timing.other_if_better(refit) is None
    proposals = by_signal.screening(refit, "delay").proposals()
    late = by_signal.add(refit, "delay", proposals) if proposals else None
    samples = late.model.effects["delay.time_s"] * RATE if late else 0.0
    assert samples == pytest.approx(0.5 if held else 0.0, abs=0.1)
    assert (timing.other_if_better(late or refit) is timing.other) == held
