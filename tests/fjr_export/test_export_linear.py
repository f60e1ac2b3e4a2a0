"""The linear model of python-control against this product's own simulation."""

from __future__ import annotations

import numpy as np
import pytest
from effect_rig import CONTROLLER, moderate, multisine_reference, relative_rms
from hypothesis import given, settings
from hypothesis import strategies as st

from controller_node import pd_filtered
from fjr_export.joint import Joint
from fjr_export.linear import control_script, linear_joint
from fjr_export.targets import ControlJoint
from fjr_export.treatments import CONTROL
from fjr_kit.errors import InputError
from fjr_sim_node import SIMULATOR, effects, g0, plant
from fjr_sim_node.simulation.closed_loop import simulate

control = pytest.importorskip("control", reason="no python-control here")

LINEAR = {"fs": 0.0, "fsm": 0.0, "k1": 0.0}


def joint_of(values: dict) -> Joint:
    return Joint(SIMULATOR.check(values), 1000.0, "test.yaml")


def test_every_effect_of_the_catalogue_is_treated():
    assert set(CONTROL) == set(effects.EFFECTS)


@settings(max_examples=30)
@given(delay=st.floats(0.0, 3e-3), lag=st.floats(0.0, 1e-3), gain=st.floats(-0.3, 0.3))
def test_the_script_moves_as_our_simulation_does(delay: float, lag: float, gain: float):
    # lags below 2e-5 s would take long here
    drive = {"delay.time_s": delay, "actuator_lag.time_constant_s": lag if lag > 2e-5 else 0.0}
    drive["torque_gain.relative_error"] = gain
    joint = joint_of({**LINEAR, **drive, **moderate("extra_mode", "transmission_damping", "cable")})
    torque = np.sin(np.arange(300) ** 2 / 900.0)
    target = ControlJoint(control_script(joint, linear_joint(joint, [])))
    target.begin(0.0, 0.0)
    position = np.empty(torque.size)
    for k, u in enumerate(torque):
        position[k] = target.position()
        target.hold(u)
    p, e = plant.coefficients(joint.values), effects.coefficients(joint.values)
    own = open_loop(torque, p, e)
    assert relative_rms(position, own) < 1e-4


def open_loop(torque: np.ndarray, p, e) -> np.ndarray:
    from fjr_sim_node.simulation import rig

    state, position = rig.at_rest(), np.empty(torque.size)
    for k, u in enumerate(torque):
        position[k] = state[rig.MOTOR]
        rig.hold(state, float(u), 1e-3, p, e)
    return position


def test_the_objects_have_the_response_of_the_theory():
    joint = joint_of(LINEAR)
    made: dict = {}
    exec(control_script(joint, linear_joint(joint, [])), made)
    frequency = np.geomspace(0.5, 400.0, 50)
    response = made["discrete"](np.exp(2j * np.pi * frequency / 1000.0))[0, 0]
    np.testing.assert_allclose(response, g0(joint.values, frequency, 1000.0), rtol=1e-9)
    assert isinstance(made["continuous"], control.StateSpace)
    assert made["continuous"].output_labels == ["motor", "link"]


def test_friction_is_made_linear_about_the_motion_and_only_there():
    joint, reference = joint_of({}), multisine_reference(2e-2)[:4000]
    with pytest.raises(InputError, match="Coulomb friction, k1 can only be made linear about a"):
        linear_joint(joint, [])
    run = simulate(reference, 1000.0, plant.coefficients(joint.values), CONTROLLER)
    found = linear_joint(joint, [run])
    speed = np.gradient(run.motor) * 1000.0
    expected = 6.0 * np.mean(np.abs(speed)) / np.mean(speed**2)  # of sgn: E|v| / E v^2
    assert found.equivalents["motor_nm_s_rad"] == pytest.approx(expected, rel=1e-9)
    assert found.equivalents["stiffness_nm_rad"] > 1500.0
    target, x = ControlJoint(control_script(joint, found)), 0.0
    target.begin(0.0, 0.0)
    position = np.empty(reference.size)
    for k, r in enumerate(reference.tolist()):
        position[k] = target.position()
        x, u = pd_filtered.step(x, r - position[k], CONTROLLER)
        target.hold(u)
    bare = joint_of({**LINEAR})
    plain = simulate(reference, 1000.0, plant.coefficients(bare.values), CONTROLLER).position
    assert relative_rms(position, run.position) < 0.5 * relative_rms(plain, run.position)
