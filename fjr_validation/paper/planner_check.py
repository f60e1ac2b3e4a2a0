"""Does the experiment that `fjr plan` proposes reach the accuracy that was predicted?"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bla_analyzer.bla.robust import robust_bla
from fjr_bringup.design.measured import simulate_level
from fjr_bringup.design.planner import error_db, pilot_of, propose
from fjr_kit.tasks import Arrays, Task

from .levels import campaign_of
from .part import Part, Statement, Table, met
from .settings import Settings

BAND_HZ = (1.0, 50.0)
PILOT_REALIZATIONS, PILOT_PERIODS = 7, 2
TARGETS_DB = (2.0, 1.0, 0.5)
SNR_DB = 30.0
RIG_TIME_S = 7200.0
RESOLUTION_HZ = (0.1, 0.5)
RATIOS = (0.8, 1.15)
"""Reached over predicted error that counts as agreement; a pilot of 7 realizations knows a standard
deviation to within some 10 % after smoothing."""


def checked(
    amplitude_rad: float, target_db: float, resolution_hz: float, seed: int
) -> dict[str, Any]:
    """Plan from a pilot, run the plan and measure the error it reached.

    Returns:
        amplitude_rad, realizations, periods, base_frequency_hz, time_s, predicted_db; reached_db:
        the same bound from the variances that the experiment itself measures.
    """
    simulator = {"noise_snr_db": SNR_DB}
    pilot_campaign = campaign_of(
        amplitude_rad, PILOT_REALIZATIONS, PILOT_PERIODS, simulator=simulator,
        excitation={"seed": seed},
    )  # fmt: skip
    pilot = pilot_of(simulate_level(pilot_campaign))
    plan = propose([pilot], target_db, BAND_HZ, RIG_TIME_S, resolution_hz=resolution_hz)
    campaign = campaign_of(
        plan.amplitude_rad,
        plan.realizations,
        plan.periods,
        transient_periods=plan.transient_periods,
        simulator=simulator,
        excitation={
            "seed": seed + 50,
            "base_frequency_hz": plan.base_frequency_hz,
            "f_min_hz": plan.base_frequency_hz,
        },
    )
    level = simulate_level(campaign)
    bla = robust_bla(level.spectra, level.lines.excited)
    chosen = (bla.frequency_hz >= BAND_HZ[0]) & (bla.frequency_hz <= BAND_HZ[1])
    return {
        "amplitude_rad": plan.amplitude_rad,
        "realizations": plan.realizations,
        "periods": plan.periods,
        "base_frequency_hz": plan.base_frequency_hz,
        "time_s": plan.time_s,
        "predicted_db": plan.error_db,
        "reached_db": error_db((bla.radius_95 / np.abs(bla.g))[chosen]),
    }


def tasks(_settings: Settings, amplitude_rad: float) -> list[Task]:
    """Return one task for each target and resolution."""
    return [
        Task(
            f"plan_{target:g}_dB_{resolution:g}_Hz",
            checked,
            {
                "amplitude_rad": amplitude_rad,
                "target_db": target,
                "resolution_hz": resolution,
                "seed": 1 + index,
            },
        )
        for resolution in RESOLUTION_HZ
        for index, target in enumerate(TARGETS_DB)
    ]


def part(results: Mapping[str, Arrays], settings: Settings, amplitude_rad: float) -> Part:
    """Return plans beside what they reached."""
    named = {task.name: task for task in tasks(settings, amplitude_rad)}
    rows, ratios = [], []
    for name, task in named.items():
        one = {key: float(value) for key, value in results[name].items()}
        ratios.append(one["reached_db"] / one["predicted_db"])
        rows.append(
            (
                f"{task.parameters['target_db']:g}",
                f"{task.parameters['resolution_hz']:g}",
                f"M {one['realizations']:.0f}, P {one['periods']:.0f}, "
                f"{1e3 * one['amplitude_rad']:.2f} mrad, f0 {one['base_frequency_hz']:g} Hz",
                f"{one['time_s']:.0f}",
                f"{one['predicted_db']:.3f}",
                f"{one['reached_db']:.3f}",
                f"{ratios[-1]:.2f}",
            )
        )
    statement = Statement(
        "planner",
        "target: the proposed experiment reaches the predicted error",
        f"reached over predicted error: {min(ratios):.2f} to {max(ratios):.2f} in {len(ratios)} "
        "plans",
        met(max(ratios) <= RATIOS[1] and min(ratios) >= RATIOS[0]),
        "fjr plan PILOT --target-db 1, or fjr paper",
    )
    text = (
        f"Pilots of M {PILOT_REALIZATIONS}, P {PILOT_PERIODS} at {1e3 * amplitude_rad:.2g} mrad "
        f"with "
        f"noise of {SNR_DB:g} dB SNR; target over {BAND_HZ[0]:g} to {BAND_HZ[1]:g} Hz: the 95 % "
        "bound of the error of 20 log10|G| that 95 % of the lines keep. Predicted from the pilot, "
        "then the proposed experiment is run and its own variances tell what it reached.",
    )
    heads = ("target (dB)", "resolution (Hz)", "proposed", "rig time (s)", "predicted (dB)",
             "reached (dB)", "ratio")  # fmt: skip
    table = Table("Plans and what they reached.", heads, tuple(rows))
    return Part("Planner", text, (statement,), (), (table,), {}, {"ratios": ratios})
