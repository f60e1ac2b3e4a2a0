"""Records without a period: leakage removed by the local polynomial method, and where it ends."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bla_analyzer.bla.local_polynomial import HALF_WINDOW, local_polynomial_bla
from fjr_kit.plots import layout
from fjr_kit.tasks import Arrays, Task
from fjr_sim_node.simulation.simulator import run_realization
from fjr_sim_node.theory.linear import g0

from . import drawing
from .levels import campaign_of
from .part import Part, PlotPlace, Statement, Table, met
from .settings import Settings

PERIOD_S = 80.0
RECORDS_S = (2.5, 5.0, 10.0, 20.0, 40.0)
"""All shorter than the period of the reference, and from rest."""
BAND_HZ = (3.0, 45.0)
LINEAR = {"fs": 0.0, "fsm": 0.0, "k1": 0.0, "noise_std_rad": 1e-5}
METHODS = ("plain division Y/U", "local polynomial")
COLORS = ("#7a7f87", "#0072b2")
LEAST_GAIN = 0.2
"""Error over that of plain division which counts as leakage removed."""


def leaky(first: int, count: int) -> dict[str, Any]:
    """Estimate the FRF of the linear rig from the beginning of one long multisine, in both ways.

    Returns:
        error_db_T: (2, count), rms error over the band by METHODS, for each record of T seconds;
        bandwidth_hz: 3 dB bandwidth of the antiresonance.
    """
    excitation = {"base_frequency_hz": 1.0 / PERIOD_S, "f_min_hz": 0.1, "grid": "full"}
    campaign = campaign_of(
        1e-3, first + count, 1, transient_periods=0, simulator=LINEAR, excitation=excitation
    )
    plant: dict[str, Any] = dict(campaign.values["simulator"])
    rate = plant["sample_rate_hz"]
    found: dict[str, Any] = {"bandwidth_hz": plant["fv"] / plant["j"] / (2.0 * np.pi)}
    for number in range(first, first + count):
        run = run_realization(plant, campaign.experiment(0, number))
        for length in RECORDS_S:
            kept = slice(0, round(length * rate))
            record = (run.reference[kept], run.torque[kept], run.position[kept])
            errors = found.setdefault(f"error_db_{length:g}", [])
            errors.append(_errors_db(record, plant, rate))
    return {name: np.array(values).T for name, values in found.items()}


def _errors_db(
    record: tuple[np.ndarray, ...], plant: Mapping[str, Any], rate: float
) -> list[float]:
    r, u, y = record
    bla = local_polynomial_bla((r, u, y), rate, BAND_HZ)
    lines = np.round(bla.frequency_hz * r.size / rate).astype(int)
    plain = np.fft.rfft(y)[lines] / np.fft.rfft(u)[lines]
    exact = g0(plant, bla.frequency_hz, rate)
    return [
        float(np.sqrt(np.mean((20.0 * np.log10(np.abs(g / exact))) ** 2))) for g in (plain, bla.g)
    ]


def tasks(settings: Settings, _amplitude_rad: float) -> list[Task]:
    """Return one task."""
    return [Task("leakage", leaky, {"first": 0, "count": settings.record_repeats})]


def part(results: Mapping[str, Arrays], settings: Settings, _amplitude_rad: float) -> Part:
    """Return errors against the length of the record."""
    found = results["leakage"]
    errors = np.array([found[f"error_db_{length:g}"].mean(axis=1) for length in RECORDS_S])
    resolved = float(found["bandwidth_hz"]) * np.array(RECORDS_S)
    within = resolved >= 2 * HALF_WINDOW
    gain = errors[:, 1] / errors[:, 0]
    text = (
        f"The linear rig (no dry friction, k1 = 0), whose G0 is known exactly, under a multisine "
        f"of {PERIOD_S:g} s of which only the beginning is used, from rest: no whole period, and "
        f"the transient within. Rms error of |G| from {BAND_HZ[0]:g} to {BAND_HZ[1]:g} Hz, mean of "
        f"{settings.record_repeats} records. The stated limit: a record of T resolves a resonance "
        f"of 3 dB bandwidth B while B T exceeds {2 * HALF_WINDOW}; here B is "
        f"{float(found['bandwidth_hz']):.2f} Hz (antiresonance).",
    )
    inside, outside = errors[within], errors[~within]
    statement = Statement(
        "local polynomial method",
        "target: no periodicity needed for leakage removal within its stated limits",
        f"error {inside[:, 1].min():.2g} to {inside[:, 1].max():.2g} dB instead of "
        f"{inside[:, 0].min():.2g} to {inside[:, 0].max():.2g} by plain division, records of "
        f"{np.array(RECORDS_S)[within][0]:g} to {RECORDS_S[-1]:g} s; beyond the limit "
        f"{outside[:, 1].max():.2g} dB at {RECORDS_S[0]:g} s",
        met(bool(gain[within].max() <= LEAST_GAIN)),
        "fjr paper; bla_analyzer.bla.local_polynomial",
    )
    style = {"dash": "solid", "symbol": "circle", "unit": "dB"}
    data = [
        drawing.curve(RECORDS_S, errors[:, index], method, COLORS[index], **style)
        for index, method in enumerate(METHODS)
    ]
    made = layout("record (s)", "rms error (dB)", log_x=True)
    made["xaxis"]["dtick"] = "D2"
    made["yaxis"] |= {"type": "log", "tickformat": "~g"}
    labels = ("Error against record length", ", no period in the record.")
    rows = [
        (f"{length:g}", f"{bt:.0f}", f"{plain:.3g}", f"{local:.3g}", f"{local / plain:.2f}")
        for length, bt, (plain, local) in zip(RECORDS_S, resolved, errors, strict=True)
    ]
    heads = ("record (s)", "B T", "plain (dB)", "local polynomial (dB)", "ratio")
    return Part(
        "Records without period",
        text,
        (statement,),
        (PlotPlace("leakage", *labels, {"data": data, "layout": made}, 320),),
        (Table("Rms error of |G|.", heads, tuple(rows)),),
        {},
        {"error_db": errors.tolist(), "record_s": list(RECORDS_S), "resolved": resolved.tolist()},
    )
