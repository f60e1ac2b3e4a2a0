"""Runs that hardly move: within its bristles an axis is a spring, and its law is least exact."""

from __future__ import annotations

import math

import numpy as np
import pytest

from controller_node.law import as_transfer_function, law_of
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node.simulation import closed_loop
from gap_diagnosis.any_record import investigate
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.outcome.verdict_words import LOST

RATE, SECONDS = 500.0, 8.0
MASS, COULOMB, VISCOUS, BRISTLE = 9.0, 28.0, 55.0, 2e-5
NOMINAL = datasheet({"jm": 1.1 * MASS, "k0": math.inf}, "test")
STEP = 1e-8  # m, of the encoder
NATURAL = 2.0 * math.pi * 20.0
LAW = {"kind": "pd", "p": MASS * NATURAL**2, "d": 1.6 * MASS * NATURAL, "n": 2000.0}
LOOKED_FOR = ("coulomb_friction", "presliding_friction", "viscous_friction")


def slow_noise(rng: np.random.Generator, rms: float) -> np.ndarray:
    """Return noise from 0.1 to 3 Hz, (samples,)."""
    samples = int(SECONDS * RATE)
    frequency = np.fft.rfftfreq(samples, 1.0 / RATE)
    inside = (frequency > 0.1) & (frequency < 3.0)
    phases = np.exp(2j * np.pi * rng.random(frequency.size))
    signal = np.fft.irfft(np.where(inside, phases, 0.0), samples)
    return rms / np.std(signal) * signal


def moved(number: int, rms: float, unseen_nm: float) -> Record:
    """Return a run of a table with bristles.

    Args:
        number: of the run.
        rms: of the reference, m.
        unseen_nm: rms of a slow force that is not logged.
    """
    rng = np.random.default_rng(number)
    bare = {"jm": MASS, "k0": math.inf}
    rubs = {"coulomb_friction.motor_nm": COULOMB, "viscous_friction.motor_nm_s_rad": VISCOUS}
    rig = Model(datasheet(bare, "test"), {**rubs, "presliding_friction.motor_rad": BRISTLE})
    unseen = slow_noise(rng, unseen_nm)
    run = closed_loop.simulate_law(
        slow_noise(rng, rms), RATE, rig.plant_coefficients,
        as_transfer_function(law_of(LAW, RATE)), effects=rig.effect_coefficients, added=unseen,
    )  # fmt: skip
    described = RecordDescription.of(
        "test", sample_rate_hz=RATE, level=0, levels=1, realization=number, realizations=3
    )
    counted = STEP * np.round(run.position / STEP)
    return Record(f"run_{number}", described, None, run.torque - unseen, counted, None)


def test_what_a_run_within_the_bristles_misses_takes_no_name_away():
    """A force that is not logged moves it as much as its own torque; the others go on."""
    runs = [moved(n, rms, unseen_nm=3.0) for n, rms in enumerate((1.5e-5, 7.5e-5, 1e-3))]
    found = investigate(RecordSet("test", RATE, tuple(runs)), NOMINAL, effects=LOOKED_FOR).diagnosis
    assert LOST not in found.notes
    assert {"coulomb_friction", "presliding_friction"} <= {*found.effects}
    assert found.parameters["coulomb_friction.motor_nm"].value == pytest.approx(COULOMB, rel=0.05)
