"""Two effects that nearly replace each other, and what is doubted of what is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_cases import SHORT, fitter_of, simulate_case

from fjr_sim_node.plant import PLANT
from gap_diagnosis.any_record import investigate
from gap_diagnosis.which.presence import at_its_bound

SMOOTH = {**PLANT.defaults(), "fvm": 0.0, "fv": 0.0}
"""A datasheet without viscous friction."""


@pytest.fixture(scope="module")
def case():
    """A cable that relaxes fast, which is a damper nearly, and a viscous friction."""
    cable = {"cable.stiffness_nm_rad": 150.0, "cable.relaxation_s": 0.06}
    return simulate_case(cable, seed=5, off=0.03, plant={"fvm": 6.0, "fv": 0.0}, **SHORT)


def test_two_effects_that_nearly_replace_each_other_are_both_found(case):
    found = investigate(case.recorded, SMOOTH, effects=("cable", "viscous_friction"))
    assert sorted(found.diagnosis.effects) == ["cable", "viscous_friction"]
    sizes = found.diagnosis.parameters
    assert sizes["cable.stiffness_nm_rad"].value == pytest.approx(150.0, rel=0.02)
    assert sizes["viscous_friction.motor_nm_s_rad"].value == pytest.approx(6.0, rel=0.02)


def test_a_shape_that_ends_at_a_bound_is_told_from_one_inside(case):
    fitter = fitter_of(case.recorded)
    refit = fitter.refit()
    seed = {
        "extra_mode.inertia_kg_m2": 0.01,
        "extra_mode.frequency_hz": 12.0,
        "extra_mode.damping_ratio": 0.05,
    }
    space = fitter._space(refit, seed)
    x = space.point(refit.model.with_effects(seed))
    inside = replace(refit, effects=("extra_mode",), space=space,
                     solution=replace(refit.solution, x=x))  # fmt: skip
    at_end = np.append(x[:-1], space.bounds()[1][-1])
    ended = replace(inside, solution=replace(refit.solution, x=at_end))
    assert not at_its_bound(inside, "extra_mode") and at_its_bound(ended, "extra_mode")
