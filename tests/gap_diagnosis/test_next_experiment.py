"""The next experiment: proposed where a set stays ambiguous, and playing it resolves the set."""

import math
from dataclasses import replace

import numpy as np
import pytest
from gap_cases import found_in, simulate_case

from controller_node import pd_filtered
from fjr_records.noise import noise_levels
from fjr_records.periodic import RecordedExperiment, RecordedRealization
from fjr_sim_node import effects, plant
from fjr_sim_node.plant import PLANT
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis.next_experiment import choice
from gap_diagnosis.next_experiment.choice import LEAST_SIGMA, next_experiment
from gap_diagnosis.next_experiment.trials import Trial, trials

NOMINAL = PLANT.defaults()
GRAVITY = {"gravity.torque_nm": 1.0, "gravity.angle_rad": math.pi / 2}


def search(recorded, *names):
    """Return the fits that a diagnosis by a few effects leaves, their misfit, and the noise."""
    told, fitted = found_in(recorded, NOMINAL, *names)
    noise = noise_levels(recorded).of_outputs(recorded)
    return [fitted.found.best, *fitted.tied], told.gap.explained.chi2_per_dof, noise


def play(case, trial: Trial, level: int) -> list[RecordedRealization]:
    """Run a trial on the rig that made a case."""
    described = case.recorded.experiment
    truth = trial.loaded(case.truth)
    discarded = described.transient_periods + (1 if trial.offset_rad else 0)
    periods = discarded + described.periods
    law = pd_filtered.coefficients(pd_filtered.CONTROLLER.defaults())
    rows = []
    for number, reference in enumerate(trial.references(periods)):
        noise = np.random.default_rng([99, number]).standard_normal(reference.size)
        run = simulate(
            reference,
            described.sample_rate_hz,
            plant.coefficients(truth.plant),
            law,
            case.rig["noise_std_rad"] * noise,
            effects.coefficients(truth.effects),
        )
        # a rise is discarded with the first period
        rows.append(
            RecordedRealization(
                f"trial_{number}",
                described.model_copy(update={"level": level, "realization": number}),
                *(
                    s.reshape(periods, -1)[discarded - described.transient_periods :]
                    for s in (run.reference, run.torque, run.position)
                ),
                None,
            )
        )
    return rows


def together(case, proposed) -> RecordedExperiment:
    (trial,) = [
        t
        for t in trials(case.recorded)
        if t.kind == proposed.kind and dict(t.settings) == proposed.settings
    ]
    more = play(case, trial, level=len(case.recorded.levels))
    return RecordedExperiment("both", (*case.recorded.realizations, *more))


@pytest.mark.parametrize(
    ("effect", "levels", "noise", "rivals", "resolved"),
    [
        (
            GRAVITY,
            (3e-3,),
            3e-4,
            ("gravity", "torque_bias"),
            {"gravity"},
        ),
        (
            {"piecewise_stiffness.zone_rad": 2e-3, "piecewise_stiffness.soft_ratio": 0.6},
            (1e-2,),
            8e-5,
            ("backlash", "piecewise_stiffness"),
            {"piecewise_stiffness"},
        ),
    ],
    ids=["gravity", "soft zone"],
)
def test_playing_the_proposed_experiment_resolves_the_set(effect, levels, noise, rivals, resolved):
    case = simulate_case(effect, seed=6, levels_rad=levels, noise_rad=noise)
    before, misfit, std = search(case.recorded, *rivals)
    confused = {name for fit in before for name in fit.effects}
    assert resolved < confused
    proposed = next_experiment(case.recorded, std, before, misfit)
    assert proposed.predicted_sigma > LEAST_SIGMA
    assert set(proposed.separates) == confused
    assert proposed.rig_time_s < 60.0

    after, misfit, _ = search(together(case, proposed), *rivals)
    assert [set(fit.effects) for fit in after] == [resolved]
    assert misfit < 2.0


@pytest.fixture(scope="module")
def biased():
    case = simulate_case({"torque_bias.torque_nm": 0.6}, seed=6, levels_rad=(7e-3,), noise_rad=3e-4)
    fits, misfit, std = search(case.recorded, "torque_bias", "asymmetric_friction")
    return case, std, fits, misfit


def test_no_experiment_is_proposed_for_what_is_the_same_in_every_experiment(biased):
    """A Coulomb friction that depends on direction is a bias, sliding or stuck."""
    case, std, fits, misfit = biased
    assert {fit.effects[0] for fit in fits} == {"torque_bias", "asymmetric_friction"}
    assert next_experiment(case.recorded, std, fits, misfit) is None


def test_a_trial_that_is_not_refitted_promises_no_more_than_those_that_are(biased):
    case, std, fits, misfit = biased
    bench = choice._Bench(case.recorded, std, fits, misfit)
    feasible = {t.description: t for t in trials(case.recorded) if bench.without_refit(t)}
    assert len(feasible) > choice._REFINED
    linear = {name: bench.linear(trial) for name, trial in feasible.items()}
    for name, trial in feasible.items():
        bound = bench.without_refit(trial)
        assert all(linear[name][pair] <= bound[pair] * (1.0 + 1e-9) for pair in bound)
    merits = sorted((bench.merit(feasible[n], linear[n]) for n in feasible), reverse=True)
    chosen = choice._most_promising(bench, list(feasible.values()))
    assert [bench.merit(*one) for one in chosen] == merits[: choice._REFINED]


def test_nothing_is_proposed_for_one_explanation_or_an_unknown_loop(biased):
    case, std, fits, misfit = biased
    assert next_experiment(case.recorded, std, fits[:1], misfit) is None
    unknown = tuple(
        replace(r, experiment=r.experiment.model_copy(update={"controller": None}))
        for r in case.recorded.realizations
    )
    assert next_experiment(replace(case.recorded, realizations=unknown), std, fits, misfit) is None


def test_a_trial_loads_every_model_alike():
    case = simulate_case(seed=1, levels_rad=(7e-3,), realizations=1)
    by_kind = {trial.kind: trial for trial in trials(case.recorded)}
    bare = case.truth
    heavier = by_kind["added_inertia"].loaded(bare)
    assert heavier.plant["j"] == pytest.approx(1.5 * bare.plant["j"])
    load = by_kind["static_load"].load_nm
    weight = by_kind["static_load"].loaded(bare.with_effects(GRAVITY)).effects
    for q in (0.0, 0.3):  # the torques of both weights add, at any angle
        total = weight["gravity.torque_nm"] * math.sin(q + weight["gravity.angle_rad"])
        assert total == pytest.approx((1.0 + load) * math.cos(q), rel=1e-9)
    rigid = {trial.kind for trial in trials(case.recorded, rigid=True)}
    assert "static_load" not in rigid and "added_inertia" in rigid


def test_an_offset_rises_smoothly_and_stays():
    case = simulate_case(seed=1, levels_rad=(7e-3,), realizations=1)
    trial = next(t for t in trials(case.recorded) if t.kind == "dc_offset")
    reference = trial.references(3)[0]
    samples = case.recorded.experiment.samples_per_period
    offset = reference - np.tile(trial.periods_rad[0], 3)
    assert offset[0] == 0.0
    assert np.allclose(offset[samples:], trial.offset_rad)
    assert np.abs(np.diff(offset)).max() < 2.0 * trial.offset_rad / samples
