"""The search for a second effect by steady periods, and what is doubted of what it names."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_cases import SHORT, fitter_of, simulate_case

from fjr_sim_node.plant import PLANT
from gap_diagnosis.any_record import investigate_any
from gap_diagnosis.which.presence import at_its_bound
from gap_diagnosis.which.ripples_passed import doubt_of_shape
from gap_diagnosis.which.search import Search

SMOOTH = {**PLANT.defaults(), "fvm": 0.0, "fv": 0.0}
"""A datasheet without viscous friction."""


def dragging(fitter):
    """Return the refit, and a fit with viscous friction that was given up after two steps."""
    refit = fitter.refit()
    _, space, point = fitter.screening(refit, "viscous_friction").proposals()[0]
    return refit, fitter.solve(("viscous_friction",), space, point, most_steps=1)


@pytest.fixture(scope="module")
def case():
    """A cable that relaxes fast, which is a damper nearly, and a viscous friction."""
    cable = {"cable.stiffness_nm_rad": 150.0, "cable.relaxation_s": 0.06}
    return simulate_case(cable, seed=5, off=0.03, plant={"fvm": 6.0, "fv": 0.0}, **SHORT)


def test_two_effects_that_nearly_replace_each_other_are_both_found(case):
    found = investigate_any(case.recorded, SMOOTH, effects=("cable", "viscous_friction"))
    assert sorted(found.diagnosis.effects) == ["cable", "viscous_friction"]
    sizes = found.diagnosis.parameters
    assert sizes["cable.stiffness_nm_rad"].value == pytest.approx(150.0, rel=0.02)
    assert sizes["viscous_friction.motor_nm_s_rad"].value == pytest.approx(6.0, rel=0.02)


def test_a_fit_that_was_given_up_is_taken_to_its_end_before_a_second_effect_joins_it(case):
    fitter = fitter_of(replace(case, recorded=case.recorded))[2]
    fitter.nominal.update(fvm=0.0, fv=0.0)
    refit, given_up = dragging(fitter)
    search = Search(fitter)
    search._found.refit = refit
    search._found.fits[given_up.effects] = given_up
    assert not given_up.converged
    search._take_parents_further(given_up)
    assert search._found.fits[given_up.effects].converged


def test_a_law_whose_shape_ends_at_a_bound_may_be_another_law(case):
    fitter = fitter_of(case)[2]
    refit = fitter.refit()
    seed = {
        "extra_mode.inertia_kg_m2": 0.01,
        "extra_mode.frequency_hz": 12.0,
        "extra_mode.damping_ratio": 0.05,
    }
    space = fitter.space(refit, seed)
    x = space.point(refit.model.with_effects(seed))
    inside = replace(refit, effects=("extra_mode",), space=space,
                     solution=replace(refit.solution, x=x))  # fmt: skip
    at_end = np.append(x[:-1], space.bounds()[1][-1])
    ended = replace(inside, solution=replace(refit.solution, x=at_end))
    assert not at_its_bound(inside, "extra_mode") and at_its_bound(ended, "extra_mode")
    assert doubt_of_shape(np.inf, bounded=True) < 0.8 < doubt_of_shape(np.inf)
