"""Each effect of the catalogue against an independent formula or a limit case."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from effect_rig import (
    APART,
    FRICTIONLESS,
    LINK_HELD,
    MOTOR_HELD,
    PAPER,
    RATE,
    Rig,
    multisine_reference,
    named,
    relative_rms,
    simulate,
)
from paths import DOCS, ROOT
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

from fjr_kit.document_tables import in_step
from fjr_sim_node import effects, plant
from fjr_sim_node.effects import document
from fjr_sim_node.plant import spring, torques
from fjr_sim_node.simulation import rig

JM, J, FSM, FS, FVM, FV, K0, K1 = (
    PAPER[name] for name in ("jm", "j", "fsm", "fs", "fvm", "fv", "k0", "k1")
)


def coasting_distance(friction, inertia, speed):
    """Return how far a body coasts against friction(v), from v dv = -friction dx / inertia."""

    def slope(_t, y):
        return [y[1], -friction(y[1]) / inertia]

    def stop(_t, y):
        return y[1]

    stop.terminal = True
    run = solve_ivp(slope, (0.0, 10.0), [0.0, speed], events=stop, rtol=1e-10, atol=1e-13)
    return run.y[0, -1]


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_stribeck_motor_breaks_away_above_coulomb_and_slides_on_the_curve(sign):
    on = named("stribeck_friction_motor", torque_nm=2.0, velocity_rad_s=0.1)
    stuck = Rig(APART, on).hold(sign * (FSM + 2.0) * (1.0 - 1e-12), 0.1)
    assert not stuck[:4].any()
    assert Rig(APART, on).hold(sign * (FSM + 2.0) * (1.0 + 1e-9), 0.1)[2] * sign > 0.0
    for speed in (0.12, 0.3, 2.0):
        held = FSM + 2.0 * math.exp(-((speed / 0.1) ** 2)) + 50.0 * speed
        body = Rig({**APART, "jm": 0.01, "fvm": 50.0}, on).start(vth=sign * 1.2 * speed)
        state = body.hold(sign * held, 0.1, parts=100)
        assert state[3] == pytest.approx(sign * speed, rel=1e-6)


def test_stribeck_vanishes_at_high_speed():
    on = named("stribeck_friction_motor", torque_nm=2.0, velocity_rad_s=0.01)
    fast, bare = Rig(APART, on).start(vth=5.0), Rig(APART).start(vth=5.0)
    assert fast.hold(0.0)[3] == pytest.approx(bare.hold(0.0)[3], rel=1e-11)


@pytest.mark.parametrize("side", ["motor", "link"])
def test_stribeck_coasting_distance(side):
    on = named(f"stribeck_friction_{side}", torque_nm=3.0, velocity_rad_s=0.1)
    body = Rig(APART, on)
    inertia, level, viscous = (JM, FSM, FVM) if side == "motor" else (J, FS, FV)
    distance = coasting_distance(
        lambda v: level + 3.0 * math.exp(-((v / 0.1) ** 2)) + viscous * v, inertia, 0.5
    )
    state = body.start(**{"vth" if side == "motor" else "vq": 0.5}).hold(0.0, 0.2)
    at = 2 if side == "motor" else 0
    assert state[at] == pytest.approx(distance, rel=1e-5)
    assert state[at + 1] == 0.0


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_stribeck_link_breaks_away_above_coulomb(sign):
    on = named("stribeck_friction_link", torque_nm=2.0)
    level = brentq(lambda d: K0 * d + K1 * d**3 - FS - 2.0, 0.0, 1.0)
    below, above = sign * level * (1.0 - 1e-8), sign * level * (1.0 + 1e-8)
    assert Rig(MOTOR_HELD, on).start(q=below).hold(0.0, 0.1)[0] == below
    assert Rig(MOTOR_HELD, on).start(q=above).hold(0.0, 0.1)[0] * sign < above * sign


def test_asymmetric_coulomb_is_a_torque_bias_while_sliding():
    torque = 20.0 * np.sin(2 * np.pi * 2.0 * np.arange(100) / RATE) + 15.0
    asymmetric = Rig({}, named("asymmetric_friction", coulomb_nm=1.5)).start(vth=0.5, vq=0.5)
    biased = Rig({}, named("torque_bias", torque_nm=-1.5)).start(vth=0.5, vq=0.5)
    states, others = asymmetric.play(torque), biased.play(torque)
    assert states[:, 3].min() > 0.0
    assert np.allclose(states, others, rtol=1e-12, atol=1e-15)
    assert not np.allclose(states[-1], Rig().start(vth=0.5, vq=0.5).play(torque)[-1], rtol=1e-3)


@pytest.mark.parametrize(("torque", "moves"), [(7.4, 0), (7.6, 1), (-4.4, 0), (-4.6, -1)])
def test_asymmetric_coulomb_breaks_away_at_another_level_each_way(torque, moves):
    state = Rig({}, named("asymmetric_friction", coulomb_nm=1.5)).hold(torque, 0.1)
    assert np.sign(state[2]) == moves


def test_a_direction_without_coulomb_level_slides_freely():
    on = named("asymmetric_friction", coulomb_nm=2.0)
    bare = {**APART, "fsm": 1.0, "fvm": 0.0}
    state = Rig(bare, on).hold(-0.5, 0.1)
    assert state[3] == pytest.approx(-0.5 / JM * 0.1, rel=1e-9)
    assert not Rig(bare, on).hold(2.9, 0.1)[:4].any()
    assert Rig(bare, on).hold(3.2, 0.1)[3] == pytest.approx(0.2 / JM * 0.1, rel=1e-9)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_asymmetric_viscous_friction_gives_two_terminal_velocities(sign):
    on = named("asymmetric_friction", viscous_nm_s_rad=0.5)
    state = Rig({**APART, "jm": 0.01}, on).hold(sign * 10.0, 1.0)
    assert state[3] == pytest.approx(sign * (10.0 - FSM) / (FVM + sign * 0.5), rel=1e-9)


def test_torque_bias_adds_to_the_torque():
    torque = np.random.default_rng(1).normal(0.0, 20.0, 300)
    biased = Rig({}, named("torque_bias", torque_nm=1.25)).play(torque)
    assert np.allclose(biased, Rig({}, named("load_friction", coefficient=1e-300)).play(
        torque + 1.25), rtol=1e-12, atol=1e-15)  # fmt: skip


@pytest.mark.parametrize("share", [0.01, 0.5, 0.9, -0.5])
def test_presliding_displacement_under_a_static_torque(share):
    on = named("presliding_friction", motor_rad=1e-3)
    body = Rig({**APART, "fvm": 50.0}, on)
    for k in range(1000):
        body.hold(share * FSM * min((k + 1) / 500.0, 1.0), 0.01)
    expected = -1e-3 * math.copysign(1.0, share) * math.log(1.0 - abs(share))
    assert body.x[2] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("side", ["motor", "link"])
def test_presliding_stiffness_is_level_over_distance(side):
    on = named("presliding_friction", **{f"{side}_rad": 1e-3})
    inertia, level = (JM, FSM) if side == "motor" else (J, FS)
    at = 2 if side == "motor" else 0
    body = Rig({**APART, "fv": 0.0, "fvm": 0.0}, on)
    body.x[at + 1] = 1e-5
    rate = math.sqrt(level / 1e-3 / inertia)
    states = body.play(np.zeros(200), 1e-4)
    times = 1e-4 * np.arange(1, 201)
    assert relative_rms(states[:, at], 1e-5 / rate * np.sin(rate * times)) < 1e-3


@pytest.mark.parametrize("speed", [1.0, 8.0])
def test_presliding_depends_on_the_path_only_and_not_on_its_speed(speed):
    """The state must follow Dahl's equation along the path, whatever the time it took."""
    distance, step = 1e-3, 1e-4 / speed
    body = Rig({"k1": 0.0}, named("presliding_friction", motor_rad=distance))
    k = np.arange(4000)
    torque = speed * 8.0 * np.sin(k * 2e-3) + speed * 5.0 * np.sin(k * 0.011)
    states = body.play(torque, step, parts=2)
    path = np.concatenate([[0.0], states[:, 2]])
    level, levels = 0.0, []
    for move in np.diff(path):
        sign = math.copysign(1.0, move)
        level = sign + (level - sign) * math.exp(-abs(move) / distance)
        levels.append(FSM * level)
    assert np.sum(np.diff(np.sign(np.diff(path))) != 0) >= 3
    assert np.abs(states[:, 8] - levels).max() < 2e-3 * FSM
    assert np.abs(levels).max() > 0.9 * FSM


