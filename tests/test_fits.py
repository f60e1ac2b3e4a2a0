"""Single effects are fitted to their end, wherever they lie between their starts."""

from __future__ import annotations

import pytest
from gap_cases import SHORT, fitter_of, simulate_case

from gap_diagnosis.attribution import STANDS_OUT, stands_out


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
    fitter = fitter_of(simulate_case(truth, seed=4, **SHORT))[2]
    refit = fitter.refit()
    proposals = fitter.screening(refit, "presliding_friction").proposals()
    fit = fitter.add(refit, "presliding_friction", proposals)
    assert refit.held_chi2 / fitter.held.size > 5.0
    assert fit.converged and fit.held_chi2 / fitter.held.size < 1.3
    for name, value in truth.items():
        assert fit.model.effects[name] == pytest.approx(value, rel=0.1, abs=1e-5)


def test_an_eccentric_encoder_is_found_though_it_scales_the_parameters_by_a_fifth():
    truth = {"encoder_eccentricity.amplitude_rad": 0.3, "encoder_eccentricity.phase_rad": 0.8}
    fitter = fitter_of(simulate_case(truth, seed=4, **SHORT))[2]
    refit = fitter.refit()
    effect = "encoder_eccentricity"
    fit = fitter.add(refit, effect, fitter.screening(refit, effect).proposals())
    fit = fit if fit.converged else fitter.continued(fit)
    assert refit.held_chi2 / fitter.held.size > 100.0
    assert fit.converged and fit.held_chi2 / fitter.held.size < 1.3
    assert fit.model.effects["encoder_eccentricity.amplitude_rad"] == pytest.approx(0.3, rel=0.2)


@pytest.mark.parametrize(("share", "knee"), [(1.15, 0.3), (1.0, 0.1), (0.85, 0.0), (0.6, 0.2)])
def test_a_drive_limit_is_found_even_if_only_its_knee_is_reached(share, knee):
    bare = fitter_of(simulate_case(seed=4, **SHORT))[2]
    limit = share * bare.peak_torque_nm
    truth = {"torque_saturation.limit_nm": limit, "torque_saturation.knee": knee}
    fitter = fitter_of(simulate_case(truth, seed=4, **SHORT))[2]
    refit, effect = fitter.refit(), "torque_saturation"
    fit = fitter.add(refit, effect, fitter.screening(refit, effect).proposals())
    assert refit.held_chi2 / fitter.held.size > 2.0
    assert fit.converged and fit.train_chi2 / fitter.train.size < 1.3


@pytest.mark.parametrize(("inertia", "hz"), [(0.1, 39.0), (0.05, 20.0), (0.005, 30.0)])
def test_a_heavy_or_a_light_third_mass_is_found(inertia, hz):
    values = {"inertia_kg_m2": inertia, "frequency_hz": hz, "damping_ratio": 0.017}
    truth = {f"extra_mode.{name}": value for name, value in values.items()}
    fitter = fitter_of(simulate_case(truth, seed=4, **SHORT))[2]
    refit = fitter.refit()
    fit = fitter.add(refit, "extra_mode", fitter.screening(refit, "extra_mode").proposals())
    assert refit.held_chi2 / fitter.held.size > 5.0
    assert fit.converged and fit.held_chi2 / fitter.held.size < 1.3
    assert fit.model.effects["extra_mode.inertia_kg_m2"] == pytest.approx(inertia, rel=0.05)


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
