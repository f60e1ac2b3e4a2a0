"""Analysis arithmetic: equality with the plain formulas, and calibration by Monte Carlo.

150 experiments of the paper's rig (both nonlinearities, 20 dB SNR), M = 7, P = 2, robust method:
the empirical variance of G over the experiments against the predicted one, and how many of the 95 %
discs hold the mean. Targets: within 1e-10; median ratio 0.95-1.05; 93-97 %.
"""

from __future__ import annotations

import os
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from machine import describe

from bla_analyzer.bla.robust import robust_bla
from controller_node import pd_filtered
from excitation_node import multisine
from fjr_records.spectra import PeriodSums
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization

M, P = 7, 2


def spectra_of(experiment, rig):
    """Return the spectra of one simulated realization, and the raw (P, 3, lines) DFT values."""
    run = run_realization(rig, experiment)
    shape = (-1, experiment.samples_per_period)
    kept = [
        signal.reshape(shape)[experiment.transient_periods :]
        for signal in (run.reference, run.torque, run.position)
    ]
    sums = PeriodSums(experiment.samples_per_period)
    for period in zip(*kept, strict=True):
        sums.add(period)
    raw = np.fft.rfft(np.array(kept), axis=-1)[..., experiment.excited_harmonics]
    spectra = sums.spectra(experiment.base_frequency_hz, max(experiment.excited_harmonics))
    return spectra, raw.transpose(1, 0, 2)


def transcription(raw):
    """Return G and its total variance by paper.md's formulas; raw is (M, P, [r, u, y], lines)."""
    mean = raw.mean(axis=1)
    phase = np.exp(-1j * np.angle(mean[:, 0]))
    u, y = mean[:, 1] * phase, mean[:, 2] * phase
    g = y.mean(0) / u.mean(0)
    total = np.sum(np.abs(y - g * u) ** 2, axis=0) / (M * (M - 1) * np.abs(u.mean(0)) ** 2)
    return g, total


def main() -> None:
    """Measure and print."""
    print(describe() + "\n")
    experiments = 30 if "--quick" in sys.argv else 150
    values = multisine.EXCITATION.check(
        {"base_frequency_hz": 0.5, "f_min_hz": 0.5, "realizations": M * experiments, "periods": P}
    )
    rig = SIMULATOR.check({"noise_snr_db": 20.0})
    law = pd_filtered.describe(pd_filtered.CONTROLLER.defaults())
    descriptions = [multisine.describe(values, 0, k, law) for k in range(M * experiments)]
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        done = list(pool.map(lambda each: spectra_of(each, rig), descriptions))
    excited = np.array(descriptions[0].excited_harmonics)
    estimates, worst = [], 0.0
    for start in range(0, len(done), M):
        members = done[start : start + M]
        bla = robust_bla([spectra for spectra, _ in members], excited)
        g, total = transcription(np.array([raw for _, raw in members]))
        worst = max(worst, np.max(np.abs(bla.g / g - 1)), np.max(np.abs(bla.var_total / total - 1)))
        estimates.append(bla)
    g = np.array([bla.g for bla in estimates])
    predicted = np.mean([bla.var_total for bla in estimates], axis=0)
    ratio = np.median(g.var(axis=0, ddof=1) / predicted)
    radius = np.array([bla.radius_95 for bla in estimates])
    covered = np.mean(np.abs(g - g.mean(axis=0)) <= radius)
    print("| what | measured | target |\n|---|---|---|")
    print(f"| greatest relative difference from the plain formulas | {worst:.1e} | 1e-10 |")
    print(f"| median of empirical over predicted variance | {ratio:.3f} | 0.95-1.05 |")
    print(f"| share of 95 % discs that hold the mean | {covered:.1%} | 93-97 % |")
    print(f"| experiments, lines | {experiments}, {excited.size} | 150 |")


if __name__ == "__main__":
    main()
