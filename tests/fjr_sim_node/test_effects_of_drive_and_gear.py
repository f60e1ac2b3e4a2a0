"""Later effects of the catalogue, each against an independent formula or a limit case."""

from __future__ import annotations

import math

import numpy as np
import pytest
from effect_rig import (
    APART,
    FRICTIONLESS,
    LINK_HELD,
    PAPER,
    Rig,
    multisine_reference,
    named,
    relative_rms,
    simulate,
)
from scipy.integrate import quad, solve_ivp

from fjr_sim_node import effects, plant
from fjr_sim_node.plant import spring, torques
from fjr_sim_node.simulation import rig

JM, J, FSM, K0, K1 = (PAPER[name] for name in ("jm", "j", "fsm", "k0", "k1"))
FREE_MOTOR = {**APART, **FRICTIONLESS}
TORQUE = 40.0 * np.random.default_rng(3).standard_normal(200)

LUGRE = {"bristle_nm_rad": 6e3, "stribeck_nm": 2.0, "velocity_rad_s": 0.05}


def lugre_motion(torque, step, sigma1):
    """Return the positions of a motor under LuGre friction, z integrated as a state of its own."""

    def slope(t, y):
        _, v, z = y
        fade = math.exp(-((v / 0.05) ** 2))
        level = FSM + 2.0 * fade
        dz = v - 6e3 * abs(v) / level * z
        bending = dz if dz * v > 0.0 else 0.0
        if abs(bending) > 2.0 * abs(v):  # bristles that hold more than a level which has fallen
            bending = 2.0 * v
        return [v, (torque(t) - 6e3 * z - sigma1 * fade * bending) / JM, dz]

    times = np.arange(1, 401) * step
    run = solve_ivp(slope, (0.0, times[-1]), [0.0, 0.0, 0.0], t_eval=times, rtol=1e-9, atol=1e-12,
                    max_step=step)  # fmt: skip
    return run.y[0]


@pytest.mark.parametrize("sigma1", [0.0, 20.0])
def test_lugre_friction_is_that_of_bristles_with_a_state_of_their_own(sigma1):
    step = 1e-3
    held = 9.0 * np.sin(2.0 * math.pi * 7.0 * step * np.arange(400))
    body = Rig({**APART, "fvm": 0.0}, named("lugre_friction", **LUGRE, damping_nm_s_rad=sigma1))
    exact = lugre_motion(lambda t: held[min(int(t / step + 1e-9), 399)], step, sigma1)
    assert relative_rms(body.play(held, step, parts=4)[:, 2], exact) < 2e-3
    assert np.ptp(exact) > 0.01


def test_lugre_friction_without_bristles_is_stribeck_friction():
    lugre = Rig({}, named("lugre_friction", stribeck_nm=2.0, velocity_rad_s=0.05))
    stribeck = Rig({}, named("stribeck_friction_motor", torque_nm=2.0, velocity_rad_s=0.05))
    assert np.array_equal(lugre.play(TORQUE), stribeck.play(TORQUE))


def test_lugre_friction_without_a_stribeck_level_is_presliding_friction():
    lugre = Rig({}, named("lugre_friction", bristle_nm_rad=FSM / 1e-3))
    presliding = Rig({}, named("presliding_friction", motor_rad=1e-3))
    assert np.allclose(lugre.play(TORQUE), presliding.play(TORQUE), rtol=1e-12, atol=1e-15)


def test_bristles_are_a_spring_to_a_small_torque():
    body = Rig({**APART, "fvm": 200.0}, named("lugre_friction", **LUGRE))
    rest = body.hold(0.05, 2.0, parts=200)[2]
    assert rest == pytest.approx(0.05 / 6e3, rel=0.01)


