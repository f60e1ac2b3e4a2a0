"""A motor that a held link springs back, driven by a torque from outside: an oscillator."""

from __future__ import annotations

import math

import numpy as np
import pytest

from controller_node.transfer_function import TransferFunction
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node.plant import coefficients
from fjr_sim_node.simulation.closed_loop import simulate_law
from gap_diagnosis.any_record import investigate
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.model.prediction import settles
from gap_diagnosis.model.record_start import held_at
from gap_diagnosis.model.rig_model import Model

RATE, SAMPLES, RESONANCE_HZ = 600.0, 6000, 68.0
INERTIA = 1.0 / (2.0 * math.pi * RESONANCE_HZ) ** 2
SHEET = datasheet(
    {"jm": INERTIA, "k0": 1.0, "j": math.inf, "fvm": 0.06 / (2.0 * math.pi * RESONANCE_HZ)},
    "oscillator",
)
CUBIC = {"cubic_stiffness.stiffness_nm_rad3": 4.0}
NOISE_RAD = 2e-4


def run(seed: int, first: int = 0, place: float = 0.0) -> Record:
    """Return a run under noise up to 200 Hz, without so many samples at its beginning."""
    rng = np.random.default_rng(seed)
    lines = np.fft.rfftfreq(SAMPLES + first, 1.0 / RATE)
    wave = np.fft.irfft(np.fft.rfft(rng.standard_normal(SAMPLES + first)) * (lines < 200.0))
    torque = 0.05 * wave / wave.std()
    nothing = TransferFunction.of([0.0], [1.0])
    made = simulate_law(
        np.zeros(torque.size), RATE, coefficients({**SHEET, **CUBIC}), nothing,
        command=torque,
    )  # fmt: skip
    described = RecordDescription.of(
        "oscillator", sample_rate_hz=RATE, level=0, levels=1, realization=seed, realizations=3
    )
    position = place + made.position + NOISE_RAD * rng.standard_normal(torque.size)
    return Record(f"run_{seed}", described, None, torque[first:], position[first:], None)


def test_a_cubic_stiffness_that_the_datasheet_lacks_is_named_with_its_size():
    """The resonance is above what an observer of a tenth of the band can hold."""
    records = RecordSet("oscillator", RATE, tuple(run(seed) for seed in range(3)))
    names = ("cubic_stiffness", "coulomb_friction", "hysteresis", "kinematic_error", "delay")
    found = investigate(records, SHEET, effects=names).diagnosis
    assert found.effects == ["cubic_stiffness"]
    assert found.parameters[next(iter(CUBIC))].value == pytest.approx(4.0, rel=0.02)
    assert any("comes to rest by itself" in note for note in found.notes)


@pytest.mark.parametrize("place", [0.0, 2.0])
def test_a_run_that_begins_in_motion_moves_about_where_its_link_is_held(place):
    records = RecordSet("oscillator", RATE, tuple(run(seed, 500, place) for seed in range(2)))
    simulator = Evidence(records, SHEET).player
    assert simulator.settles
    truth = Model(SHEET, CUBIC)
    for (y, u, link), record in zip(
        simulator.run([truth], [0, 1])[0], records.records, strict=True
    ):
        assert np.ptp(link) == 0.0 and link[0] == pytest.approx(place, abs=0.02)
        assert np.array_equal(u, record.torque)
        late = slice(SAMPLES // 2, None)
        off = y - y.mean() - record.position + record.position.mean()
        assert np.std(off[late]) < 0.1 * np.std(record.position)


def test_where_a_link_is_held():
    record = run(1, 0, 3.0)
    assert held_at(record, (3.01, 0.0), SHEET) == 3.01
    assert held_at(record, (3.2, 5.0), SHEET) == pytest.approx(3.0, abs=0.01)
    assert held_at(record, (3.2, 5.0), {**SHEET, "j": 1.0}) is None


@pytest.mark.parametrize(
    ("changed", "comes_to_rest"),
    [
        ({}, True),
        ({"fvm": 0.0}, False),
        ({"j": INERTIA}, False),
        ({"k0": math.inf, "j": 0.0}, False),
    ],
)
def test_which_models_come_to_rest_by_themselves(changed, comes_to_rest):
    assert settles({**SHEET, **changed}, 10.0) == comes_to_rest
    assert not settles(SHEET, 0.1)
