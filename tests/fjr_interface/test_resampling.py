"""Uneven samples onto an even grid: numbering, interpolation, held commands, and stated errors."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
import scipy.linalg
from bag_tools import foreign_bag, stream
from hypothesis import given, settings
from hypothesis import strategies as st

from fjr_interface.resampling.accuracy import BAND, Resampling, Survey, Surveyed
from fjr_interface.resampling.grid_stream import Grid, GridStream
from fjr_interface.resampling.hold_equivalent import hold_equivalent
from fjr_interface.resampling.resampled_reader import ResampledReader
from fjr_interface.resampling.stamp_line import StampLine
from fjr_interface.topics import MOTOR_POSITION, MOTOR_TORQUE, REFERENCE
from fjr_kit.errors import InputError

START_NS = 1_700_000_000_000_000_000
SIGNALS = {"reference": REFERENCE, "torque": MOTOR_TORQUE, "position": MOTOR_POSITION}


def band_limited(rng: np.random.Generator, band: float, lines: int = 100):
    """Return a signal of rms 1 with power below `band` (of Nyquist), as a function of time."""
    frequency = band / 2.0 * rng.random(lines)
    decay = frequency ** -rng.choice([0.0, 1.0])
    amplitude = decay / np.sqrt(np.sum(decay**2) / 2.0)
    phase = 2.0 * np.pi * rng.random(lines)
    return lambda time: np.cos(2.0 * np.pi * np.outer(time, frequency) + phase) @ amplitude


def jittered(rng: np.random.Generator, samples: int, jitter: float, loss: float = 0.0):
    """Return instants in samples, evenly spread over +-jitter, with losses in runs of 1 to 3."""
    time = np.arange(samples) + rng.random() + jitter * rng.uniform(-1.0, 1.0, samples)
    kept = np.ones(samples, bool)
    for at in np.flatnonzero(rng.random(samples) < loss):
        kept[at : at + rng.integers(1, 4)] = False
    kept[[0, -1]] = True
    return time[kept]


def stamps_of(time: np.ndarray, rate: float = 1000.0) -> np.ndarray:
    return START_NS + np.rint(time * 1e9 / rate).astype(np.int64)


def survey(name: str, time: np.ndarray, values: np.ndarray) -> Surveyed:
    made = Survey("BAG", name, "/topic")
    made.add(stamps_of(time), values)
    return made.finish()


def write(folder, streams: dict[str, tuple[np.ndarray, np.ndarray]], **options):
    """Write signals with times in ms to a bag, each on its topic of the rig."""
    return foreign_bag(
        folder,
        {
            SIGNALS[name].absolute_topic: stream(SIGNALS[name], stamps_of(time), values)
            for name, (time, values) in streams.items()
        },
        **options,
    )


@given(st.integers(0, 10**6), st.floats(0.0, 0.24), st.floats(0.0, 0.02), st.floats(-1e-4, 1e-4))
@settings(max_examples=40)
def test_every_sample_gets_its_number_whatever_jitter_and_loss(seed, jitter, loss, drift):
    rng = np.random.default_rng(seed)
    kept = np.flatnonzero(rng.random(3000) >= loss)
    time = kept * (1.0 + drift) + jitter * rng.uniform(-1.0, 1.0, len(kept))
    line = StampLine()
    numbers = np.concatenate([line.add(piece)[0] for piece in np.split(stamps_of(time), [1024])])
    np.testing.assert_array_equal(numbers - numbers[0], kept - kept[0])
    assert line.lost == kept[-1] - kept[0] + 1 - len(kept)
    assert line.jitter == pytest.approx(jitter / np.sqrt(3.0), rel=0.1, abs=1e-6)
    assert line.period_ns == pytest.approx(1e6 * (1.0 + drift), rel=2e-5)


def resampled(
    name: str, time: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return grid instants in samples, the values there and the stated error."""
    found = survey(name, time, values)
    first, last = int(np.ceil(time[0])), int(np.floor(time[-1]))
    on_grid = GridStream(found, Grid(START_NS, 1000.0, first, last))
    on_grid.add(stamps_of(time), values)
    on_grid.finish()
    return np.arange(first, last + 1), on_grid.take(last - first + 1), found.error


def position_errors(seed: int) -> tuple[float, float]:
    """Return the true and the stated rms error of a random signal, noise, clock and loss."""
    rng = np.random.default_rng(seed)
    signal = band_limited(rng, rng.uniform(0.03, 0.75))
    loss = rng.choice([0.0, 1e-3, 3e-3])
    time = jittered(rng, int(rng.integers(400, 3000)), rng.uniform(0, 0.24), loss)
    noise = rng.choice([0.0, 10.0 ** rng.uniform(-5.0, -2.0)])
    instants, values, stated = resampled(
        "position", time, signal(time) + noise * rng.standard_normal(len(time))
    )
    return rms(values - signal(instants)), stated