@pytest.mark.parametrize("torque", [-30.0, 30.0])
@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_a_directional_loss_depends_on_which_side_drives(torque, direction):
    e = effects.coefficients(named("directional_loss", forward=0.2, backward=0.05))
    level = torques.motor_level(1.0, direction, 0.0, torque, plant.coefficients(PAPER), e)
    drives = direction * torque < 0.0  # the motor turns against what the transmission asks of it
    assert level == pytest.approx(FSM + (0.2 if drives else 0.05) * 30.0)


def test_a_directional_loss_of_one_size_is_load_friction():
    both = Rig({}, named("directional_loss", forward=0.1, backward=0.1))
    load = Rig({}, named("load_friction", coefficient=0.1))
    assert np.allclose(both.play(TORQUE), load.play(TORQUE), rtol=1e-9, atol=1e-12)


def test_a_gear_that_loses_much_backward_cannot_be_driven_by_its_load():
    """A wound spring drives the motor only if the loss leaves it more than Coulomb friction."""
    for backward, moves in ((0.5, True), (0.9, False)):
        on = named("directional_loss", backward=backward)
        body = Rig({**LINK_HELD, "k1": 0.0}, on).start(th=0.02)  # 30 N m, of which 6 hold
        assert (body.hold(0.0, 0.01)[2] != 0.02) == moves


RIGID = {"k0": math.inf, "fs": 0.0, "fv": 0.0, "fvm": 0.0}


@pytest.mark.parametrize("name", ["load_friction", "directional_loss"])
def test_a_gear_of_a_rigid_axis_carries_half_of_what_the_motor_has_beside_friction(name):
    """Rotor and load have half of the inertia each, so half of the torque goes through the gear."""
    on = {"load_friction": {"coefficient": 0.2}, "directional_loss": {"forward": 0.2}}[name]
    inertia = JM + J
    carried = 0.5 * (40.0 - FSM) / 1.1  # T = (u - FSM - 0.2 T) / 2
    speed = Rig(RIGID, named(name, **on)).hold(40.0, 0.1)[3]
    assert speed == pytest.approx(0.1 * (40.0 - FSM - 0.2 * carried) / inertia, rel=1e-9)
    braking = Rig(RIGID, named(name, **on)).start(vth=2.0).hold(-20.0, 0.01)[3]
    lost = 0.2 * 0.5 * (20.0 + FSM) / 0.9 if name == "load_friction" else 0.0
    assert braking == pytest.approx(2.0 - 0.01 * (20.0 + FSM + lost) / inertia, rel=1e-9)


@pytest.mark.parametrize(("torque", "weight", "sticks"), [
    (0.0, 7.4, True), (0.0, 7.6, False),  # the weight drives: 7.5 N m less a fifth of it are 6
    (17.9, 10.0, True), (18.1, 10.0, False),  # the motor lifts: 10 N m, 2 lost, 6 of Coulomb
])  # fmt: skip
def test_a_gear_of_a_rigid_axis_loses_a_share_of_the_weight(torque, weight, sticks):
    on = named("gravity", torque_nm=weight, angle_rad=0.5 * math.pi)
    on |= named("load_friction", coefficient=0.2)
    assert (Rig(RIGID, on).hold(torque, 0.1)[2] == 0.0) == sticks


@pytest.mark.parametrize("torque", [0.0, 3.0, -3.0])
@pytest.mark.parametrize("first", [
    named("load_friction", coefficient=0.3), named("directional_loss", forward=0.4, backward=0.1),
], ids=["load friction", "directional loss"])  # fmt: skip
@pytest.mark.parametrize("second", [
    {}, named("gravity", torque_nm=6.0, angle_rad=0.4),
    named("presliding_friction", motor_rad=1e-3),
    named("external_spring", stiffness_nm_rad=50.0), named("actuator_lag", time_constant_s=2e-3),
    named("lugre_friction", stribeck_nm=3.0, velocity_rad_s=0.05, bristle_nm_rad=6e3),
], ids=["alone", "gravity", "presliding", "spring", "lag", "lugre"])  # fmt: skip
def test_a_gear_of_a_rigid_axis_makes_no_energy(first, second, torque):
    body = Rig(RIGID, first | second).start(th=-0.01, vth=0.3)
    at_play = 0.1 + abs(body.energy())
    for _ in range(20):  # a lag settles
        body.hold(torque)
    stored = []
    for _ in range(400):
        body.hold(torque)
        stored.append(body.energy() - body.work(torque))
    assert np.diff(stored).max() < 1e-5 * at_play


