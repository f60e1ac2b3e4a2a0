"""A real motor bench: the delay of its current and the drag that docs/real_machines.md tells of."""

from __future__ import annotations

import pytest
from motor_bench import NEEDS_RECORDS, imported

from gap_diagnosis.any_record import investigate, read_any

pytestmark = NEEDS_RECORDS

NOMINAL = {
    "jm": 4.47e-3, "j": 4.97e-3, "fs": 0.0, "fsm": 0.02, "fv": 0.0, "fvm": 0.01, "k0": 551.0,
    "k1": 0.0,
}  # fmt: skip
LOOKED_FOR = ("delay", "quadratic_friction")


@pytest.fixture(scope="module")
def diagnosis(tmp_path_factory):
    bag = imported(tmp_path_factory.mktemp("bench"), "A")
    records = read_any(bag.parent, as_record=True)
    return investigate(records, NOMINAL, effects=LOOKED_FOR).diagnosis


def test_the_drag_and_the_delay_are_named_beside_a_remainder(diagnosis):
    assert diagnosis.verdict == "partly_explained"
    assert set(diagnosis.effects) == {"quadratic_friction", "delay"}
    assert diagnosis.evidence.controller == "unknown" and diagnosis.remainder.share < 0.25


def test_the_delay_is_that_of_the_bench(diagnosis):
    found = diagnosis.parameters["delay.time_s"]
    assert found.value == pytest.approx(0.107e-3, rel=0.05)
    assert found.low < 0.107e-3 < found.high