@pytest.mark.parametrize(("law", "on", "highest"), [
    (lambda th, v: FSM + 2.0 * np.sign(v), named("asymmetric_friction", coulomb_nm=2.0), 8.0),
    (lambda th, v: FSM + 2.0 * math.exp(-((v / 0.2) ** 2)),
     named("stribeck_friction_motor", torque_nm=2.0, velocity_rad_s=0.2), 8.0),
    (lambda th, v: FSM + 2.0 * math.sin(50.0 * th),
     named("position_friction", amplitude_nm=2.0, cycles_per_turn=50.0), 8.0),
], ids=["direction", "velocity", "angle"])  # fmt: skip
def test_presliding_under_a_level_that_varies_follows_its_equation(law, on, highest):
    """dF = sigma (dx - |dx| F / level), integrated by scipy with F as a state of its own."""
    distance, duration = 5e-3, 0.3

    def pull(t):
        return 9.0 * math.sin(25.0 * t)

    def slope(t, y):
        th, v, friction = y
        rate = highest / distance * (v - abs(v) * friction / law(th, v))
        return [v, (pull(t) - FVM * v - friction) / JM, rate]

    body = Rig(APART, named("presliding_friction", motor_rad=distance) | on)
    step = 1e-4
    times = step * np.arange(round(duration / step))
    states = body.play([pull(t + 0.5 * step) for t in times], step)
    exact = solve_ivp(
        slope, (0.0, duration), [0.0, 0.0, 0.0], t_eval=times + step, rtol=1e-9, atol=1e-12,
        max_step=1e-3,
    )  # fmt: skip
    assert np.sum(np.diff(np.sign(exact.y[1])) != 0) >= 2
    assert relative_rms(states[:, 2], exact.y[0]) < 2e-4
    assert relative_rms(states[:, 8], exact.y[2]) < 1e-3


def test_presliding_over_no_distance_is_coulomb_friction():
    r = multisine_reference(7e-3)[:3000]
    bare = simulate(r, None).position
    errors = []
    for distance in (1e-4, 1e-5, 1e-6):
        on = named("presliding_friction", motor_rad=distance, link_rad=distance)
        errors.append(relative_rms(simulate(r, effects.coefficients(on)).position, bare))
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]
    assert errors[2] < 1e-3


