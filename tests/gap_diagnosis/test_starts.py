"""Effects whose fit finds its way only from the right starting point, or only if it goes far."""

from __future__ import annotations

import numpy as np
import pytest
from gap_cases import SHORT, fitter_of, simulate_case
from test_evidence import NOMINAL, records

from fjr_sim_node.effects import EFFECTS
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.fits.comparison import CellFit
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.simulated_rig import Simulator

pytestmark = pytest.mark.slow


def fitted(recorded, effect: str) -> tuple[CellFit, CellFitter]:
    """Return the fit of an effect to a rig that has it, taken to its end, and what fitted it."""
    fitter = fitter_of(recorded)
    refit = fitter.refit()
    fit = fitter.add(refit, effect, fitter.screening(refit, effect).proposals())
    return fitter.to_its_end(fit), fitter


def rig_with(truth: dict[str, float], seed: int = 3, **played: float):
    """Return the record of a rig with an effect."""
    return simulate_case(truth, seed=seed, **SHORT, **played).recorded


@pytest.mark.parametrize(("inertia", "frequency", "damping"), [
    (8e-4, 19.4, 0.013),
    (2e-3, 33.0, 0.02),
    (1e-2, 12.0, 0.03),
    (3e-2, 46.0, 0.045),
    (5e-2, 20.0, 0.017),
    (1e-1, 39.0, 0.017),
])  # fmt: skip
def test_a_third_mass_is_found_light_and_narrow_or_heavy(inertia, frequency, damping):
    truth = {
        "extra_mode.inertia_kg_m2": inertia,
        "extra_mode.frequency_hz": frequency,
        "extra_mode.damping_ratio": damping,
    }
    fit, fitter = fitted(rig_with(truth), "extra_mode")
    assert fitter.misfit(fit) < 1.5
    assert fit.model.effects["extra_mode.frequency_hz"] == pytest.approx(frequency, rel=0.01)
    assert fit.model.effects["extra_mode.inertia_kg_m2"] == pytest.approx(inertia, rel=0.05)


@pytest.mark.parametrize("rest", [-0.1, 0.1])
def test_a_spring_that_rests_beside_the_motion_is_found_in_records(rest):
    """Three rms amplitudes away: much like a constant torque, but its stiffness still shows."""
    truth = {"external_spring.stiffness_nm_rad": 40.0, "external_spring.rest_rad": rest}
    fitter = CellFitter(Evidence(records(truth, runs=2), NOMINAL), NOMINAL, 0.1)
    refit = fitter.refit()
    spring = fitter.screening(refit, "external_spring").proposals()
    fit = fitter.add(refit, "external_spring", spring, 1)
    assert fit is not None and fitter.misfit(fit) < 1.5
    for name, value in truth.items():
        assert fit.model.effects[name] == pytest.approx(value, rel=0.1)


@pytest.mark.parametrize("rms_rad", [(0.03, 0.06), (0.1, 0.2)])
def test_play_wider_than_its_spring_yields_is_found_in_records(rms_rad):
    truth = {"backlash.half_gap_rad": 0.1}
    fitter = CellFitter(Evidence(records(truth, runs=2, rms_rad=rms_rad), NOMINAL), NOMINAL, 0.1)
    refit = fitter.refit()
    fit = fitter.add(refit, "backlash", fitter.screening(refit, "backlash").proposals())
    assert fit.model.effects["backlash.half_gap_rad"] == pytest.approx(0.1, rel=0.002)
    assert fitter.misfit(fit) < 1e-4 * fitter.misfit(refit)


def test_lugre_friction_begins_as_the_part_of_it_that_was_fitted():
    case = simulate_case({}, seed=3, **SHORT)
    simulator = Simulator(case.recorded)
    begins = EFFECTS["lugre_friction"].from_part
    for part in (
        {"presliding_friction.motor_rad": 3e-4},
        {"presliding_friction.motor_rad": 3e-4, "coulomb_friction.motor_nm": 2.0},
        {
            "stribeck_friction_motor.torque_nm": 3.0,
            "stribeck_friction_motor.velocity_rad_s": 0.05,
        },
    ):
        beside = {n: v for n, v in part.items() if n.startswith("coulomb_friction.")}
        whole = beside | begins(part, case.truth.plant)
        models = [Model(case.truth.plant, effects) for effects in (part, whole)]
        as_part, as_whole = (simulator.signals(model) for model in models)
        np.testing.assert_array_equal(as_whole, as_part)


