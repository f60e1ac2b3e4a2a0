"""The report's section on the calibration certificate."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bla_analyzer.bla.robust import INPUT_VARIANCE_LIMIT
from fjr_kit.tasks import Arrays

from .certificate import NOISE_STD_RAD, Certificate, M, P
from .certificate_drawing import coverage_plot, figure, law_plot, ratio_plot
from .part import Part, Statement, Table, met
from .settings import Settings

NAMES = ("robust", "fast", "noise")
DISC_NAMES = ("robust", "fast")
LEAST_INSIDE = 88.0
"""Percentage of 150 lines within 95 % bounds, less than which chance does not explain."""


def part(results: Mapping[str, Arrays], settings: Settings, amplitude_rad: float) -> Part:
    """Return the certificate."""
    found = Certificate(results)
    text = (
        f"{settings.experiments} whole experiments (M {M}, P {P}, closed loop, both "
        f"nonlinearities, {1e3 * amplitude_rad:.2g} mrad, encoder noise {NOISE_STD_RAD:g} rad) "
        "with new phases and noise each; the scatter of their BLAs is the empirical variance, the "
        "mean of what they predict the predicted one. Bounds: 95 % of the F distribution for "
        f"Gaussian errors. The noise variance is tested with {settings.noise_repeats} runs of one "
        "realization. Lines with Var(U)/|U|\N{SUPERSCRIPT TWO} above "
        f"{INPUT_VARIANCE_LIMIT:g} in one realization (hollow) are those that the analyzer calls "
        "unreliable for the fast method.",
        "An experiment of the fast method is one realization, so that there are "
        f"{settings.experiments * M} of them and its bounds are tighter. They show its remaining "
        f"bias: {100.0 * found.fast_bias:.1f} % rms over lines, since it takes the distortion at "
        "an excited line from detection lines beside it.",
        "What a user relies on is one experiment: its own 95 % disc, of its own variance and "
        "degrees of freedom, shall hold the true BLA (here: that of all realizations) in 95 % of "
        "the experiments, at every line. The level of distortion itself changes from realization "
        "to realization, so that the variances which the fast method predicts scatter as if they "
        f"had {found.fast_degrees:.1f} complex degrees of freedom instead of about 8; the error "
        "changes along, so that the discs hold.",
    )
    m_law, p_law = found.laws["1/M"], found.laws["1/(MP)"]
    statements = (
        _statement(found, "robust", "robust method"),
        _statement(found, "fast", f"fast method ({settings.experiments * M} realizations)"),
        _statement(found, "noise", "noise variance"),
        _disc_statement(found, "robust"),
        _disc_statement(found, "fast"),
        Statement(
            "laws",
            "nonlinear variance falls as 1/M, noise as 1/(M P)",
            f"slope {m_law[2]:.3f} \N{PLUS-MINUS SIGN} {2 * m_law[3]:.3f} over M 2 to 14, "
            f"{p_law[2]:.3f} \N{PLUS-MINUS SIGN} {2 * p_law[3]:.3f} over P 2 to 8 (noise alone)",
            "repeats" if abs(m_law[2] + 1) < 0.05 and abs(p_law[2] + 1) < 0.05 else "differs",
            "fjr paper",
        ),
    )
    numbers = {
        name: {
            "median_ratio": float(np.median(found.ratio[name][found.reliable])),
            "percent_inside": found.inside(name),
            "bounds": list(found.limits[name]),
            "ratio": found.ratio[name].tolist(),
        }
        for name in NAMES
    }
    discs = {
        name: {
            "percent_inside": found.discs_inside(name),
            "bounds": list(found.covered_limits[name]),
            "coverage": found.covered[name].tolist(),
        }
        for name in DISC_NAMES
    }
    return Part(
        "Calibration certificate",
        text,
        statements,
        (ratio_plot(found), coverage_plot(found), law_plot(found)),
        (_table(found), _disc_table(found)),
        {"certificate": figure(found)},
        {**numbers, "discs": discs, "fast_bias": found.fast_bias},
    )


def _statement(found: Certificate, name: str, words: str) -> Statement:
    ratio = found.ratio[name]
    reliable, (low, high) = ratio[found.reliable], found.limits[name]
    median = float(np.median(reliable))
    inside = found.inside(name)
    return Statement(
        "certificate",
        f"target: predicted and empirical variance agree within chi-square bounds, {words}",
        f"median ratio {median:.3f}, {inside:.0f} % of {reliable.size} reliable lines within "
        f"{low:.2f} to {high:.2f} (95 % expected, {LEAST_INSIDE:.0f} % asked for); all lines: "
        f"median {np.median(ratio):.3f}",
        met(inside >= LEAST_INSIDE and 0.93 <= median <= 1.07),
        "fjr paper",
    )


def _disc_statement(found: Certificate, name: str) -> Statement:
    covered, (low, high) = found.covered[name][found.reliable], found.covered_limits[name]
    inside = found.discs_inside(name)
    return Statement(
        "certificate",
        f"target: one experiment's own 95 % discs hold the truth at each line, {name} method",
        f"{100 * covered.mean():.1f} % of the discs do, {100 * covered.min():.0f} to "
        f"{100 * covered.max():.0f} % line by line; {inside:.0f} % of the lines within "
        f"{100 * low:.1f} to {100 * high:.1f} % (95 % expected, {LEAST_INSIDE:.0f} % asked for)",
        met(inside >= LEAST_INSIDE and 0.94 <= covered.mean() <= 0.96),
        "fjr paper",
    )


def _table(found: Certificate) -> Table:
    rows = []
    for name in NAMES:
        ratio, (low, high) = found.ratio[name][found.reliable], found.limits[name]
        rows.append((name,
                     f"{np.median(ratio):.3f}", f"{ratio.min():.2f} to {ratio.max():.2f}",
                     f"{low:.3f} to {high:.3f}", f"{found.inside(name):.0f} %",
                     f"{ratio.size} of {found.reliable.size}"))  # fmt: skip
    return Table(
        "Empirical over predicted variance at reliable lines.",
        ("variance", "median ratio", "range", "95 % bounds", "inside", "lines"),
        tuple(rows),
    )


def _disc_table(found: Certificate) -> Table:
    rows = []
    for name in DISC_NAMES:
        covered, (low, high) = found.covered[name][found.reliable], found.covered_limits[name]
        rows.append((name, f"{covered.mean():.3f}",
                     f"{covered.min():.3f} to {covered.max():.3f}",
                     f"{low:.3f} to {high:.3f}", f"{found.discs_inside(name):.0f} %"))  # fmt: skip
    return Table(
        "Fraction of experiments whose own 95 % disc holds the truth, at reliable lines.",
        ("method", "mean", "range over lines", "95 % bounds", "inside"),
        tuple(rows),
    )
