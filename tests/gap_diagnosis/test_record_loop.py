"""Which loop drove each record: gains that were changed from run to run, a drive that was off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from controller_node.law import as_transfer_function, law_of
from excitation_node import records as made_of
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node import plant
from fjr_sim_node.simulation import closed_loop
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.record_loop import loop_of
from gap_diagnosis.model.rig_model import Model

RATE = 500.0
NOMINAL = {name: float(value) for name, value in plant.PLANT.defaults().items()}
HALF_KNOWN = {"kind": "pd", "p": None, "d": 60.0, "n": 200.0, "unknown": ["p"]}


def record(number: int, p: float, controller: dict | None, *, off: bool = False) -> Record:
    """Return a chirp of the paper's rig under a PD law; off: torque that is not the law's."""
    r = made_of.chirp(4000, RATE, amplitude_rad=0.05, f_min_hz=0.2, f_max_hz=8.0)
    law = law_of({"kind": "pd", "p": p, "d": 60.0, "n": 200.0}, RATE)
    run = closed_loop.simulate(r, RATE, plant.coefficients(NOMINAL), law)
    noise = 1e-6 * np.random.default_rng(number).standard_normal(r.size)
    described = RecordDescription.of(
        "test", sample_rate_hz=RATE, level=0, levels=1, realization=number, realizations=4,
        controller=controller,
    )  # fmt: skip
    torque = run.torque[::-1].copy() if off else run.torque
    return Record(f"run_{number}", described, r, torque, run.position + noise, None)


def test_one_set_of_gains_serves_runs_of_one_controller():
    runs = tuple(record(n, 300.0, HALF_KNOWN) for n in range(2))
    loop = loop_of(RecordSet("test", RATE, runs))
    assert loop.kind == "gains_fitted" and None not in loop.laws
    assert loop.notes[0] == "Gains of the controller solved from the recorded torque: p = 300."


def test_a_gain_that_was_changed_is_solved_run_by_run_and_the_loop_is_repeated():
    runs = tuple(record(n, p, HALF_KNOWN) for n, p in enumerate((200.0, 400.0, 800.0)))
    recorded = RecordSet("test", RATE, runs)
    evidence = Evidence(recorded, NOMINAL)
    loop = evidence.simulator.loop
    assert loop.kind == "gains_fitted"
    assert "run by run, since no one set makes the torque of all: p = 200 to 800" in loop.notes[0]
    for played, run in zip(evidence.simulator.run([Model.nominal(NOMINAL)], range(3))[0], runs,
                           strict=True):  # fmt: skip
        assert np.abs(played[0] - run.position).max() < 1e-3 * np.abs(run.position).max()


def test_controllers_that_lack_different_gains_are_each_solved():
    other = {"kind": "pd", "p": 400.0, "d": None, "n": 200.0, "unknown": ["d"]}
    runs = (record(0, 300.0, HALF_KNOWN), record(1, 400.0, other))
    loop = loop_of(RecordSet("test", RATE, runs))
    assert loop.kind == "gains_fitted" and None not in loop.laws
    assert "p = 300, d = 60" in loop.notes[0]


def test_a_run_whose_torque_the_controller_does_not_make_is_driven_by_its_torque():
    """As where the drive was off: the others are still simulated in closed loop."""
    runs = (
        record(0, 300.0, HALF_KNOWN), record(1, 300.0, HALF_KNOWN, off=True),
        record(2, 300.0, None),
    )  # fmt: skip
    loop = loop_of(RecordSet("test", RATE, runs))
    assert loop.kind == "gains_fitted"
    assert [law is None for law in loop.laws] == [False, True, True]
    (said,) = [note for note in loop.notes if "does not make" in note]
    assert "torque of run_1 (" in said and "whether the drive was on" in said


@pytest.mark.parametrize("controller", [None, {"kind": "pd", "p": 900.0, "d": 0.0, "n": 200.0}])
def test_a_loop_that_no_run_shows_is_unknown(controller):
    loop = loop_of(RecordSet("test", RATE, (record(0, 300.0, controller),)))
    assert loop.kind == "unknown" and loop.laws == (None,)
    assert bool(loop.notes) == (controller is not None)


def test_a_model_too_stiff_to_be_played_in_time_is_passed_over():
    evidence = Evidence(RecordSet("test", RATE, (record(0, 300.0, None),)), NOMINAL)
    stiff = Model(NOMINAL, {"cogging.amplitude_nm": 1e6, "cogging.cycles_per_turn": 1e4})
    assert np.isnan(evidence.simulator.run([stiff], [0])[0][0]).all()


def filtered(number: int, torque_noise: float) -> Record:
    """Return a run whose description lacks the filter of its controller's derivative.

    Or has it, and the torque is measured with noise, relative to its rms.
    """
    whole = record(number, 300.0, {"kind": "pd", "p": 300.0, "d": 60.0, "n": 200.0})
    if torque_noise:
        noise = np.random.default_rng(number + 10).standard_normal(whole.samples)
        torque = whole.torque + torque_noise * np.std(whole.torque) * noise
        return replace(whole, torque=torque)
    bare = {"kind": "pd", "p": None, "d": None, "unknown": ["p", "d"]}
    return replace(whole, description=whole.description.model_copy(update={"controller": bare}))


def test_a_controller_that_is_described_but_in_part_makes_the_recorded_motion():
    """Its other part is known as well: it is the torque that the described one does not make."""
    runs = tuple(filtered(n, 0.0) for n in range(2))
    evidence = Evidence(RecordSet("test", RATE, runs), NOMINAL)
    loop = evidence.simulator.loop
    assert loop.kind == "gains_fitted" and all(rest is not None for rest in loop.added)
    assert "is added to the loop as it was recorded" in loop.notes[-1]
    (played, _), run = evidence.simulator.run([Model.nominal(NOMINAL)], range(2))[0], runs[0]
    assert np.abs(played[0] - run.position).max() < 1e-3 * np.abs(run.position).max()
    law, start = loop.laws[0], {"start": (0.0, 0.0)}
    alone = closed_loop.simulate_law(run.reference, RATE, plant.coefficients(NOMINAL), law, **start)
    assert np.abs(alone.position - run.position).max() > 1e-2 * np.abs(run.position).max()


def test_noise_of_a_torque_sensor_is_not_added_to_the_loop():
    runs = tuple(filtered(n, 0.03) for n in range(2))
    loop = loop_of(RecordSet("test", RATE, runs))
    assert loop.kind == "known" and loop.added == (None, None)
    assert "as noise of a sensor does" in loop.notes[-1]


def test_pushes_beside_the_law_are_added_to_the_loop():
    """As where a test pushes a drive that its controller holds."""
    plain, law = record(0, 300.0, None), {"kind": "pd", "p": 300.0, "d": 60.0, "n": 200.0}
    pushes = np.zeros(plain.samples)
    pushes[1000:1300], pushes[2500:2800] = 20.0, -20.0
    described = plain.description.model_copy(update={"controller": law})
    made = as_transfer_function(law_of(law, RATE))
    run = closed_loop.simulate_law(
        plain.reference, RATE, plant.coefficients(NOMINAL), made, added=pushes
    )
    pushed = replace(plain, description=described, torque=run.torque, position=run.position)
    evidence = Evidence(RecordSet("test", RATE, (pushed,)), NOMINAL)
    loop = evidence.simulator.loop
    assert loop.kind == "known" and "such as pushes in a test" in loop.notes[-1]
    played = evidence.simulator.run([Model.nominal(NOMINAL)], [0])[0][0]
    assert np.abs(played[0] - run.position).max() < 1e-3 * np.abs(run.position).max()
