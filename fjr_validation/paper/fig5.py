"""Fig. 5 and algorithm 1: the experiments before and after shaping."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from excitation_node.shaping import ShapingGoal
from fjr_bringup.design.bench import batch_bench
from fjr_bringup.design.shape import lines_rms, response_of, shape
from fjr_bringup.design.shaping_output import line_spectra
from fjr_kit.tasks import Arrays, Task

from .fig5_drawing import SIGNALS
from .levels import campaign_of, measure, variant
from .settings import Settings

SCALES = (0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.15)
"""Torque of the shaped excitation over that of the unshaped one at its optimum."""
SHAPING_REALIZATIONS, SHAPING_PERIODS = 40, 2
TRANSIENT_PERIODS = 2
"""The shaped reference is large and slow: it rises over one period and settles over another."""


def shaped_level(amplitude_rad: float) -> dict[str, Any]:
    """Run algorithm 1 from a flat reference, at equal torque rms.

    Returns:
        shape: (F,), and level_rad, of the last pass; flatness_db: (passes,); spectra of the first
        and the last pass by signal and kind of line.
    """
    campaign = campaign_of(
        amplitude_rad,
        SHAPING_REALIZATIONS,
        SHAPING_PERIODS,
        transient_periods=TRANSIENT_PERIODS,
    )
    passes = shape(campaign, batch_bench, tolerance_db=0.1)
    excitation = passes[-1].campaign.values["excitation"]
    found: dict[str, Any] = {
        "shape": np.array(excitation["line_shape"]),
        "level_rad": excitation["amplitudes_rad"][0],
        "flatness_db": np.array([one.flatness_db for one in passes]),
        "torque_rms_nm": np.array([lines_rms(one.response) for one in passes]),
        "rms": np.array([one.level.rms for one in passes]),
        "peak": np.array([one.level.peak for one in passes]),
    }
    for when, one in (("before", passes[0]), ("after", passes[-1])):
        for signal, _ in SIGNALS:
            for kind, (frequency, values) in line_spectra(one.level, signal).items():
                found[f"{when}_{signal}_{kind}"] = np.stack([frequency, values])
    return found


def full_steps(amplitude_rad: float) -> dict[str, Any]:
    """Run the undamped loop of the paper; return its flatness after each pass."""
    campaign = campaign_of(
        amplitude_rad, SHAPING_REALIZATIONS, SHAPING_PERIODS, transient_periods=TRANSIENT_PERIODS
    )
    first = batch_bench(campaign, "")
    goal = ShapingGoal(lines_rms(response_of(first)), damping=1.0, tolerance_db=0.05)
    passes = shape(campaign, batch_bench, goal)
    return {"flatness_db": np.array([one.flatness_db for one in passes])}


def tasks(settings: Settings, amplitude_rad: float) -> list[Task]:
    """Return the loops, and the spread of V without shaping."""
    found = [
        Task("shaping", shaped_level, {"amplitude_rad": amplitude_rad}),
        Task("shaping_undamped", full_steps, {"amplitude_rad": amplitude_rad}),
    ]
    return found + _repeats("unshaped", settings, amplitude_rad, {}, 1)


def _repeats(
    name: str, settings: Settings, amplitude_rad: float, excitation: Any, transient: int
) -> list[Task]:
    """Return whole experiments on the same grid with other phases each.

    Their phases are none of those by which amplitude and torque were chosen as the best.
    """
    count = settings.both_realizations
    return [
        Task(
            f"{name}_{number:02d}",
            measure,
            {
                "amplitude_rad": amplitude_rad,
                "realizations": count,
                "periods": settings.robust_periods,
                "transient_periods": transient,
                "excitation": excitation,
                "first_realization": (number + 1) * count,
            },
        )
        for number in range(settings.repeats)
    ]


def _excitation(result: Arrays) -> dict[str, Any]:
    return {"line_shape": result["shape"].tolist(), "soft_start_s": 10.0}


def torque_tasks(settings: Settings, results: Mapping[str, Arrays]) -> list[Task]:
    """Return what needs the shape: V over the torque."""
    shaping = results["shaping"]
    excitation, level = _excitation(shaping), float(shaping["level_rad"])
    found = []
    for number, scale in enumerate(SCALES):
        parameters = {
            "amplitude_rad": level * scale,
            "realizations": settings.both_realizations,
            "periods": settings.robust_periods,
            "transient_periods": TRANSIENT_PERIODS,
            "excitation": excitation,
        }
        found.append(Task(f"shaped_scale_{number}", measure, parameters))
    return found


def best_tasks(settings: Settings, results: Mapping[str, Arrays]) -> list[Task]:
    """Return what needs the best torque: the spread of V there and at the unshaped optimum's."""
    shaping = results["shaping"]
    excitation, level = _excitation(shaping), float(shaping["level_rad"])
    found = curves(results, settings)
    torque, _, v = found["shaped"]
    best = int(np.argmin(v))
    amplitudes = [_line(one) for one in _unshaped(results, settings)]
    unshaped = float(np.interp(torque[best], found["unshaped"][0], amplitudes))
    return [
        *_repeats("shaped_best", settings, level * SCALES[best], excitation, TRANSIENT_PERIODS),
        *_repeats("shaped_equal", settings, level, excitation, TRANSIENT_PERIODS),
        *_repeats("unshaped_less", settings, unshaped, {}, 1),
    ]


def curves(
    results: Mapping[str, Arrays], settings: Settings
) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return (torque rms, V all lines, V from 1 Hz) without and with shaping."""
    levels = {
        "unshaped": _unshaped(results, settings),
        "shaped": [results[f"shaped_scale_{i}"] for i in range(len(SCALES))],
    }
    whole, above = variant("viscous", "mean", "all"), variant()
    return {
        name: (
            np.array([one["rms"][1] for one in found]),
            np.array([one["v"][whole] for one in found]),
            np.array([one["v"][above] for one in found]),
        )
        for name, found in levels.items()
    }


def _unshaped(results: Mapping[str, Arrays], settings: Settings) -> list[Arrays]:
    """Return the levels of Fig. 4 around the optimum."""
    flat = [results[f"sweep_both_{i:02d}"] for i in range(settings.amplitudes.size)]
    return [one for one in flat if 2e-3 < _line(one) < 2e-2]


def _line(level: Arrays) -> float:
    """Return the amplitude of a line of a flat reference, 167 of them (rad)."""
    return float(level["rms"][0] * np.sqrt(2.0 / level["g"].size))
