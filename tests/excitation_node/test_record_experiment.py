"""Descriptions of records, from which their references come back."""

from __future__ import annotations

import numpy as np
import pytest

from excitation_node import multisine, records
from excitation_node.record_experiment import (
    KINDS,
    RECORD,
    describe_record,
    read_reference,
    record_reference,
)
from fjr_interface.experiment import RecordDescription, parse_experiment
from fjr_kit.errors import InputError


def described(kind: str, level=0, realization=0, **values) -> RecordDescription:
    excitation = multisine.EXCITATION.check({"amplitudes_rad": [0.01, 0.1], "realizations": 3})
    return describe_record(kind, excitation, RECORD.check(values), level, realization)


@pytest.mark.parametrize("kind", KINDS)
def test_a_reference_is_made_again_from_the_text_of_its_description(kind):
    one = described(kind, 1, duration_s=5.0)
    again = parse_experiment(one.to_json(), "a bag")
    assert isinstance(again, RecordDescription)
    reference = record_reference(again)
    assert np.array_equal(reference, record_reference(one)) and reference.size == 5000
    size = np.abs(reference).max()
    assert size == pytest.approx(0.1, rel=0.05) if kind in ("chirp", "trapezoid") else size < 0.5


@pytest.mark.parametrize("kind", KINDS)
def test_realizations_are_repeats_or_differ_as_they_say(kind):
    first, second = (described(kind, 0, number, duration_s=5.0) for number in (0, 1))
    same = np.array_equal(record_reference(first), record_reference(second))
    assert first.repeat_of is None and second.repeat_of == (0 if same else None)
    assert same == (kind in ("chirp", "trapezoid"))


def test_the_functions_get_what_the_parameters_say():
    chirp = described("chirp", sweep="logarithmic", soft_start_s=0.0, duration_s=4.0)
    expected = records.chirp(
        4000, 1000.0, amplitude_rad=0.01, f_min_hz=0.1, f_max_hz=50.0, sweep="logarithmic",
        soft_start_s=0.0,
    )  # fmt: skip
    assert np.array_equal(record_reference(chirp), expected)


@pytest.mark.parametrize(
    "excitation", [None, {}, {"kind": "flute"}, {"kind": "chirp"}, {"kind": "chirp", "x": 1}]
)
def test_a_description_that_does_not_say_it_is_refused(excitation):
    bad = described("chirp").model_copy(update={"excitation": excitation})
    with pytest.raises(InputError, match="experiment description: excitation"):
        record_reference(bad)


@pytest.mark.parametrize("text", ["", "1 2\n3 4\n", "a\n", "1\nnan\n"])
def test_a_bad_file_is_refused(tmp_path, text):
    file = tmp_path / "r.txt"
    file.write_text(text)
    with pytest.raises(InputError, match=r"one position in rad a line"):
        read_reference(file)
    with pytest.raises(InputError, match="cannot be read"):
        read_reference(tmp_path / "none.txt")
