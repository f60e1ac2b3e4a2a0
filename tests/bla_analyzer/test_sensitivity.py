"""The sensitivity of the loop from its records, against 1/(1 + G C) of a linear loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import simulated_loop as loop

from bla_analyzer.bla.arbitrary import arbitrary_bla, run_of
from bla_analyzer.bla.fast import fast_bla
from bla_analyzer.bla.robust import robust_bla
from bla_analyzer.bla.sensitivity import of_this_loop
from bla_analyzer.results.result import BlaEstimate
from controller_node.law import acts_on_error

GRID = loop.lines()
N, M, P = 512, 7, 2
NOISE = 0.02


def truth(frequency_hz: np.ndarray) -> np.ndarray:
    """1/(1 + G C) of the simulated loop: z v = v + h (u - k x - d v), (z - 1) x = h z v."""
    z, h = np.exp(2j * np.pi * frequency_hz / loop.RATE_HZ), 1.0 / loop.RATE_HZ
    g = h / ((z - 1.0 + 12.0 * h) * (z - 1.0) / (h * z) + 100.0 * h)
    return 1.0 / (1.0 + loop.GAIN * g)


def simulated(count: int, noise: float = NOISE, cubic: float = 0.0):
    made = loop.experiment(
        GRID, count, P, np.random.default_rng(5), cubic=cubic, noise_std=noise, transient=3
    )
    return loop.spectra(made, GRID.last)


def test_without_noise_it_is_that_of_the_formula():
    for bla in (robust_bla(simulated(2, 0.0), GRID.excited), fast_bla(simulated(1, 0.0)[0], GRID)):
        np.testing.assert_allclose(bla.sensitivity.s, truth(bla.frequency_hz), rtol=2e-3)


def covered(made: list[BlaEstimate], s: np.ndarray) -> float:
    apart = np.array([np.abs(one.sensitivity.s - s) for one in made])
    return float(np.mean(apart <= np.array([one.sensitivity.s_radius_95 for one in made])))


def test_95_percent_of_the_discs_hold_the_formula():
    """40 experiments of 68 lines: 2720 discs tell the share to about 0.4 %."""
    spectra = simulated(40 * M)
    robust = [
        robust_bla(spectra[i : i + M], GRID.excited) for i in range(0, len(spectra), M)
    ]  # fmt: skip
    fast = [fast_bla(one, GRID) for one in spectra[:40]]
    s = truth(robust[0].frequency_hz)
    assert 0.935 < covered(robust, s) < 0.965
    assert 0.925 < covered(fast, s) < 0.97
    errors = np.array([one.sensitivity.s - s for one in robust])
    z = errors.mean(axis=0) / (errors.std(axis=0) / np.sqrt(len(robust)))
    assert np.mean(np.abs(z) ** 2) < 1.5


def test_the_coherence_is_that_of_the_noise_of_the_loop():
    """1/coherence - 1 of one realization: E|D|^2 / |G U|^2, D the noise of a mean of P periods."""
    spectra = simulated(40 * M)
    made = [robust_bla(spectra[i : i + M], GRID.excited) for i in range(0, len(spectra), M)]
    s, played = truth(made[0].frequency_hz), np.sqrt(2.0 / GRID.excited.size)
    linear = np.abs((1.0 - s) * played) ** 2
    noise = 4.0 * NOISE**2 / N / P
    found = np.mean([1.0 / one.coherence - 1.0 for one in made], axis=0)
    np.testing.assert_allclose(np.median(found * linear / noise), 1.0, atol=0.05)


def test_a_nonlinear_loop_has_discs_that_hold_the_mean_of_many_experiments():
    spectra = simulated(40 * M, cubic=2e-7)
    made = [robust_bla(spectra[i : i + M], GRID.excited) for i in range(0, len(spectra), M)]
    mean = np.mean([one.sensitivity.s for one in made], axis=0)
    assert 0.93 < covered(made, mean) < 0.97


def test_records_that_are_not_periodic_have_it_too():
    rng = np.random.default_rng(7)
    reference = rng.standard_normal((1, 16_384))
    torque, position = loop.run(reference, 0.0, NOISE * rng.standard_normal(reference.shape))
    run = run_of([np.stack([reference[0], torque[0], position[0]])], loop.RATE_HZ)
    bla = arbitrary_bla([run], loop.RATE_HZ).bla
    error = np.abs(bla.sensitivity.s - truth(bla.frequency_hz))
    every = slice(None, None, 3)
    assert np.mean((error <= bla.sensitivity.s_radius_95)[every]) > 0.9
    direct = run_of([np.stack([torque[0], torque[0], position[0]])], loop.RATE_HZ)
    assert arbitrary_bla([direct], loop.RATE_HZ).bla.sensitivity is None


@pytest.mark.parametrize(
    ("controller", "known"),
    [
        (None, None),
        ({"kind": "of a stranger"}, None),
        ({"kind": "pd_filtered", "p": 200.0, "d": 60.0, "n": 24.0}, True),
        ({"kind": "pid", "p": None, "i": 2.0, "d": 1.0, "unknown": ["p"]}, True),
        ({"kind": "pid", "p": 9.0, "i": 2.0, "d": 1.0, "derivative_on": "measurement"}, False),
        ({"kind": "pd", "p": 9.0, "d": 1.0, "feed_forward": {"velocity": 1.0}}, False),
    ],
)
def test_which_controllers_act_on_the_error_alone(controller, known):
    assert acts_on_error(controller, 1000.0) is known


def test_a_loop_whose_controller_does_not_act_on_the_error_alone_has_none():
    bla = robust_bla(simulated(2), GRID.excited)
    law = {"kind": "pd", "p": 9.0, "d": 1.0, "derivative_on": "measurement"}
    assert bla.sensitivity is not None and of_this_loop(bla, law, 100.0).sensitivity is None
    assert of_this_loop(bla, None, 100.0) is bla


def test_a_torque_that_stands_for_the_reference_tells_no_sensitivity():
    made = [replace(one, reference=one.torque) for one in simulated(2)]
    assert robust_bla(made, GRID.excited).sensitivity is None
    assert fast_bla(made[0], GRID).sensitivity is None
