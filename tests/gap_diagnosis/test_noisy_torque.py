"""A recorded torque whose sensor adds noise drives the model: that noise is told from causes."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from driven_runs import NOMINAL, driven_runs
from hypothesis import given
from hypothesis import strategies as st

from gap_diagnosis.any_record import investigate
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.verdict.noisy_torque import most_noise, torque_noise

COGGING = {"cogging.amplitude_nm": 6.0, "cogging.cycles_per_turn": 40.0}
RIGID = {
    "jm": 0.5, "fsm": 5.0, "fvm": 3.0, "j": 0.0, "fs": 0.0, "fv": 0.0, "k0": math.inf, "k1": 0.0,
}  # fmt: skip


def noisy(share: float):
    """Return a log that adds noise of a share of the torque's rms."""
    return lambda torque, rng: torque + share * np.std(torque) * rng.standard_normal(torque.size)


@given(st.integers(0, 1000), st.floats(0.01, 3.0))
def test_noise_is_seen_where_the_torque_holds_nothing_else(seed, rms):
    noise = rms * np.random.default_rng(seed).standard_normal(40_000)
    sine = 5.0 * np.sin(2.0 * np.pi * 0.01 * np.arange(noise.size))
    assert most_noise(sine + noise) == pytest.approx(rms, rel=0.1)


def test_noise_of_the_torque_is_no_gap():
    found = investigate(driven_runs(rig=RIGID, logged=noisy(0.05)), RIGID).diagnosis
    assert found.verdict == "no_gap"
    (said,) = (
        re.search(r"noise of (.*)% of its rms about the mean", n) for n in found.notes if "rms" in n
    )
    assert said is not None
    assert float(said[1]) == pytest.approx(5.0, rel=0.1)
    inertia = found.parameters["jm"]
    assert inertia.low < RIGID["jm"] < inertia.high


def test_a_cause_is_named_with_its_size_beside_noise_of_the_torque():
    found = investigate(
        driven_runs(COGGING, logged=noisy(0.02)), NOMINAL, effects=["cogging", "gravity"]
    ).diagnosis
    assert found.effects == ["cogging"]
    assert found.verdict in ("effect", "ambiguous")
    size = found.parameters["cogging.amplitude_nm"]
    assert size.low < COGGING["cogging.amplitude_nm"] < size.high


def test_noise_that_the_rig_felt_counts_as_none():
    """A controller answers the noise of its encoder, and the rig feels that."""
    records = driven_runs()
    fitter = CellFitter(Evidence(records, NOMINAL), NOMINAL, 0.1)
    assert most_noise(records.records[0].torque) > 1.0
    assert torque_noise(fitter.evidence, fitter.refit().model) is None


def test_a_torque_that_is_white_itself_is_no_noise():
    """A flat torque that excites the rig would hide what a gain of it, or a ripple, leaves."""
    rng = np.random.default_rng(0)
    records = driven_runs()
    white = tuple(
        replace(r, torque=float(np.std(r.torque)) * rng.standard_normal(r.samples))
        for r in records.records
    )
    fitter = CellFitter(Evidence(replace(records, records=white), NOMINAL), NOMINAL, 0.1)
    assert torque_noise(fitter.evidence, fitter.refit().model) is None