def test_a_motor_at_limited_voltage_runs_up_to_its_no_load_speed():
    on = named("torque_speed_limit", stall_nm=10.0, no_load_rad_s=4.0)
    states = Rig(FREE_MOTOR, on).play(np.full(400, 50.0))
    t = 1e-3 * np.arange(1, 401)
    assert np.allclose(states[:, 3], 4.0 * -np.expm1(-10.0 * t / (4.0 * JM)), rtol=1e-4)


def test_a_motor_at_limited_voltage_brakes_with_its_stall_torque():
    on = named("torque_speed_limit", stall_nm=10.0, no_load_rad_s=4.0)
    state = Rig(FREE_MOTOR, on).start(vth=3.0).hold(-50.0, 0.01)
    assert state[3] == pytest.approx(3.0 - 10.0 * 0.01 / JM, rel=1e-6)
    below = Rig(FREE_MOTOR, on).start(vth=1.0).hold(5.0, 0.01)
    assert below[3] == pytest.approx(1.0 + 5.0 * 0.01 / JM, rel=1e-6)
    above = Rig(FREE_MOTOR, on).start(vth=5.0).hold(50.0, 0.01)
    assert above[3] == pytest.approx(5.0, rel=1e-9)


@pytest.mark.parametrize("rate", [2e3, 7e3, 1e6])
def test_a_torque_that_slews_is_the_ramp(rate):
    """Speed over JM is the integral of the ramps between the commands, whose order is kept."""
    commands = np.repeat([30.0, -10.0, 5.0, 5.0], 10)
    states = Rig(FREE_MOTOR, named("torque_slew_limit", limit_nm_s=rate)).play(commands)
    fine, parts = [], 1000
    torque = 0.0
    for command in commands:
        for _ in range(parts):
            torque += float(np.clip(command - torque, -rate * 1e-3 / parts, rate * 1e-3 / parts))
            fine.append(torque)
    speed = np.cumsum(fine)[parts - 1 :: parts] * 1e-3 / parts / JM
    assert np.allclose(states[:, 3], speed, atol=2e-3 * np.abs(speed).max())


def test_a_torque_that_slews_now_and_then_is_late_by_the_delay():
    """A free motor under it is at each sample where it was three samples before without delay."""
    commands = np.repeat([30.0, -10.0, 5.0, 5.0], 10)
    slews = named("torque_slew_limit", limit_nm_s=7e4)  # some samples slew, most do not
    at_once = Rig(FREE_MOTOR, slews).play(commands)
    late = Rig(FREE_MOTOR, {**slews, **named("delay", time_s=3e-3)}).play(commands)
    assert np.allclose(late[3:], at_once[:-3], atol=1e-5 * np.abs(at_once).max())
    assert not late[:3].any()


def test_a_dead_band_shortens_every_command():
    shortened = np.sign(TORQUE) * np.maximum(np.abs(TORQUE) - 7.0, 0.0)
    exact = Rig({}, named("load_friction", coefficient=1e-300)).play(shortened)
    assert np.array_equal(Rig({}, named("dead_band", width_nm=7.0)).play(TORQUE), exact)
    assert (shortened == 0.0).any()