def torque_errors(seed: int) -> tuple[float, float]:
    """Return the same of commands whose stamps are noisy, against those that lost nothing."""
    rng = np.random.default_rng(seed)
    signal = band_limited(rng, rng.uniform(0.03, 0.5))
    true = jittered(rng, int(rng.integers(400, 3000)), rng.choice([0.0, 0.1]))
    commands = signal(true) + rng.choice([0.0, 0.02]) * rng.standard_normal(len(true))
    stamped = true + rng.choice([0.0, 0.01, 0.1]) * rng.uniform(-1.0, 1.0, len(true))
    kept = rng.random(len(true)) >= rng.choice([0.0, 2e-3])
    kept[[0, -1]] = True
    instants, values, stated = resampled("torque", stamped[kept], commands[kept])
    inner = (instants > true[40]) & (instants < true[-40])
    truth = hold_equivalent(true, commands, instants[inner].astype(float))
    return rms(values[inner] - truth), stated


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("errors", [position_errors, torque_errors])
def test_the_true_error_is_within_the_stated_one_in_95_percent(errors):
    outcomes = []
    for seed in range(60):
        try:
            outcomes.append(errors(seed))
        except InputError as refusal:
            assert "the limit" in str(refusal)
    true, stated = np.transpose(outcomes)
    assert len(true) >= 45
    assert np.mean(true <= stated) >= 0.95
    assert np.median(stated / true) < 30.0  # a bound that says something


@given(st.integers(0, 10**6), st.floats(0.0, 1.0), st.floats(0.01, 0.5 * BAND))
@settings(max_examples=40)
def test_commands_of_a_shifted_clock_are_delayed_and_nothing_else(seed, shift, frequency):
    time, points = np.arange(300) + shift, np.arange(40.0, 260.0)
    phase = np.random.default_rng(seed).uniform(0.0, 6.3)
    tone = lambda t: np.cos(2.0 * np.pi * frequency * t + phase)  # noqa: E731
    np.testing.assert_allclose(hold_equivalent(time, tone(time), points), tone(points), atol=3e-5)


def test_commands_held_on_the_grid_come_out_as_they_are():
    commands = np.random.default_rng(1).standard_normal(300)
    same = hold_equivalent(np.arange(300.0), commands, np.arange(40.0, 260.0))
    np.testing.assert_allclose(same, commands[40:260], atol=3e-5)


def test_the_equivalent_of_unevenly_held_commands_drives_a_plant_alike():
    rng = np.random.default_rng(2)
    signal = band_limited(rng, 0.1, lines=20)
    time = jittered(rng, 900, 0.2)
    commands, points = signal(time), np.arange(50.0, 850.0)
    dynamics = np.array([[0.0, 1.0], [-0.02, -0.05]])  # an oscillator, time in samples

    def positions(instants: np.ndarray, held: np.ndarray) -> np.ndarray:
        """Return the position at `points` of the oscillator under held commands, exactly."""
        events = np.union1d(instants, points)
        acting = held[np.maximum(np.searchsorted(instants, events, side="right") - 1, 0)]
        state, seen = np.zeros(2), []
        target = np.linalg.inv(dynamics) @ [0.0, 1.0]
        for at, until, command in zip(events[:-1], events[1:], acting[:-1], strict=True):
            if at in wanted:
                seen.append(state[0])
            rest = state + target * command
            state = scipy.linalg.expm(dynamics * (until - at)) @ rest - target * command
        return np.array(seen)

    wanted = set(points.tolist())
    true = positions(time, commands)
    equivalent = positions(points, hold_equivalent(time, commands, points))
    nearest = positions(points, commands[np.searchsorted(time, points, side="right") - 1])
    settled = slice(300, 800)
    scale = rms(true[settled])
    assert rms((equivalent[: true.size] - true[: equivalent.size])[settled]) < 2e-3 * scale
    assert rms((nearest[: true.size] - true[: nearest.size])[settled]) > 2e-2 * scale


WHOLE = {name: (np.arange(600.0), np.sin(0.05 * np.arange(600))) for name in SIGNALS}


