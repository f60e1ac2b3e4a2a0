"""One cause or two: near equivalents, gains, and laws of which one holds the other."""

from __future__ import annotations

import numpy as np
import pytest
from gap_cases import SHORT, fitter_of, found_in, simulate_case, true_parameters
from test_evidence import NOMINAL as RIG
from test_evidence import records

from fjr_sim_node.plant import PLANT
from gap_diagnosis.any_record import investigate
from gap_diagnosis.which.equivalents import plainness

NOMINAL = PLANT.defaults()


def test_a_gain_is_no_second_cause_beside_a_mode_on_a_rig_beyond_the_tolerance():
    mode = {
        "extra_mode.inertia_kg_m2": 0.1,
        "extra_mode.frequency_hz": 22.0,
        "extra_mode.damping_ratio": 0.02,
    }
    plant = {name: 1.25 * value for name, value in true_parameters(3, 0.02).items()}
    recorded = simulate_case(mode, seed=3, plant=plant, **SHORT).recorded
    told, fitted = found_in(recorded, NOMINAL, "extra_mode", "torque_gain")
    assert told.effects == ["extra_mode"] and told.verdict == "effect"
    best = fitted.found.best
    assert fitted.fitter.misfit(best) < 2.0
    assert best.model.effects["extra_mode.inertia_kg_m2"] == pytest.approx(0.1, rel=0.01)
    for name, value in plant.items():
        assert best.model.plant[name] == pytest.approx(value, rel=0.01)


def named(truth, few):
    recorded = simulate_case(truth, seed=3, off=0.02, **SHORT).recorded
    told, fitted = found_in(recorded, NOMINAL, *few, tolerance=0.03)
    return told, fitted.found


def test_lugre_friction_is_named_where_one_of_its_parts_leads():
    truth = {
        "lugre_friction.stribeck_nm": 6.0,
        "lugre_friction.bristle_nm_rad": 3e4,
        "lugre_friction.velocity_rad_s": 0.05,
    }
    parts = ("presliding_friction", "stribeck_friction_motor", "backlash")
    told, found = named(truth, parts)
    (names,) = told.equivalent
    assert "lugre_friction" in names
    tried = {fit.effects: fit for fits in found.rivals.values() for fit in fits}
    fitted = tried[("lugre_friction",)].model.effects
    assert fitted["lugre_friction.stribeck_nm"] == pytest.approx(6.0, rel=0.1)
    _, alone = named(truth, ("presliding_friction", "backlash"))
    tried = {effect for fits in alone.rivals.values() for fit in fits for effect in fit.effects}
    assert "lugre_friction" not in tried


def test_what_a_law_leaves_by_its_own_form_is_no_second_cause():
    """A lag that is a little off, as the rig of another maker has it, is no lag and a delay."""
    truth = {"actuator_lag.time_constant_s": 1e-3, "delay.time_s": 1e-4}
    assert named(truth, ("actuator_lag", "delay"))[0].effects == ["actuator_lag"]


def test_near_equivalents_of_like_size_are_two_causes():
    """A constant torque beside a cogging that does as much: neither alone does nearly all."""
    cogging = {
        "cogging.amplitude_nm": 2.0,
        "cogging.cycles_per_turn": 300.0,
        "cogging.phase_rad": 0.7,
    }
    few = ("cogging", "torque_bias")
    told, _ = named(cogging | {"torque_bias.torque_nm": 3.0}, few)
    assert sorted(told.effects) == sorted(few)


def test_a_rig_that_is_its_datasheet_without_noise_leaves_nothing_to_scale():
    recorded = simulate_case({}, seed=3, off=0.0, noise_rad=0.0, **SHORT).recorded
    fitter = fitter_of(recorded)
    assert np.isfinite(fitter.screening(fitter.refit(), "torque_bias").gain)


def test_of_explanations_that_do_alike_one_that_holds_another_stands_last():
    """A law's further parameters lie at their bounds then, where no test can call it present."""
    rich, plain = laws = [("delay", "torque_speed_limit"), ("delay", "torque_saturation")]
    few, more = ("a", "b"), ("a", "b", "c")
    assert plainness(rich, few, laws) > plainness(plain, more, laws)
    assert plainness(rich, few, [rich]) < plainness(plain, more, [plain])
    common, rare = laws = [("gravity",), ("external_spring",)]
    assert plainness(common, few, laws) < plainness(rare, few, laws)


@pytest.mark.parametrize("bias_nm", [0.0, 0.1])
def test_a_weak_near_equivalent_of_a_cause_is_named_where_it_closes_the_rest(bias_nm):
    """A constant torque beside a ripple is a hundredth of the gap, and nearly all that is left."""
    effects = {
        "cogging.amplitude_nm": 6.0,
        "cogging.cycles_per_turn": 300.0,
        "cogging.phase_rad": 0.7,
    } | ({"torque_bias.torque_nm": bias_nm} if bias_nm else {})
    few = ("cogging", "torque_bias", "delay")
    told = investigate(records(effects), RIG, effects=few).diagnosis
    assert set(told.effects) == {"cogging", *(["torque_bias"] if bias_nm else [])}
    if bias_nm:
        found = told.parameters["torque_bias.torque_nm"]
        assert found.low < bias_nm < found.high