def test_a_ripple_of_the_torque_constant_does_the_work_of_its_torque():
    on = named("torque_constant_ripple", amplitude=0.3, cycles_per_turn=9.0, phase_rad=0.4,
               second_ratio=0.5, second_phase_rad=1.0)  # fmt: skip
    states = Rig(FREE_MOTOR, on).play(np.full(300, 6.0), parts=2)

    def given(th):
        angle = 9.0 * th + 0.4
        return 6.0 * (1.0 + 0.3 * (math.sin(angle) + 0.5 * math.sin(2.0 * angle + 1.0)))

    for state in states[99::100]:
        assert 0.5 * JM * state[3] ** 2 == pytest.approx(quad(given, 0.0, state[2])[0], rel=1e-6)
    assert np.array_equal(Rig(FREE_MOTOR, on).play(np.zeros(5)), np.zeros((5, 11)))


def test_an_asymmetric_stiffness_has_its_two_slopes():
    e = effects.coefficients(named("asymmetric_stiffness", relative=0.3))
    p = plant.coefficients(PAPER)
    for twist, slope in ((0.01, 1.3), (-0.01, 0.7)):
        torque = spring.spring_torque(twist, p, e)
        assert torque == pytest.approx(slope * K0 * twist + K1 * twist**3, rel=1e-14)


def test_an_asymmetric_stiffness_swings_half_a_period_on_each_side():
    on = named("asymmetric_stiffness", relative=-0.4)
    body = Rig({**FRICTIONLESS, "k1": 0.0}, on).start(vth=-1.0)
    body.x[1] = JM / J  # no net momentum: the deflection begins to grow
    states = body.play(np.zeros(2000), 1e-4)
    twist = states[:, 0] - states[:, 2]
    crossing = 1e-4 * (1.0 + np.flatnonzero(np.diff(np.sign(twist))))
    reduced = J * JM / (J + JM)
    positive, negative = (math.pi * math.sqrt(reduced / (f * K0)) for f in (0.6, 1.4))
    assert crossing[0] == pytest.approx(positive, abs=2e-4)
    assert crossing[1] - crossing[0] == pytest.approx(negative, abs=2e-4)
    assert crossing[2] - crossing[1] == pytest.approx(positive, abs=2e-4)


def test_limits_that_are_never_reached_change_nothing():
    r = multisine_reference(2e-3)[:1500]
    bare = simulate(r, None).position
    for on in (
        named("torque_slew_limit", limit_nm_s=1e12),
        named("torque_speed_limit", stall_nm=1e9, no_load_rad_s=100.0),
    ):
        assert relative_rms(simulate(r, on).position, bare) < 1e-6


@pytest.mark.parametrize(
    "drive", [{"dead_band.width_nm": 1.0}, {"dead_band.width_nm": 1.0, "delay.time_s": 0.0035}]
)
def test_no_dead_band_swallows_what_is_beside_a_command(drive):
    p = plant.coefficients({**PAPER, **FRICTIONLESS})
    through, bare = rig.at_rest(), rig.at_rest()
    for k in range(50):
        beside = 0.5 * math.sin(0.2 * k)
        rig.hold(through, 0.9, 1e-3, p, effects.coefficients(drive), beside)
        rig.hold(bare, 0.0, 1e-3, p, None, beside)
    assert abs(bare[rig.MOTOR]) > 1e-5
    assert through[rig.MOTOR] == pytest.approx(bare[rig.MOTOR], rel=1e-4)


def test_a_limit_holds_for_command_and_what_is_beside_it_together():
    """Else a limit of next to nothing would leave the motion to an observer alone."""
    p = plant.coefficients({**PAPER, **FRICTIONLESS})
    e = effects.coefficients({"torque_saturation.limit_nm": 0.1})
    state, bare = rig.at_rest(), rig.at_rest()
    for _ in range(50):
        rig.hold(state, 2.0, 1e-3, p, e, 3.0)
        rig.hold(bare, 0.1, 1e-3, p, None)
    assert state[rig.MOTOR] == pytest.approx(bare[rig.MOTOR], rel=1e-4)
