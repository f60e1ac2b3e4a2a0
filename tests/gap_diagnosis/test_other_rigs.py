"""Rigs that are not the paper's: other controllers or none known, rigid axis, second encoder."""

import math
from dataclasses import replace

import numpy as np
import pytest
from effect_rig import relative_rms
from gap_cases import fitter_of, found_in, simulate_case, write_bags

from controller_node import pd_filtered
from fjr_interface.bags.signals import SignalMap
from fjr_records.periodic import read_experiment
from fjr_sim_node import effects, plant
from fjr_sim_node.plant import PLANT
from fjr_sim_node.simulation.simulator import SIMULATOR
from fjr_sim_node.theory import linear
from gap_diagnosis.gates.gate_checks import check_gates
from gap_diagnosis.model.prediction import crossover_hz, lead, observer
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.simulated_rig import Simulator
from gap_diagnosis.report.updated_parameters import simulator_values
from gap_diagnosis.starts.catalogue import catalogue
from gap_diagnosis.starts.scales import Scales
from gap_diagnosis.starts.search_space import starts
from gap_diagnosis.starts.seen_together import LACKED, LAWS, LOADS
from gap_diagnosis.where.residual_map import residual_map
from gap_diagnosis.which.equivalents import partners

NOMINAL = PLANT.defaults()
LEAD_WITH_INTEGRATOR = {
    "kind": "transfer_function",
    "numerator": [1650.0, -3270.0, 1620.5],
    "denominator": [1.0, -1.96, 0.96],
    "torque_limit_nm": None,
}
RIGID = {"k0": math.inf, "k1": 0.0}
HELD = {"j": math.inf}
SMALL = {"levels_rad": (3e-3, 1e-2)}
ANY_SCALES = Scales(100.0, 5.0, 0.05, 0.05, 1e-3, 50.0, 0.5, 300.0)


def changed(recorded, **by_name):
    """Return the record with attributes of all realizations changed by functions of them."""
    bags = (
        replace(r, **{name: change(r) for name, change in by_name.items()})
        for r in recorded.realizations
    )
    return replace(recorded, realizations=tuple(bags))


def unknown_controller(recorded):
    return changed(
        recorded, experiment=lambda r: r.experiment.model_copy(update={"controller": None})
    )


def without_reference(recorded):
    return changed(recorded, reference=lambda _: None)


@pytest.fixture(scope="module")
def backlash():
    return simulate_case({"backlash.half_gap_rad": 1.5e-3}, seed=5, **SMALL)


@pytest.mark.parametrize("losing", [unknown_controller, without_reference])
def test_the_effect_is_found_without_controller_or_reference(backlash, losing):
    recorded = losing(backlash.recorded)
    told, fitted = found_in(recorded, NOMINAL, "backlash", "delay", "transmission_damping")
    found, fitter = fitted.found, fitted.fitter
    assert found.best.effects == ("backlash",) and told.verdict == "effect"
    assert found.best.model.effects["backlash.half_gap_rad"] == pytest.approx(1.5e-3, rel=0.02)
    assert fitter.misfit(found.best) < 1.5
    for name, value in backlash.truth.plant.items():
        assert found.best.model.plant[name] == pytest.approx(value, rel=0.05)


def test_prediction_errors_of_the_true_rig_are_noise_and_their_noise_is_known(backlash):
    recorded = unknown_controller(backlash.recorded)
    simulator = Simulator(recorded)
    noise = simulator.noise(backlash.bare)  # of a model that is not true
    left = [
        np.mean(
            residual_map(recorded, noise, simulator.signals(model)[0]).signals["position"].sigma
            ** 2
        )
        for model in (backlash.truth, backlash.bare)
    ]
    assert 0.8 < left[0] < 1.3 and left[1] > 100.0


