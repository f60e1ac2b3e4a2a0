"""How much of long records is played, and that short ones are refused."""

from __future__ import annotations

import numpy as np
import pytest

from fjr_interface.experiment import RecordDescription
from fjr_kit.errors import InputError
from fjr_records.records import Record, RecordSet
from gap_diagnosis.model.record_length import within


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