def test_load_friction_shrinks_each_swing_as_its_energy_balance_says():
    """Against a held link the motor meets stiffness k0 (1 -+ c) on its way in and out."""
    c, k0, start = 0.3, 1500.0, 0.05
    for level in (0.0, 2.0):
        on = named("load_friction", coefficient=c)
        body = Rig({**LINK_HELD, "k1": 0.0, "fvm": 0.0, "fsm": level, "k0": k0}, on)
        body.start(th=start)
        travel = body.play(np.zeros(600), 1e-4)[:, 2]
        energy = 0.5 * k0 * (1.0 - c) * start**2 - level * start
        stiff = k0 * (1.0 + c)
        out = (-level + math.sqrt(level**2 + 2.0 * stiff * energy)) / stiff
        assert travel.min() == pytest.approx(-out, rel=1e-4)


def test_load_friction_swings_with_the_period_of_two_stiffnesses():
    c = 0.3
    body = Rig({**LINK_HELD, "k1": 0.0, "fvm": 0.0, "fsm": 0.0}, named("load_friction",
               coefficient=c)).start(th=0.05)  # fmt: skip
    half = 0.5 * math.pi * math.sqrt(JM / K0) * ((1 - c) ** -0.5 + (1 + c) ** -0.5)
    body.hold(0.0, half, parts=40)
    assert body.x[3] == pytest.approx(0.0, abs=1e-3)
    assert body.x[2] == pytest.approx(-0.05 * math.sqrt((1 - c) / (1 + c)), rel=1e-4)


def test_position_friction_stops_where_its_work_has_taken_the_energy():
    amplitude, cycles, phase = 2.0, 30.0, 0.4
    on = named("position_friction", amplitude_nm=amplitude, cycles_per_turn=cycles, phase_rad=phase)
    body = Rig({**APART, "fvm": 0.0}, on).start(vth=2.0)

    def left(x):
        ripple = amplitude / cycles * (math.cos(phase) - math.cos(cycles * x + phase))
        return 0.5 * JM * 4.0 - FSM * x - ripple

    assert body.hold(0.0, 0.2, parts=4)[2] == pytest.approx(brentq(left, 0.0, 1.0), rel=1e-5)
    assert body.x[3] == 0.0


def test_drag_gives_the_terminal_velocity():
    on = named("quadratic_friction", motor_nm_s2_rad2=3.0)
    state = Rig({**APART, "jm": 0.01}, on).hold(-20.0, 2.0)
    assert 3.0 * state[3] ** 2 - FVM * state[3] == pytest.approx(20.0 - FSM, rel=1e-9)


def test_drag_alone_slows_the_link_exponentially_over_its_way():
    on = named("quadratic_friction", link_nm_s2_rad2=3.0)
    state = Rig({**APART, **FRICTIONLESS}, on).start(vq=-2.0).hold(0.0, 0.1, parts=5)
    assert state[1] == pytest.approx(-2.0 / (1.0 + 3.0 * 2.0 * 0.1 / J), rel=1e-5)
    assert state[1] == pytest.approx(-2.0 * math.exp(3.0 * state[0] / J), rel=1e-5)


def torque_at(d, **on):
    e = effects.coefficients({**named("torque_bias", torque_nm=1.0), **on})
    return np.array([spring.spring_torque(float(x), plant.coefficients(PAPER), e) for x in d])


TWISTS = np.linspace(-0.01, 0.01, 401)


def test_backlash_transmits_nothing_in_the_gap_and_the_spring_beyond():
    beyond = np.sign(TWISTS) * np.maximum(np.abs(TWISTS) - 2e-3, 0.0)
    torque = torque_at(TWISTS, **named("backlash", half_gap_rad=2e-3))
    assert np.allclose(torque, K0 * beyond + K1 * beyond**3, rtol=1e-14, atol=1e-14)
    assert (torque[np.abs(TWISTS) < 2e-3] == 0.0).all()


def test_backlash_lets_the_motor_move_alone_within_the_gap():
    body = Rig(FRICTIONLESS, named("backlash", half_gap_rad=2e-3))
    crossing = body.start(th=-2e-3, vth=1.0).hold(0.0, 3.9e-3)
    assert crossing[0] == 0.0 and crossing[1] == 0.0
    assert crossing[2] == pytest.approx(1.9e-3, rel=1e-12)
    assert body.hold(0.0, 1e-3)[1] > 0.0


def test_piecewise_stiffness_has_its_slopes_and_no_jump():
    on = named("piecewise_stiffness", zone_rad=2e-3, soft_ratio=0.3)
    seen = np.sign(TWISTS) * (np.abs(TWISTS) - 0.7 * np.minimum(np.abs(TWISTS), 2e-3))
    torque = torque_at(TWISTS, **on)
    assert np.allclose(torque, K0 * seen + K1 * seen**3, rtol=1e-13, atol=1e-14)
    slopes = np.diff(torque - K1 * seen**3) / np.diff(TWISTS)
    middle = 0.5 * (TWISTS[1:] + TWISTS[:-1])
    assert np.allclose(slopes, np.where(np.abs(middle) < 2e-3, 0.3 * K0, K0), rtol=1e-9)
    assert np.array_equal(torque_at(-TWISTS, **on), -torque_at(TWISTS, **on))