def test_the_gates_say_what_a_prediction_loses(backlash):
    for losing, word in ((unknown_controller, "controller"), (without_reference, "reference")):
        recorded = losing(backlash.recorded)
        report = check_gates(recorded, backlash.bare)
        assert not report.failures
        assert "controller identity" not in [gate.name for gate in report.gates]
        (note,) = [note for note in report.notes if "observer" in note]
        assert note.startswith(f"The {word} is not known") and "Lost are" in note


def test_the_observer_is_a_lead_that_crosses_over_where_it_says():
    frequency, gain, rate = 4.0, 120.0, 1000.0
    law = lead(gain, frequency, rate)
    z = np.exp(2j * np.pi * np.array([frequency]) / rate)
    value = np.polyval(law.position, z) / np.polyval(law.denominator, z)
    assert np.abs(value[0]) == pytest.approx(gain, rel=1e-9)
    assert np.degrees(np.angle(value[0])) == pytest.approx(54.9, abs=0.1)


def test_the_observer_takes_its_gain_from_the_record(backlash):
    recorded = unknown_controller(backlash.recorded)
    assert crossover_hz(recorded) == pytest.approx(4.975)
    law = observer(recorded)
    z = np.exp(2j * np.pi * crossover_hz(recorded) / 1000.0)
    gain = np.abs(np.polyval(law.position, z) / np.polyval(law.denominator, z))
    inertia = NOMINAL["jm"] + NOMINAL["j"]
    of_inertia = inertia * (2 * np.pi * crossover_hz(recorded)) ** 2
    assert of_inertia < gain < 3.0 * of_inertia  # friction adds to it


def test_bags_without_reference_or_description_are_read(tmp_path, backlash):
    small = replace(backlash.recorded, realizations=backlash.recorded.realizations[2:])
    folder = write_bags(replace(backlash, recorded=small), tmp_path / "bags")
    whole = read_experiment(folder)
    assert whole.repeatable
    bare = read_experiment(folder, SignalMap.parse(["reference=none"]))
    assert not bare.repeatable
    for a, b in zip(whole.realizations, bare.realizations, strict=True):
        assert b.reference is None and np.array_equal(a.torque, b.torque)


def test_a_rig_with_another_controller_is_diagnosed():
    case = simulate_case(
        {"transmission_damping.nm_s_rad": 0.5}, seed=4, controller=LEAD_WITH_INTEGRATOR, **SMALL
    )
    report = check_gates(case.recorded, Model.nominal(NOMINAL))
    assert "controller identity" in [gate.name for gate in report.gates if gate.passed]
    _, fitted = found_in(case.recorded, NOMINAL, "transmission_damping", "backlash", "delay")
    found, fitter = fitted.found, fitted.fitter
    assert found.best.effects == ("transmission_damping",)
    assert fitter.misfit(found.best) < 1.5


@pytest.mark.parametrize("times", [1e-6, 1e3])
def test_a_rig_of_other_torques_is_diagnosed_alike(backlash, times):
    """Nothing in fits and judgement has the size of the paper's rig: a wrist, or a crane."""
    law = pd_filtered.CONTROLLER.check({"p": 200.0 * times, "d": 60.0 * times})
    case = simulate_case(
        {"backlash.half_gap_rad": 1.5e-3}, seed=5, **SMALL, controller=pd_filtered.describe(law),
        plant={name: times * value for name, value in backlash.truth.plant.items()},
    )  # fmt: skip
    named = ("backlash", "dead_band", "torque_bias")
    one, other = (
        found_in(recorded, {name: factor * value for name, value in NOMINAL.items()}, *named)[1]
        for recorded, factor in ((backlash.recorded, 1.0), (case.recorded, times))
    )
    best, likewise = one.found.best, other.found.best
    assert likewise.effects == best.effects == ("backlash",)
    assert likewise.model.effects == pytest.approx(best.model.effects, rel=1e-6)
    for step, same in zip(one.found.steps, other.found.steps, strict=True):
        assert other.fitter.misfit(same) == pytest.approx(one.fitter.misfit(step), rel=1e-4)


