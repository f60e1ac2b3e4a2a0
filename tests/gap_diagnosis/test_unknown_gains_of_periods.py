"""Steady periods of a controller with unknown gains are compared as whole records, which say so."""

from __future__ import annotations

import numpy as np
import pytest

from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import Experiment
from fjr_records.periodic import RecordedExperiment
from fjr_records.records import RecordSet
from gap_diagnosis.any_record import read_any

N, PERIODS = 200, 3


def bag(folder, name: str, realization: int, controller: dict | None) -> None:
    about = Experiment.of(
        "test", sample_rate_hz=500.0, samples_per_period=N, periods=PERIODS, transient_periods=0,
        amplitude_rad=0.1, excited_harmonics=[1, 3], realization=realization, realizations=2,
        controller=controller,
    )  # fmt: skip
    phase = 2 * np.pi * np.arange(N * PERIODS) / N
    r = 0.1 * (np.cos(phase + realization) + np.cos(3 * phase))
    with BagWriter(folder / name, about) as written:
        written.write_arrays(r=r, u=2.0 * r, y=0.9 * r)


@pytest.mark.parametrize("unknown", [["p"], ["p", "i"]])
def test_unknown_gains_make_periods_records(tmp_path, unknown):
    gains = {"p": 40.0, "i": 5.0, "d": 0.2} | dict.fromkeys(unknown)
    law = {"kind": "pid", **gains, "derivative_on": "error", "unknown": unknown}
    for number in range(2):
        bag(tmp_path, f"run{number}", number, law)
    read = read_any(tmp_path)
    assert isinstance(read, RecordSet) and len(read.records) == 2
    assert read.records[0].samples == N * PERIODS
    assert f"gains of their controller are unknown ({', '.join(unknown)})." in read.notes[0]


@pytest.mark.parametrize("law", [None, {"kind": "pd_filtered", "p": 2.0, "d": 0.1, "n": 50.0}])
def test_other_periods_stay_steady(tmp_path, law):
    for number in range(2):
        bag(tmp_path, f"run{number}", number, law)
    assert isinstance(read_any(tmp_path), RecordedExperiment)