def test_piecewise_stiffness_of_ratio_one_is_the_bare_spring_and_of_zero_is_backlash():
    full = named("piecewise_stiffness", zone_rad=2e-3, soft_ratio=1.0)
    assert np.allclose(
        torque_at(TWISTS, **full), K0 * TWISTS + K1 * TWISTS**3, rtol=1e-14, atol=0.0
    )
    r = multisine_reference(7e-3)[:2000]
    zone = effects.coefficients(named("piecewise_stiffness", zone_rad=2e-3, soft_ratio=0.0))
    gap = effects.coefficients(named("backlash", half_gap_rad=2e-3))
    assert np.allclose(
        torque_at(TWISTS, **named("piecewise_stiffness", zone_rad=2e-3, soft_ratio=0.0)),
        torque_at(TWISTS, **named("backlash", half_gap_rad=2e-3)), rtol=1e-14, atol=0.0,
    )  # fmt: skip
    for k1 in (0.0, K1, 1e7):
        positions = [simulate(r, e, k1=k1).position for e in (zone, gap)]
        assert relative_rms(*positions) < 1e-9
        assert relative_rms(positions[0], simulate(r, None, k1=k1).position) > 0.01


@pytest.mark.parametrize("inertia", [100.0, 25.0], ids=["slow", "twice as fast"])
def test_hysteresis_takes_the_area_of_its_loop_at_any_speed(inertia):
    """A heavy motor swings against a held link; Dahl's loop holds 4 H (A - D tanh(A/D))."""
    height, distance, swing = 0.02, 5e-3, 0.02
    on = named("hysteresis", torque_nm=height, displacement_rad=distance)
    body = Rig({**LINK_HELD, "k1": 0.0, "fsm": 0.0, "fvm": 0.0, "jm": inertia}, on)
    body.start(th=swing)
    states = body.play(np.zeros(round(4.0 * 2.0 * math.pi * math.sqrt(inertia / K0) / 1e-3)))
    position = states[:, 2]
    turns = np.flatnonzero(np.diff(np.sign(states[:, 3])) != 0)
    peaks = [np.abs(position[k - 2 : k + 3]).max() for k in turns[:6]]
    for first, last in ((peaks[1], peaks[3]), (peaks[2], peaks[4])):
        mean = math.sqrt(first * last)
        area = 4.0 * height * (mean - distance * math.tanh(mean / distance))
        assert 0.5 * K0 * (first**2 - last**2) == pytest.approx(area, rel=5e-3)


def test_hysteresis_state_follows_the_deflection_only():
    distance = 1e-3
    body = Rig({}, named("hysteresis", torque_nm=3.0, displacement_rad=distance))
    k = np.arange(3000)
    states = body.play(60.0 * np.sin(k * 2e-3) + 40.0 * np.sin(k * 0.013), 1e-4, parts=2)
    level, levels = 0.0, []
    for move in np.diff(np.concatenate([[0.0], states[:, 0] - states[:, 2]])):
        sign = math.copysign(1.0, move)
        level = sign + (level - sign) * math.exp(-abs(move) / distance)
        levels.append(level)
    assert np.abs(states[:, 9] - levels).max() < 5e-3
    assert np.abs(levels).max() > 0.9


def test_transmission_damping_gives_the_logarithmic_decrement():
    damping, start = 4.0, 0.01
    body = Rig({**FRICTIONLESS, "k1": 0.0}, named("transmission_damping", nm_s_rad=damping))
    body.start(q=start)
    reduced = 1.0 / (1.0 / J + 1.0 / JM)
    decay = damping / (2.0 * reduced)
    rate = math.sqrt(K0 / reduced - decay**2)
    states = body.play(np.zeros(300))
    t = 1e-3 * np.arange(1, 301)
    exact = start * np.exp(-decay * t) * (np.cos(rate * t) + decay / rate * np.sin(rate * t))
    assert relative_rms(states[:, 0] - states[:, 2], exact) < 1e-4


def test_kinematic_error_follows_virtual_work():
    on = named("kinematic_error", amplitude_rad=2e-3, cycles_per_turn=30.0, phase_rad=0.7)
    e, p = effects.coefficients(on), plant.coefficients(PAPER)

    def energy(q, th):
        d = q - th + 2e-3 * math.sin(30.0 * th + 0.7)
        return 0.5 * K0 * d**2 + 0.25 * K1 * d**4

    step = 1e-6
    for q, th in [(0.0, 0.0), (0.01, 0.05), (-0.02, 0.3)]:
        te = spring.transmitted_torque(q, 0.0, th, 0.0, 0.0, p, e)
        on_link = torques.link_drive(q, 0.0, te, 0.0, 0.0, 0.0, p, e)
        on_motor = torques.motor_drive(th, 0.0, te, 0.0, 0.0, p, e)
        assert on_link == pytest.approx((energy(q - step, th) - energy(q + step, th)) / 2 / step,
                                        rel=1e-6)  # fmt: skip
        assert on_motor == pytest.approx((energy(q, th - step) - energy(q, th + step)) / 2 / step,
                                         rel=1e-6)  # fmt: skip


def test_kinematic_error_shows_in_the_link_of_a_stiff_joint():
    on = named("kinematic_error", amplitude_rad=2e-3, cycles_per_turn=30.0, phase_rad=0.7)
    stiff = {"fs": 0.0, "fv": 20.0, "k0": 1e5, **MOTOR_HELD}
    state = Rig(stiff, on).start(q=0.2, th=0.2).hold(0.0, 2.0, parts=100)
    assert state[0] == pytest.approx(0.2 - 2e-3 * math.sin(30.0 * 0.2 + 0.7), rel=1e-9)