def test_lugre_friction_is_found_beside_another_effect_from_its_fitted_part():
    """It starts as presliding friction, which leaves twice as much, and ends at the truth."""
    truth = {
        "lugre_friction.stribeck_nm": 6.0,
        "lugre_friction.bristle_nm_rad": 3e3,
        "lugre_friction.velocity_rad_s": 0.3,
        "delay.time_s": 5e-4,
    }
    fitter = fitter_of(rig_with(truth))
    refit = fitter.refit()
    delay = fitter.add(refit, "delay", fitter.screening(refit, "delay").proposals())
    part = fitter.add(
        delay, "presliding_friction", fitter.screening(delay, "presliding_friction").proposals()
    )
    whole = fitter.add(delay, "lugre_friction", fitter.from_part(delay, "lugre_friction", part))
    whole = fitter.further(whole)
    assert fitter.misfit(part) > 1.5 > fitter.misfit(whole)
    assert whole.model.effects["lugre_friction.bristle_nm_rad"] == pytest.approx(3e3, rel=0.1)


@pytest.mark.parametrize(("share", "knee"), [(0.45, 0.0), (0.7, 0.0), (0.85, 0.15)])
def test_a_limit_is_found_wherever_it_clips(share, knee):
    bare = simulate_case({}, seed=3, **SHORT)
    peak = max(float(np.abs(r.torque).max()) for r in bare.recorded.realizations)
    truth = {"torque_saturation.limit_nm": share * peak, "torque_saturation.knee": knee}
    fit, fitter = fitted(rig_with(truth), "torque_saturation")
    assert fitter.misfit(fit) < 1.5
    assert fit.model.effects["torque_saturation.limit_nm"] == pytest.approx(share * peak, rel=0.01)
    assert fit.model.effects["torque_saturation.knee"] == pytest.approx(knee, abs=0.05)


@pytest.mark.parametrize(
    ("share", "speeds"), [(0.75, 1.3), (0.7, 1.6), (0.6, 2.0), (0.85, 2.5), (0.8, 4.0)]
)
def test_a_limit_that_falls_with_the_speed_is_found_wherever_it_cuts(share, speeds):
    """The line is a share of the one that the record just reaches, at some times its speed."""
    bare = fitter_of(rig_with({})).scales
    no_load = speeds * max(speed for speed, _ in bare.corners)
    stall = share * bare.stall_nm(no_load)
    truth = {
        "torque_speed_limit.stall_nm": stall, "torque_speed_limit.no_load_rad_s": no_load
    }  # fmt: skip
    fit, fitter = fitted(rig_with(truth), "torque_speed_limit")
    assert fitter.misfit(fit) < 1.5
    assert fit.model.effects["torque_speed_limit.stall_nm"] == pytest.approx(stall, rel=0.02)


def test_an_eccentric_encoder_is_followed_along_its_valley():
    truth = {"encoder_eccentricity.amplitude_rad": 0.12, "encoder_eccentricity.phase_rad": -0.6}
    fit, fitter = fitted(rig_with(truth), "encoder_eccentricity")
    assert fitter.misfit(fit) < 1.5


@pytest.mark.parametrize(
    "sizes",
    [
        {"motor_rad": 3e-5, "link_rad": 1e-5},
        {"motor_rad": 4e-5, "link_rad": 3e-3},
        {"motor_rad": 0.0, "link_rad": 1e-4},
        {"motor_rad": 1e-3, "link_rad": 0.0},
    ],
)
def test_presliding_is_found_on_either_side_or_both(sizes):
    truth = {f"presliding_friction.{name}": value for name, value in sizes.items()}
    fit, fitter = fitted(rig_with(truth, seed=4), "presliding_friction")
    assert fitter.misfit(fitter.refit()) > 5.0
    assert fitter.misfit(fit) < 1.3
    for name, value in truth.items():
        assert fit.model.effects[name] == pytest.approx(value, rel=0.1, abs=1e-5)


def test_an_eccentric_encoder_is_found_though_it_scales_the_parameters_by_a_fifth():
    truth = {"encoder_eccentricity.amplitude_rad": 0.3, "encoder_eccentricity.phase_rad": 0.8}
    fit, fitter = fitted(rig_with(truth, seed=4), "encoder_eccentricity")
    assert fitter.left_in_a_band(fitter.refit()) > 100.0
    assert fitter.misfit(fit) < 1.3


@pytest.mark.parametrize(("share", "knee"), [(1.15, 0.3), (0.95, 0.1), (0.6, 0.2)])
def test_a_drive_limit_is_found_even_if_only_its_knee_is_reached(share, knee):
    limit = share * fitter_of(rig_with({}, seed=4)).scales.peak_torque_nm
    truth = {"torque_saturation.limit_nm": limit, "torque_saturation.knee": knee}
    fit, fitter = fitted(rig_with(truth, seed=4), "torque_saturation")
    assert fitter.left_in_a_band(fitter.refit()) > 2.0
    assert fitter.misfit(fit) < 1.3
