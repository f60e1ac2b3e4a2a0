from __future__ import annotations

import numpy as np
import pytest
import simulated_loop as loop

from bla_analyzer.bla.robust import INPUT_VARIANCE_LIMIT
from bla_analyzer.checks import (
    PERIODICITY_LIMIT,
    TRANSIENT_LIMIT,
    check_realization,
    input_snr,
    periodicity,
    position_unit,
    transient,
)
from controller_node import pd_filtered
from excitation_node.multisine import EXCITATION, describe, reference
from fjr_kit.errors import InputError
from fjr_records.lines import Grid
from fjr_records.realization import read_realization
from fjr_sim_node import plant
from fjr_sim_node.simulation import closed_loop

LINES = loop.lines(256)


def grid(periods=3, transient_periods=1, samples=256, lines=LINES):
    return Grid(loop.RATE_HZ, samples, transient_periods, periods, lines)


def signals(periods, noise_std=0.0, seed=0, cubic=2e-7):
    """Return r, u, y from rest, (periods * 256,)."""
    rng = np.random.default_rng(seed)
    r = np.tile(loop.multisines(LINES.excited, 1, 256, rng), periods)
    u, y = loop.run(r, cubic, noise_std * rng.standard_normal(r.shape))
    return r[0], u[0], y[0]


