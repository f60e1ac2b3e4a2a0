"""A datasheet that is off by more than its tolerance is said to be, and stands for no effect."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from driven_runs import NOMINAL, driven_runs
from gap_cases import simulate_case

from fjr_sim_node.plant import PLANT
from gap_diagnosis.any_record import investigate
from gap_diagnosis.further_looks import CLOSER, WIDER, says_more

SHORT = {"base_frequency_hz": 0.5, "levels_rad": (4e-3, 1.2e-2), "transient_periods": 2}
FEW = ("encoder_eccentricity", "torque_bias", "delay")
TOO_STIFF = 2500.0


@pytest.fixture(scope="module")
def case():
    return simulate_case({}, seed=5, **SHORT)


@pytest.mark.parametrize("as_record", [False, True])
def test_a_stiffness_that_is_far_off_is_no_eccentric_encoder(case, as_record):
    recorded = case.recorded.as_records() if as_record else case.recorded
    nominal = {**PLANT.defaults(), "k0": TOO_STIFF}
    found = investigate(recorded, nominal, effects=FEW).diagnosis
    assert found.verdict == "parameters_only" and not found.effects
    off = 100.0 * (1.0 - case.rig["k0"] / TOO_STIFF)
    assert off > 40.0
    assert f"k0 is {off:.0f} % below it" in found.notes[0]
    assert found.parameters["k0"].value == pytest.approx(case.rig["k0"], rel=0.01)


def test_without_time_there_are_no_further_looks(case):
    nominal = {**PLANT.defaults(), "k0": TOO_STIFF}
    told: list[str] = []
    investigate(case.recorded, nominal, effects=FEW, budget_s=0.01, progress=told.append)
    assert not any("once more" in stage for stage in told)


def test_an_eccentric_encoder_stays_one_where_all_parameters_would_be_off_alike():
    eccentric = {"encoder_eccentricity.amplitude_rad": 0.2, "encoder_eccentricity.phase_rad": 0.3}
    case = simulate_case(eccentric, seed=6, **SHORT)
    found = investigate(case.recorded, PLANT.defaults(), effects=FEW).diagnosis
    assert found.effects == ["encoder_eccentricity"]


def test_a_wider_datasheet_must_not_need_more_causes_nor_end_at_a_limit(case):
    nominal = PLANT.defaults()
    found = investigate(case.recorded, nominal, effects=FEW)

    def told(effects, chi2, at_limit=False):
        gap = found.diagnosis.gap
        explained = gap.refit.model_copy(update={"chi2_per_dof": chi2})
        gap = gap.model_copy(update={"explained": explained})
        diagnosis = found.diagnosis.model_copy(update={"effects": effects, "gap": gap})
        best = found.fitted.found.best
        if at_limit:
            _, high = best.space.bounds()
            x = best.solution.x.copy()
            stiffness = list(best.space.nominal).index("k0")
            x[stiffness] = high[stiffness]
            best = replace(best, solution=replace(best.solution, x=x))
        steps = [*found.fitted.found.steps[:-1], best]
        fitted = replace(found.fitted, found=replace(found.fitted.found, steps=steps))
        return replace(found, diagnosis=diagnosis, fitted=fitted)

    assert np.isfinite(found.diagnosis.gap.refit.chi2_per_dof)
    first, more, same = told(["delay"], 100.0), told(list(FEW), 10.0), told(["delay"], 10.0)
    assert says_more(same, first, nominal, WIDER)
    assert not says_more(more, first, nominal, WIDER)
    assert says_more(more, first, nominal, CLOSER)
    assert says_more(more, told([], 100.0), nominal, WIDER)
    assert not says_more(told(["delay"], 10.0, at_limit=True), first, nominal, WIDER)
    # friction that the datasheet lacks is no cause that a wrong datasheet makes up
    lacking = ["delay", "viscous_friction"]
    assert says_more(told(lacking, 60.0), first, nominal, WIDER)
    assert not says_more(told(lacking, 80.0), first, nominal, WIDER)
    # the same causes explain more where the datasheet is taken for further off
    assert says_more(told(["delay"], 60.0), first, nominal, WIDER)
    assert not says_more(told(["delay"], 80.0), first, nominal, WIDER)
    assert not says_more(told(["delay", "torque_bias"], 40.0), first, nominal, WIDER)
    assert not says_more(told(["torque_bias", "viscous_friction"], 60.0), first, nominal, WIDER)


def test_a_single_inertia_that_is_far_off_is_not_named_as_a_gain_of_the_torque():
    """Of a datasheet of one value nothing tells them apart, and all sizes go with that gain."""
    sizes = {"coulomb_friction.motor_nm": 20.0, "viscous_friction.motor_nm_s_rad": 20.0}
    rig = dict.fromkeys(NOMINAL, 0.0) | {"jm": 0.5, "k0": math.inf}
    records = driven_runs(rig=rig | {"fsm": 20.0, "fvm": 20.0})
    effects = ["torque_gain", "coulomb_friction", "viscous_friction"]
    found = investigate(records, rig | {"jm": 2.5}, effects=effects).diagnosis
    assert {cause.effect for cause in found.causes} == {"coulomb_friction", "viscous_friction"}
    for name, size in {"jm": 0.5, **sizes}.items():
        assert found.parameters[name].value == pytest.approx(size, rel=0.02), name
    assert "jm is 80 % below it" in found.notes[0]
