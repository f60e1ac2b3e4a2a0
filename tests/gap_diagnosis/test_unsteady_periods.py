"""Periods that do not repeat: the whole runs are searched, and the verdict stays if nothing is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from gap_cases import NOISE_RAD, SHORT, simulate_case
from scipy.signal import lfilter

from controller_node import pd_filtered
from controller_node.law import as_transfer_function
from fjr_records.periodic import RecordedExperiment
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT, coefficients
from fjr_sim_node.simulation.closed_loop import simulate, simulate_law
from gap_diagnosis.any_record import investigate
from gap_diagnosis.fits.cell_fits import DRIFT, CellFitter
from gap_diagnosis.fits.gains import gain
from gap_diagnosis.gates.bags_gate import friction_follows_time
from gap_diagnosis.gates.gate_checks import check_gates
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.steady_runs import steady_runs
from gap_diagnosis.outcome.diagnosis import Diagnosis
from gap_diagnosis.report.gap_output import write_diagnosis
from gap_diagnosis.report.updated_parameters import updated_values
from gap_diagnosis.steady_periods import NOTHING_NAMED, UNSTEADY

WARMING = {"nonstationary.friction_per_s": -0.02}
LAG_S = 1e-3
KNOWN = ("actuator_lag", "torque_bias", "encoder_eccentricity")


def warming_anew(
    effects: dict[str, float],
    drift: Mapping[str, float] = WARMING,
    hum_rad: float = 0.0,
    **settings: Any,
) -> RecordedExperiment:
    """Return an experiment each run of which starts cold: friction falls within it, not beyond.

    Its reference hums at no line of the period.
    """
    case = simulate_case(effects, seed=4, realizations=3, **{**SHORT, **settings})
    rng = np.random.default_rng(8)
    law = pd_filtered.CONTROLLER.check({})
    made = []
    for r in case.recorded.realizations:
        stamps = np.arange(r.reference.size) / r.experiment.sample_rate_hz
        hum = hum_rad * np.sin(2.0 * np.pi * 7.013 * stamps)
        r = replace(r, reference=r.reference + hum.reshape(r.reference.shape))
        run = simulate(
            r.reference.ravel(),
            r.experiment.sample_rate_hz,
            coefficients(case.truth.plant),
            pd_filtered.coefficients(law),
            NOISE_RAD * rng.standard_normal(r.position.size),
            fx.coefficients({**effects, **drift}),
            0.0,
        )
        shape = r.position.shape
        made.append(
            replace(r, position=run.position.reshape(shape), torque=run.torque.reshape(shape))
        )
    return RecordedExperiment("warming", tuple(made))


def test_a_cause_is_named_beside_a_drift_within_each_run():
    recorded = warming_anew({"actuator_lag.time_constant_s": LAG_S})
    gates = check_gates(recorded, Model.nominal(PLANT.defaults()))
    assert gates.hint == "nonstationary" and gates.only_unsteady
    found = investigate(recorded, PLANT.defaults(), effects=KNOWN)
    diagnosis = found.diagnosis
    assert diagnosis.effects == ["actuator_lag"] and diagnosis.notes[0] == UNSTEADY
    assert any("drifts within bags" in note for note in diagnosis.notes)
    size = diagnosis.causes[0].parameters["actuator_lag.time_constant_s"]
    assert size.value == pytest.approx(LAG_S, rel=0.1)
    played = updated_values(found.recorded, diagnosis)["excitation"]
    assert played["amplitudes_rad"] == pytest.approx(SHORT["levels_rad"])
    assert (played["grid"], played["realizations"], played["periods"]) == ("odd_random", 3, 2)
    assert played["base_frequency_hz"] == SHORT["base_frequency_hz"]


def test_a_drift_beside_which_nothing_is_found_stays_the_verdict():
    diagnosis = investigate(warming_anew({}), PLANT.defaults(), effects=KNOWN).diagnosis
    assert diagnosis.verdict == "nonstationary" and not diagnosis.causes


def test_a_cause_is_named_beside_a_hum_of_the_reference():
    """A part in a thousand of the reference that does not repeat is no reason to refuse a run."""
    recorded = warming_anew({"actuator_lag.time_constant_s": LAG_S}, {}, hum_rad=1e-4)
    gates = check_gates(recorded, Model.nominal(PLANT.defaults()))
    assert gates.only_unsteady
    assert "reference repeats" in [gate.name for gate in gates.failures]
    diagnosis = investigate(recorded, PLANT.defaults(), effects=KNOWN).diagnosis
    assert diagnosis.effects == ["actuator_lag"]
    assert any("the reference differs between periods by" in note for note in diagnosis.notes)


def test_a_record_that_is_damaged_is_not_searched():
    recorded = warming_anew({})
    first = recorded.realizations[0]
    torque = first.torque.copy()
    torque[1, 5] += 1.0
    bad = replace(
        recorded, realizations=(replace(first, torque=torque), *recorded.realizations[1:])
    )
    found = investigate(bad, PLANT.defaults(), effects=KNOWN)
    assert not found.steady.gates.only_unsteady and found.diagnosis.verdict == "bad_data"


NO_FREE_LINES = {"grid": "full", "transient_periods": 1}


@pytest.mark.parametrize("anew", [True, False])
def test_a_drift_is_told_from_a_transient_where_no_line_is_free_of_excitation(anew):
    """Two kept periods that differ may be either; played from their start, runs tell which."""
    warming = {"nonstationary.friction_per_s": -0.01}
    recorded = (
        warming_anew({}, warming, **NO_FREE_LINES)
        if anew
        else simulate_case(warming, seed=4, realizations=3, **{**SHORT, **NO_FREE_LINES}).recorded
    )
    gates = check_gates(recorded, Model.nominal(PLANT.defaults()))
    assert gates.hint == "bad_data" and gates.only_unsteady
    found = investigate(recorded, PLANT.defaults(), effects=KNOWN)
    assert found.diagnosis.verdict == "nonstationary" and not found.diagnosis.causes
    assert "friction drifts within runs, by -" in found.diagnosis.notes[0]
    gap = found.diagnosis.gap
    assert gap.refit.nrmse_position == gap.explained.nrmse_position > 0.0
    assert not any("transient" in note for note in found.diagnosis.notes)


def test_a_transient_is_no_drift():
    recorded = simulate_case(
        seed=4, realizations=3, **{**SHORT, **NO_FREE_LINES, "transient_periods": 0}
    ).recorded
    found = investigate(recorded, PLANT.defaults(), effects=KNOWN)
    assert found.diagnosis.verdict == "bad_data"
    assert any("still transient" in note for note in found.diagnosis.notes)
    last = found.steady.gates.gates[-1]
    assert last.name == "stationary within runs" and last.passed


def test_bad_data_whose_whole_runs_were_searched_tell_what_was_left(tmp_path):
    recorded = simulate_case(
        seed=4, realizations=3, **{**SHORT, **NO_FREE_LINES, "transient_periods": 0}
    ).recorded
    found = investigate(recorded, PLANT.defaults(), effects=KNOWN)
    write_diagnosis(found, tmp_path / "out")
    told = Diagnosis.read(tmp_path / "out" / "diagnosis.json")
    assert told.verdict == "bad_data" and not told.causes and NOTHING_NAMED in told.notes
    nominal, refit = (step.nrmse_position for step in told.steps)
    assert nominal > refit == told.gap.refit.nrmse_position > 0.0
    assert NOTHING_NAMED in (tmp_path / "out" / "report.html").read_text()


def test_a_drift_of_a_rigid_axis_is_told_from_a_transient():
    rigid = {"jm": 0.5, "fsm": 11.0, "fvm": 6.0}
    plant = {"k0": math.inf, "k1": 0.0, "jm": 0.3, "j": 0.2}
    recorded = simulate_case(
        {"nonstationary.friction_per_s": -0.01}, seed=4, realizations=3, plant=plant, off=0.0,
        **{**SHORT, **NO_FREE_LINES},
    ).recorded  # fmt: skip
    nominal = dict.fromkeys(PLANT.names, 0.0) | rigid | {"k0": math.inf}
    found = investigate(recorded, nominal, effects=KNOWN)
    assert found.steady.gates.only_unsteady
    assert found.steady.gates.gates[-1].name == "stationary within runs"
    assert found.diagnosis.verdict == "nonstationary"


def test_a_drift_is_a_cause_beside_another_one_with_its_size():
    warming = {"nonstationary.friction_per_s": -0.01}
    causes = {"torque_bias.torque_nm": 3.0, **warming}
    case = simulate_case(causes, seed=4, realizations=3, **SHORT)
    found = investigate(case.recorded, PLANT.defaults()).diagnosis
    assert found.effects == ["torque_bias", "nonstationary"] and found.notes[0] == UNSTEADY
    (drift,) = found.causes[1].parameters.values()
    assert drift.low < -0.01 < drift.high < -0.009


@pytest.mark.parametrize("in_time", [True, False])
def test_a_drift_goes_with_the_order_of_the_runs(in_time):
    """What is other at each level looks like a drift of rigs that are recorded level by level."""
    warming = {"nonstationary.friction_per_s": -0.01}
    case = simulate_case(warming if in_time else {}, seed=4, realizations=3, **SHORT)
    records = case.recorded.as_records()
    if not in_time:
        friction = dict.fromkeys(("fs", "fsm", "fv", "fvm"), 0.8)
        plant = {n: friction.get(n, 1.0) * v for n, v in case.truth.plant.items()}
        low = simulate_case({}, seed=4, realizations=3, plant=plant, **SHORT).recorded
        changed = low.as_records().records
        runs = tuple(
            other if other.level == 0 else own
            for own, other in zip(records.records, changed, strict=True)
        )
        records = replace(records, records=runs)
    nominal = PLANT.defaults()
    fitter = CellFitter(Evidence(records, nominal), nominal, 0.1)
    refit = fitter.refit()
    fit = fitter.add(refit, DRIFT, fitter.screening(refit, DRIFT).proposals())
    assert fit is not None and gain(fitter, fit, refit).present
    assert friction_follows_time(fitter.evidence, refit.variance, refit.model) == in_time


def pushed(recorded: RecordedExperiment, truth: Model, rms_nm: float) -> RecordedExperiment:
    """Return an experiment again, under a slow torque that nobody records, of an unknown loop."""
    rng, made = np.random.default_rng(2), []
    law = as_transfer_function(pd_filtered.coefficients(pd_filtered.CONTROLLER.check({})))
    for r in recorded.realizations:
        steps = rng.standard_normal(r.position.size)
        slow = lfilter([1.0], [1.0, -0.99], steps)
        push = rms_nm * slow / slow.std()
        rate = r.experiment.sample_rate_hz
        run = simulate_law(
            r.reference.ravel(), rate, coefficients(truth.plant), law, added=push,
            noise=NOISE_RAD * rng.standard_normal(push.size),
        )  # fmt: skip
        shape = r.position.shape
        torque, position = run.torque - push, run.position.reshape(shape)
        unknown = r.experiment.model_copy(update={"controller": None})
        made.append(replace(r, experiment=unknown, position=position, torque=torque.reshape(shape)))
    return RecordedExperiment("pushed", tuple(made))


def test_where_the_loop_is_not_known_the_noise_is_that_of_what_the_torque_predicts():
    """What pushes a rig moves a model that the recorded torque drives as much, not less."""
    case = simulate_case({}, seed=4, off=0.0, realizations=2, **{**SHORT, "periods": 6})
    recorded = pushed(case.recorded, case.truth, 1.0)
    evidence = Evidence(steady_runs(recorded), case.truth.whole_plant)
    assert evidence.simulator.loop.kind == "unknown"
    parts = range(len(evidence.parts))
    left = evidence.mean_squares(evidence.errors([case.truth], parts)[0], parts)
    ratio = left / evidence.floor(parts)
    assert 0.5 < np.median(ratio) < 1.5 and ratio.max() < 3.0
    # by how much the recorded position scatters it would not be
    scatter = [rows[0] for rows in evidence.records.scatter]
    seen = np.tile(evidence.octaves.of_scatter(scatter), len(evidence.records.levels))
    assert (left / seen).max() > 5.0 or (left / seen).min() < 0.2
