"""The fast method's variance over 22 rigs: how near is it, and do the 95 % discs hold?

Run `python benchmarks/fast_method.py`. On each rig 200 realizations (50 with --quick) of two
periods, each an experiment of the fast method. Bias: mean predicted variance against the scatter of
all their BLAs, rms over reliable lines, of which chance is 1/sqrt(realizations). Coverage: share of
the realizations whose 95 % disc holds the mean BLA, at the worst reliable line. The rows take the
method's four steps in one by one (docs/paper.md).
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from machine import describe

from bla_analyzer.bla.fast import NEIGHBOURS, fast_bla
from bla_analyzer.bla.robust import INPUT_VARIANCE_LIMIT, confidence_radius, turned
from bla_analyzer.checks import periodicity
from bla_analyzer.distortion.levels import corrected_position
from bla_analyzer.distortion.local_power import local_power
from bla_analyzer.distortion.resonant_poles import resonant_poles, resonant_power
from fjr_bringup.design.measured import simulate_level
from fjr_kit.worker_pool import worker_count
from fjr_records.lines import Lines, interpolate_frf, nearest
from fjr_records.spectra import RealizationSpectra
from fjr_validation.paper.certificate import empirical
from fjr_validation.paper.levels import campaign_of

PERIODS = 2
NOISE = {"noise_std_rad": 1e-4}
FRICTION, TRANSMISSION = {"k1": 0.0}, {"fs": 0.0, "fsm": 0.0}
LIGHT = {"jm": 0.1, "j": 0.2, "fs": 3.0, "fsm": 4.0, "fv": 2.0, "fvm": 2.0, "k0": 2000.0}
HEAVY = {"jm": 0.3, "j": 0.6, "fs": 8.0, "fsm": 6.0, "fv": 6.0, "fvm": 3.0, "k0": 2500.0}
Rig = tuple[float, dict[str, float], dict[str, Any]]
"""Amplitude of a line (rad), what differs from the paper's rig, and from its excitation."""
RIGS: dict[str, Rig] = {
    "paper, 7 mrad": (7e-3, {}, {}),
    "paper, 2 mrad": (2e-3, {}, {}),
    "paper, 14 mrad": (14e-3, {}, {}),
    "friction alone, 7 mrad": (7e-3, FRICTION, {}),
    "friction alone, 2 mrad": (2e-3, FRICTION, {}),
    "transmission alone, 7 mrad": (7e-3, TRANSMISSION, {}),
    "transmission alone, 14 mrad": (14e-3, TRANSMISSION, {}),
    "Fgroup 2": (7e-3, {}, {"group": 2}),
    "Fgroup 4": (7e-3, {}, {"group": 4}),
    "0.05 Hz spacing": (5e-3, {}, {"base_frequency_hz": 0.05, "f_min_hz": 0.05}),
    "0.2 Hz spacing": (10e-3, {}, {"base_frequency_hz": 0.2, "f_min_hz": 0.2}),
    "light plant, 7 mrad": (7e-3, LIGHT, {}),
    "light plant, 3 mrad": (3e-3, LIGHT, {}),
    "heavy plant, 7 mrad": (7e-3, HEAVY, {}),
    "heavy plant, 14 mrad": (14e-3, HEAVY, {}),
    "backlash 0.5 mrad": (7e-3, {"backlash.half_gap_rad": 5e-4}, {}),
    "backlash 2 mrad": (7e-3, {"backlash.half_gap_rad": 2e-3}, {}),
    "extra mode, 30 Hz": (7e-3, {"extra_mode.inertia_kg_m2": 0.05}, {}),
    "rigid plant": (7e-3, {"k0": 30_000.0}, {}),
    "hardly damped plant": (4e-3, {"fv": 0.4, "fvm": 0.4}, {}),
    "linear plant, noise": (7e-3, {**FRICTION, **TRANSMISSION, "noise_std_rad": 1e-3}, {}),
    "paper, strong noise": (7e-3, {"noise_std_rad": 1e-3}, {}),
}
Estimate = tuple[np.ndarray, np.ndarray]
"""Variance of G at the excited lines, (F,), and the radius of its 95 % disc."""


def parts_of(spectra: RealizationSpectra, lines: Lines) -> tuple[np.ndarray, np.ndarray]:
    """Return G at the excited lines and the power of Yc at the odd detection lines."""
    g = spectra.position[lines.excited] / spectra.torque[lines.excited]
    return g, np.abs(corrected_position(spectra, g, lines, lines.odd)) ** 2


