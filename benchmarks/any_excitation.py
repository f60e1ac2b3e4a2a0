"""The BLA from any excitation on random rigs: do 95 % discs hold the truth, and do signals agree?

Run `python benchmarks/any_excitation.py` (--quick: fewer rigs; a number: the first seed). Each case
is one record of 30 s of a rig, three of each rig, under noise, a chirp or a multisine of equal flat
power, analysed by itself. Truth of a linear rig: its sampled response. Truth of a rig with friction
and a hardening transmission: the pooled response of 160 multisines of that power; beside it the
statistical linearisation. A trapezoid shows which lines it excites.
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from machine import describe

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import rig_records as rigs

from bla_analyzer.bla.arbitrary import arbitrary_bla, run_of
from bla_analyzer.bla.local_fit import Run, fit_window
from bla_analyzer.bla.windows import ORDER
from fjr_kit.errors import InputError
from fjr_sim_node.theory.statistical_linearisation import linearise

KINDS = ("noise", "chirp", "multisine")
CASES = ((True, 30.0, 0.03), (True, 30.0, 1e-3), (False, 30.0, 1e-3), (False, 30.0, 0.01))
"""(linear, seconds, encoder noise over rms of the reference)."""
TRUTH_RUNS = 160
RECORDS = 3
"""Of each kind of every rig."""
EVERY = 4
"""Every how many lines the truth is looked at."""
LOW_HZ = 1.0
"""Below, the response bends within one window."""
Row = tuple[int, int, int, float, float, int, int]
"""Lines held, reliable lines, lines left out, median radius over |G|, median error in dB; lines
held and reliable lines below LOW_HZ."""


def many_runs(rig: rigs.Rig, seconds: float) -> list[Run]:
    """Return the multisines behind the truth of a rig that is not linear."""
    return [
        run_of([rigs.record(rig, "multisine", seconds, noise=0.0, seed=10_000 + m)], rigs.RATE)
        for m in range(0 if rig.linear else TRUTH_RUNS)
    ]


class Truth:
    """The BLA of a rig for multisines, complex, rad/(N m); each frequency is computed once."""

    def __init__(self, rig: rigs.Rig, seconds: float) -> None:
        self._rig, self._seconds = rig, seconds
        self._runs = many_runs(rig, seconds)
        self._known: dict[float, complex] = {}

    def at(self, frequency_hz: np.ndarray) -> np.ndarray:
        """Return it at some frequencies, complex (F,)."""
        if self._rig.linear:
            return rigs.truth(self._rig, frequency_hz)
        for f in frequency_hz:
            if f not in self._known:
                half = max(9.0 / self._seconds, 0.02 * f)
                band = max(f - half, 1.0 / self._seconds), f + half
                fit = fit_window(self._runs, f, band, ORDER)
                self._known[f] = complex(np.nan) if fit is None else fit.g
        return np.array([self._known[f] for f in frequency_hz])


def linearised(rig: rigs.Rig, seconds: float, frequency_hz: np.ndarray) -> np.ndarray:
    """Return the BLA that statistical linearisation predicts, complex (F,)."""
    low, high = rigs.BAND_HZ
    lines = np.arange(np.ceil(low * seconds), high * seconds + 1) / seconds
    amplitude = np.full(lines.size, rigs.RMS_RAD[rig.linear] * np.sqrt(2.0 / lines.size))
    try:
        found = linearise(rig.values, rig.controller, rigs.RATE, lines, amplitude)
    except InputError:
        return np.full(frequency_hz.size, complex(np.nan))
    return found.frf(frequency_hz)


def judged(seed: int, linear: bool, seconds: float, noise: float) -> dict[str, Row]:
    """Return a row for each kind of excitation, and for statistical linearisation."""
    rig = rigs.random_rig(seed, linear=linear)
    truth = Truth(rig, seconds)
    rows: dict[str, Row] = {}
    for kind in KINDS:
        held = lines = lost = held_low = lines_low = 0
        radii, errors, off = [], [], []
        for number in range(RECORDS):
            record = rigs.record(rig, kind, seconds, noise=noise, seed=seed + 100 * number)
            found = arbitrary_bla([run_of([record], rigs.RATE)], rigs.RATE)
            bla = found.bla
            keep = np.flatnonzero(bla.reliable)[::EVERY]
            f, g, radius = bla.frequency_hz[keep], bla.g[keep], bla.radius_95[keep]
            exact = truth.at(f)
            inside, low = np.abs(g - exact) <= radius, f < LOW_HZ
            held, lines = held + int(inside.sum()), lines + keep.size
            held_low, lines_low = held_low + int(inside[low].sum()), lines_low + int(low.sum())
            lost += int((found.left_out_hz < rigs.BAND_HZ[1]).sum())
            radii.append(radius / np.abs(g))
            errors.append(np.abs(20.0 * np.log10(np.abs(g / exact))))
            if kind == "multisine" and not linear:
                by_theory = linearised(rig, seconds, f)
                off.append(np.abs(20.0 * np.log10(np.abs(by_theory / exact))))
        radius, error = np.median(np.concatenate(radii)), np.nanmedian(np.concatenate(errors))
        rows[kind] = (held, lines, lost, float(radius), float(error), held_low, lines_low)
        if off:
            error = float(np.nanmedian(np.concatenate(off)))
            rows["statistical linearisation"] = (0, lines, 0, np.nan, error, 0, 0)
    return rows


def covered(held: np.ndarray, lines: np.ndarray) -> str:
    """Return the share of lines that are held, with its standard error over rigs (jackknife)."""
    share = held.sum() / lines.sum()
    without = (held.sum() - held) / (lines.sum() - lines)
    error = np.sqrt((held.size - 1) / held.size * np.sum((without - without.mean()) ** 2))
    return f"{100.0 * share:.1f} +- {100.0 * error:.1f} %"


def trapezoid(seed: int) -> tuple[float, float, int, int, int, int]:
    """Return first and last frequency found, lines found, left out, reliable, and of these held."""
    rig = rigs.random_rig(seed, linear=True)
    record = rigs.record(rig, "trapezoid", 60.0, noise=0.01, seed=seed)
    found = arbitrary_bla([run_of([record], rigs.RATE)], rigs.RATE)
    f = found.bla.frequency_hz
    held = np.abs(found.bla.g - rigs.truth(rig, f)) <= found.bla.radius_95
    sure = found.bla.reliable
    return f[0], f[-1], f.size, found.left_out_hz.size, int(sure.sum()), int(held[sure].sum())


def main() -> None:
    """Measure and print."""
    print(describe() + "\n", flush=True)
    first_seed = next((int(given) for given in sys.argv[1:] if given.isdecimal()), 0)
    seeds = range(first_seed, first_seed + (8 if "--quick" in sys.argv else 20))
    head = f"{'rig':8}{'s':>5}{'noise':>8}  {'excitation':26}{'discs hold':>14}{'lines':>7}"
    print(head + f"{'left out':>10}{'radius':>9}{'error':>9}  below {LOW_HZ:g} Hz")
    with ProcessPoolExecutor(2) as pool:
        for linear, seconds, noise in CASES:
            jobs = [pool.submit(judged, s, linear, seconds, noise) for s in seeds]
            found = [job.result() for job in jobs]
            for kind in found[0]:
                rows = np.array([one[kind] for one in found])
                lines, lost = rows[:, 1:3].sum(axis=0)
                cover = covered(rows[:, 0], rows[:, 1]) if kind in KINDS else ""
                radius = f"{np.median(rows[:, 3]):.2%}" if kind in KINDS else ""
                low = "{:.0f} of {:.0f}".format(*rows[:, 5:].sum(axis=0)) if kind in KINDS else ""
                name = "linear" if linear else "friction"
                print(
                    f"{name:8}{seconds:5.0f}{noise:8g}  {kind:26}{cover:>14}{lines:7.0f}"
                    f"{lost:10.0f}{radius:>9}{np.nanmedian(rows[:, 4]):6.2f} dB  {low}",
                    flush=True,
                )
        found = list(pool.map(trapezoid, seeds))
    first, last, lines, lost, sure, held = np.array(found, float).T
    print(
        f"\ntrapezoid, {len(seeds)} linear rigs: {np.median(first):.2f} to "
        f"{np.median(last):.1f} Hz (medians), {lines.sum():.0f} lines found, {lost.sum():.0f} "
        f"left out, {sure.sum():.0f} reliable, whose discs hold {covered(held, sure)}"
    )


if __name__ == "__main__":
    main()
