"""Chirps, noise, moves and steps: their spectra, limits and starts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import welch

from excitation_node import records
from fjr_kit.errors import InputError

RATE = 500.0
BAND = {"f_min_hz": 2.0, "f_max_hz": 40.0}


@pytest.mark.parametrize("sweep", ["linear", "logarithmic"])
def test_a_chirp_sweeps_its_band_once(sweep):
    signal = records.chirp(20_000, RATE, amplitude_rad=0.1, sweep=sweep, soft_start_s=0.0, **BAND)
    assert np.abs(signal).max() == pytest.approx(0.1, rel=1e-2)
    crossings = np.flatnonzero(np.diff(np.signbit(signal))) / RATE
    frequency = 0.5 / np.diff(crossings)
    middle = (crossings[1:] + crossings[:-1]) / 2 / 40.0
    expected = 2.0 + 38.0 * middle if sweep == "linear" else 2.0 * 20.0**middle
    assert np.median(np.abs(frequency / expected - 1.0)) < 0.05
    assert np.abs(signal[0]) < 0.1 * 2 * np.pi * 2.1 / RATE


def test_noise_is_gaussian_flat_and_of_the_rms_that_was_asked_for():
    signal = records.noise(200_000, RATE, rms_rad=0.02, seed=4, **BAND)
    degrees = 2 * 38.0 * 400.0  # of freedom in band times duration
    assert signal.std() == pytest.approx(0.02, rel=4.0 / np.sqrt(2 * degrees))
    frequency, power = welch(signal, RATE, nperseg=2000)
    inside = (frequency > 3.0) & (frequency < 39.0)
    assert power[inside].mean() == pytest.approx(0.02**2 / 38.0, rel=0.05)
    assert power[inside].std() / power[inside].mean() < 0.15
    assert power[(frequency < 1.0) | (frequency > 41.0)].max() < 1e-2 * power[inside].mean()
    assert np.mean(signal**4) / np.mean(signal**2) ** 2 == pytest.approx(3.0, abs=0.15)
    # Its second half is no repetition of the first.
    assert abs(np.corrcoef(signal[:100_000], signal[100_000:])[0, 1]) < 0.05
    again = records.noise(200_000, RATE, rms_rad=0.02, seed=4, **BAND)
    assert np.array_equal(signal, again)


@given(
    st.lists(st.integers(-200, 200).map(lambda x: x / 100), min_size=1, max_size=4).filter(any),
    st.floats(0.05, 5.0),
    st.floats(0.5, 50.0),
    st.sampled_from([0.0, 0.05, 0.5]),
)
def test_moves_keep_velocity_and_acceleration_and_reach_their_targets(targets, v, a, dwell):
    signal = records.trapezoid(
        20_000, RATE, targets_rad=targets, velocity_rad_s=v, acceleration_rad_s2=a, dwell_s=dwell
    )
    whole = np.concatenate([[0.0], signal])
    speed = np.diff(whole) * RATE
    assert np.abs(speed).max() <= v * (1 + 1e-6)
    assert np.abs(np.diff(speed, prepend=0.0)).max() * RATE <= 2 * a * (1 + 1e-6)
    assert signal.min() >= min(*targets, 0.0) - 1e-9 and signal.max() <= max(*targets, 0.0) + 1e-9
    first = next(target for target in targets if target)
    ramp = min(v / a, np.sqrt(abs(first) / a))
    arrival = int((abs(first) / (ramp * a) + ramp + dwell * targets.index(first)) * RATE) + 1
    if dwell > 0.01:
        assert signal[arrival] == pytest.approx(first, abs=1e-9)


def test_each_move_may_have_its_own_speed():
    signal = records.trapezoid(
        4000, RATE, targets_rad=[1.0, 0.0], velocity_rad_s=[0.5, 2.0], acceleration_rad_s2=20.0
    )
    speed = np.diff(signal) * RATE
    assert speed.max() == pytest.approx(0.5) and speed.min() == pytest.approx(-2.0)


def test_a_single_target_is_reached_and_held():
    signal = records.trapezoid(
        1000, RATE, targets_rad=[0.2], velocity_rad_s=1.0, acceleration_rad_s2=10.0
    )
    assert np.array_equal(signal[500:], np.full(500, 0.2))


def test_steps_hold_each_target():
    signal = records.steps(40, 10.0, targets_rad=[0.1, -0.2], hold_s=0.5)
    assert np.array_equal(signal[:4], np.zeros(4))
    assert np.array_equal(signal[4:9], np.full(5, 0.1))
    assert np.array_equal(signal[9:14], np.full(5, -0.2))
    assert np.array_equal(signal[14:19], np.full(5, 0.1))


@pytest.mark.parametrize(
    ("make", "change", "says"),
    [
        (records.chirp, {"f_max_hz": 250.0}, "f_max_hz 250 must be a band"),
        (records.chirp, {"f_min_hz": 0.0}, "f_min_hz 0 and"),
        (records.chirp, {"amplitude_rad": float("nan")}, "amplitude_rad must be greater"),
        (records.chirp, {"soft_start_s": -1.0}, "soft_start_s must be zero or greater"),
        (records.chirp, {"samples": 0}, "samples must be greater"),
        (records.noise, {"f_min_hz": 2.0, "f_max_hz": 2.001}, "holds no line of 501 samples"),
        (records.trapezoid, {"targets_rad": [0.0]}, "targets_rad must hold"),
        (records.trapezoid, {"targets_rad": [1e-3, 1e-3 + 1e-13]}, "less than a sample"),
        (records.trapezoid, {"velocity_rad_s": [1.0, 0.0]}, "velocity_rad_s must be greater"),
        (records.steps, {"targets_rad": []}, "targets_rad must hold"),
        (records.steps, {"hold_s": 0.0}, "hold_s must be greater"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(make, change, says):
    known = {
        records.chirp: {"amplitude_rad": 0.1, **BAND},
        records.noise: {"rms_rad": 0.1, "seed": 1, **BAND},
        records.trapezoid: {
            "targets_rad": [1.0], "velocity_rad_s": 1.0, "acceleration_rad_s2": 1.0,
        },
        records.steps: {"targets_rad": [1.0], "hold_s": 1.0},
    }[make]  # fmt: skip
    arguments = {"samples": 501, "sample_rate_hz": RATE, **known, **change}
    with pytest.raises(InputError, match=says):
        make(arguments.pop("samples"), arguments.pop("sample_rate_hz"), **arguments)
