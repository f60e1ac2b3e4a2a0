"""Frictions, a load and inertia in the torque that a model lacks along a motion."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller_node.transfer_function import TransferFunction
from fjr_interface.experiment import RecordDescription
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from fjr_records.records import Record, RecordSet
from fjr_sim_node.plant import coefficients
from fjr_sim_node.simulation.closed_loop import simulate_law
from gap_diagnosis.any_record import diagnose, investigate
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.starts.seen_together import LOADS, Seen, lacked, load_parameters, solved

EVERY = ("coulomb_friction", "viscous_friction", "load_friction", *LOADS)
BARE = Model.nominal(datasheet({"jm": 2.0}, "joint"))


def seen(inertia=0.0, coulomb=0.0, viscous=0.0, of_load=0.0, load=None, noise=0.0, drag=0.0):
    """Return what is seen of a joint that has more than the bare model; the load by its angle."""
    stamps = np.arange(4000) / 100.0
    angle = 1.2 * np.sin(0.9 * stamps) + 0.5 * np.sin(2.3 * stamps + 1.0)
    velocity, acceleration = np.gradient(angle) * 100.0, np.gradient(np.gradient(angle)) * 1e4
    rows = np.abs(velocity) > 0.2
    angle, velocity, acceleration = angle[rows], velocity[rows], acceleration[rows]
    carried = np.zeros(angle.size) if load is None else load(angle)
    friction = (coulomb + of_load * np.abs(carried)) * np.sign(velocity) + viscous * velocity
    friction += drag * velocity * np.abs(velocity)
    missing = -inertia * acceleration - friction + carried
    missing += noise * np.random.default_rng(3).standard_normal(angle.size)
    return Seen(BARE, angle, velocity, acceleration, missing)


SIZES = st.floats(0.1, 10.0)


@settings(max_examples=40, deadline=None)
@given(SIZES, SIZES, SIZES, st.floats(-3.0, 3.0), st.floats(-1.5, 4.0))
def test_friction_gravity_and_inertia_are_seen_as_they_are(
    coulomb, viscous, gravity, direction, inertia
):
    joint = seen(inertia, coulomb, viscous, load=lambda q: -gravity * np.sin(q + direction))
    names, model = joint.together(EVERY)[0]
    assert set(names) == {"coulomb_friction", "viscous_friction", "gravity"}
    assert names[-1] == "gravity"
    found = {name: model.effects[name] for name in model.effects if name.split(".")[0] in names}
    assert found["coulomb_friction.motor_nm"] == pytest.approx(coulomb, rel=1e-4)
    assert found["viscous_friction.motor_nm_s_rad"] == pytest.approx(viscous, rel=1e-4)
    assert found["gravity.torque_nm"] == pytest.approx(gravity, rel=1e-4)
    assert math.cos(found["gravity.angle_rad"] - direction) == pytest.approx(1.0, abs=1e-6)
    assert model.plant["jm"] == pytest.approx(2.0 + inertia, rel=1e-4)


def test_friction_under_load_is_told_from_that_of_the_motor():
    joint = seen(0.3, 1.0, 0.5, of_load=0.2, load=lambda q: -8.0 * np.sin(q))
    names, model = joint.together(EVERY)[0]
    assert names == ("coulomb_friction", "viscous_friction", "load_friction", "gravity")
    assert model.effects["load_friction.coefficient"] == pytest.approx(0.2, rel=0.2)
    without = tuple(name for name in EVERY if name != "load_friction")
    assert "load_friction" not in joint.together(without)[0][0]


def test_the_frictions_of_every_joint_are_tried_beside_rarer_ones_and_in_place_of_each_other():
    """Along moves of one speed friction is one number, whichever law makes it."""
    joint = seen(0.3, 1.0, 0.5, of_load=0.2, load=lambda q: -8.0 * np.sin(q))
    sets = [names for names, _ in joint.together(EVERY)]
    plain = ("coulomb_friction", "viscous_friction", "gravity")
    assert sets[0] != plain and plain in sets
    fan = seen(drag=0.5, load=lambda q: -8.0 * np.sin(q))
    every = (*EVERY, "quadratic_friction")
    models = [model.effects for names, model in fan.together(every) if names == plain]
    sizes = ("coulomb_friction.motor_nm", "viscous_friction.motor_nm_s_rad")
    assert [[bool(model.get(size)) for size in sizes] for model in models] == [
        [False, True],
        [True, False],
    ]


def test_the_plainest_load_that_does_as_well_is_taken_and_none_where_there_is_none():
    held = seen(0.1, 1.0, 0.5, load=lambda q: 0.4 + 0.0 * q, noise=0.05)
    assert [names[-1] for names, _ in held.together(EVERY)] == ["torque_bias"]
    free = seen(0.1, 1.0, 0.5, noise=0.05)
    assert [names for names, _ in free.together(EVERY)] == [
        ("coulomb_friction", "viscous_friction")
    ]
    sprung = seen(0.1, 1.0, 0.5, load=lambda q: -3.0 * (q - 0.2), noise=0.05)
    names, model = sprung.together(EVERY)[0]
    assert names[-1] == "external_spring"
    assert model.effects["external_spring.stiffness_nm_rad"] == pytest.approx(3.0, rel=0.02)
    assert model.effects["external_spring.rest_rad"] == pytest.approx(0.2, rel=0.1)


@pytest.mark.parametrize("stiffness", [0.0, 2.0])
def test_a_spring_that_hardens_is_seen_where_a_linear_one_is_looked_for(stiffness):
    def pull(q):
        return -(stiffness + 3.0 * (q - 0.1) ** 2) * (q - 0.1)

    hard = seen(0.1, 1.0, 0.5, load=pull, noise=0.05)
    asked = [effect for effect in EVERY if effect != "hardening_spring"]
    names, model = hard.together(asked)[0]
    assert names[-1] == "hardening_spring"
    assert model.effects["hardening_spring.cubic_nm_rad3"] == pytest.approx(3.0, rel=0.02)
    assert model.effects["hardening_spring.stiffness_nm_rad"] == pytest.approx(stiffness, abs=0.1)
    assert model.effects["hardening_spring.rest_rad"] == pytest.approx(0.1, abs=0.01)
    without = [effect for effect in asked if effect != "external_spring"]
    assert hard.together(without)[0][0][-1] != "hardening_spring"


def test_one_cause_alone_and_what_pushes_are_left_to_the_usual_search():
    assert seen(0.1, viscous=0.5, noise=0.01).together(EVERY) == []
    assert seen(0.1, -1.0, 0.5, noise=0.01).together(("coulomb_friction", "viscous_friction")) == []
    assert seen(-2.5, 1.0, 0.5, noise=0.01).together(EVERY) == []  # no inertia would be left
    assert load_parameters("external_spring", [-1.0, 0.0]) is None
    assert load_parameters("hardening_spring", [-1.0, 0.0, 1.0, 0.0]) is None


def test_a_datasheet_lacks_a_friction_that_it_has_nowhere():
    bare = datasheet({"jm": 2.0}, "joint")
    assert lacked(bare) == {"coulomb_friction", "viscous_friction"}
    assert lacked(datasheet({"jm": 2.0, "fsm": 1.0}, "joint")) == {"viscous_friction"}
    axis = {"jm": 1.0, "j": 1.0, "k0": 100.0, "fsm": 0.1, "fv": 0.2}
    assert lacked(datasheet(axis, "axis")) == frozenset()


def test_columns_of_any_size_are_solved():
    columns = [np.array([1e-9, 2e-9, 1e-9]), np.array([1e9, 0.0, -1e9]), np.zeros(3)]
    sizes, left = solved(columns, 3e9 * columns[0] + 2e-9 * columns[1])
    assert sizes[:2] == pytest.approx([3e9, 2e-9]) and left == pytest.approx(0.0, abs=1e-9)


def moved(motion: np.ndarray, inertia, coulomb, viscous, gravity) -> np.ndarray:
    """Return the torque of a motion (angle, speed, acceleration) by inverse dynamics."""
    angle, speed, acceleration = motion
    friction = coulomb * np.tanh(speed / 2e-3) + viscous * speed
    return inertia * acceleration + friction + gravity * np.sin(angle)


def test_a_robot_joint_whose_datasheet_is_an_inertia_alone_is_found_whole(tmp_path):
    """Two Fourier trajectories that repeat, of which each cause alone leaves most unexplained."""
    truth = {
        "coulomb_friction.motor_nm": 0.9,
        "viscous_friction.motor_nm_s_rad": 1.6,
        "gravity.torque_nm": 4.0,
    }
    rate, rng, files = 125.0, np.random.default_rng(4), []
    stamps = np.arange(int(20.0 * rate)) / rate
    for number in range(2):
        motion = np.zeros((3, stamps.size))
        for line in range(1, 6):
            w, turn = 0.2 * np.pi * line, rng.normal() * 0.6 / line
            turn = turn * np.exp(1j * (0.2 * np.pi * line * stamps + rng.uniform(0, 6.3)))
            motion += np.array([turn.imag, (1j * w * turn).imag, (-w * w * turn).imag])
        torque = moved(motion, 1.4, *truth.values())
        torque += 0.02 * np.std(torque) * rng.standard_normal(torque.size)
        seen_angle = motion[0] + 2e-5 * rng.standard_normal(stamps.size)
        files.append(Path(tmp_path) / f"run{number}.csv")
        table = np.column_stack([stamps, motion[0], seen_angle, torque])
        head = {"delimiter": ",", "header": "t,r,q,tau", "comments": ""}
        np.savetxt(files[-1], table, fmt="%.9g", **head)
    columns = parse_map(["time=t", "reference=r:1", "position=q:1", "torque=tau:1"])
    import_files(files, tmp_path / "bags", ImportOptions(columns))
    found = diagnose(tmp_path / "bags", datasheet({"jm": 1.1}, "joint"))
    assert {name.split(".")[0] for name in truth} <= set(found.effects)
    for name, size in truth.items():
        assert found.parameters[name].value == pytest.approx(size, rel=0.08)
    assert found.parameters["jm"].value == pytest.approx(1.4, rel=0.08)


def driven(torque: np.ndarray, number: int, rate_hz: float, motor: dict[str, float]) -> Record:
    """Return the record of a motor that a torque drives, with no loop about it."""
    nothing = TransferFunction.of([0.0], [1.0])
    rest = np.zeros(torque.size)
    run = simulate_law(rest, rate_hz, coefficients(motor), nothing, command=torque)
    described = RecordDescription.of(
        "motor", sample_rate_hz=rate_hz, level=0, levels=1, realization=number, realizations=2
    )
    position = np.round(run.position / 1e-3) * 1e-3
    return Record(f"run_{number}", described, None, torque, position, None)


def test_a_motor_that_would_run_away_without_the_friction_that_its_datasheet_lacks_is_searched():
    """Of such a motor the inertia alone misses many times the motion, which ends no search."""
    rng, rate_hz, made = np.random.default_rng(5), 200.0, []
    motor = {"jm": 7e-4, "j": 0.0, "fs": 0.0, "fsm": 0.045, "fv": 0.0, "fvm": 7e-4,
             "k0": math.inf, "k1": 0.0}  # fmt: skip
    for number in range(2):
        steps = np.repeat(rng.uniform(-0.05, 0.05, 50), int(0.2 * rate_hz))
        made.append(driven(steps, number, rate_hz, motor))
    records = RecordSet("motor", rate_hz, tuple(made))
    names = ("coulomb_friction", "viscous_friction", "torque_bias", "delay")
    bare = datasheet({"jm": 7.5e-4}, "motor")
    found = investigate(records, bare, effects=names)
    assert found.diagnosis.steps[1].nrmse_position > 5.0
    assert found.diagnosis.effects == ["coulomb_friction"]
    assert found.diagnosis.steps[-1].nrmse_position < 0.02
    size = found.diagnosis.parameters["coulomb_friction.motor_nm"]
    assert size.value == pytest.approx(motor["fsm"], rel=0.05)


def test_friction_that_falls_is_seen_only_where_it_is():
    stamps = np.arange(8000) / 100.0
    angle = 1.2 * np.sin(0.9 * stamps) + 0.5 * np.sin(2.3 * stamps + 1.0)
    velocity, acceleration = np.gradient(angle) * 100.0, np.gradient(np.gradient(angle)) * 1e4
    rows = np.abs(velocity) > 0.05
    angle, velocity, acceleration = angle[rows], velocity[rows], acceleration[rows]
    for level, there in ((0.0, False), (0.6, True)):
        falls = level * np.exp(-((velocity / 0.25) ** 2))
        missing = -(1.0 + falls) * np.sign(velocity) - 0.5 * velocity - 0.3 * acceleration
        missing += 0.02 * np.random.default_rng(1).standard_normal(missing.size)
        found = Seen(BARE, angle, velocity, acceleration, missing).falling(
            (*EVERY, "stribeck_friction_motor")
        )
        assert bool(found) == there
    names, model = found[0]
    assert names == ("coulomb_friction", "viscous_friction", "stribeck_friction_motor")
    assert model.effects["stribeck_friction_motor.torque_nm"] == pytest.approx(0.6, rel=0.3)
    assert model.effects["stribeck_friction_motor.velocity_rad_s"] == pytest.approx(0.25, rel=0.5)
    assert model.effects["coulomb_friction.motor_nm"] == pytest.approx(1.0, rel=0.1)
    assert Seen(BARE, angle, velocity, acceleration, missing).falling(EVERY) == []


def test_no_friction_is_below_zero_and_of_two_that_do_the_same_the_plainer_stays():
    sizes, _ = solved([np.array([1.0, 0.0]), np.array([0.0, 1.0])], np.array([-1.0, -2.0]), 1)
    assert sizes == pytest.approx([0.0, -2.0])
    held = seen(0.1, 1.0, 0.5, load=lambda q: 0.4 + 0.0 * q, noise=0.01)
    assert held.together(EVERY)[0][0] == ("coulomb_friction", "viscous_friction", "torque_bias")
