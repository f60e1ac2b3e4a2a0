"""Checks of each realization: periodicity, transient and input signal-to-noise ratio."""

from __future__ import annotations

import numpy as np

from .realization import Realization
from .result import Check
from .robust import INPUT_VARIANCE_LIMIT

PERIODICITY_LIMIT = 0.1
"""Greatest mismatch of y in the band (relative rms) that white noise does not explain. The emulated
rig at 9e-2 rad reaches 0.4 to 0.6, and stays below 2e-4 where it settles."""
TRANSIENT_LIMIT = 0.01
"""Greatest rms of a remaining transient relative to y, where it starts."""


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
    )


def _check(realization: Realization, name: str, value: float, limit: float, sentence: str) -> Check:
    passed = not value > limit  # NaN: not testable, which the sentence says
    where = f"{realization.name}: "
    return Check(
        name, realization.level, realization.realization, passed, value, limit, where + sentence
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
            f"the response is not periodic: {measured}, and noise as strong as above the band "
            "does not explain it."
        )
    else:
        sentence = f"the response is periodic: {measured}, no more than noise explains."
        if mismatch.unexplained:
            sentence = (
                f"the response is periodic: {measured}; {mismatch.unexplained:.2g} is not "
                "explained by white noise."
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
