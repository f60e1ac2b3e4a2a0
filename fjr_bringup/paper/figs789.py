"""Figs. 7, 8 and 9: the BLA by the fast and by the robust method, with distortion and noise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bla_analyzer.checks import periodicity
from bla_analyzer.fast import fast_bla

from ..measured import simulate_level
from ..tasks import Arrays, Task
from . import agreement, drawing
from .figs789_drawing import (
    FIG9,
    fast_figure,
    fast_plot,
    fig9_caption,
    fig9_figure,
    fig9_plot,
    state,
)
from .levels import campaign_of, measure, models, predicted, variant
from .part import Part, PlotPlace, Statement, Table, repeats
from .prediction import difference
from .resonance import fit_level
from .settings import CASES, SMALL_RAD, SNR_DB, STRONG_RAD, Settings

FAST_PERIODS = 7
STRONG_RATE_HZ = 20_000.0
"""At 9e-2 rad a loop at 1 kHz is chaotic; at 20 kHz some realizations become periodic."""
CANDIDATES = 6
RANGES_DB = {"fig7": (-250.0, 0.0), "fig8": (-300.0, 50.0)}
"""The paper's axes."""


def fast(
    amplitude_rad: float,
    simulator: Mapping[str, float],
    rate_hz: float = 1000.0,
    transient_periods: int = 1,
    candidates: int = 1,
) -> dict[str, Any]:
    """Estimate the BLA of the first realization that is periodic by the fast method, P = 7.

    Returns:
        frequency_hz, g, g_viscous, predicted, var_total, var_noise, var_nonlinear: (F,); periodic;
        mismatch; realization: the one that was taken.
    """
    campaign = campaign_of(
        amplitude_rad,
        candidates,
        FAST_PERIODS,
        rate_hz=rate_hz,
        transient_periods=transient_periods,
        simulator=simulator,
    )
    for number in range(candidates):
        level = simulate_level(campaign, 0, [number])
        check = periodicity(level.realizations[0])
        if check.passed:
            break
    bla = fast_bla(level.realizations[0].spectra, level.lines)
    return {
        "frequency_hz": bla.frequency_hz,
        "g": bla.g,
        "g_viscous": models(campaign, bla.frequency_hz)["viscous"],
        "predicted": predicted(campaign, bla.frequency_hz),
        "var_total": bla.var_total,
        "var_noise": bla.var_noise,
        "var_nonlinear": bla.var_nonlinear,
        "periodic": check.passed,
        "mismatch": check.value,
        "realization": number,
    }


def tasks(settings: Settings, amplitude_rad: float) -> list[Task]:
    """Return the tasks of the three figures, with noise of 20 dB and without."""
    found = []
    strong = {"rate_hz": STRONG_RATE_HZ, "transient_periods": 6, "candidates": CANDIDATES}
    for noise, extra in (("", {}), ("_noise", CASES["noise"])):
        friction = {**CASES["friction"], **extra}
        transmission = {**CASES["transmission"], **extra}
        for name, values in (
            ("fig7", {"amplitude_rad": SMALL_RAD, "simulator": friction}),
            ("fig8", {"amplitude_rad": STRONG_RAD, "simulator": transmission, **strong}),
            ("fig8_1khz", {"amplitude_rad": STRONG_RAD, "simulator": transmission}),
        ):
            found.append(Task(f"{name}{noise}", fast, values))
        for name, amplitude, count, simulator in (
            ("friction", SMALL_RAD, settings.friction_realizations, friction),
            ("transmission", STRONG_RAD, settings.transmission_realizations, transmission),
            ("both", amplitude_rad, settings.both_realizations, extra),
        ):
            parameters = {
                "amplitude_rad": amplitude,
                "realizations": count,
                "periods": settings.robust_periods,
                "simulator": simulator,
            }
            found.append(Task(f"fig9_{name}{noise}", measure, parameters))
    return found + agreement.tasks(settings, amplitude_rad)


def part(results: Mapping[str, Arrays], settings: Settings, amplitude_rad: float) -> Part:
    """Return the three figures with their statements."""
    plots, figures = [], {}
    for name, title in (
        ("fig7", "Fig. 7: fast method, friction only, 1 mrad, M 1, P 7"),
        ("fig8", "Fig. 8: fast method, transmission only, 90 mrad, M 1, P 7"),
    ):
        for noise, words in (("_noise", f"noise of {SNR_DB:.0f} dB SNR"), ("", "without noise")):
            result = results[f"{name}{noise}"]
            caption = f"<b>{title}</b>, {words}. {state(result)}"
            plots.append(PlotPlace(f"{name}{noise}", caption, fast_plot(result), 400))
            figures[f"{name}{noise}"] = fast_figure(result, RANGES_DB[name])
    plots.append(PlotPlace("fig9", fig9_caption(settings, amplitude_rad), fig9_plot(results), 460))
    figures["fig9"] = fig9_figure(results)
    return Part(
        "Figs. 7 to 9: the BLA, its distortion and its noise",
        (
            "Distortion and noise variance stand on the same axes, 10 log10 of the variance of "
            "G of "
            "one realization. A noise variance that a periodic response without noise shows is "
            "round-off.",
        ),
        (*_statements(results, settings, amplitude_rad), agreement.statement(results)),
        tuple(plots),
        (_table(results),),
        figures,
        {"agreement_db": agreement.summary(results)},
    )


