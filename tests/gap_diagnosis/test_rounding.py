"""A coarse encoder is seen in the record, and named where the refit leaves nothing but it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_cases import simulate_case

from bla_analyzer.checks import TRANSIENT_LIMIT
from fjr_records.encoder_step import position_step
from fjr_records.noise import noise_levels
from fjr_records.periodic import RecordedExperiment
from fjr_records.realization import unsettled
from fjr_sim_node.plant import PLANT
from gap_diagnosis.investigation import investigate
from gap_diagnosis.model.misfit import Misfit
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.simulated_rig import Simulator
from gap_diagnosis.outcome.verdict_words import ROUNDING
from gap_diagnosis.which import rounding
from gap_diagnosis.which.attribution import Attribution
from gap_diagnosis.which.fits import Fitter
from gap_diagnosis.which.rounding import widened, with_rounding

STEP = 6e-4
SHORT = {"base_frequency_hz": 0.5, "levels_rad": (4e-3, 1.2e-2), "transient_periods": 2}


def step_of(recorded: RecordedExperiment) -> float | None:
    return position_step([r.position for r in recorded.realizations])


@pytest.fixture(scope="module")
def coarse():
    return simulate_case({f"{ROUNDING}.resolution_rad": STEP}, seed=5, **SHORT)


def test_the_step_is_read_from_the_record(coarse):
    assert step_of(coarse.recorded) == pytest.approx(STEP, rel=1e-9)


def test_the_step_is_read_where_the_lowest_level_has_a_few_counts_only():
    case = simulate_case({f"{ROUNDING}.resolution_rad": 5e-3}, seed=5, **SHORT)
    fewest = min(np.unique(r.position).size for r in case.recorded.realizations)
    assert fewest < 20
    assert step_of(case.recorded) == pytest.approx(5e-3, rel=1e-9)


def test_rounding_that_locks_in_some_periods_is_no_transient():
    rng = np.random.default_rng(2)
    period = np.sin(2 * np.pi * np.arange(2000) / 2000)
    last = np.round(period / 0.2) * 0.2
    first = np.round((period + rng.uniform(-0.1, 0.1, 2000)) / 0.2) * 0.2
    assert unsettled(None, first, last, last) > TRANSIENT_LIMIT
    assert unsettled(None, first, last, last, 0.2) == 0.0
    decaying = last + np.exp(-np.arange(2000) / 200)
    assert unsettled(None, decaying, last, last, 0.2) > TRANSIENT_LIMIT


def test_a_record_with_noise_or_of_few_values_has_no_step():
    fine = simulate_case(seed=5, **SHORT).recorded
    assert step_of(fine) is None
    still = [replace(r, position=np.zeros_like(r.position)) for r in fine.realizations]
    assert step_of(replace(fine, realizations=tuple(still))) is None


def test_rounding_has_the_variance_of_a_uniform_error():
    samples = 4000
    noise = np.random.default_rng(0).uniform(-0.5, 0.5, (400, samples)) * STEP
    lines = np.fft.rfft(noise, axis=1)[:, :50] * (2.0 / samples)
    lines[:, 0] *= 0.5
    expected = np.sqrt(np.mean(np.abs(lines) ** 2, axis=0))
    found = widened(np.zeros((1, 1, 50)), STEP, samples)[0, 0]
    assert found[1:] == pytest.approx(np.full(49, expected[1:].mean()), rel=0.05)
    assert found[0] == pytest.approx(expected[0], rel=0.15)


def attribution(case, step):
    recorded, simulator = case.recorded, Simulator(case.recorded)
    std = noise_levels(recorded).of_outputs(recorded)
    nominal = Model.nominal(PLANT.defaults()).plant
    seen = widened(std, step, recorded.experiment.samples_per_period)
    fitter = Fitter(recorded, simulator, seen, nominal, (0, 2), (1, 3))
    refit = fitter.refit()
    plain = Misfit(recorded, simulator, std, (0, 2)), Misfit(recorded, simulator, std, (1, 3))
    return with_rounding(Attribution(refit, (), refit, (), True), plain, step), fitter


def test_the_coarse_encoder_is_named_and_the_refit_is_left_as_it_is(coarse):
    found, fitter = attribution(coarse, STEP)
    assert found.best.effects == (ROUNDING,)
    assert found.best.held_chi2 / fitter.held.size < 2.0
    assert found.refit.held_chi2 > 1.25 * found.best.held_chi2
    assert found.best.model.effects == {f"{ROUNDING}.resolution_rad": STEP}
    assert found.best.model.plant == found.refit.model.plant


def test_the_coarse_encoder_is_named_beside_another_cause():
    late = {"delay.time_s": 1e-3, f"{ROUNDING}.resolution_rad": STEP}
    case = simulate_case(late, seed=5, **SHORT)
    recorded = case.recorded
    nominal = Model.nominal(PLANT.defaults()).plant
    few = ("delay", "actuator_lag", "torque_bias")
    found = investigate(recorded, nominal, effects=[*few, ROUNDING]).diagnosis
    assert found.effects == ["delay", ROUNDING] and found.verdict == "effect"
    assert found.gap_closed == pytest.approx(1.0, abs=0.05)
    said = next(note for note in found.notes if "judged by its statistics" in note)
    assert "the refit with delay leaves" in said
    alone = investigate(recorded, nominal, effects=few).diagnosis
    assert alone.effects == ["delay"]


FEW_COUNTS = 0.5e-2
"""A step of which the motion of the lowest level is three counts, of many samples each."""


@pytest.fixture(scope="module")
def few_counts():
    slow = {**SHORT, "levels_rad": (1.5e-2, 5e-2), "f_max_hz": 10.0, "sample_rate_hz": 4000.0}
    return simulate_case({f"{ROUNDING}.resolution_rad": FEW_COUNTS}, seed=5, **slow)


def test_rounding_moves_a_motion_of_few_counts_in_the_mean_as_simulated(few_counts, coarse):
    assert rounding.coarse(few_counts.recorded, FEW_COUNTS)
    assert not rounding.coarse(coarse.recorded, STEP / 10.0)
    recorded, simulator = few_counts.recorded, Simulator(few_counts.recorded)
    std = noise_levels(recorded).of_outputs(recorded)
    samples = recorded.experiment.samples_per_period
    true = few_counts.bare
    found = rounding.in_the_loop(simulator, true, FEW_COUNTS, std.shape)
    every = range(len(recorded.realizations))
    white = Misfit(recorded, simulator, widened(std, FEW_COUNTS, samples), every)
    moved = Misfit(recorded, simulator.adding(found.added), np.hypot(std, found.std), every)
    assert white.chi2(true) > 10.0
    assert 0.2 < moved.chi2(true) < 4.0


def test_a_coarse_encoder_under_few_counts_is_named_and_the_parameters_are_right(few_counts):
    nominal = Model.nominal(PLANT.defaults()).plant
    effects = [ROUNDING, "torque_bias", "cogging", "presliding_friction"]
    found = investigate(few_counts.recorded, nominal, effects=effects).diagnosis
    assert found.verdict == "effect" and found.effects == [ROUNDING]
    steps = [step.chi2_per_dof for step in found.steps]
    assert steps[1] > 5.0 * steps[2] and steps[2] < 2.0
    for name in ("jm", "j", "k0"):
        true = few_counts.truth.plant[name]
        assert found.parameters[name].value == pytest.approx(true, rel=0.03)


def test_a_fine_encoder_is_not_named():
    step = 1e-6
    found, _ = attribution(
        simulate_case({f"{ROUNDING}.resolution_rad": step}, seed=5, **SHORT), step
    )
    assert found.best.effects == ()
