"""Realizations that repeat a reference, pooled: their periods are further periods of one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fjr_records.spectra import RealizationSpectra

SAME_PHASES = 0.05
"""Two references whose spectra differ by less than this (relative) are the same realization."""


def repeat_groups(
    spectra: Sequence[RealizationSpectra], repeat_of: Sequence[int | None], numbers: Sequence[int]
) -> list[list[int]]:
    """Return indices of realizations by reference, in order.

    Args:
        spectra: one entry each realization of a level.
        repeat_of: the number of the realization that each is described to repeat, or None.
        numbers: the number of each realization.
    """
    groups: list[list[int]] = []
    for i, one in enumerate(spectra):
        for group in groups:
            first = spectra[group[0]].reference
            apart = np.linalg.norm(one.reference - first)
            if repeat_of[i] == numbers[group[0]] or apart < SAME_PHASES * np.linalg.norm(first):
                group.append(i)
                break
        else:
            groups.append([i])
    return groups


def pooled(spectra: Sequence[RealizationSpectra]) -> RealizationSpectra:
    """Return realizations of one reference as one, with the periods of all.

    Means and scatter are those that all periods together would have given; what differs from one
    run to the next counts as noise.
    """
    periods = sum(one.periods for one in spectra)
    if len(spectra) == 1:
        return spectra[0]
    share = np.array([one.periods for one in spectra])[:, None] / periods
    reference, torque, position = (
        (share * np.array([getattr(one, name) for one in spectra])).sum(axis=0)
        for name in ("reference", "torque", "position")
    )
    scatter = np.zeros((3, reference.size), complex)
    for one in spectra:
        off_torque, off_position = one.torque - torque, one.position - position
        scatter += one.periods * np.stack(
            [
                np.abs(off_torque) ** 2,
                np.abs(off_position) ** 2,
                off_position * off_torque.conj(),
            ]
        )
        if one.periods > 1:
            own = np.stack([one.var_torque, one.var_position, one.cov_position_torque])
            scatter += one.periods * (one.periods - 1) * own
    scatter /= periods * (periods - 1)
    return RealizationSpectra(
        periods=periods,
        frequency_hz=spectra[0].frequency_hz,
        reference=reference,
        torque=torque,
        position=position,
        var_torque=scatter[0].real,
        var_position=scatter[1].real,
        cov_position_torque=scatter[2],
    )
