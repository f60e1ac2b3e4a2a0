"""The MuJoCo model against this product's own simulation, effect by effect, in the paper's loop."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from effect_rig import CONTROLLER, axis, moderate, multisine_reference, relative_rms

from controller_node import pd_filtered
from fjr_export.joint import Joint
from fjr_export.mjcf import mujoco_model
from fjr_export.targets import MuJoCoJoint
from fjr_export.treatments import MJCF
from fjr_export.urdf import urdf
from fjr_kit.errors import InputError
from fjr_sim_node import SIMULATOR, effects, plant
from fjr_sim_node.simulation.closed_loop import simulate

pytest.importorskip("mujoco", reason="no MuJoCo here")

SAMPLES = 800
FRICTIONLESS = {"fs": 0.0, "fsm": 0.0}
TOLERANCE = {"native": 0.012, "equivalent": 0.08}
"""Rms error of the motor position over its rms, in closed loop; at 2 mrad, where the motor sticks,
it is 0.002 to 0.007 of native effects, by how long MuJoCo takes to stick."""


def joint_of(values: dict) -> Joint:
    return Joint(SIMULATOR.check(values), 1000.0, "test.yaml")


def played(joint: Joint, reference: np.ndarray) -> np.ndarray:
    target = MuJoCoJoint.of_mjcf(mujoco_model(joint))
    target.begin(0.0, 0.0)
    x, position = 0.0, np.empty(reference.size)
    for k, r in enumerate(reference.tolist()):
        position[k] = target.position()
        x, u = pd_filtered.step(x, r - position[k], CONTROLLER)
        target.hold(u)
    return position


def simulated(joint: Joint, reference: np.ndarray) -> np.ndarray:
    p, e = plant.coefficients(joint.values), effects.coefficients(joint.values)
    return simulate(reference, 1000.0, p, CONTROLLER, None, e).position


def test_every_effect_of_the_catalogue_is_treated():
    assert set(MJCF) == set(effects.EFFECTS)


@pytest.mark.parametrize("effect", [n for n, t in MJCF.items() if t.kind != "refused"])
def test_each_effect_moves_the_joint_as_our_simulation_does(effect: str):
    joint = joint_of({**moderate(effect), **axis(effect)})
    reference = multisine_reference(2e-3)[:SAMPLES]
    error = relative_rms(played(joint, reference), simulated(joint, reference))
    assert error < TOLERANCE[MJCF[effect].kind], error


def test_a_joint_that_slides_moves_as_one_that_turns_by_the_same_numbers():
    cogging = {"cogging.amplitude_nm": 0.5, "cogging.cycles_per_turn": 40.0}
    turning = joint_of({**moderate("coulomb_friction"), **cogging})
    sliding = replace(turning, linear=True)
    kinds = {one.get("type") for one in ET.fromstring(mujoco_model(sliding).xml).iter("joint")}
    assert kinds >= {"slide"} and "hinge" not in kinds
    reference = multisine_reference(2e-3)[:SAMPLES]
    assert relative_rms(played(sliding, reference), played(turning, reference)) < 1e-6
    target = MuJoCoJoint.of_urdf(urdf(sliding), sliding)
    assert target.position() == 0.0
    target.begin(0.0, 0.0)
    target.hold(100.0)
    assert target.position() > 0.0
    moving = ET.fromstring(urdf(sliding)).find("joint")
    assert moving.get("type") == "prismatic" and moving.find("limit").get("lower") is not None


@pytest.mark.parametrize("amplitude", [2e-3, 7e-3])
def test_two_inertias_with_friction_delay_and_lag_agree(amplitude: float):
    values = {**moderate("actuator_lag", "transmission_damping"), "delay.time_s": 3.7e-4}
    joint, reference = joint_of(values), multisine_reference(amplitude)[:SAMPLES]
    assert relative_rms(played(joint, reference), simulated(joint, reference)) < 0.012


@pytest.mark.parametrize("delay", [0.0, 2e-5, 1e-4, 3.7e-4, 1e-3, 1.23e-3])
def test_any_delay_is_exact_without_friction(delay: float):
    joint = joint_of({**FRICTIONLESS, "delay.time_s": delay})
    reference = multisine_reference(7e-3)[:SAMPLES]
    assert relative_rms(played(joint, reference), simulated(joint, reference)) < 2e-4


def test_a_delay_that_is_too_short_is_the_shortest_there_is_and_that_is_said():
    model = mujoco_model(joint_of({"delay.time_s": 1e-7}))
    assert "the least that its time steps allow" in model.notes[0]


def test_effects_beside_one_another_agree():
    together = moderate("backlash", "piecewise_stiffness", "asymmetric_stiffness", "hysteresis",
                        "cogging", "torque_gain", "presliding_friction")  # fmt: skip
    joint = joint_of({**together, "k1": 0.0})
    reference = multisine_reference(7e-3)[:SAMPLES]
    assert relative_rms(played(joint, reference), simulated(joint, reference)) < 0.012


def test_what_cannot_stand_beside_another_is_refused():
    with pytest.raises(InputError, match="cannot express actuator_lag beside a limit of speed"):
        mujoco_model(joint_of(moderate("actuator_lag", "torque_speed_limit")))
    with pytest.raises(InputError, match="cannot express hardening_spring beside external_spring"):
        mujoco_model(joint_of(moderate("hardening_spring", "external_spring")))
