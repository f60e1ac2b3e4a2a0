"""The report's section on Fig. 5: spectra before and after shaping, and V before and after."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy import stats

from fjr_kit.tasks import Arrays

from .fig5 import SHAPING_PERIODS, SHAPING_REALIZATIONS, TRANSIENT_PERIODS, curves
from .fig5_drawing import figure, spectra_plots, v_plot
from .levels import variant
from .part import Part, Statement, Table, met, repeats
from .settings import Settings

REPEATED = {
    "unshaped": "unshaped, optimum",
    "shaped_best": "shaped, best torque",
    "shaped_equal": "shaped, torque of the unshaped optimum",
    "unshaped_less": "unshaped, best torque of the shaped one",
}
"""Excitations whose V is measured in several experiments."""


def part(results: Mapping[str, Arrays], settings: Settings, amplitude_rad: float) -> Part:
    """Return Fig. 5 with its statements."""
    shaping = results["shaping"]
    found = curves(results, settings)
    flatness = ", ".join(f"{value:.2f}" for value in shaping["flatness_db"])
    undamped = ", ".join(f"{value:.2f}" for value in results["shaping_undamped"]["flatness_db"])
    text = (
        f"Algorithm 1 at {1e3 * amplitude_rad:.2g} mrad, M = {SHAPING_REALIZATIONS}, P = "
        f"{SHAPING_PERIODS}, soft start over the first of {TRANSIENT_PERIODS} discarded periods. "
        f"Distance of the torque spectrum from flat, pass by pass (dB, rms over lines): {flatness} "
        f"with the damped step; {undamped} with the paper's full step.",
        "Flat torque down to 0.1 Hz asks for a large slow reference: "
        f"{shaping['rms'][-1, 0]:.2f} rad rms instead of {shaping['rms'][0, 0]:.3f}, with a "
        f"peak of "
        f"the position of {shaping['peak'][-1, 2]:.2f} rad.",
        "Shaping moves torque from the middle of the band to its low lines and to the resonances, "
        "where it deflects the joint more; so at the torque rms of the unshaped optimum the "
        "shaped excitation is beyond its own optimum. The plot sets both beside each other at "
        "every "
        "torque.",
    )
    return Part(
        "Fig. 5: spectrum shaping",
        text,
        _statements(results, settings),
        (*spectra_plots(shaping), v_plot(found)),
        (_table(results, settings),),
        {"fig5": figure(shaping)},
        {
            "flatness_db": shaping["flatness_db"].tolist(),
            "v_against_torque": {
                name: [list(map(float, column)) for column in curve]
                for name, curve in found.items()
            },
        },
    )


def _spread(
    results: Mapping[str, Arrays], name: str, settings: Settings, column: int
) -> np.ndarray:
    return np.array([results[f"{name}_{i:02d}"]["v"][column] for i in range(settings.repeats)])


def mean_interval(values: np.ndarray) -> tuple[float, float, float]:
    """Return the mean of repeated experiments and the ends of its 95 % interval (Student)."""
    mean = float(np.mean(values))
    half = float(stats.t.ppf(0.975, values.size - 1) * stats.sem(values))
    return mean, mean - half, mean + half


def _words(values: np.ndarray) -> str:
    return "{:.2f} ({:.2f} to {:.2f})".format(*mean_interval(values))


def _torque(results: Mapping[str, Arrays], name: str, settings: Settings) -> float:
    """Return the torque rms of repeated experiments (N m)."""
    rms = [results[f"{name}_{i:02d}"]["rms"][1] for i in range(settings.repeats)]
    return float(np.sqrt(np.mean(np.square(rms))))


def _statements(results: Mapping[str, Arrays], settings: Settings) -> tuple[Statement, ...]:
    whole = variant(band="all")
    before = _spread(results, "unshaped", settings, whole)
    above = {name: _spread(results, name, settings, variant()) for name in REPEATED}
    after = _spread(results, "shaped_best", settings, whole)
    torque = {name: _torque(results, name, settings) for name in REPEATED}
    lowered = mean_interval(above["unshaped"] - above["shaped_best"])
    shaping = results["shaping"]
    odd, even = (_silent_db(shaping, "before", kind) for kind in ("odd", "even"))
    odd_after, even_after = (_silent_db(shaping, "after", kind) for kind in ("odd", "even"))
    m, p = settings.both_realizations, settings.robust_periods
    size = f"{before.size} experiments of M {m}, P {p}"
    repeat = "fjr shape, or fjr paper"
    passes = shaping["flatness_db"].size - 1
    return (
        Statement(
            "Fig. 5",
            "before shaping the torque spectrum is not flat, with energy at odd detection lines "
            "and "
            "none at even ones",
            f"{shaping['flatness_db'][0]:.1f} dB from flat; odd detection lines {odd:.0f} dB, even "
            f"lines {even:.0f} dB relative to excited ones (after shaping: odd {odd_after:.0f}, "
            f"even {even_after:.0f} dB)",
            repeats(odd > -60.0 and even < -200.0),
            repeat,
        ),
        Statement(
            "Algorithm 1",
            "after 2-3 iterations the torque spectrum is flat",
            f"{shaping['flatness_db'][-1]:.2f} dB from flat after {passes} damped iterations; "
            f"{results['shaping_undamped']['flatness_db'][3]:.2f} dB after 3 undamped ones",
            repeats(bool(results["shaping_undamped"]["flatness_db"][3] < 0.5)),
            repeat,
        ),
        Statement(
            "text",
            "V at the optimum amplitude before shaping: 0.94",
            f"{before.mean():.2f} dB² with all lines ({before.min():.2f} to {before.max():.2f} in "
            f"{size}), {_words(above['unshaped'])} from 1 Hz (95 % interval of the mean)",
            repeats(bool(before.min() <= 0.94 <= before.max())),
            repeat,
        ),
        Statement(
            "text",
            "shaping lowers V at the optimum, from 0.94 to 0.78",
            f"from 1 Hz {_words(above['unshaped'])} unshaped at {torque['unshaped']:.0f} N m rms, "
            f"{_words(above['shaped_best'])} dB² shaped at its best torque, "
            f"{torque['shaped_best']:.0f} N m (means of {size} with 95 % intervals); lower by "
            "{:.2f} ({:.2f} to {:.2f})".format(*lowered),
            repeats(lowered[1] > 0.0),
            repeat,
        ),
        Statement(
            "text",
            "target: V with shaping at most 0.78 dB² (all lines, as the paper's)",
            f"{_words(after)} dB² at its best torque, {_words(before)} unshaped (means of {size} "
            "with 95 % intervals)",
            met(mean_interval(after)[2] <= 0.78),
            repeat,
        ),
        Statement(
            "fair comparison",
            "shaping lowers V at equal torque rms (not said in the paper)",
            f"from 1 Hz at {torque['unshaped']:.0f} N m rms {_words(above['shaped_equal'])} dB² "
            f"shaped, {_words(above['unshaped'])} unshaped; at {torque['shaped_best']:.0f} N m "
            f"{_words(above['shaped_best'])} shaped, {_words(above['unshaped_less'])} unshaped",
            "finding",
            repeat,
        ),
    )


def _silent_db(shaping: Arrays, when: str, kind: str) -> float:
    """Return the level of the torque at lines of a kind relative to that at excited ones."""
    excited = _mean_db(shaping[f"{when}_torque_excited"])
    return _mean_db(shaping[f"{when}_torque_{kind}"]) - excited


def _mean_db(spectrum: np.ndarray) -> float:
    power = 10.0 ** (spectrum[1][np.isfinite(spectrum[1])] / 10.0)
    return float(10.0 * np.log10(power.mean())) if power.size else -np.inf


def _table(results: Mapping[str, Arrays], settings: Settings) -> Table:
    rows = []
    for name, words in REPEATED.items():
        cells = [words, f"{_torque(results, name, settings):.1f}"]
        for column in (variant(), variant(statistic="median"), variant(band="all")):
            cells.append("{:.3f} ({:.3f} to {:.3f})".format(
                *mean_interval(_spread(results, name, settings, column))))  # fmt: skip
        spread = _spread(results, name, settings, variant(band="all"))
        rows.append((*cells, f"{spread.min():.2f} to {spread.max():.2f}"))
    return Table(
        f"V (dB², against G0_viscous): mean of {settings.repeats} whole experiments each with its "
        "95 % interval.",
        ("excitation", "torque rms (N m)", "from 1 Hz", "median from 1 Hz", "all lines",
         "all lines, least to greatest"),
        tuple(rows),
    )  # fmt: skip
