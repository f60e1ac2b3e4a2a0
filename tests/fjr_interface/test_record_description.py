"""Records that are not periodic: their description, their bags, and who refuses them."""

from __future__ import annotations

import numpy as np
import pytest

from fjr_interface.bags.reader import BagReader, audit, read_record
from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import Experiment, RecordDescription, parse_experiment
from fjr_interface.topics import MOTOR_POSITION, MOTOR_TORQUE, REFERENCE
from fjr_kit.errors import InputError
from fjr_records.periodic import read_experiment

PUBLISHED = (
    '{"schema": "fjr_rig/experiment/1", "kind": "record", "sample_rate_hz": 1000.0, '
    '"realization": 0, "realizations": 2, "level": 0, "levels": 3}'
)
SIGNALS = (REFERENCE, MOTOR_POSITION, MOTOR_TORQUE)


def noise(samples: int = 500) -> dict[str, np.ndarray]:
    return dict(zip("ryu", np.random.default_rng(1).normal(size=(3, samples)), strict=True))


def write(folder, description: RecordDescription, values: dict[str, np.ndarray]):
    signals = tuple(signal for signal in SIGNALS if signal.symbol in values)
    with BagWriter(folder, description, signals=signals) as bag:
        bag.write_arrays(**values)
    return folder


def test_the_published_example_is_a_record_and_one_without_kind_a_multisine():
    record = parse_experiment(PUBLISHED, "example")
    assert isinstance(record, RecordDescription)
    assert (record.levels, record.controller, record.samples) == (3, None, None)
    periodic = '{"sample_rate_hz": 1000, "samples_per_period": 100, "periods": 1, '
    periodic += '"transient_periods": 0, "amplitude_rad": 1, "excited_harmonics": [1]}'
    assert isinstance(parse_experiment(periodic, "example"), Experiment)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (PUBLISHED.replace("record", "chirp"), "kind: must be 'multisine' or 'record'"),
        (PUBLISHED.replace("1000.0", "-1"), "sample_rate_hz: must be greater than 0"),
        (PUBLISHED[:-1], "Invalid JSON"),
        ("[]", "must be names with values"),
    ],
)
def test_a_bad_description_is_named(text, says):
    with pytest.raises(InputError, match=f"^rig: experiment description: .*{says}"):
        parse_experiment(text, "rig")


def test_a_multisine_is_asked_for_where_nothing_else_will_do():
    with pytest.raises(InputError, match=r"^topic: is a record that is not periodic"):
        Experiment.from_json(PUBLISHED, "topic")


@pytest.mark.parametrize("described", [None, 500])
@pytest.mark.parametrize("symbols", ["ryu", "yu"])
def test_a_bag_of_a_record_is_written_audited_and_read(tmp_path, described, symbols):
    values = {symbol: each for symbol, each in noise().items() if symbol in symbols}
    description = RecordDescription(sample_rate_hz=200.0, samples=described)
    bag = write(tmp_path / "level_0_realization_000", description, values)
    audit(bag)
    back = read_record(bag)
    assert BagReader(bag).experiment == description
    np.testing.assert_array_equal(back.position, values["y"])
    np.testing.assert_array_equal(back.torque, values["u"])
    assert (back.reference is None) == ("r" not in symbols)


def test_a_record_that_says_how_long_it_is_is_found_cut_off(tmp_path):
    description = RecordDescription(sample_rate_hz=200.0, samples=500)
    short = {symbol: each[:400] for symbol, each in noise().items()}
    with pytest.raises(ValueError, match="must have the shape"):
        write(tmp_path / "bag", description, short)
    assert list(tmp_path.iterdir()) == []


def test_what_needs_periods_refuses_a_record_in_a_sentence(tmp_path):
    write(tmp_path / "bag", RecordDescription(sample_rate_hz=200.0), noise())
    with pytest.raises(InputError, match=r"bag: is a record that is not periodic .*\.$"):
        read_experiment(tmp_path)
