"""How much of long records is played, and that short ones are refused."""

from __future__ import annotations

import numpy as np
import pytest

from fjr_interface.experiment import RecordDescription
from fjr_kit.errors import InputError
from fjr_records.records import Record, RecordSet
from gap_diagnosis.model.parts import cut, hop_of
from gap_diagnosis.model.record_length import RUNS, within


def lasting(rate_hz: float, *samples: int) -> RecordSet:
    """Return runs of so many samples; each signal counts its samples."""
    described = RecordDescription.of("test", sample_rate_hz=rate_hz, samples=max(samples))
    runs = [np.arange(each, dtype=float) for each in samples]
    return RecordSet("test", rate_hz, tuple(Record("run", described, s, s, s, s) for s in runs))


@pytest.mark.parametrize(
    ("rate_hz", "samples", "kept"),
    [
        (1000.0, (100_000, 200_000), (100_000, 200_000)),  # 300 s
        (1000.0, (200_000, 400_000), (100_000, 200_000)),
        (50.0, (10_000, 20_000), (10_000, 20_000)),  # 600 s, but 30,000 samples
        (0.25, (1024, 1024), (1024, 1024)),
        (10.0, (45_000, 45_000), (15_000, 15_000)),
    ],
)
def test_long_records_are_cut_by_time_or_by_samples(rate_hz, samples, kept):
    left, notes = within(lasting(rate_hz, *samples))
    assert [run.samples for run in left.records] == list(kept)
    for run in left.records:
        for signal in (run.reference, run.torque, run.position, run.link):
            np.testing.assert_array_equal(signal, np.arange(run.samples))
    cut = samples != kept
    assert len(notes) == cut
    if cut:
        share = round(100 * sum(kept) / sum(samples))
        assert f"the first {share} % of each" in notes[0]
        assert f"{sum(kept) / rate_hz:.0f} s in all" in notes[0]


def test_a_record_too_short_for_windows_is_refused():
    with pytest.raises(InputError, match=r"run: holds 63 samples, too few .* record 64 or more"):
        within(lasting(1000.0, 1000, 63))


def moving(rate_hz: float, seconds: float, seed: int, rests: bool = True) -> np.ndarray:
    """Return moves from zero to random places, with rests between them or without."""
    rng, pieces, at = np.random.default_rng(seed), [], 0.0
    while sum(map(len, pieces)) < seconds * rate_hz:
        to, samples = rng.uniform(-1.0, 1.0), int(rng.uniform(0.3, 1.2) * rate_hz)
        pieces.append(at + (to - at) * (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, samples))))
        pieces.append(np.full(int(rng.uniform(0.1, 0.5) * rate_hz) if rests else 0, to))
        at = to
    return np.concatenate(pieces)[: int(seconds * rate_hz)]


def one(index: int, position: np.ndarray, rate_hz: float, level: int = 0, **known) -> Record:
    about = RecordDescription.of(
        "run", sample_rate_hz=rate_hz, level=level, levels=level + 1, realization=index, **known
    )
    return Record(f"run_{index}", about, position, np.gradient(position), position, None)


@pytest.mark.parametrize("seed", range(4))
def test_a_long_record_is_played_in_stretches_over_the_whole_of_it(seed):
    rate = float(np.random.default_rng(seed).choice([100.0, 250.0]))
    whole = one(0, moving(rate, 1200.0, seed), rate)
    left, notes = within(RecordSet("test", rate, (whole,)))
    runs = left.records
    assert len(runs) == RUNS and sum(r.samples for r in runs) == 300.0 * rate
    assert [r.description.realization for r in runs] == list(range(RUNS))
    assert len({r.name for r in runs}) == RUNS and left.repeats == tuple((k,) for k in range(RUNS))
    ends = 0
    for k, run in enumerate(runs):
        begin = round(run.after_s * rate)
        assert run.elapsed_s == run.after_s and begin >= ends
        ends = begin + run.samples
        for signal, of in ((run.position, whole.position), (run.torque, whole.torque)):
            np.testing.assert_array_equal(signal, of[begin:ends])
        assert np.ptp(run.position[:20]) < 1e-2 or k == 0  # it stands
        assert run.after_s == pytest.approx(1150.0 * k / (RUNS - 1), abs=50.0)
    assert "6 stretches of run_0 of 50 s" in notes[0] and "300 s in all" in notes[0]


def test_what_never_stands_is_begun_in_motion_or_only_where_it_begins():
    rate = 100.0
    turning = np.cumsum(1.0 + 0.2 * np.sin(np.arange(90_000) / 200.0)) / rate
    alone, _ = within(RecordSet("test", rate, (one(0, turning, rate),)))
    assert len(alone.records) == RUNS and alone.records[3].after_s > 300.0
    other = one(1, 1.1 * turning, rate)
    pair, notes = within(RecordSet("test", rate, (one(0, turning, rate), other)))
    assert len(pair.records) == 2 and "the first 17 % of each" in notes[0]


def test_long_records_of_one_level_are_played_in_stretches_of_each():
    rate = 100.0
    runs = [one(k, moving(rate, 600.0, k), rate) for k in range(2)]
    left, notes = within(RecordSet("test", rate, tuple(runs)))
    assert [r.name[:5] for r in left.records] == ["run_0"] * 3 + ["run_1"] * 3
    assert "3 stretches of run_0" in notes[0] and "3 stretches of run_1" in notes[0]


def test_records_that_repeat_each_other_and_many_levels_keep_their_first_part():
    rate = 100.0
    y = moving(rate, 600.0, 0)
    left, notes = within(RecordSet("test", rate, (one(0, y, rate), one(1, y, rate))))
    assert [r.samples for r in left.records] == [15_000] * 2 and left.repeats == ((0, 1),)
    levels = [one(0, moving(rate, 200.0, k), rate, level=k) for k in range(6)]
    left, notes = within(RecordSet("test", rate, tuple(levels)))
    assert len(left.records) == 6 and "the first 25 % of each are used" in notes[0]


def test_stretches_serve_each_purpose_early_and_late():
    rate = 100.0
    left, _ = within(RecordSet("test", rate, (one(0, moving(rate, 1200.0, 0), rate),)))
    purposes = {part.record: part.purpose for part in cut(left, hop_of(left, 0, slow=False))}
    assert [purposes[k] for k in range(RUNS)] == [
        "fit", "select", "report", "report", "select", "fit",
    ]  # fmt: skip
