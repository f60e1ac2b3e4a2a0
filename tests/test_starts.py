"""Effects whose fit finds its way only from the right starting point, or only if it goes far."""

from __future__ import annotations

import numpy as np
import pytest
from gap_cases import SHORT, fitter_of, simulate_case

from gap_diagnosis.fits import Fit


def fitted(truth: dict[str, float], effect: str, more: bool = False) -> tuple[Fit, float]:
    """Return the fit of an effect to a rig that has it, and its held-out misfit."""
    fitter = fitter_of(simulate_case(truth, seed=3, **SHORT))[2]
    refit = fitter.refit()
    fit = fitter.add(refit, effect, fitter.screening(refit, effect).proposals())
    if more and not fit.converged:
        fit = fitter.continued(fit)
    return fit, fit.held_chi2 / fitter.held.size


@pytest.mark.parametrize(("inertia", "frequency", "damping"), [
    (8e-4, 19.4, 0.013),
    (2e-3, 33.0, 0.02),
    (1e-2, 12.0, 0.03),
    (3e-2, 46.0, 0.045),
])  # fmt: skip
def test_a_third_mass_is_found_light_and_narrow_or_heavy(inertia, frequency, damping):
    truth = {
        "extra_mode.inertia_kg_m2": inertia,
        "extra_mode.frequency_hz": frequency,
        "extra_mode.damping_ratio": damping,
    }
    fit, left = fitted(truth, "extra_mode")
    assert fit.converged and left < 1.5
    assert fit.model.effects["extra_mode.frequency_hz"] == pytest.approx(frequency, rel=0.01)


@pytest.mark.parametrize(("share", "knee"), [(0.45, 0.0), (0.7, 0.0), (0.85, 0.15)])
def test_a_limit_is_found_wherever_it_clips(share, knee):
    bare = simulate_case({}, seed=3, **SHORT)
    peak = max(float(np.abs(r.torque).max()) for r in bare.recorded.realizations)
    truth = {"torque_saturation.limit_nm": share * peak, "torque_saturation.knee": knee}
    fit, left = fitted(truth, "torque_saturation")
    assert fit.converged and left < 1.5
    assert fit.model.effects["torque_saturation.limit_nm"] == pytest.approx(share * peak, rel=0.01)
    assert fit.model.effects["torque_saturation.knee"] == pytest.approx(knee, abs=0.05)


def test_an_eccentric_encoder_is_followed_along_its_valley():
    truth = {"encoder_eccentricity.amplitude_rad": 0.12, "encoder_eccentricity.phase_rad": -0.6}
    fit, left = fitted(truth, "encoder_eccentricity", more=True)
    assert fit.converged and left < 1.5


def test_an_effect_that_no_start_shows_is_found_if_a_step_from_there_gains():
    """An eccentric encoder that errs in gain wants all bare parameters to follow far."""
    truth = {"encoder_eccentricity.amplitude_rad": 0.2, "encoder_eccentricity.phase_rad": 0.05}
    fitter = fitter_of(simulate_case(truth, seed=1, noise_rad=2.8e-3, **SHORT))[2]
    refit = fitter.refit()
    proposals = fitter.screening(refit, "encoder_eccentricity").proposals()
    assert proposals[0][0] > refit.train_chi2
    fit = fitter.add(refit, "encoder_eccentricity", proposals)
    assert fit.converged and fit.held_chi2 / fitter.held.size < 1.5