def read(data, used, **options):
    size = used.samples_per_period
    count = -(-data[0].size // size)
    blocks = [tuple(x[i * size : (i + 1) * size] for x in data) for i in range(count)]
    return read_realization("bag_7", 2, 3, blocks, used, **options)


@pytest.mark.parametrize("noise_db", [0, -10, -20])
def test_white_encoder_noise_is_not_taken_for_a_response_that_does_not_repeat(noise_db):
    _, _, y = signals(4)
    for seed in range(5):
        data = signals(6, noise_std=np.std(y) * 10 ** (noise_db / 20), seed=seed)
        check = periodicity(read(data, grid(3, 3)))
        assert check.passed, check
        assert "is periodic" in check.sentence
        assert (check.name, check.level, check.realization) == ("periodicity", 2, 3)


def test_motion_that_does_not_repeat_is_found_without_and_with_noise():
    rng = np.random.default_rng(1)
    r, u, y = signals(8, noise_std=0.02)
    slow = np.cumsum(np.cumsum(rng.standard_normal(y.size)))  # falls off as masses do
    slow -= np.polynomial.Polynomial.fit(np.arange(y.size), slow, 9)(np.arange(y.size))
    check = periodicity(read((r, u, y + 0.8 * slow / slow.std() * y.std()), grid(5, 3)))
    assert not check.passed
    assert check.value > PERIODICITY_LIMIT
    assert "bag_7: the response is not periodic" in check.sentence


def subharmonic(r, u, y, share, samples=256):
    """Add a motion of twice the period, of a share of y's rms."""
    t = np.arange(y.size) / samples
    motion = np.sin(np.pi * 2 * 9.5 * t) + 0.5 * np.sin(np.pi * 2 * 4.5 * t + 1.0)
    return r, u, y + share * y.std() * motion / motion.std()


@pytest.mark.parametrize("periods", [2, 3, 6])
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_subharmonic_of_six_percent_is_not_called_noise(periods, noise):
    level = np.std(signals(4)[2])
    for seed in range(5):
        data = signals(periods + 3, noise * level, seed)
        check = periodicity(read(subharmonic(*data, 0.06), grid(periods, 3)))
        assert not check.passed, check
        assert 0.03 < check.value < 0.09
        assert "beyond noise" in check.sentence


def test_a_subharmonic_within_the_noise_is_found_by_its_order_of_periods():
    level = np.std(signals(4)[2])
    data = signals(15, 0.2 * level, 3)
    mismatch = read(data, grid(12, 3)).mismatch
    assert mismatch.unexplained == 0.0 and mismatch.position > 0.06
    check = periodicity(read(subharmonic(*data, 0.1), grid(12, 3)))
    assert not check.passed and 0.05 < check.value < 0.12


@pytest.mark.parametrize("periods", [2, 3, 5])
def test_white_and_coloured_noise_raise_an_alarm_as_seldom_as_stated(periods):
    # 400 records at a probability of 1e-4 of each of two tests: one alarm in twelve such runs
    rng = np.random.default_rng(0)
    r, u, y = signals(3 + periods)
    alarms = 0
    for index in range(400):
        noise = rng.standard_normal(y.size)
        if index % 2 and periods > 2:  # by order alone: white above the band, stronger in it
            slow = np.cumsum(rng.standard_normal(y.size))
            noise = noise + 0.05 * (slow - np.convolve(slow, np.ones(64) / 64, "same"))
        check = periodicity(read((r, u, y + 0.3 * y.std() * noise), grid(periods, 3)))
        alarms += not check.passed
    assert alarms <= 1


def test_noise_free_response_is_periodic_to_round_off():
    realization = read(signals(14), grid(2, 12))
    assert realization.mismatch.position < 1e-12
    assert realization.mismatch.torque < 1e-12
    assert all(check.passed for check in check_realization(realization, LINES.excited))


def paper_case(amplitude, periods=3):
    values = EXCITATION.defaults() | {"amplitudes_rad": (amplitude,), "periods": periods}
    described = describe(values, 0, 0)
    r = reference(described)
    controller = pd_filtered.coefficients(pd_filtered.CONTROLLER.defaults())
    rig = plant.coefficients(plant.PLANT.defaults())
    out = closed_loop.simulate(r, described.sample_rate_hz, rig, controller)
    lines = loop.classify(described.excited_harmonics, described.detection_harmonics)
    used = Grid(1000.0, described.samples_per_period, 1, periods, lines)
    return read((r, out.torque, out.position), used)


def test_the_papers_large_amplitude_at_1_khz_is_not_periodic_and_the_small_one_is():
    large, small = periodicity(paper_case(9e-2)), periodicity(paper_case(7e-3))
    assert not large.passed
    assert 0.3 < large.value < 0.7
    assert small.passed
    assert small.value < 1e-6


def test_transient_is_found_where_nothing_is_discarded():
    check = transient(read(signals(3), grid(3, 0)))
    assert not check.passed
    assert check.value > TRANSIENT_LIMIT
    assert "discard more periods" in check.sentence


def test_transient_is_found_at_the_end_of_the_discarded_period():
    r, u, y = signals(5)
    decay = 0.5 * y.std() * np.exp(-np.arange(y.size) / 200.0)
    realization = read((r, u, y + decay), grid(2, 1))
    assert not transient(realization).passed
    assert transient(read((r, u, y + decay), grid(2, 3))).passed


@pytest.mark.parametrize("noise_db", [-100, -20, 0])
def test_noise_is_not_taken_for_a_transient(noise_db):
    std = np.std(signals(4)[2]) * 10 ** (noise_db / 20)
    for seed in range(20):
        assert transient(read(signals(4, std, seed), grid(2, 2))).passed


def test_input_snr():
    good = input_snr(read(signals(4, 0.001), grid(2, 2)), LINES.excited)
    assert good.passed
    assert good.value < 1e-4
    r, u, y = signals(4)
    noise = np.random.default_rng(0).standard_normal(u.size)
    bad = input_snr(read((r, u + 10 * u.std() * noise, y), grid(2, 2)), LINES.excited)
    assert not bad.passed
    assert bad.value > INPUT_VARIANCE_LIMIT
    assert "dB" in bad.sentence


def test_input_snr_is_the_stated_ratio():
    r, u, y = signals(12)
    noise = u.std() * np.random.default_rng(4).standard_normal(u.size)
    value = input_snr(read((r, u + noise, y), grid(10, 2)), LINES.excited).value
    power = 2 * u.var() / LINES.excited.size  # about, of each line
    expected = 4 * u.var() / 256 / 10 / power
    assert value == pytest.approx(expected, rel=0.5)


def test_one_period_can_be_read_and_says_what_it_cannot_show():
    *within_periods, unit = check_realization(read(signals(3), grid(1, 2)), LINES.excited)
    assert unit.name == "position_unit" and unit.passed and np.isfinite(unit.value)
    for check in within_periods:
        assert check.passed
        assert np.isnan(check.value)
        assert "one period cannot show" in check.sentence


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(180 / np.pi, "degrees"), (1e3, "mrad"), (1e6, "urad")],
)
def test_position_in_another_unit_taken_for_rad_is_named(factor, unit):
    r, u, y = signals(4)
    good = position_unit(read((r, u, y), grid()), LINES.excited)
    assert good.passed and 0.3 < good.value < 1.2
    bad = position_unit(read((r, u, factor * y), grid()), LINES.excited)
    assert not bad.passed and bad.value == pytest.approx(factor * good.value)
    assert f"y is {bad.value:.3g} times r" in bad.sentence
    assert f"y seems to be in {unit} and taken for rad, which gives {factor:.4g}" in bad.sentence
    assert "give position and reference in rad" in bad.sentence