def shaped_by(shape: Callable[..., np.ndarray]) -> Callable[..., Estimate]:
    """Return the power law over eight lines, what `shape` gives divided out before."""

    def estimate(spectra: RealizationSpectra, lines: Lines) -> Estimate:
        g, power = parts_of(spectra, lines)
        at = np.concatenate([lines.odd, lines.excited])
        by = shape(spectra.frequency_hz, lines, g, at)
        odd, excited = by[: lines.odd.size], by[lines.odd.size :]
        found, degrees = local_power(power / odd, lines.odd, lines.excited, NEIGHBOURS)
        variance = found * excited / np.abs(spectra.torque[lines.excited]) ** 2
        return variance, confidence_radius(variance, degrees)

    return estimate


def mean_of_lines(spectra: RealizationSpectra, lines: Lines) -> Estimate:
    """Take the mean power of the eight nearest odd detection lines."""
    _, power = parts_of(spectra, lines)
    mean = power[nearest(lines.excited, lines.odd, NEIGHBOURS)].mean(axis=1)
    variance = mean / np.abs(spectra.torque[lines.excited]) ** 2
    return variance, confidence_radius(variance, np.full(variance.shape, float(NEIGHBOURS)))


def as_it_is(spectra: RealizationSpectra, lines: Lines) -> Estimate:
    """Take the product's own estimate."""
    bla = fast_bla(spectra, lines)
    return bla.var_total, bla.radius_95


METHODS: dict[str, Callable[[RealizationSpectra, Lines], Estimate]] = {
    "the mean of 8 lines": mean_of_lines,
    "a power law, 8 lines": shaped_by(lambda f, lines, g, at: np.ones(at.size)),
    "the same, divided by the measured gain of G": shaped_by(
        lambda f, lines, g, at: np.abs(interpolate_frf(at, lines.excited, g)) ** 2
    ),
    "the same, divided by the resonances (steps 1, 2)": shaped_by(
        lambda f, lines, g, at: resonant_power(f[at], resonant_poles(f[lines.excited], g))
    ),
    "steps 1 to 4": as_it_is,
}


def judged(name: str, realizations: int) -> tuple[np.ndarray, float]:
    """Return (bias, least coverage) of all METHODS on a rig, (methods, 2), and what is periodic."""
    amplitude_rad, simulator, excitation = RIGS[name]
    campaign = campaign_of(
        amplitude_rad,
        realizations,
        PERIODS,
        simulator={**NOISE, **simulator},
        excitation=excitation,
    )
    found: list[list[Estimate]] = []
    torque, position, periodic = [], [], []
    for number in range(realizations):
        level = simulate_level(campaign, 0, [number])
        u, y = turned(level.spectra, level.lines.excited)
        torque.append(u[0])
        position.append(y[0])
        periodic.append(periodicity(level.realizations[0]).passed)
        found.append([method(level.spectra[0], level.lines) for method in METHODS.values()])
    u, y = np.array(torque), np.array(position)
    reliable = u.var(axis=0) / np.abs(u.mean(axis=0)) ** 2 <= INPUT_VARIANCE_LIMIT
    g, truth = y / u, y.mean(axis=0) / u.mean(axis=0)
    scores = []
    for method in range(len(METHODS)):
        variance = np.array([one[method][0] for one in found])
        radius = np.array([one[method][1] for one in found])
        ratio = (variance.mean(axis=0) / empirical(g))[reliable]
        held = np.mean(np.abs(g - truth) <= radius, axis=0)[reliable]
        scores.append((float(np.sqrt(np.mean((ratio - 1.0) ** 2))), float(held.min())))
    return np.array(scores), float(np.mean(periodic))


def main() -> None:
    """Measure and print."""
    print(describe() + "\n", flush=True)
    realizations = 50 if "--quick" in sys.argv else 200
    every = []
    with ProcessPoolExecutor(worker_count(None, len(RIGS))) as pool:
        jobs = {name: pool.submit(judged, name, realizations) for name in RIGS}
        print(f"{realizations} realizations each; bias of the first and the last method, periodic")
        for name, job in jobs.items():
            scores, periodic = job.result()
            every.append(scores)
            print(f"{name:30}{scores[0, 0]:6.0%}{scores[-1, 0]:6.0%}{periodic:8.0%}", flush=True)
    bias, coverage = np.moveaxis(np.array(every), -1, 0)
    print(f"\n{'variance from':50}{'median':>8}{'worst':>8}{'coverage':>10}")
    for number, name in enumerate(METHODS):
        print(
            f"{name:50}{np.median(bias[:, number]):8.0%}{bias[:, number].max():8.0%}"
            f"{coverage[:, number].mean():10.0%}"
        )


if __name__ == "__main__":
    main()
