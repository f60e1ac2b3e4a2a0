from __future__ import annotations

import numpy as np
import pytest

from bla_analyzer.bla.robust import robust_bla
from bla_analyzer.compare.metrics import squared_error_db
from controller_node import pd_filtered
from fjr_bringup.campaign.plan import Campaign
from fjr_bringup.design.measured import simulate_level
from fjr_kit.errors import InputError
from fjr_sim_node.plant import PLANT
from fjr_sim_node.theory.linear import g0
from fjr_sim_node.theory.statistical_linearisation import (
    controller_frf,
    linearise,
    linearise_experiment,
)


def campaign(amplitude, realizations=1, periods=1, **simulator):
    excitation = {
        "amplitudes_rad": (amplitude,),
        "realizations": realizations,
        "periods": periods,
    }
    return Campaign.create(None, {"excitation": excitation, "simulator": simulator})


def prediction(one):
    return linearise_experiment(one.values["simulator"], one.experiment(0, 0))


@pytest.mark.parametrize(
    ("simulator", "bound"), [({}, 0.05), ({"k1": 0.0}, 0.05), ({"fs": 0.0, "fsm": 0.0}, 0.05)]
)
def test_it_meets_the_simulated_bla_near_the_optimum(simulator, bound):
    """Bound: the issue's target, in dB^2 from 1 Hz on; 12 realizations add some 0.04 at most."""
    one = campaign(7e-3, 12, **simulator)
    level = simulate_level(one)
    bla = robust_bla(level.spectra, level.lines.excited)
    above = bla.frequency_hz >= 1.0 - 1e-9
    error = squared_error_db(bla.g, prediction(one).frf(bla.frequency_hz))[above]
    assert error.mean() < bound
    plain = g0(one.values["simulator"], bla.frequency_hz, 1000.0)
    assert error.mean() < 0.3 * squared_error_db(bla.g, plain)[above].mean()


def test_standard_deviations_are_those_of_the_simulated_motion():
    from fjr_sim_node.simulation.simulator import run_realization

    one = campaign(7e-3, 1, 4)
    experiment = one.experiment(0, 0)
    run = run_realization(one.values["simulator"], experiment)
    kept = slice(experiment.samples_per_period, None)
    found = prediction(one)
    rate = experiment.sample_rate_hz
    assert found.deflection_rad == pytest.approx((run.link - run.motor)[kept].std(), rel=0.03)
    assert found.link_velocity_rad_s == pytest.approx(
        np.diff(run.link[kept]).std() * rate, rel=0.03
    )
    motor = np.diff(run.motor[kept]).std() * rate
    assert found.motor_velocity_rad_s == pytest.approx(motor, rel=0.03)


def test_a_linear_plant_stays_as_it_is():
    one = campaign(1e-2, fs=0.0, fsm=0.0, k1=0.0)
    frequency = np.linspace(0.1, 50.0, 40)
    expected = g0(one.values["simulator"], frequency, 1000.0)
    np.testing.assert_allclose(prediction(one).frf(frequency), expected, rtol=1e-12)


def test_friction_damps_less_and_the_spring_is_stiffer_at_higher_amplitude():
    found = [prediction(campaign(a)).parameters for a in (2e-3, 4e-3, 8e-3, 1.6e-2)]
    for name, sign in (("fv", -1), ("fvm", -1), ("k0", 1)):
        assert (sign * np.diff([parameters[name] for parameters in found]) > 0).all(), name


def test_the_fixed_point_does_not_depend_on_how_power_is_split_between_near_lines():
    """Two lines side by side act as one of the same power."""
    coefficients = pd_filtered.coefficients(pd_filtered.CONTROLLER.defaults())
    plant = PLANT.defaults()
    one = linearise(plant, coefficients, 1000.0, np.array([5.0]), np.array([0.05]))
    near = np.array([5.0, 5.0 + 1e-9])
    two = linearise(plant, coefficients, 1000.0, near, np.full(2, 0.05 / np.sqrt(2)))
    assert two.deflection_rad == pytest.approx(one.deflection_rad, rel=1e-6)


def test_the_controllers_frequency_response_is_that_of_its_steps():
    coefficients = pd_filtered.coefficients(pd_filtered.CONTROLLER.defaults())
    samples, line = 4000, 25
    error = np.cos(2 * np.pi * line * np.arange(3 * samples) / samples)
    state, torque = 0.0, np.empty(error.size)
    for k, value in enumerate(error):
        state, torque[k] = pd_filtered.step.py_func(state, value, coefficients)
    ratio = np.fft.rfft(torque[-samples:])[line] / np.fft.rfft(error[-samples:])[line]
    z = np.exp(2j * np.pi * line / samples)
    assert controller_frf(coefficients, z) == pytest.approx(ratio, rel=1e-9)


def test_an_experiment_without_controller_is_refused():
    experiment = campaign(1e-2).experiment(0, 0).model_copy(update={"controller": None})
    with pytest.raises(InputError, match="controller"):
        linearise_experiment(campaign(1e-2).values["simulator"], experiment)
