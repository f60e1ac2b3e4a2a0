"""Runs that no fit has seen are compared beside what their own friction explains."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_evidence import NOMINAL, records

from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.fits.gains import gain
from gap_diagnosis.fits.unseen_friction import SCATTER, beside_scatter, deviated
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model

STEP = 0.01


def stacked(errors: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    return np.concatenate([errors[None], errors + STEP * slopes])


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), sizes=st.tuples(*[st.floats(-2.0, 2.0)] * 2))
def test_what_the_friction_of_a_run_moves_is_taken_off_and_nothing_else(seed, sizes):
    rng = np.random.default_rng(seed)
    slopes, noise = rng.standard_normal((2, 400)), 1e-3 * rng.standard_normal(400)
    run = np.arange(400) < 250
    moved = (np.array(sizes) * SCATTER) @ slopes
    left = beside_scatter(stacked(noise + moved, slopes), np.full(400, 1e3), [run])
    assert np.abs(left - noise)[run].max() < 2e-3
    assert np.array_equal(left[~run], (noise + moved)[~run])


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), size=st.floats(0.0, 1e3))
def test_it_never_explains_more_than_friction_scatters_by(seed, size):
    rng = np.random.default_rng(seed)
    slopes, errors = rng.standard_normal((2, 100)), size * rng.standard_normal(100)
    left = beside_scatter(stacked(errors, slopes), np.ones(100), [np.ones(100, bool)])
    assert np.sum(left**2) <= np.sum(errors**2) * (1.0 + 1e-9)
    change = np.linalg.lstsq(slopes.T, left - errors, rcond=None)[0]
    assert np.abs(change).max() <= 3.0 * SCATTER * (1.0 + 1e-6)


def test_a_motion_that_diverges_is_left_as_it_is():
    errors = np.array([[1.0, 2.0], [np.inf, 1.0]])
    assert np.array_equal(beside_scatter(errors, np.ones(2), [np.ones(2, bool)]), errors[0])


def test_what_the_datasheet_lacks_deviates_with_what_it_adds_to():
    lacking = Model({**NOMINAL, "fsm": 0.0, "fv": 0.0, "fvm": 0.0},
                    {"coulomb_friction.motor_nm": 2.0, "cogging.amplitude_nm": 1.0})  # fmt: skip
    (coulomb,) = deviated(lacking)
    assert coulomb.effects["coulomb_friction.motor_nm"] == pytest.approx(2.02)
    assert coulomb.effects["cogging.amplitude_nm"] == 1.0
    assert coulomb.plant["fs"] == pytest.approx(1.01 * NOMINAL["fs"])
    assert deviated(Model({**NOMINAL, **dict.fromkeys(("fs", "fsm", "fv", "fvm"), 0.0)}, {})) == []


@pytest.mark.parametrize("runs", [1, 3])
def test_only_runs_that_no_fit_has_seen_are_given_a_friction_of_their_own(runs):
    fitter = CellFitter(Evidence(records(runs=runs, seconds=5.0), NOMINAL), NOMINAL, 0.1)
    seen = {fitter.evidence.parts[p].record for p in fitter.fit_parts}
    unseen = {fitter.evidence.parts[p].record for p in fitter.select_parts} - seen
    assert len(fitter.weights.unseen) == len(unseen) == (0 if runs == 1 else 2)


def test_a_small_offset_is_there_on_runs_whose_friction_differs(monkeypatch):
    """What friction moves had hidden it: none of these four rigs showed anything."""
    bias, shown = {"torque_bias.torque_nm": 0.01}, {True: 0, False: 0}
    for beside in shown:
        if not beside:
            monkeypatch.setattr("gap_diagnosis.fits.comparison.deviated", lambda model: [])
        for seed in range(4):
            evidence = Evidence(records(bias, runs=2, scatter=0.05, seed=seed), NOMINAL)
            fitter = CellFitter(evidence, NOMINAL, 0.1)
            refit = fitter.refit()
            proposals = fitter.screening(refit, "torque_bias").proposals()
            fit = fitter.add(refit, "torque_bias", proposals) if proposals else None
            shown[beside] += fit is not None and gain(fitter, fit, refit).present
    assert shown[True] == 4 and shown[False] <= 1


@pytest.mark.parametrize(
    ("gains", "there"),
    [((82.0, 25.0, 1.2), True), ((82.0, 25.0, -1.2), False), ((82.0,), False), ((1.0, 0.9), False)],
)
def test_few_parts_show_an_effect_if_all_of_them_do(gains, there, monkeypatch):
    change = np.zeros(24)
    change[: len(gains)] = gains
    monkeypatch.setattr(CellFitter, "gains", lambda self, after, before: change)
    monkeypatch.setattr("gap_diagnosis.fits.gains.left_of", lambda *_: 1.0)
    fitter = object.__new__(CellFitter)
    assert gain(fitter, None, None, change != 0.0).present == there
