"""The excitation: grid of lines, phases, spectrum, description."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from excitation_node import multisine
from fjr_interface.experiment import Experiment
from fjr_kit.errors import InputError


def describe(level=0, realization=0, **values):
    return multisine.describe(multisine.EXCITATION.check(values), level, realization)


def test_the_papers_grid():
    experiment = describe()
    assert len(experiment.excited_harmonics) == 167
    assert len(experiment.detection_harmonics) == 83
    assert experiment.samples_per_period == 10_000
    every = sorted(experiment.excited_harmonics + experiment.detection_harmonics)
    assert every == list(range(1, 501, 2))
    r = multisine.reference_period(experiment)
    assert np.sqrt(np.mean(r**2)) / 7e-3 == pytest.approx(9.14, abs=0.005)


bands = st.tuples(st.integers(1, 200), st.integers(0, 400)).map(lambda b: (b[0], b[0] + b[1] + 1))


@given(bands, st.integers(2, 6), st.integers(0, 2**31 - 1))
def test_one_line_of_each_group_is_left_out(band, group, seed):
    grid = multisine.make_grid(*band, "odd_random", group, seed)
    odd = [h for h in range(band[0], band[1] + 1) if h % 2]
    assert sorted(grid.excited + grid.detection) == odd
    whole = len(odd) // group
    assert len(grid.detection) == whole
    for i in range(whole):
        members = odd[i * group : (i + 1) * group]
        assert len(set(members) & set(grid.detection)) == 1


@given(st.integers(0, 2**31 - 1))
def test_every_place_in_a_group_is_drawn(seed):
    grid = multisine.make_grid(1, 1999, "odd_random", 4, seed)
    places = np.bincount((np.array(grid.detection) // 2) % 4, minlength=4)
    assert places.sum() == 250
    assert places.min() > 25  # 62.5 expected; 25 lies 5.5 standard deviations below


def test_odd_and_full_grids_leave_nothing_out():
    assert multisine.make_grid(1, 9, "odd") == multisine.Grid((1, 3, 5, 7, 9), ())
    assert multisine.make_grid(2, 5, "full") == multisine.Grid((2, 3, 4, 5), ())


@given(
    st.lists(st.integers(1, 249), min_size=1, max_size=40, unique=True),
    st.integers(500, 700),
    st.integers(0, 2**31 - 1),
)
def test_the_spectrum_has_exactly_the_lines(harmonics, samples, seed):
    rng = np.random.default_rng(seed)
    amplitudes = rng.uniform(1e-3, 1.0, len(harmonics))
    phases = multisine.draw_phases(seed, len(harmonics))
    period = multisine.one_period(np.array(harmonics), amplitudes, phases, samples)
    t = np.arange(samples)[:, None] / samples
    plain = (amplitudes * np.cos(2 * np.pi * t * np.array(harmonics) + phases)).sum(axis=1)
    np.testing.assert_allclose(period, plain, atol=1e-11)
    spectrum = 2.0 / samples * np.fft.rfft(period)
    np.testing.assert_allclose(
        spectrum[harmonics], amplitudes * np.exp(1j * phases), rtol=1e-9, atol=1e-13
    )
    others = np.setdiff1d(np.arange(spectrum.size), harmonics)
    assert np.abs(spectrum[others]).max() < 1e-14 * len(harmonics) + 1e-15


def test_phases_are_uniform():
    phases = multisine.draw_phases(3, 100_000)
    assert phases.min() >= 0.0
    assert phases.max() < 2.0 * np.pi
    assert abs(np.exp(1j * phases).mean()) < 4.0 / math.sqrt(100_000)


def test_phase_seeds_differ_by_seed_level_and_realization():
    seeds = [
        multisine.phase_seed(s, level, r) for s in range(5) for level in range(5) for r in range(40)
    ]
    assert len(set(seeds)) == len(seeds)


def test_one_grid_for_the_experiment_and_new_phases_for_each_realization():
    values = {"amplitudes_rad": (1e-3, 7e-3), "seed": 5}
    all_of_them = [describe(level, m, **values) for level in (0, 1) for m in range(7)]
    assert len({tuple(e.excited_harmonics) for e in all_of_them}) == 1
    periods = [multisine.reference_period(e) for e in all_of_them]
    spectra = [np.abs(np.fft.rfft(p)) for p in periods]
    np.testing.assert_allclose(spectra[0], spectra[6], atol=1e-10)
    np.testing.assert_allclose(7.0 * spectra[0], spectra[7], atol=1e-9)
    assert all(not np.allclose(periods[0], p, atol=1e-4) for p in periods[1:])


def test_another_seed_is_another_grid_and_the_same_seed_the_same_reference():
    assert describe(seed=1).excited_harmonics != describe(seed=2).excited_harmonics
    first, second = multisine.reference(describe(seed=9)), multisine.reference(describe(seed=9))
    assert np.array_equal(first, second)


def test_the_reference_repeats_the_period_and_starts_at_one_sample_time():
    experiment = describe(periods=2, transient_periods=1)
    r = multisine.reference(experiment)
    assert r.size == experiment.samples == 30_000
    period = multisine.reference_period(experiment)
    assert np.array_equal(r, np.tile(period, 3))
    lines, phases = (
        np.array(experiment.excited_harmonics),
        multisine.draw_phases(experiment.phase_seed, len(experiment.excited_harmonics)),
    )
    at_first_sample = 7e-3 * np.cos(2 * np.pi * lines * 0.1 * 1e-3 + phases).sum()
    assert r[0] == pytest.approx(at_first_sample, abs=1e-12)


@given(
    seed=st.integers(0, 2**31 - 1),
    amplitude=st.floats(1e-6, 10.0),
    realization=st.integers(0, 6),
    rate=st.sampled_from([200.0, 1000.0, 20_000.0]),
    grid=st.sampled_from(["odd_random", "odd", "full"]),
)
def test_the_description_survives_json(seed, amplitude, realization, rate, grid):
    experiment = describe(
        realization=realization,
        seed=seed,
        amplitudes_rad=(amplitude,),
        sample_rate_hz=rate,
        grid=grid,
    )
    again = Experiment.from_json(experiment.to_json(), "bag")
    assert again == experiment
    assert again.to_json() == experiment.to_json()
    assert np.array_equal(multisine.reference_period(again), multisine.reference_period(experiment))


def test_a_list_of_amplitudes_shapes_the_spectrum():
    amplitudes = np.linspace(1e-3, 2e-3, 167)
    shaped = describe().model_copy(update={"amplitude_rad": amplitudes.tolist()})
    spectrum = np.abs(np.fft.rfft(multisine.reference_period(shaped))) * 2.0 / 10_000
    np.testing.assert_allclose(spectrum[shaped.excited_harmonics], amplitudes, rtol=1e-10)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"base_frequency_hz": 0.3}, ("base_frequency_hz", "sample_rate_hz/base_frequency_hz")),
        ({"sample_rate_hz": 100.0}, ("f_max_hz", "below 50 Hz")),
        ({"f_max_hz": 500.0}, ("f_max_hz", "below 500 Hz")),
        ({"f_min_hz": 10.0, "f_max_hz": 5.0}, ("f_min_hz", "f_max_hz", "widen")),
        ({"f_min_hz": 0.2, "f_max_hz": 0.2}, ("f_min_hz", "f_max_hz", "widen")),
        ({"amplitudes_rad": (0.0,)}, ("amplitudes_rad[0]", "greater than zero")),
        ({"amplitudes_rad": ()}, ("no level 0",)),
        ({"amplitudes_rad": (-1.0,)}, ("amplitudes_rad", "[0, 10] rad")),
        ({"amplitudes_rad": (math.nan,)}, ("amplitudes_rad", "number")),
        ({"amplitudes_rad": "loud"}, ("amplitudes_rad", "number")),
        ({"amplitudes_rad": None}, ("amplitudes_rad", "list of numbers")),
        ({"realizations": 0}, ("realizations", "[1, 100000]")),
        ({"realizations": 1.5}, ("realizations", "whole number")),
        ({"periods": 0}, ("periods", "[1, 100000]")),
        ({"sample_rate_hz": 0.5}, ("sample_rate_hz", "[1, 20000] Hz")),
        ({"group": 1}, ("group", "[2, 100]")),
        ({"grid": "even"}, ("grid", "odd_random, odd, full")),
        ({"amplitude_rad": 1e-3}, ("amplitude_rad", "did you mean amplitudes_rad")),
    ],
    ids=str,
)
def test_bad_input_is_one_sentence(values, words):
    with pytest.raises(InputError) as raised:
        describe(**values)
    message = str(raised.value)
    assert all(word in message for word in words), message
    assert message.endswith((".", "?"))
    assert "\n" not in message


@pytest.mark.parametrize(("level", "realization"), [(1, 0), (0, 7), (-1, 0), (0, -1)])
def test_a_realization_that_is_not_there_is_refused(level, realization):
    with pytest.raises(InputError, match=f"level {level}, realization {realization}"):
        describe(level, realization)


def test_a_description_without_seed_cannot_be_played():
    silent = describe().model_copy(update={"phase_seed": None})
    with pytest.raises(InputError, match="phase_seed is missing"):
        multisine.reference_period(silent)
