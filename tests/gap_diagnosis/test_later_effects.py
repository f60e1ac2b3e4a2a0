"""Later effects of the catalogue are found in records of a rig that has them, with their values."""

from __future__ import annotations

import pytest
from gap_cases import SHORT, fitter_of, found_in, simulate_case

from fjr_sim_node.plant import PLANT

pytestmark = pytest.mark.slow

CASES = {
    "lugre_friction": (
        {"stribeck_nm": 3.0, "bristle_nm_rad": 2e4, "velocity_rad_s": 0.1,
         "damping_nm_s_rad": 0.0},
        {"stribeck_nm": 0.05, "bristle_nm_rad": 0.02, "velocity_rad_s": 0.05},
    ),
    "directional_loss": ({"forward": 0.08, "backward": 0.02}, {}),
    "asymmetric_stiffness": ({"relative": -0.1}, {"relative": 0.03}),
    "torque_speed_limit": (
        {"stall_nm": 400.0, "no_load_rad_s": 40.0}, {"stall_nm": 0.05},
    ),
    "torque_slew_limit": ({"limit_nm_s": 6e4}, {"limit_nm_s": 0.02}),
    "dead_band": ({"width_nm": 2.0}, {"width_nm": 0.05}),
    "torque_constant_ripple": (
        {"amplitude": 0.05, "cycles_per_turn": 31.0, "phase_rad": 0.7},
        {"amplitude": 0.05, "cycles_per_turn": 0.01},
    ),
}  # fmt: skip
"""Truth, and how near the fit comes to it, relative."""

LOW = (1.5e-3, 6e-3)  # rad, where friction is not only its sliding level


@pytest.mark.parametrize("effect", CASES)
def test_an_effect_is_fitted_with_its_values(effect):
    truth, near = CASES[effect]
    named = {f"{effect}.{name}": value for name, value in truth.items()}
    levels = LOW if effect == "lugre_friction" else SHORT["levels_rad"]
    case = simulate_case(named, seed=3, **{**SHORT, "levels_rad": levels})
    fitter = fitter_of(case.recorded)
    refit = fitter.refit()
    fit = fitter.add(refit, effect, fitter.screening(refit, effect).proposals())
    fit = fitter.to_its_end(fit)
    assert fitter.misfit(refit) > 3.0
    assert fitter.misfit(fit) < 1.5
    for name, share in near.items():
        found = fit.model.effects[f"{effect}.{name}"]
        assert found == pytest.approx(truth[name], rel=share), name
    if effect == "directional_loss":  # only the ratio of what reaches the motor counts
        forward, backward = (fit.model.effects[f"{effect}.{name}"] for name in truth)
        assert (1.0 + forward) / (1.0 - backward) == pytest.approx(1.08 / 0.98, rel=0.005)


@pytest.mark.parametrize(
    "truth",
    [
        {"load_friction.coefficient": 0.05},
        {"directional_loss.forward": 0.08, "directional_loss.backward": 0.02},
    ],
)
def test_losses_that_grow_with_the_load_are_in_one_set(truth):
    # while the motor slides they differ by the parameters behind the gear alone
    recorded = simulate_case(truth, seed=3, **SHORT).recorded
    losses = ["directional_loss", "load_friction"]
    found, _ = found_in(recorded, PLANT.defaults(), *losses)
    assert [sorted(members) for members in found.equivalent] == [losses]
