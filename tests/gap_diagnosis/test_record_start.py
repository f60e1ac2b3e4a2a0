"""Where a record begins: a run from rest is told from one that moves already."""

from __future__ import annotations

import numpy as np
import pytest

from controller_node import pd_filtered
from excitation_node import multisine
from fjr_interface.experiment import RecordDescription
from fjr_records.record_noise import record_noise
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT, coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis.model.record_rig import RecordSimulator
from gap_diagnosis.model.rig_model import Model

RATE_HZ = 1000.0
NOISE_RAD = 2e-5
LAW = pd_filtered.CONTROLLER.check({})


def run(
    seed: int, amplitude: float, effects: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return r, u, y and the true motion from rest under the paper's multisine, at once at full."""
    values = multisine.EXCITATION.check(
        {"amplitudes_rad": (amplitude,), "periods": 1, "transient_periods": 0, "seed": seed,
         "base_frequency_hz": 0.5}
    )  # fmt: skip
    reference = multisine.reference(multisine.describe(values, 0, 0))
    noise = NOISE_RAD * np.random.default_rng(seed).standard_normal(reference.size)
    signals = simulate(
        reference, RATE_HZ, coefficients(PLANT.defaults()), pd_filtered.coefficients(LAW), noise,
        effects,
    )  # fmt: skip
    return reference, signals.torque, signals.position, signals.motor


def played_by(reference, torque, position) -> RecordSimulator:
    """Return what plays one record of these signals."""
    description = RecordDescription.of(
        "run", sample_rate_hz=RATE_HZ, controller=pd_filtered.describe(LAW)
    )
    record = Record("run", description, reference, torque, position, None)
    records = RecordSet("memory", RATE_HZ, (record,))
    return RecordSimulator(records, record_noise(records), 30.0, PLANT.defaults())


def start_of(reference, torque, position) -> tuple[float, float]:
    return played_by(reference, torque, position).drive(0).start


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("amplitude", [5e-3, 2e-2])
def test_a_run_that_starts_to_move_from_rest_starts_at_rest(seed, amplitude):
    reference, torque, position, _ = run(seed, amplitude)
    assert np.ptp(position[:10]) > 20.0 * NOISE_RAD or amplitude < 1e-2  # it moves within them
    assert start_of(reference, torque, position) == (0.0, 0.0)


@pytest.mark.parametrize("seed", range(6))
def test_the_speed_of_a_run_that_moves_already_is_found(seed):
    reference, torque, position, motor = run(seed, 2e-2)
    begin = 300 + 37 * seed
    found, speed = start_of(reference[begin:], torque[begin:], position[begin:])
    true_speed = (motor[begin + 1] - motor[begin - 1]) * RATE_HZ / 2.0
    assert found == pytest.approx(motor[begin], abs=5.0 * NOISE_RAD)
    assert speed == pytest.approx(true_speed, abs=0.05 * np.abs(np.diff(motor)).max() * RATE_HZ)


@pytest.mark.parametrize("phase", [0.5 * np.pi, -2.0])
def test_a_run_with_an_eccentric_encoder_starts_where_that_encoder_reads(phase):
    on = {"encoder_eccentricity.amplitude_rad": 5e-3, "encoder_eccentricity.phase_rad": phase}
    reference, torque, position, _ = run(1, 5e-3, fx.coefficients(on))
    assert abs(position[0]) > 100.0 * NOISE_RAD  # the rig rests at zero, its encoder does not
    player = played_by(reference, torque, position)
    ((signals,),) = player.run([Model(PLANT.defaults(), on)], [0])
    left = np.abs(signals[0] - position)
    assert left.max() < 0.1 * abs(position[0])  # how its law began is known up to noise
    assert left[500:].max() < 6.0 * NOISE_RAD
