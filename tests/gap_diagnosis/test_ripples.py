"""Ripples over the motor angle: found without simulating each, and with their second harmonic."""

from __future__ import annotations

import numpy as np
import pytest
from gap_cases import SHORT, fitter_of, simulate_case

from fjr_sim_node import effects
from gap_diagnosis.which.harmonics import with_second_harmonics
from gap_diagnosis.which.ripples import RippleSearch

SIZES = {"position_friction": "amplitude_nm", "kinematic_error": "amplitude_rad",
         "cogging": "amplitude_nm", "torque_constant_ripple": "amplitude"}  # fmt: skip


def ripple(effect, size, cycles, **more):
    names = {SIZES[effect]: size, "cycles_per_turn": cycles, "phase_rad": 0.7, **more}
    return {f"{effect}.{name}": value for name, value in names.items()}


@pytest.mark.parametrize(("effect", "size", "cycles", "off"), [
    ("position_friction", 0.8, 20.0, 5.0),
    ("kinematic_error", 3e-4, 33.0, 1.0),
    ("cogging", 0.8, 57.0, 1.0),
    ("torque_constant_ripple", 0.05, 31.0, 1.0),
])  # fmt: skip
def test_ripples_are_proposed_near_enough_for_the_fit_to_find_them(effect, size, cycles, off):
    case = simulate_case(ripple(effect, size, cycles), seed=3, **SHORT)
    recorded, simulator, fitter = fitter_of(case)
    refit = fitter.refit()
    proposed = RippleSearch(
        effect, recorded, simulator, fitter.train, refit.model, refit.solution,
        fitter.scales.cycles(),
    ).cycles(most=4)  # fmt: skip
    assert len(proposed) <= 4
    assert min(abs(np.array(proposed) - cycles)) <= off
    fit = fitter.add(refit, effect, fitter.screening(refit, effect).proposals())
    assert fit.converged and fit.held_chi2 / fitter.held.size < 1.5
    found = fit.model.effects[f"{effect}.cycles_per_turn"]
    assert found == pytest.approx(cycles, rel=0.01)


def test_a_second_harmonic_is_fitted_where_the_rig_has_one():
    truth = ripple("cogging", 1.0, 24.0, second_ratio=0.3, second_phase_rad=1.1)
    fitter = fitter_of(simulate_case(truth, seed=3, **SHORT))[2]
    refit = fitter.refit()
    plain = fitter.add(refit, "cogging", fitter.screening(refit, "cogging").proposals())
    richer = with_second_harmonics(fitter, plain)
    assert richer.converged and richer.held_chi2 < 0.7 * plain.held_chi2
    assert richer.held_chi2 / fitter.held.size < 1.5
    effects = richer.model.effects
    assert effects["cogging.second_ratio"] == pytest.approx(0.3, abs=0.03)
    assert effects["cogging.cycles_per_turn"] == pytest.approx(24.0, rel=0.01)


def test_one_ripple_that_lies_between_two_harmonics_gives_way_to_both():
    truth = ripple("cogging", 0.3, 24.0, second_ratio=2.5, second_phase_rad=1.1)
    fitter = fitter_of(simulate_case(truth, seed=3, **SHORT))[2]
    refit = fitter.refit()
    plain = fitter.add(refit, "cogging", fitter.screening(refit, "cogging").proposals())
    assert 30.0 < plain.model.effects["cogging.cycles_per_turn"] < 48.0
    richer = with_second_harmonics(fitter, plain)
    assert richer.converged and richer.held_chi2 / fitter.held.size < 1.5
    assert richer.model.effects["cogging.cycles_per_turn"] == pytest.approx(24.0, rel=0.01)


def test_every_ripple_of_the_catalogue_is_searched_for():
    assert set(SIZES) == {e.identifier for e in effects.CATALOGUE if e.ripple}
