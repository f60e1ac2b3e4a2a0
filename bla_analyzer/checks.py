"""Checks of each realization (periodicity, transient, noise, unit), of signs and BLA of a level."""

from __future__ import annotations

import numpy as np

from fjr_kit.check import Check
from fjr_records.driven import opposes, wrong_sign
from fjr_records.realization import FALSE_ALARM, Realization, TimeSignals
from fjr_records.units import FOLLOWING_LIMIT, compare_units, following

from .bla.robust import INPUT_VARIANCE_LIMIT
from .results.result import BlaEstimate

PERIODICITY_LIMIT = 0.015
"""Greatest mismatch of y in the band (relative rms) beyond what noise explains, see
`period_mismatch`. The emulated rig at 9e-2 rad reaches 0.4 to 0.6, and stays below 2e-4 where it
settles; a real motor bench, disturbed in the band by more than its encoder's noise, scatters by
0.010."""
TRANSIENT_LIMIT = 0.01
"""Greatest rms of a remaining transient relative to y, where it starts."""

SIGNS_LIMIT = 0.5
"""Greatest number of doubts on signs: none."""
UNRELIABLE_LIMIT = 0.5
"""Greatest share of lines that may be unreliable, or whose 95 % disc may hold zero."""


def check_realization(realization: Realization, excited: np.ndarray) -> tuple[Check, ...]:
    """Return the checks of one realization.

    Args:
        realization: what was read.
        excited: (F,), excited harmonics.
    """
    return (
        periodicity(realization),
        transient(realization),
        input_snr(realization, excited),
        position_unit(realization, excited),
    )


def _check(realization: Realization, name: str, value: float, limit: float, sentence: str) -> Check:
    passed = not value > limit  # NaN: not testable, which the sentence says
    return Check(
        name=name,
        level=realization.level,
        realization=realization.realization,
        passed=passed,
        value=value,
        limit=limit,
        sentence=f"{realization.name}: {sentence}",
    )


def periodicity(realization: Realization) -> Check:
    """Tell whether y repeats from period to period, up to noise."""
    mismatch = realization.mismatch
    measured = (
        f"from period to period y differs by {mismatch.position:.2g} and u by "
        f"{mismatch.torque:.2g} of their rms in the band"
    )
    if np.isnan(mismatch.unexplained):
        sentence = "one period cannot show whether the response is periodic."
    elif mismatch.unexplained > PERIODICITY_LIMIT:
        sentence = (
            f"the response is not periodic: {measured}, and {mismatch.unexplained:.2g} is beyond "
            f"noise (false-alarm probability {FALSE_ALARM:g})."
        )
        if realization.transient > TRANSIENT_LIMIT:
            sentence += " A transient is left, so discard more periods first."
    else:
        sentence = f"the response is periodic: {measured}, no more than noise explains."
        if mismatch.unexplained:
            sentence = (
                f"the response is periodic to {PERIODICITY_LIMIT:.1%}: {measured}; "
                f"{mismatch.unexplained:.2g} is beyond noise."
            )
    return _check(realization, "periodicity", mismatch.unexplained, PERIODICITY_LIMIT, sentence)


def transient(realization: Realization) -> Check:
    """Tell whether the discarded periods were enough."""
    value = realization.transient
    if np.isnan(value):
        sentence = "one period cannot show whether the transient has decayed."
    elif value > TRANSIENT_LIMIT:
        sentence = (
            f"the transient has not decayed: {value:.2g} of the rms of y is left when the kept "
            "periods begin; discard more periods."
        )
    else:
        sentence = "the transient has decayed before the kept periods begin."
    return _check(realization, "transient", value, TRANSIENT_LIMIT, sentence)


def input_snr(realization: Realization, excited: np.ndarray) -> Check:
    """Compare the noise on the mean torque spectrum with its level, median over excited lines."""
    spectra = realization.spectra
    value = float(np.median(spectra.var_torque[excited] / np.abs(spectra.torque[excited]) ** 2))
    if np.isnan(value):
        sentence = "one period cannot show the noise of the torque."
    else:
        with np.errstate(divide="ignore"):
            snr_db = -10.0 * np.log10(value)
        sentence = (
            f"the torque spectrum at excited lines has a signal-to-noise ratio of {snr_db:.0f} dB "
            "(median)."
        )
    return _check(realization, "input_snr", value, INPUT_VARIANCE_LIMIT, sentence)


def position_unit(realization: Realization, excited: np.ndarray) -> Check:
    """Tell whether y follows r as closely as it must if both are in one unit."""
    spectra = realization.spectra
    if np.array_equal(spectra.reference, spectra.torque):
        value = float("nan")
        sentence = "without a reference the unit of y cannot be checked."
    else:
        ratio = following(spectra.reference[excited], spectra.position[excited])
        value, sentence = compare_units(ratio)
    return _check(realization, "position_unit", value, FOLLOWING_LIMIT, sentence)


def signs(level: int, signals: TimeSignals) -> Check:
    """Tell whether torque, position and reference of a level go with each other by their signs."""
    r, u, y = signals.reference_rad, signals.torque_nm, signals.position_rad
    against = wrong_sign(u, y)
    mirrored = opposes(r, y) if np.isfinite(r).all() and not np.array_equal(r, u) else None
    doubts = [doubt for doubt in (against, mirrored) if doubt is not None]
    found = "; ".join(doubts) or "the signs of torque, position and reference go together"
    return Check(
        name="signs",
        level=level,
        passed=len(doubts) <= SIGNS_LIMIT,
        value=float(len(doubts)),
        limit=SIGNS_LIMIT,
        sentence=f"level {level}: {found}.",
    )


def reliable_lines(level: int, bla: BlaEstimate | None) -> Check:
    """Tell whether most lines of the BLA can be used.

    A line cannot where Var(U)/|U|^2 is not small or where the 95 % disc of G holds zero.
    """
    share, lines = 1.0, 0
    if bla is not None:
        bad = ~bla.reliable | (bla.radius_95 >= np.abs(bla.g))
        share, lines = float(np.mean(bad)), bad.size
    sentence = f"{1.0 - share:.0%} of the {lines} lines of the BLA can be used."
    if share > UNRELIABLE_LIMIT:
        sentence = (
            f"{share:.0%} of the {lines} lines of the BLA are unreliable: the torque hardly "
            "follows the reference there, or the 95 % disc holds zero; excite more, or check that "
            "the reference belongs to this record."
        )
    if bla is None:
        sentence = "there is no BLA."
    return Check(
        name="reliable_lines",
        level=level,
        passed=share <= UNRELIABLE_LIMIT,
        value=share,
        limit=UNRELIABLE_LIMIT,
        sentence=f"level {level}: {sentence}",
    )
