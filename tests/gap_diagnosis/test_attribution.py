"""When a gap counts as explained."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_cases import SHORT, fitter_of, simulate_case, true_parameters

from fjr_records.noise import noise_levels
from fjr_sim_node.plant import PLANT
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.simulated_rig import Simulator
from gap_diagnosis.notes import unexplained
from gap_diagnosis.which import ranking
from gap_diagnosis.which.attribution import STANDS_OUT, Attribution, stands_out
from gap_diagnosis.which.equivalents import plainness
from gap_diagnosis.which.fits import Fit, Fitter
from gap_diagnosis.which.least_squares import Solution
from gap_diagnosis.which.search import Search
from gap_diagnosis.which.search_space import Space


@pytest.mark.parametrize(
    ("left", "refit", "rival", "out"),
    [
        (10.0, 300.0, 280.0, True),  # another form of the catalogue's law
        (9.0, 350.0, 19.0, True),  # next comes the same effect on the other side
        (6.5, 55.0, 10.0, False),  # one of several substitutes
        (70.0, 770.0, 200.0, False),
        (2.1, 3.7, 2.9, False),
    ],
)
def test_an_explanation_that_leaves_a_lot_must_stand_out(left, refit, rival, out):
    assert (stands_out(left, refit, rival) > STANDS_OUT) is out


def test_a_gain_is_no_second_cause_beside_a_mode_on_a_rig_beyond_the_tolerance():
    mode = {
        "extra_mode.inertia_kg_m2": 0.1,
        "extra_mode.frequency_hz": 22.0,
        "extra_mode.damping_ratio": 0.02,
    }
    plant = {name: 1.25 * value for name, value in true_parameters(3, 0.02).items()}
    recorded = simulate_case(mode, seed=3, plant=plant, **SHORT).recorded
    noise = noise_levels(recorded).of_outputs(recorded)
    nominal = Model.nominal(PLANT.defaults()).plant
    few = ("extra_mode", "torque_gain")
    fitter = Fitter(recorded, Simulator(recorded), noise, nominal, (0, 2), (1, 3), 0.03, few)
    found = Search(fitter).run()
    assert found.best.effects == ("extra_mode",) and found.explained
    assert not any({"extra_mode", "torque_gain"} == set(f.effects) for f in found.candidates)
    assert found.best.held_chi2 / fitter.held.size < 2.0
    assert found.best.model.effects["extra_mode.inertia_kg_m2"] == pytest.approx(0.1, rel=0.01)
    for name, value in plant.items():
        assert found.best.model.plant[name] == pytest.approx(value, rel=0.01)


def searched(truth, few):
    recorded = simulate_case(truth, seed=3, off=0.02, **SHORT).recorded
    noise = noise_levels(recorded).of_outputs(recorded)
    nominal = Model.nominal(PLANT.defaults()).plant
    fitter = Fitter(recorded, Simulator(recorded), noise, nominal, (0, 2), (1, 3), 0.03, few)
    return Search(fitter).run()


def test_lugre_friction_is_named_where_one_of_its_parts_leads():
    truth = {
        "lugre_friction.stribeck_nm": 6.0,
        "lugre_friction.bristle_nm_rad": 3e4,
        "lugre_friction.velocity_rad_s": 0.05,
    }
    parts = ("presliding_friction", "stribeck_friction_motor", "backlash")
    found = searched(truth, parts)
    assert found.best.effects == ("lugre_friction",) and found.explained
    assert found.best.model.effects["lugre_friction.stribeck_nm"] == pytest.approx(6.0, rel=0.1)
    alone = searched(truth, ("presliding_friction", "backlash"))
    assert all("lugre_friction" not in fit.effects for fit in alone.candidates)


def test_what_a_law_leaves_by_its_own_form_is_no_second_cause(monkeypatch):
    """A lag that is a little off, as the rig of another maker has it, is no lag and a delay."""
    truth = {"actuator_lag.time_constant_s": 3e-3, "delay.time_s": 2.5e-4}
    few = ("actuator_lag", "delay")
    assert searched(truth, few).best.effects == ("actuator_lag",)
    monkeypatch.setattr(ranking, "_FORM", 0.0)
    assert searched(truth, few).best.effects == ("actuator_lag",)  # near equivalents, one cause
    monkeypatch.setattr(ranking, "ONE_CAUSE", 0.0)
    assert set(searched(truth, few).best.effects) == set(few)


def test_near_equivalents_of_like_size_are_two_causes():
    """A constant torque beside a cogging that does as much: neither alone does nearly all."""
    cogging = {
        "cogging.amplitude_nm": 2.0,
        "cogging.cycles_per_turn": 60.0,
        "cogging.phase_rad": 0.7,
    }
    few = ("cogging", "torque_bias")
    found = searched(cogging | {"torque_bias.torque_nm": 3.0}, few)
    assert set(found.best.effects) == set(few)


def test_an_offset_counts_by_how_far_the_rig_is_moved():
    bias = {"torque_bias.torque_nm": 1.0}
    case = simulate_case(bias, seed=3, **SHORT)
    _, simulator, fitter = fitter_of(case)
    bare, biased = Model(case.truth.plant, {}), case.truth
    moved = [a - b for a, b in zip(*(simulator.signals(m)[0] for m in (bare, biased)), strict=True)]
    expected = sum(np.mean(moved[i]) ** 2 for i in fitter.held.which)
    assert fitter.held.left(bare) == pytest.approx(expected, rel=0.3)
    assert abs(fitter.held.left(biased)) < 0.05 * expected


def fit(effects: tuple[str, ...], held_chi2: float, converged: bool = True) -> Fit:
    solution = Solution(np.zeros(0), 0.0, np.zeros((1, 0)), np.zeros(1), converged)
    return Fit(effects, Model({}, {}), Space({}), solution, 0.0, held_chi2)


@pytest.mark.parametrize(
    ("best", "candidates", "words"),
    [
        (("backlash",), [(("delay", "gravity"), 2000.0), (("backlash",), 3000.0)],
         "misfit of 50.0 per degree of freedom, the best explanation, backlash, one of 30.0"),
        ((), [(("delay",), 4000.0), (("backlash",), 4500.0)],
         "misfit of 50.0 per degree of freedom, the best explanation, delay, one of 40.0"),
        ((), [], "misfit of 50.0 per degree of freedom; no effect"),
    ],
)  # fmt: skip
def test_the_note_on_what_is_left_pairs_each_name_with_its_own_misfit(best, candidates, words):
    refit = fit((), 5000.0)
    fits = tuple(fit(effects, chi2) for effects, chi2 in candidates)
    chosen = next((f for f in fits if f.effects == best), refit)
    found = Attribution(refit, fits, chosen, (), False)
    assert words in unexplained(found, 100)


def test_what_has_not_converged_is_not_called_the_best():
    refit = fit((), 5000.0)
    lost = fit(("delay",), 10.0, converged=False)
    note = unexplained(Attribution(refit, (lost,), refit, (), False), 100)
    assert "delay" not in note


def test_a_rig_that_is_its_datasheet_without_noise_leaves_nothing_to_scale():
    _, _, fitter = fitter_of(simulate_case({}, seed=3, off=0.0, noise_rad=0.0, **SHORT))
    space = fitter.refit().space
    exact = fitter.solve((), space, np.zeros(len(space.nominal)), most_steps=1)
    nothing = replace(
        exact, solution=replace(exact.solution, residuals=0.0 * exact.solution.residuals)
    )
    assert np.isfinite(fitter.screening(nothing, "torque_bias").gain)


def test_of_explanations_that_do_alike_one_that_holds_another_stands_last():
    """A law's further parameters lie at their bounds then, where no test can call it present."""
    rich, plain = laws = [("delay", "torque_speed_limit"), ("delay", "torque_saturation")]
    few, more = ("a", "b"), ("a", "b", "c")
    assert plainness(rich, few, laws) > plainness(plain, more, laws)
    assert plainness(rich, few, [rich]) < plainness(plain, more, [plain])
    common, rare = laws = [("gravity",), ("external_spring",)]
    assert plainness(common, few, laws) < plainness(rare, few, laws)
