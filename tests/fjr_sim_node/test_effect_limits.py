"""What must hold for all effects: off is off, no energy from nothing, sticking, symmetry, step."""

from __future__ import annotations

import math

import numpy as np
import pytest
from effect_rig import (
    APART,
    CONTROLLER,
    MODERATE,
    PAPER,
    RATE,
    Rig,
    axis,
    moderate,
    multisine_reference,
    named,
    relative_rms,
    simulate,
)
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from controller_node import pd_filtered
from fjr_kit.errors import InputError
from fjr_sim_node import effects, plant
from fjr_sim_node.simulation import rig

IDENTIFIERS = tuple(effects.EFFECTS)
SIGNALS = ("position", "torque", "link", "motor")
EVEN = {
    "asymmetric_friction", "torque_bias", "position_friction", "kinematic_error", "gravity",
    "external_spring", "hardening_spring",
    "cogging", "encoder_eccentricity", "asymmetric_stiffness", "torque_constant_ripple",
}  # fmt: skip
PASSIVE = set(IDENTIFIERS) - {
    "torque_bias", "delay", "torque_gain", "torque_saturation", "encoder_quantization",
    "encoder_eccentricity", "torque_speed_limit", "torque_slew_limit", "dead_band",
    "torque_constant_ripple",
}  # fmt: skip


def same(first, second) -> bool:
    return all(np.array_equal(getattr(first, s), getattr(second, s)) for s in SIGNALS)


def odd_values(effect: effects.Effect) -> dict[str, float]:
    """Return the effect at size zero with its other parameters far from their defaults."""
    odd = {}
    for name, parameter in zip(effect.names, effect.parameters, strict=True):
        if name in effect.size_names:
            continue
        high = parameter.high if math.isfinite(parameter.high) else 1e3
        odd[name] = parameter.low + 0.37 * (high - parameter.low)
    return odd


def test_every_effect_of_the_catalogue_is_tested_here():
    assert set(MODERATE) == set(IDENTIFIERS)
    assert len(IDENTIFIERS) == 37


@pytest.mark.parametrize("identifier", IDENTIFIERS)
def test_an_effect_of_size_zero_is_off_whatever_its_other_parameters(identifier):
    effect = effects.EFFECTS[identifier]
    odd = odd_values(effect)
    assert effects.coefficients(odd) is None
    r = multisine_reference(7e-3)[:1500]
    values = [float(odd.get(p.name, p.default)) for p in effects.PARAMETERS]
    forced = np.array([*values, 1.0, 1.0, 1.0])  # all families switched on
    assert same(simulate(r, forced), simulate(r, None))


@pytest.mark.parametrize("identifier", IDENTIFIERS)
def test_laws_that_are_passed_over_would_have_done_nothing(identifier):
    on = effects.coefficients(moderate(identifier))
    if on is None:
        assert effects.EFFECTS[identifier].of_bare_plant
        return
    in_plant = effects.EFFECTS[identifier].law.startswith("plant.")
    assert on[-3:].any() == in_plant  # a law before or behind the plant leaves it bare
    forced = np.array([*on[:-3], 1.0, 1.0, 1.0])
    r = multisine_reference(7e-3)[:1500]
    assert same(simulate(r, on, **axis(identifier)), simulate(r, forced, **axis(identifier)))


@pytest.mark.parametrize("identifier", IDENTIFIERS)
def test_a_moderate_size_shows(identifier):
    r = multisine_reference(2e-2 if identifier == "torque_saturation" else 2e-3)[:4000]
    bare = simulate(r, None, 20.0, **axis(identifier))
    on = simulate(r, moderate(identifier), 20.0, **axis(identifier))
    shown = relative_rms(on.torque, bare.torque)
    assert 1e-4 < shown < 1.0


@pytest.mark.parametrize("identifier", IDENTIFIERS)
def test_a_vanishing_size_approaches_the_bare_plant(identifier):
    effect = effects.EFFECTS[identifier]
    r = multisine_reference(7e-3)[:1500]
    bare, errors = simulate(r, None, **axis(identifier)).position, []
    for factor in (1e-1, 1e-3):
        values = dict(MODERATE[identifier])
        for parameter in effect.parameters:
            if parameter.role == "size" and parameter.name in values:
                values[parameter.name] *= factor
            elif parameter.role == "limit":
                values[parameter.name] /= factor
        on = simulate(r, named(identifier, **values), **axis(identifier))
        errors.append(relative_rms(on.position, bare))
    assert errors[1] < 0.2 * errors[0] or errors[1] < 2e-5


def test_all_effects_at_once_run():
    result = simulate(multisine_reference(7e-3)[:2000], moderate(*IDENTIFIERS))
    assert np.isfinite(result.torque).all()


sizes = st.floats(-1.0, 1.0).map(lambda x: 10.0**x)


