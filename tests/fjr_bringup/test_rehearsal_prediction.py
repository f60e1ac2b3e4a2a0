"""The predicted bias of the BLA by the loop's delay, against the batch simulation of that delay."""

from __future__ import annotations

import numpy as np
import pytest
from loop_messages import loop

from controller_node import pd_filtered
from excitation_node import multisine
from fjr_bringup.rehearsal.limits import LIMITS, judge
from fjr_bringup.rehearsal.prediction import bla_bias, predict
from fjr_bringup.rehearsal.timing import loop_timing
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization

RATE = 1000.0
RIG = SIMULATOR.defaults()


def experiment(realization=0, **excitation):
    given = {
        "base_frequency_hz": 1.0,
        "f_min_hz": 1.0,
        "f_max_hz": 50.0,
        "periods": 2,
        "realizations": 12,
        **excitation,
    }
    controller = pd_filtered.describe(pd_filtered.CONTROLLER.defaults())
    return multisine.describe(multisine.EXCITATION.check(given), 0, realization, controller)


def bla(delay_s, realizations=12):
    """Return lines and Y/U of mean spectra, turned by the reference's phases (the robust BLA)."""
    mean = 0.0
    for number in range(realizations):
        described = experiment(number, transient_periods=5)
        run = run_realization({**RIG, "delay.time_s": delay_s}, described)
        lines = np.array(described.excited_harmonics)
        n = described.samples_per_period
        signals = [run.reference[-n:], run.position[-n:], run.torque[-n:]]
        r, y, u = (np.fft.rfft(signal)[lines] for signal in signals)
        mean = mean + np.stack([y, u]) * np.exp(-1j * np.angle(r))
    return lines * described.base_frequency_hz, mean[0] / mean[1]


def test_predicted_bias_is_that_of_a_simulated_campaign_with_the_delay():
    """Friction and cubic stiffness included: the BLA itself moves, but hardly beside the delay."""
    delay_s = 0.8e-3
    frequency, undelayed = bla(0.0)
    _, delayed = bla(delay_s)
    found = delayed / undelayed
    prediction = predict(RIG, experiment(), np.full(100, delay_s))
    np.testing.assert_allclose(prediction.frequency_hz, frequency)
    assert np.median(np.abs(np.rad2deg(np.angle(found)) - prediction.bias_deg)) < 1.0
    assert np.median(np.abs(20.0 * np.log10(np.abs(found)) - prediction.bias_db)) < 0.3
    assert prediction.worst_bias_deg == pytest.approx(360.0 * 49.0 * delay_s, rel=0.05)


def test_a_constant_delay_turns_the_phase_and_jitter_costs_gain():
    frequency = np.array([50.0])
    constant = bla_bias(RIG, frequency, RATE, np.full(50, 1e-3))
    jittering = bla_bias(RIG, frequency, RATE, np.linspace(0.0, 2e-3, 50))
    assert constant[1][0] == pytest.approx(-18.0, abs=0.01)
    assert constant[0][0] == pytest.approx(0.0, abs=1e-6)
    assert jittering[1][0] == pytest.approx(-18.0, abs=0.2)
    assert jittering[0][0] < -0.05


def test_prediction_knows_the_margins_and_judges_their_use():
    found = predict(RIG, experiment(), np.full(10, 2e-3))
    assert (
        found.delay_margin_frictionless_s < found.delay_margin_s < found.delay_margin_equivalent_s
    )
    assert found.margin_share == pytest.approx(2e-3 / found.delay_margin_s)
    timing = loop_timing(*loop(), 500.0)
    checks = {check.name: check for check in judge(timing, found, LIMITS.defaults())}
    assert not checks["delay_margin"].passed
    wide = {"delay_margin_share": 1.0, "bias_db": 10.0, "bias_deg": 90.0}
    assert all(check.passed for check in judge(timing, found, LIMITS.check(wide)))


def test_a_law_without_statistical_linearisation_has_its_margin_still():
    law = {"kind": "transfer_function", "numerator": [200.0], "denominator": [1.0]}
    described = experiment().model_copy(update={"controller": law})
    found = predict(RIG, described, np.full(10, 1e-4))
    assert np.isnan(found.delay_margin_equivalent_s)
    assert found.delay_margin_s > 0.0
    assert found.worst_bias_deg > 0.0


def test_a_rig_that_sticks_for_good_has_no_equivalent_plant():
    weak = {"kind": "pd_filtered", "p": 2.0, "d": 0.1, "n": 24.0, "torque_limit_nm": None}
    described = experiment().model_copy(update={"controller": weak})
    found = predict(RIG, described, np.full(10, 1e-3))
    assert np.isnan(found.delay_margin_equivalent_s)
    assert found.worst_bias_deg > 10.0