def three_masses(mass, frequency, ratio, v=PAPER):
    """Return the state matrix over (q, vq, th, vth, q3, v3), linear friction only."""
    k3 = mass * (2.0 * math.pi * frequency) ** 2
    c3 = 2.0 * ratio * math.sqrt(k3 * mass)
    inertia = np.diag([v["j"], v["jm"], mass])
    k, kt = v["k0"], k3
    stiffness = np.array([[k + kt, -k, -kt], [-k, k, 0.0], [-kt, 0.0, kt]])
    damping = np.array([[v["fv"] + c3, 0.0, -c3], [0.0, v["fvm"], 0.0], [-c3, 0.0, c3]])
    a = np.zeros((6, 6))
    a[0::2, 1::2] = np.eye(3)
    a[1::2, 0::2] = -np.linalg.solve(inertia, stiffness)
    a[1::2, 1::2] = -np.linalg.solve(inertia, damping)
    return a


@pytest.mark.parametrize(
    ("mass", "frequency", "ratio"), [(0.03, 30.0, 0.02), (0.3, 5.0, 0.0), (1.0, 100.0, 1.5)]
)
def test_extra_mode_is_the_third_mass_of_the_matrix(mass, frequency, ratio):
    on = named("extra_mode", inertia_kg_m2=mass, frequency_hz=frequency, damping_ratio=ratio)
    body = Rig({"fs": 0.0, "fsm": 0.0, "k1": 0.0}, on).start(q=0.01, vth=0.3)
    states = body.play(np.zeros(200))[:, :6]
    step, exact, expected = expm(1e-3 * three_masses(mass, frequency, ratio)), [], None
    expected = np.array([0.01, 0.0, 0.0, 0.3, 0.01, 0.0])
    for _ in range(200):
        expected = step @ expected
        exact.append(expected)
    assert relative_rms(states, np.array(exact)) < 1e-4


def test_extra_mode_rings_at_the_eigenfrequencies_of_three_masses():
    on = named("extra_mode", inertia_kg_m2=0.1, frequency_hz=30.0, damping_ratio=0.0)
    body = Rig({**FRICTIONLESS, "k1": 0.0}, on).start(vth=1.0)
    body.x[1] = -2.0 / 3.0  # no net momentum
    states = body.play(np.zeros(8192))
    window = np.hanning(8192)
    spectrum = np.abs(np.fft.rfft((states[:, 2] - states[:, 2].mean()) * window))
    lines = [k for k in range(20, 800) if spectrum[k] == spectrum[k - 8 : k + 9].max()]
    lines = sorted(sorted(lines, key=lambda k: -spectrum[k])[:2])
    still = {**PAPER, **FRICTIONLESS}
    rates = np.abs(np.linalg.eigvals(three_masses(0.1, 30.0, 0.0, still)).imag) / (2 * np.pi)
    expected = sorted({round(float(f), 6) for f in rates if f > 1.0})
    assert np.allclose(np.array(lines) * RATE / 8192, expected, atol=0.5 * RATE / 8192)


def test_gravity_swings_the_free_link_with_the_pendulum_period():
    on = named("gravity", torque_nm=3.0, angle_rad=0.5)
    body = Rig({**APART, **FRICTIONLESS}, on).start(q=1.0 - 0.5)
    period = 4.0 * math.sqrt(J / 3.0) * ellipk(math.sin(0.5) ** 2)
    state = body.hold(0.0, period, parts=2000)
    assert state[0] == pytest.approx(0.5, rel=1e-6)
    assert state[1] == pytest.approx(0.0, abs=1e-4)


def test_gravity_swings_a_rigid_axis_as_one_pendulum():
    on = named("gravity", torque_nm=3.0, angle_rad=0.5)
    body = Rig({**FRICTIONLESS, "k0": math.inf}, on).start(th=1.0 - 0.5)
    period = 4.0 * math.sqrt((J + JM) / 3.0) * ellipk(math.sin(0.5) ** 2)
    before = body.energy()
    state = body.hold(0.0, period, parts=2000)
    assert state[2] == pytest.approx(0.5, rel=1e-6)
    assert state[3] == pytest.approx(0.0, abs=1e-4)
    assert body.energy() == pytest.approx(before, rel=1e-9)
    assert not state[:2].any()


def test_gravity_on_a_rigid_axis_is_cogging_of_one_cycle():
    torque = 20.0 * np.random.default_rng(5).standard_normal(400)
    gravity = Rig({"k0": math.inf}, named("gravity", torque_nm=4.0, angle_rad=0.7))
    cogging = Rig({"k0": math.inf}, named("cogging", amplitude_nm=4.0, phase_rad=0.7 + math.pi))
    assert np.allclose(gravity.play(torque), cogging.play(torque), rtol=1e-9, atol=1e-12)
    assert np.ptp(gravity.play(torque)[:, 2]) > 1e-3


def test_gravity_of_a_rigid_axis_is_held_by_its_friction_up_to_its_level():
    for torque, sticks in ((10.9, True), (11.1, False)):
        on = named("gravity", torque_nm=torque, angle_rad=0.5 * math.pi)
        moved = Rig({"k0": math.inf}, on).hold(0.0, 0.1)[2]
        assert (moved == 0.0) == sticks


def test_a_spring_to_the_frame_swings_the_free_link_about_its_rest():
    on = named("external_spring", stiffness_nm_rad=7.0, rest_rad=0.2)
    for axis, inertia, at in ((APART, J, 0), ({"k0": math.inf}, J + JM, 2)):
        body = Rig({**axis, **FRICTIONLESS}, on).start(q=0.5, th=0.5)
        before = body.energy()
        state = body.hold(0.0, math.pi * math.sqrt(inertia / 7.0), parts=2000)
        assert state[at] == pytest.approx(0.2 - 0.3, rel=1e-6)
        assert state[at + 1] == pytest.approx(0.0, abs=1e-4)
        assert body.energy() == pytest.approx(before, rel=1e-9)