def test_a_rigid_axis_is_one_body():
    values = {**NOMINAL, **RIGID}
    rigid = Model.nominal(values)
    assert rigid.rigid and set(rigid.plant) == {"jm", "fsm", "fvm"}
    assert rigid.plant["jm"] == values["jm"] + values["j"]
    stiff = Model.nominal({**NOMINAL, "k0": 1e7, "k1": 0.0})
    reference = simulate_case(seed=1, levels_rad=(1e-2,), realizations=1).recorded
    (near, far), (torque, other) = zip(
        *(Simulator(reference).signals(model) for model in (rigid, stiff)), strict=True
    )
    assert relative_rms(near, far) < 1e-3 and relative_rms(torque, other) < 1e-2
    frequency = np.linspace(0.5, 50.0, 100)
    assert np.allclose(
        linear.g0(values, frequency, 1000.0),
        linear.g0({**NOMINAL, "k0": 1e8}, frequency, 1000.0),
        rtol=1e-3,
    )


@pytest.mark.parametrize(
    "effect",
    [
        {"stribeck_friction_motor.torque_nm": 2.0, "stribeck_friction_motor.velocity_rad_s": 0.05},
        {"presliding_friction.motor_rad": 1e-3},
        {"quadratic_friction.motor_nm_s2_rad2": 1.0},
        {"delay.time_s": 5e-4},
        {"gravity.torque_nm": 12.0, "gravity.angle_rad": 1.0},
    ],
    ids=lambda effect: next(iter(effect)),
)
def test_motor_side_effects_of_a_rigid_axis_are_found(effect):
    case = simulate_case(effect, seed=7, plant=RIGID, **SMALL)
    name = next(iter(effect)).split(".")[0]
    _, fitted = found_in(case.recorded, {**NOMINAL, **RIGID}, name, "torque_bias", "cogging")
    found, fitter = fitted.found, fitted.fitter
    assert found.best.effects == (name,)
    assert fitter.misfit(found.best) < 1.5
    for parameter, value in effect.items():
        assert found.best.model.effects[parameter] == pytest.approx(value, rel=0.05)
    assert not any(".link_" in parameter for parameter in found.best.space.effects)


def test_a_held_link_stays_where_it_is():
    held, heavy = (Model.nominal({**NOMINAL, **link}) for link in (HELD, {"j": 1e7}))
    reference = simulate_case(seed=1, levels_rad=(1e-2,), realizations=1).recorded
    (near, far), (torque, other) = zip(
        *(Simulator(reference).signals(model) for model in (held, heavy)), strict=True
    )
    assert relative_rms(near, far) < 1e-6 and relative_rms(torque, other) < 1e-6
    assert simulator_values(held.plant) == {**NOMINAL, **HELD, "fs": 0.0, "fv": 0.0}
    frequency = np.linspace(0.5, 50.0, 100)
    a, b = linear.state_space({**NOMINAL, **HELD})
    s = 2j * np.pi * frequency
    response = np.array([np.linalg.solve(each * np.eye(4) - a, b)[2] for each in s])
    own = 1.0 / (NOMINAL["jm"] * s**2 + NOMINAL["fvm"] * s + NOMINAL["k0"])
    assert np.allclose(response, own, rtol=1e-12)


