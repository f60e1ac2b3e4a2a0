"""Signals that were not sampled together: each has stamps of its own, or rows of its own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fjr_kit.errors import InputError

from .import_map import OWN_TIME, TIME


def own_stamps(
    path: Path, values: Mapping[str, np.ndarray], times: Mapping[str, np.ndarray]
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the samples of each signal, and their stamps.

    Args:
        path: the file.
        values: {quantity: float64 (rows,)}, NaN in rows that hold no sample of it.
        times: {`time` or `QUANTITY_time`: float64 (rows,), NaN in rows without a stamp}.

    Returns:
        {quantity: float64 (its samples,)} and {quantity: its stamps}. Of signals that were sampled
        together all after all, the stamps are one array.

    Raises:
        InputError: a signal has no stamps, or another number of them.
    """
    found, stamps = {}, {}
    for quantity, each in values.items():
        own = f"{quantity}{OWN_TIME}"
        name = own if own in times else TIME
        if name not in times:
            raise InputError(
                f"{path}: its signals were not sampled together, and {quantity} has no stamps; map "
                f"{own}=COLUMN, or {TIME}=COLUMN for all signals that have none of their own."
            )
        if times[name].size != each.size:
            raise InputError(
                f"{path}: {quantity} has {each.size} samples, but {name} has {times[name].size}; "
                f"map {own}=COLUMN, the stamps of this signal."
            )
        there = np.isfinite(each) & np.isfinite(times[name])
        found[quantity], stamps[quantity] = each[there], times[name][there]
    first = stamps["position"]
    if all(np.array_equal(each, first) for each in stamps.values()):
        stamps = dict.fromkeys(stamps, first)
    return found, stamps
