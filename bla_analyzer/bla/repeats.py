"""Realizations that repeat a reference, pooled: their periods are further periods of one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fjr_records.spectra import LinkSpectra, RealizationSpectra

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
    means, covariances = zip(*(_signals(one) for one in spectra), strict=True)
    counts = np.array([one.periods for one in spectra])
    mean = np.einsum("i,isf->sf", counts / periods, np.array(means))
    scatter = np.zeros((len(mean), *mean.shape), complex)
    for count, own, covariance in zip(counts.tolist(), means, covariances, strict=True):
        off = own - mean
        scatter += count * off[:, None] * off[None].conj()
        if count > 1:
            scatter += count * (count - 1) * covariance
    scatter /= periods * (periods - 1)
    share = counts[:, None] / periods
    return RealizationSpectra(
        periods=periods,
        frequency_hz=spectra[0].frequency_hz,
        reference=(share * np.array([one.reference for one in spectra])).sum(axis=0),
        torque=mean[0],
        position=mean[1],
        var_torque=scatter[0, 0].real,
        var_position=scatter[1, 1].real,
        cov_position_torque=scatter[1, 0],
        link=None
        if len(mean) < 3
        else LinkSpectra(mean[2], scatter[2, 2].real, scatter[2, 0], scatter[2, 1]),
    )


def _signals(one: RealizationSpectra) -> tuple[np.ndarray, np.ndarray]:
    """Return means of torque, position and link, (2 or 3, K+1), and their covariance."""
    cross = one.cov_position_torque
    means, rows = [one.torque, one.position], [[one.var_torque + 0j, cross.conj()]]
    rows.append([cross, one.var_position + 0j])
    if one.link is not None:
        link = one.link
        means.append(link.mean)
        rows[0].append(link.cov_torque.conj())
        rows[1].append(link.cov_position.conj())
        rows.append([link.cov_torque, link.cov_position, link.var + 0j])
    return np.array(means), np.array(rows)