def _gap_db(result: Arrays, key: str) -> float:
    """Return the median of distortion over noise variance of one realization (dB)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = result["var_nonlinear"] / result[key]
    positive = ratio[np.isfinite(ratio) & (ratio > 0)]
    return float(10.0 * np.log10(np.median(positive))) if positive.size else float("nan")


def _statements(
    results: Mapping[str, Arrays], settings: Settings, amplitude_rad: float
) -> tuple[Statement, ...]:
    repeat = "fjr paper; fjr simulate and fjr analyze --method fast"
    seven, seven_clean = results["fig7_noise"], results["fig7"]
    eight, clean = results["fig8_noise"], results["fig8"]
    friction = results["fig9_friction_noise"]
    both = results["fig9_both_noise"]
    shifted = fit_level(results["fig9_transmission_noise"])
    # The least gain of both curves tells whether the antiresonance is masked.
    depth = np.ptp(drawing.decibel(seven["g_viscous"])[_band(seven, 9, 14)])
    seen = fit_level(friction)
    columns = (variant("viscous", "mean", "all"), variant(), variant("viscous", "median"))
    v_friction, v_both = ([result["v"][c] for c in columns] for result in (friction, both))
    return (
        Statement(
            "Fig. 7",
            "friction masks the resonances; distortion well above noise",
            f"distortion {_gap_db(seven, 'var_noise'):.0f} dB above noise of 20 dB SNR (median), "
            f"{_gap_db(seven_clean, 'var_noise'):.0f} dB above round-off without it; "
            f"damping of the link {seen.parameters['fv']:.0f} N m s/rad instead of 4 "
            f"(G0 has a dip of {depth:.0f} dB between 9 and 14 Hz)",
            repeats(_gap_db(seven, "var_noise") > 3.0),
            repeat,
        ),
        Statement(
            "Fig. 8",
            "noise at least 100 dB below distortion",
            f"{_gap_db(eight, 'var_noise'):.0f} dB (median) with the stated SNR of 20 dB, "
            f"{_gap_db(clean, 'var_noise'):.0f} dB without noise at {STRONG_RATE_HZ / 1e3:.0f} kHz "
            f"({'periodic' if clean['periodic'] else 'not periodic'}, realization "
            f"{int(clean['realization']) + 1}), "
            f"{_gap_db(results['fig8_1khz'], 'var_noise'):.0f} dB at 1 kHz, where it is "
            f"{'periodic' if results['fig8_1khz']['periodic'] else 'not periodic'}",
            "cannot be right",
            repeat,
        ),
        Statement(
            "Fig. 9",
            "friction only (M 40, P 4): the BLA is almost G0",
            f"V {v_friction[0]:.1f} dB² with all lines, {v_friction[1]:.1f} from 1 Hz, median "
            f"{v_friction[2]:.2f}, at 1 mrad: the mean over phases keeps the damping of friction",
            repeats(v_friction[1] < 3.0),
            repeat,
        ),
        Statement(
            "Fig. 9",
            "transmission only (M 100): resonances shifted to the right",
            f"antiresonance {shifted.antiresonance_hz:.2f} \N{PLUS-MINUS SIGN} "
            f"{shifted.antiresonance_half_hz:.2f} Hz instead of 11.25, resonance "
            f"{shifted.resonance_hz:.2f} \N{PLUS-MINUS SIGN} {shifted.resonance_half_hz:.2f} Hz "
            f"instead of 17.79; periodic in "
            f"{100 * float(results['fig9_transmission']['periodic']):.0f} % of the realizations "
            "at 1 kHz",
            repeats(shifted.resonance_hz - shifted.resonance_half_hz > 17.79),
            repeat,
        ),
        Statement(
            "Fig. 9",
            "both at the optimum amplitude: the BLA fits G0 perfectly",
            f"V {v_both[0]:.2f} dB² with all lines, {v_both[1]:.2f} from 1 Hz, median "
            f"{v_both[2]:.3f}, at {1e3 * amplitude_rad:.2g} mrad with noise",
            repeats(v_both[1] < 1.0),
            repeat,
        ),
        Statement(
            "noise",
            "Gaussian noise with an SNR of 20 dB, and 100 dB between noise and distortion",
            "both cannot hold: see Fig. 8 in both forms",
            "cannot be right",
            repeat,
        ),
    )


def _band(result: Arrays, low: float, high: float) -> np.ndarray:
    return (result["frequency_hz"] >= low) & (result["frequency_hz"] <= high)


def _table(results: Mapping[str, Arrays]) -> Table:
    rows = []
    for name, _ in FIG9:
        for noise, words in (("_noise", "20 dB SNR"), ("", "none")):
            result = results[f"fig9_{name}{noise}"]
            found = fit_level(result)
            v = [f"{result['v'][variant('viscous', 'mean', band)]:.3g}" for band in ("all", "1hz")]
            rows.append(
                (
                    name,
                    words,
                    *v,
                    f"{found.antiresonance_hz:.2f} \N{PLUS-MINUS SIGN} "
                    f"{found.antiresonance_half_hz:.2f}",
                    f"{found.resonance_hz:.2f} \N{PLUS-MINUS SIGN} {found.resonance_half_hz:.2f}",
                    "{:.3g} / {:.2g}".format(*difference(result)[:2]),
                    f"{_gap_db(result, 'var_noise'):.0f}",
                    f"{100 * float(result['periodic']):.0f} %",
                )
            )
    return Table(
        "The BLAs of Fig. 9. Noise: median of the nonlinear variance of one realization over the "
        "noise variance of the BLA. From prediction: distance to the BLA of statistical "
        "linearisation from 1 Hz on, in dB\N{SUPERSCRIPT TWO} and in sigma (0.7: exact).",
        ("case", "noise", "V all", "V from 1 Hz", "antiresonance (Hz)", "resonance (Hz)",
         "from prediction", "over noise (dB)", "periodic"),
        tuple(rows),
    )  # fmt: skip