@pytest.mark.parametrize(
    "effect",
    [
        {"hysteresis.torque_nm": 1.0, "hysteresis.displacement_rad": 5e-4},
        {"stribeck_friction_motor.torque_nm": 2.0, "stribeck_friction_motor.velocity_rad_s": 0.05},
        {"delay.time_s": 5e-4},
    ],
    ids=lambda effect: next(iter(effect)),
)
def test_effects_of_drive_and_transmission_are_found_before_a_held_link(effect):
    case = simulate_case(effect, seed=7, plant=HELD, **SMALL)
    name = next(iter(effect)).split(".")[0]
    _, fitted = found_in(case.recorded, {**NOMINAL, **HELD}, name, "torque_bias", "cogging")
    found, fitter = fitted.found, fitted.fitter
    assert found.best.effects == (name,)
    assert fitter.misfit(found.best) < 1.5
    for parameter, value in effect.items():
        assert found.best.model.effects[parameter] == pytest.approx(value, rel=0.06)
    possible = set(catalogue({**found.best.model.plant}))
    assert not possible & {"stribeck_friction_link", "extra_mode", "gravity", "cable"}
    assert {"hysteresis", "backlash", "load_friction", "quadratic_friction"} <= possible


def test_drag_of_motor_and_of_transmission_are_one_before_a_held_link():
    case = simulate_case({}, seed=7, plant={**HELD, "fvm": 4.0}, **SMALL)
    nominal = {**NOMINAL, **HELD, "fvm": 0.0}
    drags = ("viscous_friction", "transmission_damping")
    told, _ = found_in(case.recorded, nominal, *drags, "delay")
    (either,) = told.equivalent
    assert sorted(either) == sorted(drags)
    (size,) = (told.parameters[n] for n in told.parameters if n.split(".")[0] in drags)
    assert size.value == pytest.approx(4.0, rel=0.05)
    assert partners(["viscous_friction"], set(drags), nominal) == ["viscous_friction"]
    assert partners(["viscous_friction"], set(drags), {"jm": 0.2, "k0": 1e3}) == sorted(drags)
    assert partners(["viscous_friction"], set(drags), {"jm": 0.2}) == ["viscous_friction"]


def test_effects_of_transmission_and_link_are_not_looked_for_on_a_rigid_axis():
    case = simulate_case(seed=7, plant=RIGID, **SMALL)
    nominal = {**NOMINAL, **RIGID}
    fitted = {e.identifier for e in effects.CATALOGUE if e.starts and not e.on_request}
    assert fitted - set(catalogue(Model.nominal(nominal).plant)) == {
        "stribeck_friction_link", "backlash", "piecewise_stiffness", "hysteresis",
        "transmission_damping", "kinematic_error", "extra_mode",
        "coulomb_friction", "viscous_friction", "asymmetric_stiffness", "cubic_stiffness",
    }  # fmt: skip
    fitter = fitter_of(case.recorded, nominal)
    refit = fitter.refit()
    assert set(refit.model.plant) == {"jm", "fsm", "fvm"}
    assert fitter.misfit(refit) < 1.3


@pytest.mark.parametrize("axis", [{}, RIGID], ids=["flexible", "rigid"])
@pytest.mark.parametrize(("kind", "motor", "link"), [
    ("coulomb_friction", "fsm", "fs"), ("viscous_friction", "fvm", "fv"),
])  # fmt: skip
def test_friction_that_the_nominal_lacks_is_a_cause(axis, kind, motor, link):
    """The rig has the friction, its datasheet says zero."""
    case = simulate_case({}, seed=7, plant=axis, **SMALL)
    nominal = {**NOMINAL, **axis, motor: 0.0, link: 0.0}
    _, fitted = found_in(case.recorded, nominal, kind, "torque_bias", "quadratic_friction")
    found, fitter = fitted.found, fitted.fitter
    assert found.best.effects == (kind,)
    assert fitter.misfit(found.best) < 1.5
    fitted = {**found.best.model.plant, **found.best.model.effects}
    own = simulator_values(fitted)
    total = own[motor] + own[link]
    assert total == pytest.approx(case.rig[motor] + case.rig[link], rel=0.05)
    assert not set(own) & set(effects.EFFECTS[kind].names)


