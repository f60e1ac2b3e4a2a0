"""What a folder holds is decided once: analysis and diagnosis take it alike, or refuse it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bag_tools import foreign_bag, stream

from bla_analyzer import analyze
from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import Experiment, RecordDescription
from fjr_interface.topics import SIGNALS
from fjr_kit.errors import InputError
from fjr_records.any_folder import NOT_PERIODIC
from fjr_records.experiment_bag import Override
from fjr_records.records import RecordSet
from gap_diagnosis.any_record import read_any

N, PERIODS, RATE = 200, 6, 500.0


def described(kind: str) -> Experiment | RecordDescription:
    if kind == "record":
        return RecordDescription.of("test", sample_rate_hz=RATE)
    return Experiment.of(
        "test", sample_rate_hz=RATE, samples_per_period=N, periods=PERIODS - 1, transient_periods=1,
        realization=0, realizations=1, level=0, levels=1, amplitude_rad=0.1,
        excited_harmonics=[1, 3, 5],
    )  # fmt: skip


def write(folder: Path, kind: str, seed: int = 0, period: int = N) -> Path:
    """Write a bag: of a multisine, of noise as a record, or of either without description."""
    rng = np.random.default_rng(seed)
    if kind == "record":
        r = 0.1 * rng.standard_normal(N * PERIODS)
    else:
        phase = 2.0 * np.pi * np.arange(N * PERIODS) / period
        r = sum(0.1 * np.cos(k * phase + rng.uniform(0.0, 6.0)) for k in (1, 3, 5))
    y = np.convolve(r, np.full(5, 0.2))[: r.size]
    y = np.convolve(r, np.full(5, 0.2))[: r.size] + 1e-6 * rng.standard_normal(r.size)
    signals = {"r": r, "u": 20.0 * (r - y), "y": y}
    if kind == "bare":
        stamps = 2_000_000 * np.arange(1, r.size + 1)
        topics = {s.absolute_topic: stream(s, stamps, signals[s.symbol]) for s in SIGNALS}
        return foreign_bag(folder, topics)
    with BagWriter(folder, described(kind)) as bag:
        bag.write_arrays(**signals)
    return folder


def both(folder: Path, **options) -> tuple[str, str]:
    """Return what analysis and diagnosis say against a folder."""
    with pytest.raises(InputError) as analysed:
        analyze(folder, **options)
    with pytest.raises(InputError) as read:
        read_any(folder, **options)
    return str(analysed.value), str(read.value)


def test_records_are_not_cut_into_periods(tmp_path):
    write(tmp_path / "rig" / "noise", "record")
    for override in (Override(samples_per_period=100), Override(periods=2)):
        sentences = both(tmp_path / "rig", override=override)
        assert all("records are not cut into periods" in sentence for sentence in sentences)


def test_a_record_beside_a_multisine_is_refused_unless_all_are_to_be_records(tmp_path):
    write(tmp_path / "one", "multisine")
    write(tmp_path / "two", "record")
    sentences = both(tmp_path)
    assert all("two is a record that is not periodic but one is a" in text for text in sentences)
    assert isinstance(read_any(tmp_path, as_record=True), RecordSet)


def test_what_nobody_described_and_shows_no_common_period_is_records_and_says_why(tmp_path):
    write(tmp_path / "one", "bare")
    write(tmp_path / "two", "bare", period=150)
    read = read_any(tmp_path)
    assert isinstance(read, RecordSet)
    (note,) = [note for note in read.notes if note.startswith(NOT_PERIODIC)]
    assert "one and two differ in sample rate, period or excited lines" in note
    assert note in analyze(tmp_path).notes
    sentences = both(tmp_path, override=Override(transient_periods=1))
    assert all("differ in sample rate, period" in sentence for sentence in sentences)
