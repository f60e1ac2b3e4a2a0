"""Short records: the local polynomial method beside discarding the transient."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bla_analyzer.bla.local_polynomial import transient_free_spectra
from bla_analyzer.bla.robust import robust_bla
from bla_analyzer.compare.metrics import LOW_LINES_HZ
from fjr_bringup.design.measured import periods_of
from fjr_kit.plots import layout
from fjr_kit.tasks import Arrays, Task
from fjr_records.lines import Grid
from fjr_records.realization import read_realization
from fjr_sim_node.simulation.simulator import run_realization

from . import drawing
from .levels import campaign_of
from .part import Part, PlotPlace, Statement, Table, met
from .settings import Settings

M = 7
RECORD_PERIODS = (2, 3, 4, 6)
NOISES = {"weak noise": 1e-5, "strong noise": 1e-3}
METHODS = ("discarding the first period", "local polynomial, whole record")
COLORS = ("#7a7f87", "#0072b2")


def compared(amplitude_rad: float, noise_std_rad: float, first: int, count: int) -> dict[str, Any]:
    """Estimate BLAs of M realizations from records of P periods from rest, in both ways.

    Returns:
        g_P: complex (2, count, F), the methods along the first axis, and reference_g: (F,), the
        mean of the BLAs of all experiments from settled periods without noise.
    """
    found: dict[str, list[list[np.ndarray]]] = {f"g_{p}": [[], []] for p in RECORD_PERIODS}
    clean = []
    longest = max(RECORD_PERIODS)
    for experiment_number in range(first, first + count):
        campaign = campaign_of(
            amplitude_rad,
            (experiment_number + 1) * M,
            longest,
            transient_periods=0,
            simulator={"noise_std_rad": noise_std_rad},
        )
        silent = campaign_of(amplitude_rad, (experiment_number + 1) * M, 1)
        runs, settled = [], []
        for number in range(experiment_number * M, (experiment_number + 1) * M):
            experiment = campaign.experiment(0, number)
            runs.append(run_realization(campaign.values["simulator"], experiment))
            quiet = silent.experiment(0, number)
            settled.append(_discarded(run_realization(silent.values["simulator"], quiet), quiet, 2))
        excited = Grid.of(experiment).lines.excited
        clean.append(robust_bla(settled, excited).g)
        for periods in RECORD_PERIODS:
            pair = found[f"g_{periods}"]
            for index, reduce in enumerate((_discarded, _polynomial)):
                spectra = [reduce(run, experiment, periods) for run in runs]
                pair[index].append(robust_bla(spectra, excited).g)
    arrays = {name: np.array(values) for name, values in found.items()}
    frequency = excited * experiment.base_frequency_hz
    return {**arrays, "clean": np.array(clean), "frequency_hz": frequency}


def _discarded(run: Any, experiment: Any, periods: int) -> Any:
    grid = Grid.of(experiment.model_copy(update={"periods": periods - 1, "transient_periods": 1}))
    blocks = periods_of(run, grid.samples_per_period)
    return read_realization("record", 0, 0, blocks, grid).spectra


def _polynomial(run: Any, experiment: Any, periods: int) -> Any:
    kept = slice(0, periods * experiment.samples_per_period)
    record = (run.reference[kept], run.torque[kept], run.position[kept])
    last = Grid.of(experiment).lines.last
    return transient_free_spectra(record, periods, experiment.base_frequency_hz, last)


def tasks(settings: Settings, amplitude_rad: float) -> list[Task]:
    """Return the comparisons in chunks, by noise."""
    chunks = 4
    size = max(settings.record_repeats // chunks, 1)
    return [
        Task(
            f"records_{name.split()[0]}_{chunk}",
            compared,
            {
                "amplitude_rad": amplitude_rad,
                "noise_std_rad": std,
                "first": chunk * size,
                "count": size,
            },
        )
        for name, std in NOISES.items()
        for chunk in range(chunks)
    ]


def errors_db(results: Mapping[str, Arrays], noise: str) -> np.ndarray:
    """Return the rms error in dB from 1 Hz on, (methods, record lengths).

    The truth of an experiment is the BLA of the same phases without noise, after the transient:
    what remains is what transient and noise do.
    """
    found = [
        result for name, result in results.items() if name.startswith(f"records_{noise.split()[0]}")
    ]
    above = found[0]["frequency_hz"] >= LOW_LINES_HZ * (1.0 - 1e-9)
    clean = np.concatenate([one["clean"] for one in found])[:, above]
    table = np.empty((2, len(RECORD_PERIODS)))
    for column, periods in enumerate(RECORD_PERIODS):
        g = np.concatenate([one[f"g_{periods}"] for one in found], axis=1)[:, :, above]
        error = 20.0 * np.log10(np.abs(g) / np.abs(clean))
        table[:, column] = np.sqrt(np.mean(error**2, axis=(1, 2)))
    return table


def part(results: Mapping[str, Arrays], settings: Settings, amplitude_rad: float) -> Part:
    """Return errors against the length of the record."""
    found = {name: errors_db(results, name) for name in NOISES}
    ratios = np.concatenate([table[1] / table[0] for table in found.values()])
    text = (
        f"{settings.record_repeats} experiments of M {M} at {1e3 * amplitude_rad:.2g} mrad from "
        f"rest, "
        "records of 2 to 6 periods in all. Discarding keeps all but the first period; the local "
        "polynomial method takes the whole record and removes the transient by what lies between "
        "the lines. Error: rms dB distance from 1 Hz on to the BLA of the same phases without "
        "noise, "
        "after the transient.",
    )
    statement = Statement(
        "local polynomial method",
        "target: at least as accurate as discarding the transient on the same record length",
        f"error {ratios.min():.2f} to {ratios.max():.2f} times that of discarding, over two noises "
        f"and records of {RECORD_PERIODS[0]} to {RECORD_PERIODS[-1]} periods",
        met(bool(ratios.max() <= 1.02)),
        "fjr paper; bla_analyzer.bla.local_polynomial",
    )
    data = [
        drawing.curve(
            RECORD_PERIODS, table[index], f"{method}, {name}", COLORS[index], symbol="circle",
            dash="solid" if "strong" in name else "dot", unit="dB",
        )
        for name, table in found.items()
        for index, method in enumerate(METHODS)
    ]  # fmt: skip
    made = layout("periods of the record, the first included", "rms error (dB)")
    made["yaxis"] |= {"type": "log", "tickformat": "~g"}
    labels = ("Error against record length", ", both methods on the same records.")
    rows = [
        (
            name,
            str(p),
            f"{table[0, i]:.3g}",
            f"{table[1, i]:.3g}",
            f"{table[1, i] / table[0, i]:.2f}",
        )
        for name, table in found.items()
        for i, p in enumerate(RECORD_PERIODS)
    ]
    heads = ("noise", "periods", "discarding (dB)", "local polynomial (dB)", "ratio")
    return Part(
        "Short records: local polynomial method",
        text,
        (statement,),
        (PlotPlace("records", *labels, {"data": data, "layout": made}, 340),),
        (Table("Rms error from 1 Hz on.", heads, tuple(rows)),),
        {},
        {name: table.tolist() for name, table in found.items()},
    )