def test_a_cubic_stiffness_that_the_nominal_lacks_is_a_cause():
    """The rig's spring stiffens, its datasheet has it linear."""
    case = simulate_case({}, seed=7, **SMALL)
    nominal = {**NOMINAL, "k1": 0.0}
    assert "cubic_stiffness" in catalogue(nominal) and "cubic_stiffness" not in catalogue(NOMINAL)
    _, fitted = found_in(
        case.recorded, nominal, "cubic_stiffness", "piecewise_stiffness", "torque_bias"
    )
    found, fitter = fitted.found, fitted.fitter
    assert found.best.effects == ("cubic_stiffness",)
    assert fitter.misfit(found.best) < 1.5
    own = simulator_values({**found.best.model.plant, **found.best.model.effects})
    assert own["k1"] == pytest.approx(case.rig["k1"], rel=0.05)


@pytest.mark.parametrize(
    ("rig", "goes_with"), [("linear_axis", "of_a_turn"), ("swings_free", "of_command")]
)
def test_what_an_effect_goes_with_stands_in_its_entry(monkeypatch, rig, goes_with):
    assert "backlash" in catalogue(NOMINAL, **{rig: True})
    entry = replace(effects.EFFECTS["backlash"], **{goes_with: True})
    monkeypatch.setitem(effects.EFFECTS, "backlash", entry)
    assert "backlash" in catalogue(NOMINAL)
    assert "backlash" not in catalogue(NOMINAL, **{rig: True})


def test_loads_and_frictions_that_are_seen_together_are_those_of_the_table():
    assert LOADS == ("torque_bias", "gravity", "external_spring", "hardening_spring")
    assert LACKED == ("coulomb_friction", "viscous_friction")
    assert [name.split(".")[0] for name in LAWS] == [*LACKED, "quadratic_friction"]
    of_command = {e.identifier for e in effects.CATALOGUE if e.of_command}
    of_drive = {e.identifier for e in effects.CATALOGUE if e.acts_on == "drive"}
    assert of_drive - of_command == {"torque_bias", "cogging"} and of_command < of_drive


def test_weight_on_a_linear_axis_is_a_constant_force():
    carriage = {"jm": 95.0}
    turning, sliding = (set(catalogue(carriage, linear_axis=slides)) for slides in (False, True))
    assert turning - sliding == {"gravity"} and "torque_bias" in sliding


def test_one_side_that_has_friction_is_not_offered_it_again():
    assert "coulomb_friction" not in catalogue(NOMINAL)
    points = starts("coulomb_friction", ANY_SCALES, nominal={**NOMINAL, "fs": 0.0})
    assert points and all(set(point) == {"coulomb_friction.link_nm"} for point in points)
    assert "transmission_stiffness" not in catalogue(NOMINAL)
    assert "transmission_stiffness" in catalogue({"jm": 0.5, "fsm": 1.0, "fvm": 1.0})


def test_a_transmission_that_yields_is_found_where_the_nominal_is_rigid():
    case = simulate_case({}, seed=7, plant={"k1": 0.0}, **SMALL)
    nominal = {**NOMINAL, **RIGID}
    _, fitted = found_in(case.recorded, nominal, "transmission_stiffness", "delay", "torque_bias")
    found, fitter = fitted.found, fitted.fitter
    assert found.best.effects == ("transmission_stiffness",)
    assert fitter.misfit(found.best) < 1.5
    own = simulator_values({**found.best.model.plant, **found.best.model.effects})
    for name in ("jm", "j", "k0"):
        assert own[name] == pytest.approx(case.rig[name], rel=0.05), name


def test_the_updated_simulation_of_a_rigid_axis_is_rigid():
    own = simulator_values({"jm": 0.5, "fsm": 2.0, "fvm": 1.0, "gravity.torque_nm": 3.0})
    assert own["k0"] == math.inf and own["gravity.torque_nm"] == 3.0
    sums = plant.rigid_sums(SIMULATOR.check(own))
    assert sums == pytest.approx({"jm": 0.5, "fsm": 2.0, "fvm": 1.0}, rel=1e-5)
