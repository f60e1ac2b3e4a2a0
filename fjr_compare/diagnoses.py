"""Two diagnoses: parameters with their intervals, causes, gaps."""

from __future__ import annotations

import math

from scipy.stats import norm

from fjr_sim_node.simulation.simulator import SIMULATOR
from gap_diagnosis.fits.estimates import run_scatter
from gap_diagnosis.outcome.diagnosis import Diagnosis
from gap_diagnosis.outcome.gap_size import Gap
from gap_diagnosis.outcome.verdict_words import unit_of

from .result import CauseDifference, Pair, ParameterDifference

SURE = 0.95
"""Probability from which on a cause that only one diagnosis names counts as a change."""
_QUANTILE = float(norm.ppf(0.975))
_CANNOT_NAME = ("bad_data", "nonstationary")


def compared_diagnoses(names: tuple[str, str], first: Diagnosis, other: Diagnosis) -> Pair:
    """Return what differs between two diagnoses.

    Args:
        names: of both.
        first: the diagnosis that the other is held against.
        other: the other one.
    """
    shared = [name for name in first.parameters if name in other.parameters]
    return Pair(
        other=names[1],
        parameters=[_parameter(name, first, other) for name in shared],
        causes=_causes(first, other),
        gap_first=_gaps(first),
        gap_other=_gaps(other),
        notes=_notes(names, first, other, bool(shared)),
    )


def _notes(names: tuple[str, str], first: Diagnosis, other: Diagnosis, shared: bool) -> list[str]:
    notes = [
        f"{name} ends in {diagnosis.verdict}, so it names no causes."
        for name, diagnosis in zip(names, (first, other), strict=True)
        if diagnosis.verdict in _CANNOT_NAME
    ]
    if not shared:
        notes.append("The two diagnoses have no parameter in common.")
    if first.verdict == "unexplained" or other.verdict == "unexplained":
        notes.append(
            "A gap that nothing explains may have moved into the parameters, so that they can "
            "differ although the rig does not."
        )
    return notes


def _gaps(diagnosis: Diagnosis) -> list[Gap]:
    none = Gap(nrmse_position=None, nrmse_torque=None, chi2_per_dof=None)
    return [diagnosis.gap.nominal or none, diagnosis.gap.explained or diagnosis.gap.refit or none]


def _parameter(name: str, first: Diagnosis, other: Diagnosis) -> ParameterDifference:
    one, two = first.parameters[name], other.parameters[name]
    scatters = [_scatter(name, diagnosis) for diagnosis in (first, other)]
    known = [scatter for scatter in scatters if scatter is not None]
    change = two.value - one.value
    sides = (one.high - one.value, two.value - two.low)
    if change < 0.0:
        sides = (one.value - one.low, two.high - two.value)
    squares = [(side / _QUANTILE) ** 2 for side in sides]
    for value, scatter in zip((one.value, two.value), scatters, strict=True):
        squares.append((value * (scatter or 0.0) / 100.0) ** 2)
    std = math.sqrt(sum(squares)) if all(map(math.isfinite, squares)) else math.nan
    p = 2.0 * float(norm.sf(abs(change) / std)) if std > 0.0 else None
    return ParameterDifference(
        name=name,
        unit=unit_of(name, linear=first.linear) if name in SIMULATOR else "",
        first=one,
        other=two,
        scatter_percent=max(known) if known else None,
        change_percent=100.0 * change / one.value if one.value else None,
        low=change - _QUANTILE * std,
        high=change + _QUANTILE * std,
        p_value=p,
    )


def _scatter(name: str, diagnosis: Diagnosis) -> float | None:
    """Return the standard deviation of a parameter between runs, in percent, if one is stated."""
    found = run_scatter(diagnosis.parameters, diagnosis.bags).get(name)
    value = abs(diagnosis.parameters[name].value)
    return 100.0 * found / value if found is not None and value > 0.0 else None


def _causes(first: Diagnosis, other: Diagnosis) -> list[CauseDifference]:
    mine, theirs = _named(first), _named(other)
    found = []
    for effects, present in mine:
        match = next((their for their in theirs if effects & their[0]), None)
        found.append(_cause(effects, present, match[1] if match else None, first, other))
    for effects, present in theirs:
        if not any(effects & my[0] for my in mine):
            found.append(_cause(effects, None, present, first, other))
    return found


def _cause(
    effects: frozenset[str], mine: float | None, theirs: float | None,
    first: Diagnosis, other: Diagnosis,
) -> CauseDifference:  # fmt: skip
    only = other if mine is None else first
    silent = first if mine is None else other
    present = theirs if mine is None else mine
    alone = (mine is None) != (theirs is None)
    sure = present is not None and present >= SURE and only.verdict not in _CANNOT_NAME
    could = silent.verdict not in _CANNOT_NAME
    return CauseDifference(
        effects=sorted(effects), first=mine, other=theirs, changed=alone and sure and could
    )


def _named(diagnosis: Diagnosis) -> list[tuple[frozenset[str], float]]:
    """Return each cause with what it cannot be told from, and the probability that it is there."""
    if diagnosis.causes:
        return [(frozenset([c.effect, *c.others]), c.present) for c in diagnosis.causes]
    sets = diagnosis.equivalent or [[effect] for effect in diagnosis.effects]
    return [(frozenset(names), diagnosis.confidence) for names in sets]
