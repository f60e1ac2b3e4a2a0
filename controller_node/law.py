"""The control law of an experiment description, whatever its kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fjr_kit.errors import InputError, shown

from . import pd_filtered
from .gains import SOURCE, unknown_gains, with_gains
from .structures import KINDS, known_fields, structure_of
from .transfer_function import TransferFunction

Law = np.ndarray | TransferFunction
"""A control law that can be simulated: coefficients of `pd_filtered`, or any other linear law."""


def law_of(
    controller: Mapping[str, Any] | None,
    sample_rate_hz: float,
    gains: Mapping[str, float] | None = None,
) -> Law:
    """Return the law of the `controller` entry of an experiment description, of any kind.

    Args:
        controller: the entry, see `controller_file`.
        sample_rate_hz: rate of the experiment.
        gains: values of the gains that are unknown, by the names of `unknown_gains`.

    Raises:
        InputError: there is no such entry, it is of no known kind, its values are bad, a gain is
            unknown, or the law is not causal or not stable.
    """
    controller = with_gains(controller or {}, gains or {})
    kind = controller.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        raise InputError(f"{SOURCE}.kind is {shown(kind)}; known are {', '.join(KINDS)}.")
    if kind == "pd_filtered" and not controller.get("feed_forward"):
        return pd_filtered.coefficients(pd_filtered.from_description(controller, sample_rate_hz))
    return structure_of(known_fields(controller), SOURCE).law(sample_rate_hz, SOURCE)


def law_as_run(
    controller: Mapping[str, Any] | None,
    sample_rate_hz: float,
    gains: Mapping[str, float] | None = None,
) -> TransferFunction:
    """Return the law as it ran: several times in one sample where a description says so.

    Args:
        controller: as of `law_of`.
        sample_rate_hz: rate of the experiment.
        gains: as of `law_of`.

    Raises:
        InputError: as `law_of`.
    """
    filled = with_gains(controller or {}, gains or {})
    given = filled.get("given")
    whole = {**filled, **given} if isinstance(given, Mapping) else filled
    if not whole.get("rate_hz"):
        return as_transfer_function(law_of(filled, sample_rate_hz))
    return structure_of(known_fields(whole), SOURCE).law_as_run(sample_rate_hz, SOURCE)


def as_transfer_function(law: Law) -> TransferFunction:
    """Return any law as a transfer function."""
    return law if isinstance(law, TransferFunction) else TransferFunction.of_pd(law)


def acts_on_error(controller: Mapping[str, Any] | None, sample_rate_hz: float) -> bool | None:
    """Return whether a described controller acts on r - y alone; None where that is not known.

    Args:
        controller: the `controller` entry of an experiment description.
        sample_rate_hz: rate of the experiment.
    """
    try:
        gains = dict.fromkeys(unknown_gains(controller), 1.0)
        return as_transfer_function(law_of(controller, sample_rate_hz, gains)).one_degree
    except InputError:
        return None
