"""What is evidently wrong with the signals of a file, but might be meant."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fjr_kit.errors import InputError

from ..driven import opposes, wrong_sign
from ..units import may_stick, unit_taken_for_rad
from . import coherence, impossible
from .import_map import Column
from .repetition import Repetition

_NO_TORQUE = re.compile(r"(^|[^a-z])(pwm|duty|counts?|volts?|voltage|current)([^a-z]|$)", re.I)


def doubts_of_values(
    values: Mapping[str, np.ndarray],
    columns: Mapping[str, Column],
    rate_hz: float,
    stamps_s: np.ndarray | None,
) -> tuple[str, ...]:
    """Return what is doubtful in signals as they stand in a file.

    Args:
        values: {quantity: float64 (its samples,)}.
        columns: where each quantity stands.
        rate_hz: of the samples.
        stamps_s: of the position (its samples,), s; None where they are even.
    """
    found = [unlikely_torque(columns)]
    position, torque = values["position"], values.get("torque")
    if not columns["position"].is_speed:
        stamps = np.arange(position.size) / rate_hz if stamps_s is None else stamps_s
        found.append(impossible.jump(position, stamps))
    elif torque is not None and torque.size == position.size:
        found.append(impossible.magnitude_of_speed(position, torque))
    return tuple(doubt for doubt in found if doubt)


def unlikely_torque(columns: Mapping[str, Column]) -> str | None:
    """Return the clause that doubts a torque which by its name is none, and has no factor."""
    torque = columns.get("torque")
    if torque is None or torque.by_factor or torque.unit or not _NO_TORQUE.search(torque.name):
        return None
    return (
        f"{torque.name} is taken as a torque in N m, which by its name it is not; give the factor "
        f"from it to N m, as in torque={torque.name}:0.01"
    )


def doubts_of_signals(
    path: Path,
    signals: Mapping[str, np.ndarray],
    repetition: Repetition | None,
    columns: Mapping[str, Column],
    swings_free: bool,
    before: tuple[str, ...],
) -> tuple[str, ...]:
    """Return what is doubtful in evenly sampled signals; raise InputError where it is certain.

    Args:
        path: the file.
        signals: {symbol: float64 (samples,)} in SI.
        repetition: their period; None without one.
        columns: where each quantity stands.
        swings_free: whether no torque acts.
        before: what was doubtful in the file, which is returned as well.
    """
    doubts = before + _unit_doubts(path, signals, repetition, columns)
    u, y = signals["u"], signals["y"]
    if not (np.ptp(u) > 0 or swings_free):
        doubts += ("the torque is constant, so no response can be told from this run",)
    if (magnitude := impossible.magnitude_of_torque(u, y)) is not None:
        doubts += (magnitude,)
    elif impossible.SPEED not in before and (against := wrong_sign(u, y)) is not None:
        doubts += (f"{against}: --map torque=-COLUMN or position=-COLUMN turns it",)
    if "r" in signals and (against := opposes(signals["r"], y)) is not None:
        doubts += (f"{against}: --map reference=-COLUMN or position=-COLUMN turns it",)
    return doubts


def _unit_doubts(
    path: Path,
    signals: Mapping[str, np.ndarray],
    repetition: Repetition | None,
    columns: Mapping[str, Column],
) -> tuple[str, ...]:
    """Refuse angles in different units; doubt them where a factor, or a rig that sticks, may be."""
    pairs = []
    if "reference" in columns and not columns["reference"].by_factor:  # else it is a current, say
        pairs.append(("position", "reference", coherence.angle_ratio(signals, repetition)))
    if "q" in signals and np.ptp(signals["q"]) > 0:
        ratio = float(np.std(signals["q"]) / np.std(signals["y"]))
        pairs.append(("link", "position", ratio))
    doubts = []
    for one, other, ratio in pairs:
        doubt = coherence.unit_doubt(ratio, one, other)
        if doubt is None:
            continue
        meant = columns[one].by_factor or columns[other].by_factor
        meant = meant or (one == "link" and unit_taken_for_rad(max(ratio, 1.0 / ratio)) is None)
        if not (meant or (one == "position" and may_stick(ratio))):
            raise InputError(f"{path}: {doubt}.")
        doubts.append(doubt)
    return tuple(doubts)
