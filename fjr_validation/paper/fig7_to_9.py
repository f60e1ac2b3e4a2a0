"""Figs. 7, 8 and 9: the BLA by the fast and by the robust method, with distortion and noise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bla_analyzer.bla.fast import fast_bla
from bla_analyzer.checks import periodicity
from bla_analyzer.results.summary import decibel
from fjr_bringup.design.measured import simulate_level
from fjr_kit.tasks import Arrays, Task

from . import agreement, fig9
from .fig7_to_9_drawing import (
    FIG9_TITLE,
    fast_figure,
    fast_plot,
    fig9_caption,
    fig9_figure,
    fig9_plot,
    state,
)
from .fig9 import over_noise_db
from .levels import campaign_of, measure, models, predicted
from .part import Part, PlotPlace, Statement, inconsistent, repeats
from .resonance import fit_level
from .settings import CASES, SMALL_RAD, SNR_DB, STRONG_RAD, Settings

FAST_PERIODS = 7
STRONG_RATE_HZ = 20_000.0
"""At 9e-2 rad a loop at 1 kHz is chaotic; at 20 kHz some realizations become periodic."""
CANDIDATES = 6
PAPER_GAP_DB = 100.0
"""What the paper says of noise below distortion in Fig. 8."""
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
            (
                "friction_rms",
                fig9.RMS_READING * SMALL_RAD,
                settings.friction_realizations,
                friction,
            ),
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
            caption = f", {words}. {state(result)}"
            plots.append(PlotPlace(f"{name}{noise}", title, caption, fast_plot(result), 400))
            figures[f"{name}{noise}"] = fast_figure(result, RANGES_DB[name])
    caption = f"{fig9_caption(settings, amplitude_rad)} {fig9.mean_of_responses(results)}"
    plots.append(PlotPlace("fig9", FIG9_TITLE, caption, fig9_plot(results), 460))
    figures["fig9"] = fig9_figure(results)
    return Part(
        "Figs. 7 to 9: the BLA, its distortion and its noise",
        (
            "Distortion and noise variance stand on the same axes as 10 log10 of the variance of G "
            "of one realization, so that 1 rad/(N m) is the reference of all. A noise variance "
            "that a periodic response without noise shows is round-off.",
        ),
        (
            *_statements(results),
            *fig9.statements(results, settings, amplitude_rad),
            agreement.statement(results),
        ),
        tuple(plots),
        (fig9.references_table(results), fig9.table(results)),
        figures,
        {"agreement_db": agreement.summary(results)},
    )


def _statements(results: Mapping[str, Arrays]) -> tuple[Statement, ...]:
    repeat = "fjr paper; fjr simulate and fjr analyze --method fast"
    seven, seven_clean = results["fig7_noise"], results["fig7"]
    eight, clean = results["fig8_noise"], results["fig8"]
    # The least gain of both curves tells whether the antiresonance is masked.
    depth = np.ptp(decibel(seven["g_viscous"])[_band(seven, 9, 14)])
    seen = fit_level(results["fig9_friction_noise"])
    return (
        Statement(
            "Fig. 7",
            "friction masks the resonances; distortion well above noise",
            f"distortion {over_noise_db(seven):.0f} dB above noise of 20 dB SNR (median), "
            f"{over_noise_db(seven_clean):.0f} dB above round-off without it; "
            f"damping of the link {seen.parameters['fv']:.0f} N m s/rad instead of 4 "
            f"(G0 has a dip of {depth:.0f} dB between 9 and 14 Hz)",
            repeats(over_noise_db(seven) > 3.0),
            repeat,
        ),
        Statement(
            "Fig. 8, noise",
            "noise at least 100 dB below distortion (Fig. 8), with an SNR of 20 dB (text)",
            f"{over_noise_db(eight):.0f} dB (median) with the stated SNR of 20 dB, "
            f"{over_noise_db(clean):.0f} dB without noise at {STRONG_RATE_HZ / 1e3:.0f} kHz "
            f"({'periodic' if clean['periodic'] else 'not periodic'}, realization "
            f"{int(clean['realization']) + 1}), "
            f"{over_noise_db(results['fig8_1khz']):.0f} dB at 1 kHz, where it is "
            f"{'periodic' if results['fig8_1khz']['periodic'] else 'not periodic'}",
            inconsistent(over_noise_db(eight) < PAPER_GAP_DB),
            repeat,
        ),
    )


def _band(result: Arrays, low: float, high: float) -> np.ndarray:
    return (result["frequency_hz"] >= low) & (result["frequency_hz"] <= high)