@settings(max_examples=200)
@given(
    identifiers=st.lists(st.sampled_from(sorted(PASSIVE)), min_size=1, max_size=3, unique=True),
    scale=sizes,
    frictionless=st.booleans(),
    start=st.tuples(*(st.floats(-limit, limit) for limit in (0.05, 2.0, 0.05, 2.0))),
)
@example(["cubic_stiffness"], 10.0, True, (0.0, 0.0, 0.03125, 0.0))
def test_no_energy_comes_from_nothing(identifiers, scale, frictionless, start):
    on = {}
    for identifier in identifiers:
        for parameter in effects.EFFECTS[identifier].parameters:
            value = MODERATE[identifier].get(parameter.name, parameter.default)
            if parameter.name not in ("phase_rad", "angle_rad", "soft_ratio", "coefficient"):
                value = min(max(value * scale, parameter.low), parameter.high)
            on[f"{identifier}.{parameter.name}"] = value
    bare = {"fs": 0.0, "fsm": 0.0, "fv": 0.0, "fvm": 0.0} if frictionless else {}
    bare |= axis(*identifiers)
    # Viscous friction that pushes in one direction is no passive effect.
    viscous = plant.with_added({**PAPER, **on, **bare})["fvm"]
    assume(on.get("asymmetric_friction.viscous_nm_s_rad", 0.0) <= viscous)
    body = Rig(bare, on).start(*start)
    energies = [body.energy()]
    for _ in range(60):
        body.hold(0.0)
        energies.append(body.energy())
    at_play = 0.1 + abs(energies[0])
    assert np.diff(energies).max() < 1e-5 * at_play


@pytest.mark.parametrize("torque", [0.0, 3.0, -3.0])
@pytest.mark.parametrize("first", IDENTIFIERS)
def test_no_effect_and_no_pair_of_effects_gives_more_energy_than_a_held_torque(first, torque):
    """Stored energy less the torque's work never grows, so no pair oscillates by itself."""
    for second in IDENTIFIERS[IDENTIFIERS.index(first) :]:
        on = named(first, **MODERATE[first]) | named(second, **MODERATE[second])
        # no viscous friction but what the asymmetric one needs to be passive
        viscous = on.get("asymmetric_friction.viscous_nm_s_rad", 0.0)
        rig = axis(first, second) | {"fv": 0.0, "fvm": viscous}
        body = Rig(rig, on).start(q=0.01, vq=0.4, th=-0.01, vth=-0.3)
        at_play = 0.1 + abs(body.energy())
        for _ in range(20):  # a lag or a delay settles
            body.hold(torque)
        stored = []
        for _ in range(400):
            body.hold(torque)
            stored.append(body.energy() - body.work(torque))
        assert np.diff(stored).max() < 1e-5 * at_play, second
        assert max(stored) <= stored[0] + 1e-5 * at_play, second


@pytest.mark.parametrize("torque", [-0.5, 0.5, 0.0])
@pytest.mark.parametrize("second", [
    named("asymmetric_friction", coulomb_nm=4.0), named("load_friction", coefficient=0.3),
    named("position_friction", amplitude_nm=4.0, cycles_per_turn=500.0),
    named("stribeck_friction_motor", torque_nm=4.0, velocity_rad_s=0.01),
], ids=lambda on: next(iter(on)).split(".")[0])  # fmt: skip
@pytest.mark.parametrize("bare", [{"fv": 0.0, "fvm": 0.0}, {**APART, "fvm": 0.05}],
                         ids=["frictionless link", "motor alone"])  # fmt: skip
def test_presliding_beside_another_friction_comes_to_rest_under_a_torque_below_it(
    bare, second, torque
):
    body = Rig({**bare, "fs": 0.0}, named("presliding_friction", motor_rad=1e-3) | second)
    states = body.play(np.full(4000, torque))
    assert np.abs(states[-500:, 3]).max() < 5e-3
    assert np.ptp(states[-500:, 2]) < 1e-4
    assert np.abs(states[:, 2]).max() < 5e-3


@pytest.mark.parametrize("identifier", ["kinematic_error", "extra_mode", "gravity", "cogging",
                                        "external_spring", "hardening_spring",
                                        "backlash", "piecewise_stiffness",
                                        "asymmetric_stiffness"])  # fmt: skip
def test_conservative_effects_keep_the_energy_without_friction(identifier):
    values = {**MODERATE[identifier]}
    values.pop("damping_ratio", None)
    on = named(identifier, **values)
    if identifier == "extra_mode":
        on["extra_mode.damping_ratio"] = 0.0
    body = Rig({"fs": 0.0, "fsm": 0.0, "fv": 0.0, "fvm": 0.0}, on)
    before = body.start(q=0.02, vq=0.5, th=0.0, vth=-0.3).energy()
    body.play(np.zeros(1000), parts=4)
    kinetic = 0.5 * (0.3 * 0.5**2 + 0.2 * 0.3**2) + 0.5 * 1500.0 * 0.02**2
    assert abs(body.energy() - before) < 1e-4 * kinetic