def test_a_spring_to_the_frame_is_gravity_of_small_travel():
    torque = 20.0 * np.random.default_rng(5).standard_normal(300)
    for axis in ({}, {"k0": math.inf}):
        on = (
            named("external_spring", stiffness_nm_rad=40.0, rest_rad=0.0),
            named("gravity", torque_nm=40.0, angle_rad=0.0),
            {},
        )
        spring, weight, bare = (Rig(FRICTIONLESS | axis, e).play(torque)[:, 2] for e in on)
        assert 1e-3 < np.abs(spring).max() < 0.1
        assert np.abs(spring - weight).max() < 0.01 * np.abs(spring - bare).max()


@pytest.mark.parametrize("swing", [0.5, 5.0])
def test_a_spring_that_hardens_swings_the_free_link_as_jacobis_functions_do(swing):
    """Duffing's equation, undamped: A cn(w t, m), J w^2 = k + c A^2, m = c A^2 / (2 J w^2)."""
    k, c, rest = 7.0, 90.0, 0.2
    on = named("hardening_spring", cubic_nm_rad3=c, stiffness_nm_rad=k, rest_rad=rest)
    for axis, inertia, at in ((APART, J, 0), ({"k0": math.inf}, J + JM, 2)):
        body = Rig({**axis, **FRICTIONLESS}, on).start(q=rest + swing, th=rest + swing)
        before = body.energy()
        rate = math.sqrt((k + c * swing**2) / inertia)
        m = c * swing**2 / (2.0 * (k + c * swing**2))
        held = np.full(60, 3.0 * 4.0 * ellipk(m) / rate / 60)  # three periods, in 60 samples
        found = np.array([body.hold(0.0, float(h))[at] for h in held])
        expected = rest + swing * ellipj(rate * np.cumsum(held), m)[1]
        assert np.abs(found - expected).max() < 2e-4 * swing
        assert body.energy() == pytest.approx(before, rel=1e-4)


def test_a_spring_that_does_not_harden_is_the_linear_one():
    torque = 20.0 * np.random.default_rng(5).standard_normal(300)
    for axis in ({}, {"k0": math.inf}):
        on = ("external_spring", {}), ("hardening_spring", {"cubic_nm_rad3": 0.0})
        linear, hard = (
            Rig(axis, named(name, stiffness_nm_rad=40.0, rest_rad=0.1, **more)).play(torque)
            for name, more in on
        )
        np.testing.assert_allclose(linear, hard, rtol=1e-12, atol=1e-14)


def test_a_cable_is_a_spring_behind_a_damper():
    """The free body under it: a third-order linear system, solved by the matrix exponential."""
    stiffness, relaxation = 7.0, 0.6
    on = named("cable", stiffness_nm_rad=stiffness, relaxation_s=relaxation)
    for axis, inertia, at in ((APART, J, 0), ({"k0": math.inf}, J + JM, 2)):
        body = Rig({**axis, **FRICTIONLESS}, on).start(q=0.5, th=0.5)
        body.x[at + 1] = 2.0
        a = np.array(
            [
                [0.0, 1.0, 0.0],
                [-stiffness / inertia, 0.0, stiffness / inertia],
                [1.0 / relaxation, 0.0, -1.0 / relaxation],
            ]
        )
        expected = expm(1.5 * a) @ [0.5, 2.0, 0.5]
        found = body.hold(0.0, 1.5, parts=1500)[[at, at + 1, 10]]
        np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_a_cable_that_hardly_gives_way_is_a_spring_and_one_that_does_at_once_a_damper():
    torque = 20.0 * np.random.default_rng(5).standard_normal(300)
    for axis in ({}, {"k0": math.inf}):
        body = FRICTIONLESS | axis

        def play(on, changed=body):
            return Rig(changed, on).play(torque)[:, 2]

        slow = play(named("cable", stiffness_nm_rad=40.0, relaxation_s=1e4))
        spring = play(named("external_spring", stiffness_nm_rad=40.0, rest_rad=0.0))
        np.testing.assert_allclose(slow, spring, atol=1e-4 * np.abs(spring).max())
        quick = play(named("cable", stiffness_nm_rad=4e4, relaxation_s=1e-4))
        damper = play({}, {**body, "fv": 4.0})
        bare = play({})
        assert np.abs(quick - damper).max() < 0.01 * np.abs(damper - bare).max()


@pytest.mark.parametrize(("on", "bare"), [
    (named("coulomb_friction", motor_nm=2.0, link_nm=1.5), {"fsm": 2.0, "fs": 1.5}),
    (named("viscous_friction", motor_nm_s_rad=1.0, link_nm_s_rad=3.0), {"fvm": 1.0, "fv": 3.0}),
], ids=["coulomb", "viscous"])  # fmt: skip
def test_friction_that_the_datasheet_lacks_is_the_plant_with_that_friction(on, bare):
    lacking = {name: 0.0 for name in bare}
    torque = 30.0 * np.random.default_rng(5).standard_normal(300)
    for axis in ({}, {"k0": math.inf}):
        with_effect, with_value = Rig(lacking | axis, on), Rig(bare | axis)
        assert np.array_equal(with_effect.play(torque), with_value.play(torque))
        assert with_effect.energy() == with_value.energy()


