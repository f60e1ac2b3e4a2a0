"""Starts and bounds of fits follow the record, not a rig: other sizes and units, other starts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT
from gap_diagnosis.starts.scales import Scales
from gap_diagnosis.starts.search_space import Space, space_for, starts

PAPER_LIKE = Scales(
    torque_nm=150.0, velocity_rad_s=8.0, angle_rad=0.065, deflection_rad=0.1,
    period_s=1e-3, band_hz=50.0, inertia_kg_m2=0.5, peak_torque_nm=780.0,
)  # fmt: skip
FITTED = [effect.identifier for effect in fx.CATALOGUE if effect.starts]

logarithmic = st.floats(-3.0, 3.0).map(lambda power: 10.0**power)


@st.composite
def any_scales(draw) -> Scales:
    torque = draw(logarithmic)
    rate = draw(st.sampled_from([100.0, 1000.0, 5000.0]))
    angle = draw(logarithmic)
    return Scales(
        torque, draw(logarithmic), angle, angle * draw(st.floats(1e-3, 1.0)), 1.0 / rate,
        draw(st.floats(0.01, 0.5)) * rate, draw(logarithmic), torque * draw(st.floats(1.0, 20.0)),
    )  # fmt: skip


@given(any_scales())
def test_every_start_of_any_record_lies_within_the_bounds_of_its_fit(scales):
    for effect in FITTED:
        points = starts(effect, scales)
        assert points and len(points) == len({tuple(point.items()) for point in points})
        for point in points:
            space = space_for({"jm": 1.0, "k0": 1.0}, point, scales)
            low, high = space.bounds()
            x = space.point(space.model(np.clip(np.zeros(low.size), low, high)))
            assert np.isfinite(x).all() and (low <= high).all()
            for name, value in point.items():
                least, most = scales.bounds(name)
                assert least <= value <= most, name
                assert abs(value) >= scales.negligible(name) or value == 0.0, name


def test_fits_do_not_leave_what_the_simulator_takes():
    """A fit that ended beyond could not be written as parameters of a simulation."""
    nominal = {"jm": 2e-9, "j": 3.0, "k0": 500.0, "fsm": 9e4, "k1": 0.0}
    space = Space(nominal, (), (), 0.1, PAPER_LIKE)
    for x in space.bounds():
        for name, value in space.model(x).plant.items():
            assert PLANT[name].low <= value <= PLANT[name].high
    free = Space({"jm": 1.0}, (), (), 0.1, PAPER_LIKE).bounds()
    assert free[1] == pytest.approx(-free[0]) and free[1] > 0.5
    heavy = Space({"jm": 1.5e4}, (), (), 0.1, PAPER_LIKE).bounds()  # the sum of a rigid axis
    assert heavy[0] == -free[1] and heavy[1] == 0.0


def test_starts_follow_torque_velocity_and_angle_by_their_units():
    other = replace(PAPER_LIKE, torque_nm=1.5, velocity_rad_s=0.08)
    for effect, name, factor in [
        ("torque_bias", "torque_nm", 1e-2),
        ("transmission_damping", "nm_s_rad", 1.0),
        ("quadratic_friction", "motor_nm_s2_rad2", 1e2),
        ("stribeck_friction_motor", "velocity_rad_s", 1e-2),
        ("backlash", "half_gap_rad", 1.0),
        ("load_friction", "coefficient", 1.0),
    ]:
        first, second = starts(effect, PAPER_LIKE)[0], starts(effect, other)[0]
        full = f"{effect}.{name}"
        assert second[full] == pytest.approx(factor * first[full], rel=1e-9), full
    slower = starts("delay", replace(PAPER_LIKE, period_s=1e-2))
    assert slower[0]["delay.time_s"] == pytest.approx(1e-3)
    assert slower[-1]["delay.time_s"] == pytest.approx(0.1)  # never beyond what is physical


def test_the_gap_of_a_transmission_is_sought_in_its_deflection_not_in_the_motion():
    stiff = replace(PAPER_LIKE, deflection_rad=1e-4)
    gaps = [point["backlash.half_gap_rad"] for point in starts("backlash", stiff)]
    assert max(gaps) == pytest.approx(4e-4)  # four times it
    assert starts("presliding_friction", stiff) == starts("presliding_friction", PAPER_LIKE)


@given(any_scales(), st.floats(0.01, 2.0))
@example(replace(PAPER_LIKE, velocity_rad_s=1e-3, angle_rad=0.1), 1.0)  # 2e6 by its samples
def test_ripples_are_those_that_the_motion_can_show(scales, slow):
    """Down to a few in its slow stretches, in even steps that a fit can bridge."""
    scales = replace(scales, slow_rad_s=slow * scales.velocity_rad_s)
    cycles = scales.cycles()
    travelled = 8.0 * scales.angle_rad  # to and fro, of a motion that looks like noise
    assert cycles[0] == pytest.approx(max(0.25 * 2.0 * math.pi / travelled, 0.02), rel=0.05)
    step = cycles[1] - cycles[0]
    assert 0.0 < step * scales.angle_rad <= 0.5 * (1 + 1e-9)
    np.testing.assert_allclose(np.diff(cycles), step, rtol=1e-6)  # of up to half a million
    sampled = 2.0 * math.pi / (3.0 * scales.period_s * min(slow, 1.0) * scales.velocity_rad_s)
    assert cycles[-1] <= max(sampled, 4.0 * cycles[0]) * (1 + 1e-9)
    assert cycles[-1] >= min(0.9 * sampled, 8e5) or cycles.size > 400_000
    assert (
        scales.bounds("cogging.cycles_per_turn")[1] <= fx.parameter("cogging.cycles_per_turn").high
    )


def test_slow_stretches_show_finer_ripples_and_rest_shows_none():
    rng = np.random.default_rng(1)
    pieces = [np.zeros(3000), *(np.full(1000, way) for way in (1e-3, -1e-4, -9e-4)), np.zeros(3000)]
    way = np.cumsum(np.concatenate(pieces))
    nominal = {"jm": 0.5}
    noisy = way + 1e-5 * rng.standard_normal(way.size)
    scales = Scales.of_record([noisy], [np.ones(way.size)], 1000.0, 100.0, nominal)
    assert scales.slow_rad_s == pytest.approx(0.9, rel=0.1)  # a twentieth of the way is slower
    slower = np.cumsum(np.concatenate([*pieces, np.full(3000, 1e-4)]))
    scales = Scales.of_record([slower], [np.ones(slower.size)], 1000.0, 100.0, nominal)
    assert scales.slow_rad_s == pytest.approx(0.1, rel=0.1)
    still = Scales.of_record([0.0 * way], [np.ones(way.size)], 1000.0, 100.0, nominal)
    assert still.cycles().size > 1


def test_scales_are_those_of_the_record():
    rate, band = 1000.0, 20.0
    t = np.arange(8000) / rate
    motion = 0.3 + 0.2 * np.sin(2.0 * np.pi * 5.0 * t)
    noisy = motion + 1e-4 * np.random.default_rng(1).standard_normal(t.size)
    torque = 3.0 * np.cos(2.0 * np.pi * 5.0 * t)
    nominal = {"jm": 0.2, "j": 0.3, "k0": 100.0}
    halves = [torque[:4000], torque[4000:]]
    scales = Scales.of_record([noisy[:4000], noisy[4000:]], halves, rate, band, nominal)
    assert scales.angle_rad == pytest.approx(0.2 / math.sqrt(2.0), rel=1e-3)
    assert scales.velocity_rad_s == pytest.approx(2.0 * math.pi / math.sqrt(2.0), rel=0.02)
    assert scales.torque_nm == pytest.approx(3.0 / math.sqrt(2.0), rel=1e-3)
    assert scales.deflection_rad == pytest.approx(scales.torque_nm / 100.0)
    assert (scales.period_s, scales.band_hz) == (1e-3, band)
    assert scales.inertia_kg_m2 == 0.5 and scales.peak_torque_nm == pytest.approx(3.0, rel=1e-3)
    rigid = Scales.of_record([noisy], [torque], rate, band, {"jm": 0.5})
    assert rigid.deflection_rad == rigid.angle_rad and rigid.inertia_kg_m2 == 0.5


def test_a_stall_torque_is_that_of_the_line_which_the_record_reaches():
    rate, band = 1000.0, 20.0
    t = np.arange(8000) / rate
    w = 2.0 * np.pi * 5.0
    torque = 3.0 * np.cos(w * t) + 1.0 * np.sin(w * t)  # drives with 3 at speed 0.2 w, 1 at rest
    scales = Scales.of_record([0.2 * np.sin(w * t)], [torque], rate, band, {"jm": 0.5})
    phase = np.linspace(0.0, 2.0 * np.pi, 100000)
    speed, driven = 0.2 * w * np.cos(phase), 3.0 * np.cos(phase) + np.sin(phase)
    for no_load in (1.5 * 0.2 * w, 4.0 * 0.2 * w):
        exact = np.max(np.abs(driven) / (1.0 - np.maximum(np.sign(driven) * speed, 0.0) / no_load))
        assert scales.stall_nm(no_load) == pytest.approx(exact, rel=0.04)
    assert scales.stall_nm(1e9) == pytest.approx(scales.peak_torque_nm, rel=1e-6)
    still = Scales.of_record([0.0 * t], [torque], rate, band, {"jm": 0.5})
    assert still.stall_nm(1.0) == still.peak_torque_nm


def test_the_paper_s_rig_starts_where_its_effects_usually_are():
    def values(effect, name):
        return sorted({point[f"{effect}.{name}"] for point in starts(effect, PAPER_LIKE)})

    assert np.allclose(values("presliding_friction", "motor_rad"), [2e-5, 2e-4, 2e-3], rtol=0.05)
    assert np.allclose(values("stribeck_friction_link", "velocity_rad_s")[:3], [0.02, 0.1, 0.5],
                       rtol=0.05)  # fmt: skip
    assert values("delay", "time_s")[0] == pytest.approx(1e-4)
    assert PAPER_LIKE.bounds("extra_mode.frequency_hz") == pytest.approx((2.0, 120.0))


def test_what_is_known_is_not_free_and_a_ripple_stays_the_one_that_it_was():
    nominal = {"jm": 0.2, "fsm": 0.0, "fvm": 0.0}
    start = {"cogging.amplitude_nm": 2.0, "cogging.cycles_per_turn": 40.0, "cogging.phase_rad": 0.0}
    free = space_for(nominal, start, PAPER_LIKE)
    short, long = (replace(PAPER_LIKE, travel_rad=travel) for travel in (0.01, 0.1 * math.pi))
    near = replace(free, known=("jm",), cycles={"cogging.cycles_per_turn": 40.0}, scales=short)
    at = 3 + free.effects.index("cogging.cycles_per_turn")
    low, high = near.bounds()
    assert low[0] == high[0] == 0.0 and free.bounds()[0][0] < 0.0 < free.bounds()[1][0]
    assert low[at] == pytest.approx(0.5) and high[at] == pytest.approx(2.0)
    assert free.bounds()[0][at] < 0.5 and free.bounds()[1][at] > 2.0
    nearer = replace(near, scales=long).bounds()  # of two ripples no more than a tenth of one
    assert [bound[at] for bound in nearer] == pytest.approx([0.95, 1.05])
