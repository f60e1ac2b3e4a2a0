"""Diagnosis of the motor bench: fit on record A, judge on record B; numbers and figures.

python docs/motor_bench/diagnose.py bench_a bench_b docs/motor_bench
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from fjr_records.periodic import RecordedExperiment, RecordedRealization, read_experiment
from fjr_records.spectra import line_spectrum
from gap_diagnosis.model.misfit import Misfit
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.simulated_rig import Simulator
from gap_diagnosis.which.fits import Fit, Fitter

TOLERANCE = 2.3  # friction is not known at all: every value may be a factor of sixty off
BANDS = ((11, 40), (40, 60), (60, 90), (90, 150), (150, 250))


def held(torque: np.ndarray) -> np.ndarray:
    """Return the mean of a sampled, band-limited current over each sample interval.

    The bench's current is measured, not commanded and held; this is what a hold must play.
    """
    flat = torque.ravel()
    cycles = np.fft.rfftfreq(flat.size)
    lines = np.fft.rfft(flat) * np.exp(1j * np.pi * cycles) * np.sinc(cycles)
    return np.fft.irfft(lines, flat.size).reshape(torque.shape)


def nominal(record: RecordedRealization, lines: int) -> dict[str, float]:
    """Return a two-mass nominal from antiresonance, resonance and low-frequency gain of a record.

    Friction values are guesses.
    """
    excited = np.array(record.experiment.excited_harmonics)
    y, u = (record.spectrum(s, lines).mean(0)[excited] for s in (record.position, record.torque))
    rate = 2.0 * np.pi * excited * record.experiment.base_frequency_hz
    mobility = np.abs(rate**2 * y / u)
    zero, pole = rate[np.argmin(mobility)], rate[np.argmax(mobility)]
    low = (rate > 2 * np.pi * 15) & (rate < 2 * np.pi * 25)
    shape = (1 - (rate[low] / zero) ** 2) / (1 - (rate[low] / pole) ** 2)
    total = float(1.0 / np.median(mobility[low] / shape))
    ratio = float((pole / zero) ** 2 - 1.0)  # j / jm
    jm = total / (1.0 + ratio)
    return {
        "jm": jm, "j": ratio * jm, "fs": 0.3, "fsm": 0.3, "fv": 0.05, "fvm": 0.05,
        "k0": ratio * jm * float(zero) ** 2, "k1": 0.0,
    }  # fmt: skip


@dataclass(frozen=True)
class Bench:
    """Both records with what fits them."""

    recorded: RecordedExperiment
    simulator: Simulator
    noise: np.ndarray
    fitter: Fitter


def prepare(a: RecordedRealization, b: RecordedRealization, values: dict[str, float]) -> Bench:
    """Return a fitter that trains on record A and judges on record B."""
    recorded = RecordedExperiment("bench", (a, b))
    simulator = Simulator(recorded)
    noise = []
    for one in (a, replace(b, experiment=a.experiment)):  # each record has a noise of its own
        alone = RecordedExperiment(one.name, (one,))
        noise.append(Simulator(alone).noise(Model.nominal(values)).of_outputs(alone)[0])
    noise = np.array(noise)
    fitter = Fitter(recorded, simulator, noise, values, (0,), (1,), TOLERANCE)
    return Bench(recorded, simulator, noise, fitter)


def relative_errors(bench: Bench, model: Model, index: int) -> np.ndarray:
    """Return |prediction error| of motor and load angle over frequency, (2, lines), rad."""
    run = line_spectrum(bench.simulator.many([model], [index])[0, 0], bench.recorded.lines)
    return np.abs(run - Misfit(bench.recorded, bench.simulator, bench.noise, [index]).measured[0])


def table(bench: Bench, models: dict[str, Model]) -> None:
    """Print errors on record B over the response, by band and encoder."""
    excited = np.array(bench.recorded.realizations[1].experiment.excited_harmonics)
    measured = np.abs(Misfit(bench.recorded, bench.simulator, bench.noise, [1]).measured[0])
    for low, high in BANDS:
        lines = excited[(excited >= low) & (excited < high)]
        size = np.sqrt((measured[:, lines] ** 2).sum(1))
        row = [f"{low}-{high} Hz"]
        for model in models.values():
            error = relative_errors(bench, model, 1)[:, lines]
            row.append("{:.1%} {:.1%}".format(*(np.sqrt((error**2).sum(1)) / size)))
        row.append(
            "{:.2%} {:.2%}".format(*(np.linalg.norm(bench.noise[1][:, lines], axis=1) / size))
        )
        print(" | ".join(row))


def distortion(bench: Bench, models: dict[str, Model]) -> None:
    """Print power means at silent lines of record B below 40 Hz: response and errors."""
    excited = bench.recorded.realizations[1].experiment.excited_harmonics
    silent = np.setdiff1d(np.arange(11, 40), excited)
    measured = np.abs(Misfit(bench.recorded, bench.simulator, bench.noise, [1]).measured[0, 0])
    rows = {"measured": measured, "noise": bench.noise[1][0]}
    rows |= {name: relative_errors(bench, model, 1)[0] for name, model in models.items()}
    for name, values in rows.items():
        levels = [
            10 * np.log10(np.mean(values[silent[silent % 2 == parity]] ** 2)) for parity in (1, 0)
        ]
        print(f"{name}: odd {levels[0]:.1f} dB, even {levels[1]:.1f} dB")


def plot_errors(bench: Bench, models: dict[str, Model], path: Path) -> None:
    """Draw prediction errors of both angles on the held-out record."""
    excited = np.array(bench.recorded.realizations[1].experiment.excited_harmonics)
    measured = np.abs(Misfit(bench.recorded, bench.simulator, bench.noise, [1]).measured[0])
    figure, axes = plt.subplots(1, 2, figsize=(10, 4), sharey=True, layout="constrained")
    for side, (axis, title) in enumerate(zip(axes, ("motor angle", "load angle"), strict=True)):
        axis.loglog(excited, measured[side, excited], "k.-", lw=0.8, label="response")
        for name, model in models.items():
            error = relative_errors(bench, model, 1)[side, excited]
            axis.loglog(excited, error, ".-", lw=0.8, ms=3, label=f"error, {name}")
        axis.loglog(excited, bench.noise[1][side, excited], color="0.7", label="noise of the mean")
        axis.set_title(f"record B (held out), {title}")
        axis.set_xlabel("frequency (Hz)")
        axis.set_xticks([15, 30, 53, 77, 150, 250], ["15", "30", "53", "77", "150", "250"])
        axis.tick_params(axis="x", which="minor", labelbottom=False)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("amplitude (rad)")
    axes[1].legend(fontsize=8, loc="lower left")
    figure.savefig(path / "diagnosis_errors.png", dpi=120)


def plot_ranking(bench: Bench, parent: Fit, fits: dict[str, Fit], path: Path) -> None:
    """Draw the held-out misfit of every effect beside the delay."""
    size = bench.fitter.held.size
    ordered = sorted(fits, key=lambda name: -fits[name].held_chi2)
    figure, axis = plt.subplots(figsize=(7, 6), layout="constrained")
    axis.barh(ordered, [fits[name].held_chi2 / size for name in ordered], color="tab:blue")
    axis.axvline(parent.held_chi2 / size, color="k", lw=1, label="delay alone")
    axis.axvline(1.0, color="tab:green", lw=1, label="noise alone")
    axis.set_xscale("log")
    axis.set_xlabel("misfit per degree of freedom on record B")
    axis.set_title("delay and one effect more, fitted on record A")
    figure.legend(loc="outside lower center", ncols=2)
    figure.savefig(path / "diagnosis_ranking.png", dpi=120)


def main(folder_a: str, folder_b: str, out: str) -> None:
    """Fit, print, draw."""
    a, b = (
        replace(r, torque=held(r.torque))
        for r in (read_experiment(Path(f)).realizations[0] for f in (folder_a, folder_b))
    )
    values = nominal(a, RecordedExperiment("a", (a,)).lines)
    bench = prepare(a, b, values)
    fitter = bench.fitter

    def show(name: str, fit: Fit) -> None:
        misfits = fit.train_chi2 / fitter.train.size, fit.held_chi2 / fitter.held.size
        found = {k: float(f"{v:.4g}") for k, v in {**fit.model.plant, **fit.model.effects}.items()}
        print(f"{name}: A {misfits[0]:.0f}, B {misfits[1]:.0f}, {found}")

    start = Model.nominal(values)
    print(f"nominal: A {fitter.train.chi2(start):.0f}, B {fitter.held.chi2(start):.0f}", values)
    refit = fitter.refit()
    show("refit", refit)
    single = {
        effect: fitter.add(refit, effect, fitter.screening(refit, effect).proposals())
        for effect in fitter.catalogue
    }
    for effect in sorted(single, key=lambda name: single[name].held_chi2)[:6]:
        show(effect, single[effect])
    delayed = single["delay"]
    more = {
        effect: fitter.add(delayed, effect, fitter.screening(delayed, effect).proposals())
        for effect in fitter.catalogue
        if effect != "delay"
    }
    for effect in sorted(more, key=lambda name: more[name].held_chi2)[:6]:
        show(f"delay + {effect}", more[effect])
    drag = more["quadratic_friction"].model
    models = {
        "nominal": start,
        "refit": refit.model,
        "delay": delayed.model,
        "delay and drag": drag,
    }
    table(bench, models)
    distortion(bench, {**models, "delay and presliding": more["presliding_friction"].model})
    plot_errors(bench, models, Path(out))
    plot_ranking(bench, delayed, more, Path(out))


if __name__ == "__main__":
    main(*sys.argv[1:])