def test_a_cubic_stiffness_that_the_datasheet_lacks_is_the_plant_with_that_k1():
    torque = 30.0 * np.random.default_rng(5).standard_normal(300)
    with_effect = Rig({"k1": 0.0}, named("cubic_stiffness", stiffness_nm_rad3=3e6))
    with_value = Rig({"k1": 3e6})
    assert np.array_equal(with_effect.play(torque), with_value.play(torque))
    assert with_effect.energy() == with_value.energy() > 0.0
    assert not np.allclose(with_value.play(torque), Rig({"k1": 0.0}).play(torque), rtol=1e-3)


def test_a_transmission_that_yields_is_the_flexible_plant():
    torque = 30.0 * np.random.default_rng(5).standard_normal(300)
    on = named(
        "transmission_stiffness",
        compliance_rad_nm=1.0 / 1500.0, link_inertia_share=J / (J + JM),
        link_coulomb_share=0.25, link_viscous_share=0.5,
    )  # fmt: skip
    rigid = {"k0": math.inf, "fs": 0.0, "fsm": 8.0, "fv": 0.0, "fvm": 4.0}
    flexible = {"k1": 0.0, "fs": 2.0, "fsm": 6.0, "fv": 2.0, "fvm": 2.0}
    assert np.allclose(Rig(rigid, on).play(torque), Rig(flexible).play(torque), rtol=1e-7,
                       atol=1e-12)  # fmt: skip
    assert np.array_equal(Rig(flexible, on).play(torque), Rig(flexible).play(torque))


def test_gravity_rests_where_the_spring_holds_it():
    on = named("gravity", torque_nm=30.0, angle_rad=0.5)
    state = Rig({"fs": 0.0, "fv": 20.0, "k1": 0.0, **MOTOR_HELD}, on).hold(0.0, 3.0, parts=300)
    assert state[0] == pytest.approx(
        brentq(lambda q: K0 * q + 30.0 * math.sin(q + 0.5), -1.0, 1.0), rel=1e-9
    )


def test_cogging_swings_the_free_motor_about_its_stable_angle():
    on = named("cogging", amplitude_nm=2.0, cycles_per_turn=24.0, phase_rad=0.3)
    rest = (math.pi - 0.3) / 24.0
    body = Rig({**APART, **FRICTIONLESS}, on).start(th=rest + 1e-5)
    rate = math.sqrt(2.0 * 24.0 / JM)
    states = body.play(np.zeros(500))[:, 2] - rest
    assert relative_rms(states, 1e-5 * np.cos(rate * 1e-3 * np.arange(1, 501))) < 1e-4


def test_cogging_holds_the_motor_up_to_its_amplitude():
    on = named("cogging", amplitude_nm=2.0, cycles_per_turn=24.0, phase_rad=0.5 * math.pi)
    assert not Rig({}, on).hold(3.999, 0.1)[:4].any()
    assert Rig({}, on).hold(4.001, 0.1)[2] > 0.0
    assert not Rig({}, on).hold(-7.999, 0.1)[:4].any()


TORQUE = 40.0 * np.random.default_rng(3).standard_normal(400)


@pytest.mark.parametrize("rate", [1000.0, 20_000.0])
@pytest.mark.parametrize("samples", [1, 3, 10])
def test_delay_of_whole_samples_is_the_shifted_torque(samples, rate):
    on = named("delay", time_s=samples / rate)
    delayed = Rig({}, on).play(TORQUE, 1.0 / rate)
    shifted = np.concatenate([np.zeros(samples), TORQUE[:-samples]])
    exact = Rig({}, named("load_friction", coefficient=1e-300)).play(shifted, 1.0 / rate)
    assert np.array_equal(delayed, exact)


def test_a_delay_of_a_tenth_of_a_second_is_remembered_at_the_highest_rate():
    steps = np.where(np.arange(2100) < 50, 30.0, 0.0)
    late = Rig({}, named("delay", time_s=0.1)).play(steps, 1.0 / 20_000.0)
    assert not late[:2000, 2].any() and late[2001:, 2].all()
    now = Rig({}, named("load_friction", coefficient=1e-300)).play(steps[:100], 1.0 / 20_000.0)
    assert np.array_equal(late[2000:, 2], now[:, 2])


def test_a_delay_beyond_what_is_remembered_is_no_motion():
    assert np.isnan(Rig({}, named("delay", time_s=0.1)).hold(30.0, 5e-6)[2])


@pytest.mark.parametrize("fifths", [1, 2, 8])
def test_fractional_delay_is_the_shift_on_a_finer_grid(fifths):
    delayed = Rig({}, named("delay", time_s=fifths * 2e-4)).play(TORQUE)
    fine = np.concatenate([np.zeros(fifths), np.repeat(TORQUE, 5)])[: 5 * TORQUE.size]
    exact = Rig().play(fine, 2e-4)[4::5]
    assert relative_rms(delayed[:, 2], exact[:, 2]) < 1e-4


@pytest.mark.parametrize("lag", [5e-5, 5e-4, 1e-3, 2e-2])
def test_actuator_lag_is_the_first_order_response(lag):
    on = named("actuator_lag", time_constant_s=lag)
    body = Rig({**APART, **FRICTIONLESS}, on)
    states = body.play(np.full(20, 10.0))
    t = 1e-3 * np.arange(1, 21)
    assert np.allclose(states[:, 6], 10.0 * -np.expm1(-t / lag), atol=1e-3 * 10.0)
    speed = 10.0 / JM * (t + lag * np.expm1(-t / lag))
    assert np.allclose(states[:, 3], speed, rtol=1e-3)
    assert states[-1, 3] == pytest.approx(speed[-1], rel=1e-4)


