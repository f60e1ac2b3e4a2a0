"""Even samples behind stamps of a coarse clock: their rate, and how well it is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fjr_kit.errors import InputError
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import read_files
from fjr_records.importers.record_file import ImportOptions, Record
from fjr_records.importers.rounded_stamps import rounded

T = 0.37 + np.arange(10_000) / 1000.0
WINDOWS_S = 1.0 / 64.0
CLOCKS = {
    "whole seconds": np.floor(T),
    "seconds since 1970": np.floor(T + 1.7e9),
    "ticks of Windows": np.floor(T / WINDOWS_S) * WINDOWS_S,
    "ticks of Windows, written in ms": np.round(np.floor(T / WINDOWS_S) * WINDOWS_S, 3),
    "ticks of Windows since 1970": np.round(1.7e9 + np.floor(T / WINDOWS_S) * WINDOWS_S, 6),
    "hundredths": np.round(T, 2),
}


def taken(
    folder, time: np.ndarray, rate_hz: float | None = None, smooth: int = 1, held: int = 1
) -> Record:
    """Return what is read of random signals, means of some samples, each held for some rows."""
    noise = np.random.default_rng(3).normal(size=time.size // held)
    torque = np.convolve(noise, np.hanning(smooth + 2), "same")
    signals = {"u": torque, "y": torque + 0.1 * np.cumsum(torque)}
    held_signals = {name: np.repeat(each, held) for name, each in signals.items()}
    np.savez(folder / "a.npz", t=time, **held_signals)
    columns = parse_map(["torque=u", "position=y", "time=t"])
    return read_files([folder / "a.npz"], ImportOptions(columns, rate_hz)).records[0]


@pytest.mark.parametrize("clock", CLOCKS)
def test_a_coarse_clock_tells_the_rate_and_how_well_it_does(tmp_path, clock):
    record = taken(tmp_path, CLOCKS[clock])
    assert record.sample_rate_hz == 1000.0
    assert record.samples == T.size
    assert any("taken as even, 1000 samples/s (they allow 99" in note for note in record.notes)


@given(
    rate_hz=st.floats(20.0, 5000.0),
    tick_s=st.sampled_from([1.0, 0.1, 1e-3, 1.0 / 64.0, 1.0 / 60.0]),
    begin_s=st.floats(0.0, 10.0),
    samples=st.integers(1000, 20_000),
)
def test_the_rates_that_stamps_allow_hold_the_true_one(rate_hz, tick_s, begin_s, samples):
    time = np.floor((begin_s + np.arange(samples) / rate_hz) / tick_s) * tick_s
    if time[-1] - time[0] < 3.0 * tick_s:
        return
    found = rounded(time)
    if found is None:  # each stamp is one tick further, say
        return
    near = 1e-9 * rate_hz
    assert found.least_hz - near <= rate_hz <= found.most_hz + near
    assert found.least_hz <= found.rate_hz <= found.most_hz
    assert found.most_hz - found.least_hz < 4.0 * rate_hz * found.tick_s / (time[-1] - time[0])


def test_a_given_rate_that_the_stamps_allow_is_taken(tmp_path):
    assert taken(tmp_path, np.floor(T), 999.95).sample_rate_hz == 999.95
    with pytest.raises(InputError, match="says 1000 Hz, not 900 Hz"):
        taken(tmp_path, np.floor(T), 900.0)


def test_stamps_that_allow_any_rate_are_refused_with_the_mend(tmp_path):
    says = r"allows any rate from 629 to inf Hz; .* leave time=COLUMN out and give --sample-rate-hz"
    with pytest.raises(InputError, match=says):
        taken(tmp_path, np.floor(T)[:1000])
    assert taken(tmp_path, np.floor(T)[:1000], 1000.0).sample_rate_hz == 1000.0


def test_where_ticks_are_no_rounding_the_mend_is_named(tmp_path):
    uneven = np.cumsum(np.random.default_rng(1).uniform(0.0, 0.002, 10_000))
    with pytest.raises(InputError, match="leave time=COLUMN out and give --sample-rate-hz"):
        taken(tmp_path, np.floor(uneven / WINDOWS_S) * WINDOWS_S)


def test_copies_of_samples_are_left_out_though_they_repeat_a_stamp_regularly(tmp_path):
    time = np.floor(np.arange(4000) / 4) * 0.004
    assert taken(tmp_path, time, smooth=100, held=4).sample_rate_hz == 250.0
    assert taken(tmp_path, time, smooth=100).sample_rate_hz == 1000.0
