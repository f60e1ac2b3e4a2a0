"""Records and their simulations beside each other: signals, errors by band, missing torque."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..model.evidence import Evidence
from ..model.rig_model import Model

BINS = 40
_LEAST = 5  # samples of a bin, below which it shows nothing


@dataclass(frozen=True)
class Curve:
    """Torque that a model lacks over one coordinate; arrays (bins,).

    Attributes:
        center: median of the coordinate in each bin.
        torque: median of the torque in it, N m.
    """

    center: np.ndarray
    torque: np.ndarray


@dataclass(frozen=True)
class RunComparison:
    """One level of records.

    Attributes:
        level: its index.
        name: of the record that is shown.
        time_s: of its samples, (samples,).
        position: y of the rig and of each model by its name, rad, (samples,).
        torque: u likewise, N m.
        edges_hz: (bands + 1,), ends of the bands; band 0 is the mean and slow motion.
        errors: rms error of the position in each band by name of the model, (bands,): over the
            noise where that is known, else over the motion in the band.
        over_velocity, over_angle: torque that a model lacks by its name.
        compared: what of rig and model was; where it is the torque, `position` of a model says
            nothing more.
    """

    level: int
    name: str
    time_s: np.ndarray
    position: Mapping[str, np.ndarray]
    torque: Mapping[str, np.ndarray]
    edges_hz: np.ndarray
    errors: Mapping[str, np.ndarray]
    over_velocity: Mapping[str, Curve]
    over_angle: Mapping[str, Curve]
    compared: Literal["motion", "torque"] = "motion"


def compare_runs(
    evidence: Evidence, parts: tuple[int, ...], models: Mapping[str, Model]
) -> list[RunComparison]:
    """Compare records with models, level by level.

    Args:
        evidence: the records.
        parts: those that report.
        models: by name: the nominal, the refit, and a model for each cause that was added.
    """
    errors = evidence.errors(list(models.values()), parts)
    yardstick = _yardstick(evidence, parts)
    own = len(evidence.octaves)  # bands of the motion
    by_band = {
        name: _root_ratio(evidence.mean_squares(each, parts), yardstick).reshape(
            -1, evidence.bands
        )[:, :own]
        for name, each in zip(models, errors, strict=True)
    }
    return [
        _compare(evidence, parts, models, row, {k: v[row] for k, v in by_band.items()})
        for row in range(len(evidence.records.levels))
        if any(evidence.parts[p].level == evidence.records.levels[row] for p in parts)
    ]


def _yardstick(evidence: Evidence, parts: tuple[int, ...]) -> np.ndarray:
    if evidence.noise.known:
        return evidence.noise_power
    return evidence.mean_squares(evidence.measured(parts), parts)


def _root_ratio(squares: np.ndarray, yardstick: np.ndarray) -> np.ndarray:
    whole = np.where(yardstick > 0.0, yardstick, np.nan)
    return np.asarray(np.sqrt(squares / whole))


def _compare(
    evidence: Evidence,
    parts: tuple[int, ...],
    models: Mapping[str, Model],
    row: int,
    errors: Mapping[str, np.ndarray],
) -> RunComparison:
    level = evidence.records.levels[row]
    index = next(evidence.parts[p].record for p in parts if evidence.parts[p].level == level)
    record = evidence.records.records[index]
    ends = _ends(models)
    runs = evidence.simulator.run(list(ends.values()), [index])
    signals = {name: run[0] for name, run in zip(ends, runs, strict=True)}
    rate = evidence.records.sample_rate_hz
    smooth = max(int(rate / (evidence.lines * evidence.line_hz)), 1)
    velocity = rate * np.gradient(uniform_filter1d(record.position, smooth))
    lacking = {
        name: evidence.simulator.missing_torque(model, [index])[0]
        for name, model in ends.items()
        if name != "nominal"
    }
    lacking = {name: uniform_filter1d(torque, smooth) for name, torque in lacking.items()}
    return RunComparison(
        level=level,
        name=record.name,
        time_s=np.arange(record.samples) / rate,
        position={"rig": record.position, **{name: run[0] for name, run in signals.items()}},
        torque={"rig": record.torque, **{name: run[1] for name, run in signals.items()}},
        edges_hz=evidence.octaves.edges * evidence.line_hz,
        errors=errors,
        over_velocity={name: binned(velocity, torque) for name, torque in lacking.items()},
        over_angle={name: binned(record.position, torque) for name, torque in lacking.items()},
        compared="torque" if evidence.slow else "motion",
    )


def _ends(models: Mapping[str, Model]) -> dict[str, Model]:
    """Return the nominal, the refit and, where there is a cause, the best model."""
    names = list(models)
    ends = {name: models[name] for name in names[:2]}
    return ends | ({"explained": models[names[-1]]} if len(names) > 2 else {})


def binned(values: np.ndarray, torque: np.ndarray) -> Curve:
    """Return medians in BINS bins of as many samples; a torque that is not finite is left out."""
    finite = np.isfinite(torque) & np.isfinite(values)
    values, torque = values[finite], torque[finite]
    order = np.argsort(values, kind="stable")
    pieces = [p for p in np.array_split(order, BINS) if p.size >= _LEAST]
    return Curve(
        np.array([np.median(values[p]) for p in pieces]),
        np.array([np.median(torque[p]) for p in pieces]),
    )