def test_saturation_clips_the_torque():
    clipped = Rig({}, named("torque_saturation", limit_nm=25.0)).play(TORQUE)
    exact = Rig({}, named("load_friction", coefficient=1e-300)).play(np.clip(TORQUE, -25.0, 25.0))
    assert np.array_equal(clipped, exact)
    assert np.abs(TORQUE).max() > 25.0


def test_a_knee_bends_the_torque_smoothly_into_its_limit():
    u = np.linspace(-60.0, 60.0, 24_001)
    given = np.array([rig.limited(value, 30.0, 0.2) for value in u])
    inside, outside = np.abs(u) <= 24.0, np.abs(u) >= 36.0
    assert np.array_equal(given[inside], u[inside])
    assert np.array_equal(given[outside], np.copysign(30.0, u[outside]))
    slope = np.diff(given) / np.diff(u)
    assert np.abs(np.diff(slope)).max() < 1.1 * 5e-3 / (2 * 0.2 * 30.0)  # a parabola: no kink
    assert rig.limited(1e3, math.inf, 0.2) == 1e3


@pytest.mark.parametrize("error", [-0.2, 0.07])
def test_torque_gain_is_all_parameters_scaled(error):
    r = multisine_reference(7e-3)[:3000]
    scaled = {name: value / (1.0 + error) for name, value in PAPER.items()}
    gained = simulate(r, effects.coefficients(named("torque_gain", relative_error=error)))
    exact = simulate(r, None, **scaled)
    assert relative_rms(gained.position, exact.position) < 1e-9
    assert relative_rms(gained.torque, exact.torque) < 1e-9
    assert relative_rms(gained.position, simulate(r, None).position) > 1e-3


def test_quantization_rounds_what_the_encoder_reads():
    e = effects.coefficients(named("encoder_quantization", resolution_rad=1e-4))
    result = simulate(multisine_reference(7e-3)[:2000], e)
    counts = result.position / 1e-4
    assert np.allclose(counts, np.round(counts), atol=1e-9)
    assert np.abs(result.position - result.motor).max() <= 0.5e-4 * (1 + 1e-9)
    assert np.unique(np.round(counts)).size > 50


def test_eccentricity_adds_its_sine_once_per_turn():
    on = named("encoder_eccentricity", amplitude_rad=1e-3, phase_rad=0.6)
    e, x = effects.coefficients(on), rig.at_rest()
    for angle in np.linspace(-7.0, 7.0, 29):
        x[rig.MOTOR] = angle
        expected = angle + 1e-3 * math.sin(angle + 0.6) + 1e-5
        assert rig.measure(x, 1e-5, e) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("size", [0.0, 1e-3, 0.5])
def test_a_rig_can_begin_where_an_eccentric_encoder_reads_something(size):
    on = named("encoder_eccentricity", amplitude_rad=size, phase_rad=0.6) if size else {}
    e, x, step = effects.coefficients(on), rig.at_rest(), 1e-6
    for reading in np.linspace(-7.0, 7.0, 57):
        at, speed = rig.under_reading(reading, 3.0, e)
        for later in (0.0, step):
            rig.move(x, at + later * speed, speed)
            assert rig.measure(x, 0.0, e) == pytest.approx(reading + later * 3.0, abs=2e-11)


@pytest.mark.parametrize("elapsed", [0.0, 10.0, 100.0])
def test_nonstationary_friction_has_drifted_by_rate_times_time(elapsed):
    drifting = Rig({}, named("nonstationary", friction_per_s=-0.004), rig.at_rest(elapsed))
    factor = 1.0 - 0.004 * elapsed
    friction = {name: factor * PAPER[name] for name in FRICTIONLESS}
    states = drifting.start(vth=1.0, vq=-1.0).hold(30.0)
    exact = Rig(friction, named("load_friction", coefficient=1e-300)).start(vth=1.0, vq=-1.0)
    assert np.allclose(states, exact.hold(30.0), rtol=1e-12, atol=1e-15)


def test_nonstationary_friction_goes_on_drifting_and_never_drives():
    on = named("nonstationary", friction_per_s=-0.1)
    body = Rig({**APART}, on, rig.at_rest(9.95)).start(vth=1.0)
    speeds = body.play(np.zeros(1000))[:, 3]
    loss = -np.diff(speeds)
    assert (loss[:40] > loss[1:41]).all()
    assert (loss[60:] == 0.0).all()


DOCUMENT = DOCS / "effects.md"


def test_the_document_is_in_step_with_the_catalogue():
    text = DOCUMENT.read_text(encoding="utf-8")
    assert in_step(text, document.TABLES) == text, (
        "renew it: python -m fjr_sim_node.effects.document docs/effects.md"
    )
    for name in effects.NAMES:
        assert f"| `.{name.partition('.')[2]}`" in text


def test_the_number_of_effects_is_said_once_by_the_catalogue():
    root = ROOT
    said = {
        path.name: found
        for path in (root / "README.md", *sorted((root / "docs").glob("*.md")))
        if (found := re.findall(r"(\d+) effects(?! outside)", path.read_text(encoding="utf-8")))
    }
    assert said == {"effects.md": [str(len(effects.CATALOGUE))]}


def test_the_document_has_a_formula_for_every_effect():
    formulas = DOCUMENT.read_text(encoding="utf-8").partition("## Formulas")[2]
    formulas = formulas.partition("## What cannot be told apart")[0]
    listed = {word for line in formulas.splitlines() if line.startswith("- `")
              for word in line.partition(":")[0].split("`")[1::2]}  # fmt: skip
    assert listed == set(effects.EFFECTS)