STICKING = sorted(
    set(IDENTIFIERS)
    - {"presliding_friction", "lugre_friction", "torque_bias", "external_spring"}
    - {"gravity", "hardening_spring", "cogging", "nonstationary"}
)


@pytest.mark.parametrize("identifier", STICKING)
def test_sticking_is_exact_with_an_effect_on(identifier):
    """Below the lowest level both sides keep every bit of their position."""
    body = Rig({}, named(identifier, **MODERATE[identifier]))
    body.start(q=0.0123, th=0.0123)
    if identifier == "kinematic_error":  # put the link where the gear wants it
        angle = 20.0 * 0.0123 + 0.3
        body.start(q=0.0123 - 1e-3 * math.sin(angle), th=0.0123)
    place = body.x[:4].copy()
    for torque in (3.0, -3.0, 0.0, 3.9):
        state = body.hold(torque, 0.01, parts=5)
        assert np.array_equal(state[:4], place)


@pytest.mark.parametrize("identifier", sorted(set(IDENTIFIERS) - EVEN))
def test_odd_effects_keep_the_loop_odd_bit_for_bit(identifier):
    r = multisine_reference(7e-3)[:3000]
    on, rigid = moderate(identifier), axis(identifier)
    result, mirror = simulate(r, on, 20.0, **rigid), simulate(-r, on, 20.0, **rigid)
    for signal in SIGNALS:
        assert np.array_equal(getattr(result, signal), -getattr(mirror, signal))


@pytest.mark.parametrize("identifier", sorted(EVEN))
def test_even_effects_break_the_symmetry(identifier):
    r = multisine_reference(7e-3)[:3000]
    result, mirror = simulate(r, moderate(identifier)), simulate(-r, moderate(identifier))
    assert relative_rms(-mirror.torque, result.torque) > 1e-4


def closed_loop_in_parts(r, e, p, parts):
    """Return the position of the loop whose plant takes at least `parts` steps in a sample."""
    state, memory, position = rig.at_rest(), 0.0, np.empty(r.size)
    for k in range(r.size):
        position[k] = y = rig.measure(state, 0.0, e)
        memory, u = pd_filtered.step(memory, r[k] - y, CONTROLLER)
        for _ in range(parts):
            rig.hold(state, u, 1.0 / RATE / parts, p, e)
    return position


@pytest.mark.parametrize("amplitude", [2e-3, 7e-3, 2e-2])
@pytest.mark.parametrize("identifier", IDENTIFIERS)
def test_ten_times_finer_steps_change_the_position_by_less_than_a_thousandth(identifier, amplitude):
    r = multisine_reference(amplitude)[:4000]
    on, rigid = moderate(identifier), axis(identifier)
    p, e = plant.coefficients({**PAPER, **rigid, **on}), effects.coefficients(on)
    fine = closed_loop_in_parts(r, e, p, 20)
    default = simulate(r, on, **rigid).position
    assert relative_rms(default, fine) < 1e-3
    assert not np.array_equal(default, fine)


@pytest.mark.parametrize("identifier", ["backlash", "piecewise_stiffness", "hysteresis",
                                        "presliding_friction", "kinematic_error",
                                        "extra_mode"])  # fmt: skip
def test_the_order_stays_four_across_reversals_and_kinks(identifier):
    torque = simulate(multisine_reference(7e-3)[:1000], None).torque
    on = named(identifier, **MODERATE[identifier])
    runs = [Rig({}, on).play(torque, parts=parts)[:, 2] for parts in (2, 4, 8, 64)]
    errors = np.array([relative_rms(run, runs[-1]) for run in runs[:-1]])
    assert np.log2(errors[:-1] / errors[1:]).min() > 3.6
    assert errors[0] < 1e-4


def extremes(parameter) -> st.SearchStrategy[float]:
    high = parameter.high if math.isfinite(parameter.high) else 1e6
    span = high - parameter.low
    corners = st.sampled_from([parameter.low, high, parameter.default, parameter.low + 1e-9 * span])
    return corners | st.floats(-9.0, 0.0).map(lambda power: parameter.low + span * 10.0**power)


@st.composite
def absurd_values(draw) -> dict[str, float]:
    chosen = draw(st.lists(st.sampled_from(effects.CATALOGUE), min_size=1, max_size=6, unique=True))
    return {
        name: min(max(draw(extremes(parameter)), parameter.low), parameter.high)
        for effect in chosen
        for name, parameter in zip(effect.names, effect.parameters, strict=True)
    }


@settings(max_examples=200)
@given(values=absurd_values(), frictionless=st.booleans())
def test_absurd_parameters_end_in_motion_or_one_sentence(values, frictionless):
    bare = {"fs": 0.0, "fsm": 0.0, "fv": 0.0, "fvm": 0.0} if frictionless else {}
    try:
        result = simulate(multisine_reference(7e-3)[:20], values, **bare)
    except InputError as error:
        assert "diverges at" in str(error)
        assert str(error).endswith(".") and str(error).count(". ") == 0
    else:
        assert np.isfinite(result.torque).all()
