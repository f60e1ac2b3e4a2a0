from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from bla_analyzer.bla.local_polynomial import local_polynomial_bla, transient_free_spectra
from bla_analyzer.bla.robust import robust_bla
from fjr_kit.errors import InputError
from fjr_validation.paper.levels import campaign_of
from fjr_validation.paper.short_records import compared, errors_db

RATE = 200.0
POLE = signal.cont2discrete(([40.0**2], [1.0, 2 * 0.1 * 40.0, 40.0**2]), 1.0 / RATE, method="zoh")
B, A = POLE[0].ravel(), POLE[1]


def true_frf(frequency_hz):
    return signal.freqz(B, A, 2 * np.pi * frequency_hz / RATE)[1]


def record(reference, noise_std=0.0, gain=0.5, seed=0):
    """A linear loop u = gain (r - y), y = G u + noise, sample by sample from rest."""
    rng = np.random.default_rng(seed)
    noise = noise_std * rng.standard_normal(reference.size)
    torque, position = np.zeros(reference.size), np.zeros(reference.size)
    plant = np.zeros(reference.size)
    for k in range(reference.size):
        plant[k] = sum(b * torque[k - i] for i, b in enumerate(B) if 0 < i <= k) - sum(
            a * plant[k - i] for i, a in enumerate(A) if 0 < i <= k
        )
        position[k] = plant[k] + noise[k]
        torque[k] = gain * (reference[k] - position[k])
    return reference, torque, position


def multisine(samples, lines, rng):
    spectrum = np.zeros(samples // 2 + 1, complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size))
    return np.fft.irfft(spectrum, samples) * samples / np.sqrt(2.0 * lines.size)


def test_a_noise_record_without_period_gives_the_frf_where_plain_division_leaks():
    rng = np.random.default_rng(1)
    r, u, y = record(rng.standard_normal(4000))
    bla = local_polynomial_bla((r, u, y), RATE, (2.0, 20.0))
    exact = true_frf(bla.frequency_hz)
    error = np.abs(bla.g - exact) / np.abs(exact)
    spectra = np.fft.rfft(np.stack([r, u, y]))
    lines = np.round(bla.frequency_hz * r.size / RATE).astype(int)
    plain = np.abs(spectra[2, lines] / spectra[1, lines] - exact) / np.abs(exact)
    assert np.sqrt(np.mean(error**2)) < 0.02
    assert np.sqrt(np.mean(error**2)) < 0.2 * np.sqrt(np.mean(plain**2))


def test_a_part_of_a_multisine_period_is_enough():
    rng = np.random.default_rng(2)
    period = multisine(6000, np.arange(1, 1200), rng)
    bla = local_polynomial_bla(record(period[:4000]), RATE, (2.0, 20.0))
    exact = true_frf(bla.frequency_hz)
    assert np.median(np.abs(bla.g - exact) / np.abs(exact)) < 0.01


def test_its_variance_is_that_of_repeated_records():
    """60 records: the ratio of variances has a standard error of some 2 % over the lines."""
    estimates, predicted = [], []
    for seed in range(60):
        rng = np.random.default_rng(100 + seed)
        r = multisine(2000, np.arange(1, 800), rng)
        bla = local_polynomial_bla(record(r, 0.02, seed=seed), RATE, (3.0, 20.0))
        estimates.append(bla.g)
        predicted.append(bla.var_total)
    exact = true_frf(bla.frequency_hz)
    empirical = np.mean(np.abs(np.array(estimates) - exact) ** 2, axis=0)
    ratio = np.median(empirical / np.mean(predicted, axis=0))
    assert 0.85 < ratio < 1.2


def test_the_transient_of_a_periodic_record_is_removed_without_discarding():
    rng = np.random.default_rng(3)
    lines = np.arange(1, 200, 2)
    r, u, y = record(np.tile(multisine(1000, lines, rng), 3))
    clean = transient_free_spectra((r, u, y), 3, RATE / 1000, 200)
    error = np.abs(clean.position[lines] / clean.torque[lines] - true_frf(lines * 0.2))
    raw = np.fft.rfft(np.stack([r, u, y]))[:, lines * 3]
    leaky = np.abs(raw[2] / raw[1] - true_frf(lines * 0.2))
    assert np.sqrt(np.mean(error**2)) < 0.05 * np.sqrt(np.mean(leaky**2))


def test_noise_of_a_periodic_record_is_known():
    """40 records: var_noise of the BLA against its scatter, median over lines within 15 %."""
    rng = np.random.default_rng(4)
    lines = np.arange(1, 200, 2)
    r = np.tile(multisine(1000, lines, rng), 3)
    estimates, predicted = [], []
    for seed in range(40):
        one = transient_free_spectra(record(r, 0.02, seed=seed), 3, RATE / 1000, 200)
        g = one.position[lines] / one.torque[lines]
        estimates.append(g)
        predicted.append(one.noise_of_residual(g, lines) / np.abs(one.torque[lines]) ** 2)
    empirical = np.var(np.array(estimates), axis=0, ddof=1)
    assert 0.85 < np.median(empirical / np.mean(predicted, axis=0)) < 1.15


def test_on_the_rig_it_is_at_least_as_accurate_as_discarding():
    """Same records: errors of 5 experiments by 165 lines, whose ratio has some 2 % of chance."""
    results = {"records_strong_0": compared(7e-3, 1e-3, 0, 5)}
    ratio = np.divide(*errors_db(results, "strong noise")[::-1])
    assert (ratio < 1.04).all()
    assert ratio[0] < 0.9


def test_its_spectra_serve_the_robust_method():
    campaign = campaign_of(7e-3, 2, 2, transient_periods=0)
    from fjr_sim_node.simulation.simulator import run_realization

    spectra = []
    for number in range(2):
        experiment = campaign.experiment(0, number)
        run = run_realization(campaign.values["simulator"], experiment)
        signals = (run.reference, run.torque, run.position)
        spectra.append(transient_free_spectra(signals, 2, 0.1, 500))
    bla = robust_bla(spectra, np.array(experiment.excited_harmonics))
    assert np.isfinite(bla.g).all() and (bla.var_total > 0).all()


def test_bad_records_are_refused():
    r = np.random.default_rng(0).standard_normal(1000)
    with pytest.raises(InputError, match="two or more whole periods"):
        transient_free_spectra((r, r, r), 1, 1.0, 10)
    with pytest.raises(InputError, match="two or more whole periods"):
        transient_free_spectra((r, r, r), 3, 1.0, 10)
    with pytest.raises(InputError, match="narrow the band or record longer"):
        local_polynomial_bla((r, r, r), RATE, (0.1, 20.0))