def test_a_reference_in_degrees_is_named_and_a_joint_that_sticks_is_not_said_to_follow():
    r, u, y = signals(4)
    follows = position_unit(read((r, u, y), grid()), LINES.excited).value
    degrees = position_unit(read((np.degrees(r), u, y / follows), grid()), LINES.excited)
    assert not degrees.passed and degrees.value == pytest.approx(180 / np.pi)
    assert "r seems to be in degrees and taken for rad, which gives 57.3" in degrees.sentence
    assert "reference=COLUMN:deg" in degrees.sentence
    stuck = position_unit(read((r, u, y / follows / 20), grid()), LINES.excited)
    assert stuck.passed and "the joint hardly moves, or r is in another unit" in stuck.sentence


def test_position_of_no_known_unit_and_without_reference():
    r, u, y = signals(4)
    strange = position_unit(read((r, u, 1e9 * y), grid()), LINES.excited)
    assert not strange.passed and "counts of an encoder); give" in strange.sentence
    open_loop = position_unit(read((u, u, 1e9 * y), grid()), LINES.excited)
    assert open_loop.passed and np.isnan(open_loop.value)


def test_levels_and_signals_of_a_realization():
    r, u, y = signals(4)
    got = read((r, u, y), grid(3, 1), keep_signals=True)
    kept = slice(256, None)
    expected = [np.mean(x[kept] ** 2) for x in (r, u, y)]
    np.testing.assert_allclose(got.mean_square, expected)
    np.testing.assert_allclose(got.peak, [np.abs(x[kept]).max() for x in (r, u, y)])
    assert got.signals is not None
    np.testing.assert_array_equal(got.signals.position_rad, y[-256:])
    np.testing.assert_array_equal(got.signals.reference_rad, r[-256:])
    np.testing.assert_allclose(got.signals.time_s, np.arange(256) / 100.0)
    assert read((r, u, y), grid(3, 1)).signals is None


def test_rest_and_surplus_periods_are_left_out_but_read():
    r, u, y = (np.concatenate([x, x[:100]]) for x in signals(5))
    consumed = []

    def blocks():
        for start in range(0, r.size, 256):
            consumed.append(start)
            yield r[start : start + 256], u[start : start + 256], y[start : start + 256]

    got = read_realization("bag", 0, 0, blocks(), grid(2, 1))
    assert got.spectra.periods == 2
    assert len(consumed) == 6
    expected = read((r[: 3 * 256], u[: 3 * 256], y[: 3 * 256]), grid(2, 1))
    np.testing.assert_array_equal(got.spectra.position, expected.spectra.position)


def test_too_few_periods_are_refused():
    with pytest.raises(InputError, match="bag_7: holds fewer than 4 periods of 256 samples"):
        read(signals(3), grid(3, 1))


def test_reference_that_does_not_repeat_is_refused():
    r, u, y = signals(4)
    with pytest.raises(InputError, match="bag_7: the reference does not repeat after 250 samples"):
        read((r, u, y), grid(2, 1, samples=250))


@pytest.mark.parametrize(("signal", "name"), [(0, "reference"), (1, "torque")])
def test_silent_excited_line_is_refused_by_name(signal, name):
    data = list(signals(4))
    line = int(LINES.excited[3])
    spectrum = np.fft.rfft(data[signal].reshape(4, 256))
    spectrum[:, line] = 0
    data[signal] = np.fft.irfft(spectrum).ravel()
    with pytest.raises(InputError, match=f"bag_7: the {name} is zero on excited harmonic {line} "):
        read(tuple(data), grid(2, 2))


@pytest.mark.parametrize("scale", [1e-150, 1e-300])
def test_a_position_whose_squares_underflow_is_refused(scale):
    r, u, y = signals(4)
    with pytest.raises(InputError, match="the position is zero on excited harmonic 1 "):
        read((r, u, scale * y), grid(2, 1))


def test_constant_reference_is_refused():
    _, u, y = signals(4)
    with pytest.raises(InputError, match="reference is zero on excited harmonic 1 "):
        read((np.full(u.shape, 0.3), u, y), grid(2, 1))