def changed(name: str, **how) -> dict:
    """Return the signals with one of them changed: times moved, kept or values replaced."""
    time, values = WHOLE[name]
    time, values = time + how.get("moved", 0.0), how.get("values", values)
    kept = how.get("kept", slice(None))
    return {**WHOLE, name: (time[kept], values[kept])}


def without(*numbers: int) -> np.ndarray:
    return np.delete(np.arange(600), numbers)


RNG = np.random.default_rng(3)
NOISE = RNG.standard_normal(600)


@pytest.mark.parametrize(
    ("streams", "said"),
    [
        (changed("torque", kept=without(*range(300, 309))), "9 samples in a row are missing after"),
        (
            changed("position", kept=without(*range(100, 500, 40))),
            "1.7% of the samples are missing",
        ),
        (changed("reference", moved=0.15 * NOISE), "is the limit|above the limit|told apart"),
        (changed("position", values=NOISE), "would be 1"),
        (changed("position", values=np.where(NOISE > 2.5, np.nan, NOISE)), "nan at 1700000000.0"),
        (changed("torque", kept=np.r_[0:200, 199, 200:600]), "does not come after the one before"),
        (changed("torque", kept=slice(0, 200)), "holds 200 samples, too few to resample"),
        (changed("torque", moved=1e6), "have no time in common"),
    ],
    ids=["gap", "loss", "jitter", "noise", "NaN", "repeated", "short", "clocks"],
)
def test_what_cannot_be_resampled_is_refused_in_a_sentence(tmp_path, streams, said):
    folder = write(tmp_path / "bag", streams)
    with pytest.raises(InputError, match=said) as caught:
        ResampledReader(folder)
    sentence = str(caught.value)
    assert str(folder) in sentence and "\n" not in sentence and sentence.endswith(".")
    assert any(signal.absolute_topic in sentence for signal in SIGNALS.values())
    if "limit" in sentence:
        assert "samples/s, jitter" in sentence and "in a row" in sentence and ";" in sentence


@pytest.mark.parametrize("text", ["fast", "-1", "nan", "0"])
def test_a_rate_is_a_number(text):
    with pytest.raises(InputError, match="give a rate in Hz, or auto"):
        Resampling.parse(text)


def test_blocks_do_not_depend_on_their_size_and_start_at_whole_periods(tmp_path):
    rng = np.random.default_rng(4)
    time = {name: jittered(rng, 10_000, 0.1) for name in SIGNALS}
    streams = {}
    for name, instants in time.items():
        kept = instants[np.r_[True, rng.random(len(instants) - 2) > 1e-3, True]]
        streams[name] = kept, np.sin(0.05 * kept)
    reader = ResampledReader(write(tmp_path / "bag", streams))
    (whole,) = reader.blocks(2**62)
    parts = list(reader.blocks(777))
    assert reader.sample_rate_hz == 1000.0 and {len(p.torque) for p in parts[:-1]} == {777}
    for field in ("stamps_ns", "reference", "torque", "position"):
        joined = np.concatenate([getattr(part, field) for part in parts])
        np.testing.assert_array_equal(joined, getattr(whole, field))
    assert (whole.stamps_ns % 1_000_000 == 0).all() and (np.diff(whole.stamps_ns) == 10**6).all()
    instants = (whole.stamps_ns - START_NS) / 1e6
    np.testing.assert_allclose(whole.position, np.sin(0.05 * instants), atol=1e-4)
    held = hold_equivalent(time["torque"], np.sin(0.05 * time["torque"]), instants)
    assert rms((whole.torque - held)[50:-50]) < reader.surveyed["torque"].error
    assert reader.surveyed["torque"].lost > 0


def test_the_grid_takes_another_rate(tmp_path):
    reader = ResampledReader(write(tmp_path / "bag", WHOLE), resampling=Resampling.parse("500"))
    (record,) = reader.blocks(2**62)
    assert reader.sample_rate_hz == 500.0 and reader.band_hz == 200.0
    instants = (record.stamps_ns - START_NS) / 1e6
    np.testing.assert_allclose(record.position, np.sin(0.05 * instants), atol=1e-6)


def test_memory_does_not_grow_with_the_length_of_the_bag(tmp_path):
    def peak(samples: int) -> int:
        time = np.arange(samples) + 0.1 * RNG.uniform(-1.0, 1.0, samples)
        streams = dict.fromkeys(SIGNALS, (time, np.sin(0.05 * time)))
        folder = write(tmp_path / str(samples), streams)
        tracemalloc.start()
        for _ in ResampledReader(folder).blocks(1000):
            pass
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return peak

    peak(500)  # what is only once
    assert peak(30_000) < 1.2 * peak(10_000)
