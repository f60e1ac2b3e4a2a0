"""The part of a file that is asked for: samples to skip at the beginning, and samples to keep."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fjr_kit.errors import InputError

LEAST_SAMPLES = 16
"""Fewest samples of a record."""

Signals = dict[str, np.ndarray]


def of_rows(path: Path, rows: Mapping[str, np.ndarray], skip: int, keep: int | None) -> Signals:
    """Return a part of signals, and perhaps of their stamps, that were sampled together.

    Args:
        path: the file.
        rows: {quantity: (samples,)}, position among them, all of one length.
        skip: samples to leave out at the beginning.
        keep: samples to keep after those; None keeps all.

    Raises:
        InputError: too few samples are left.
    """
    part = slice(skip, None if keep is None else skip + keep)
    _refuse_short(path, rows["position"][part].size, skip)
    return {quantity: each[part] for quantity, each in rows.items()}


def of_time(
    path: Path,
    values: Mapping[str, np.ndarray],
    stamps: Mapping[str, np.ndarray],
    skip: int,
    keep: int | None,
) -> tuple[Signals, Signals]:
    """Return the part of signals with stamps of their own that lies in that of the position.

    Args:
        path: the file.
        values: {quantity: (its samples,)}, position among them.
        stamps: {quantity: (its samples,)}.
        skip: samples of the position to leave out at the beginning.
        keep: samples of the position to keep after those; None keeps all.

    Returns:
        The part of values and of stamps.

    Raises:
        InputError: too few samples are left.
    """
    if not skip and keep is None:
        return dict(values), dict(stamps)
    part = stamps["position"][slice(skip, None if keep is None else skip + keep)]
    _refuse_short(path, part.size, skip)
    inside = {q: (part[0] <= each) & (each <= part[-1]) for q, each in stamps.items()}
    return (
        {quantity: each[inside[quantity]] for quantity, each in values.items()},
        {quantity: each[inside[quantity]] for quantity, each in stamps.items()},
    )


def _refuse_short(path: Path, left: int, skipped: int) -> None:
    if not left:
        raise InputError(f"{path}: no samples are left after {skipped} skipped ones.")
    if left < LEAST_SAMPLES:
        raise InputError(
            f"{path}: {left} sample{'s are' if left > 1 else ' is'} too few for a record; give "
            f"{LEAST_SAMPLES} or more."
        )
