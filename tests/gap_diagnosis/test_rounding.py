"""A coarse encoder is seen in records, and named where all else leaves nothing but it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_cases import Case, simulate_case, true_parameters
from scipy.signal import chirp

from controller_node import pd_filtered
from fjr_interface.experiment import RecordDescription
from fjr_records.encoder_step import position_step
from fjr_records.record_noise import record_noise
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT, coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis.any_record import investigate
from gap_diagnosis.how_far.ledger import Ledger
from gap_diagnosis.investigation import Investigation
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.outcome.diagnosis import Diagnosis
from gap_diagnosis.outcome.verdict_words import ROUNDING
from gap_diagnosis.report.gap_report import compared, render_gap_report
from gap_diagnosis.report.telltales import telltales
from gap_diagnosis.report.updated_parameters import updated_values
from gap_diagnosis.verdict.coarse_encoder import with_coarse_encoder
from gap_diagnosis.which.rounding import (
    STEP,
    beside_rounding,
    in_few_counts,
    in_the_loop,
)

COARSE = 6e-4
SHORT = {"base_frequency_hz": 0.5, "levels_rad": (4e-3, 1.2e-2), "transient_periods": 2}
NOMINAL = PLANT.defaults()
FEW_COUNTS = 0.5e-2
"""A step of which the motion of the lowest level is three counts, of many samples each."""
RATE_HZ = 500.0


def investigated(recorded: RecordSet, *effects: str) -> Investigation:
    return investigate(recorded, NOMINAL, effects=effects)


def chi2(evidence: Evidence, model: Model) -> float:
    return Ledger(evidence).step(model, None, "refit").chi2_per_dof


@pytest.fixture(scope="module")
def coarse() -> Case:
    return simulate_case({STEP: COARSE}, seed=5, **SHORT)


@pytest.fixture(scope="module")
def named(coarse) -> Investigation:
    return investigated(coarse.recorded.as_records(), ROUNDING, "torque_bias", "delay")


def test_noise_without_rounding_is_seen_from_what_repeats(coarse):
    noise = record_noise(coarse.recorded.as_records())
    assert noise.step_rad == pytest.approx(COARSE, rel=1e-9)
    assert noise.std_rad == pytest.approx(COARSE / np.sqrt(12.0))
    assert 0.0 < noise.seen_rad < 0.8 * noise.std_rad and noise.rounds


def test_the_first_counts_of_a_run_from_rest_are_no_speed(coarse):
    evidence = Evidence(coarse.recorded.as_records(), NOMINAL)
    runs = range(len(evidence.records.records))
    assert [evidence.player.drive(run).start for run in runs] == [(0.0, 0.0) for _ in runs]


def test_the_highest_lines_of_rounded_positions_show_no_noise_without_rounding(coarse):
    (first, *_) = coarse.recorded.as_records().records
    alone = RecordSet("one", coarse.recorded.sample_rate_hz, (_undescribed(first),))
    noise = record_noise(alone)
    assert noise.known and np.isnan(noise.seen_rad)


def _undescribed(record: Record) -> Record:
    rate = record.description.sample_rate_hz
    own = RecordDescription.of("run", sample_rate_hz=rate, controller=record.controller)
    return replace(record, description=own)


def test_the_coarse_encoder_is_named_alone(named):
    found = named.diagnosis
    assert found.verdict == "effect" and found.effects == [ROUNDING]
    [cause] = found.causes
    assert 0.9 <= cause.present <= 0.99 and found.confidence == cause.present
    assert cause.parameters[STEP].value == pytest.approx(COARSE, rel=1e-9)
    assert found.parameters[STEP] == cause.parameters[STEP]
    assert any("judged by its statistics" in note for note in found.notes)


def test_steps_before_it_count_by_the_noise_alone_and_its_own_by_rounding_as_well(named):
    steps = named.diagnosis.steps
    assert [(s.stage, s.added) for s in steps] == [
        ("nominal", None), ("refit", None), ("cause", ROUNDING)
    ]  # fmt: skip
    misfits = [step.chi2_per_dof for step in steps]
    assert misfits[1] > 5.0 * misfits[2] and misfits[2] < 2.0
    assert named.diagnosis.gap.explained.chi2_per_dof == misfits[2]


def test_report_and_updated_parameters_hold_the_step(named):
    values = updated_values(named.recorded, named.diagnosis)
    assert values["simulator"][STEP] == pytest.approx(COARSE, rel=1e-9)
    page = render_gap_report(named, compared(named), {})
    assert "encoder quantization" in page
    [plot] = telltales(named)[1].values()
    _, added, without = (np.array(trace["y"]) for trace in plot["data"])
    assert 0.5 < np.median(added / without) < 1.5  # rounding is as large as what it explains
    schema = Diagnosis.model_validate_json(named.diagnosis.to_json())
    assert schema.effects == [ROUNDING]


def test_it_is_not_named_where_it_was_not_asked_for(coarse):
    assert investigated(coarse.recorded.as_records(), "torque_bias").diagnosis.effects == []


def test_the_coarse_encoder_is_named_beside_another_cause():
    late = {"delay.time_s": 1e-3, STEP: COARSE}
    recorded = simulate_case(late, seed=5, **SHORT).recorded.as_records()
    few = ("delay", "actuator_lag", "torque_bias")
    found = investigated(recorded, *few, ROUNDING).diagnosis
    assert sorted(found.effects) == ["delay", ROUNDING] and found.verdict == "effect"
    assert found.gap_closed == pytest.approx(1.0, abs=0.05)
    said = next(note for note in found.notes if "judged by its statistics" in note)
    assert "the refit with delay leaves" in said
    assert investigated(recorded, *few).diagnosis.effects == ["delay"]


@pytest.fixture(scope="module")
def few_counts() -> Case:
    slow = {**SHORT, "levels_rad": (1.5e-2, 5e-2), "f_max_hz": 10.0, "sample_rate_hz": 4000.0}
    return simulate_case({STEP: FEW_COUNTS}, seed=5, **slow)


def test_rounding_moves_a_motion_of_few_counts_in_the_mean_as_simulated(few_counts):
    true = few_counts.bare
    white = Evidence(few_counts.recorded.as_records(), NOMINAL)
    assert in_few_counts(white)
    rounded = in_the_loop(white, true)
    moved = white.played_by(
        white.player.adding(rounded.added), white.noise.seen_rad**2 + rounded.power
    )
    assert chi2(white, true) > 4.0
    assert 0.2 < chi2(moved, true) < 2.0
    assert Ledger(moved).squares(true).sum() < 0.2 * Ledger(white).squares(true).sum()


def test_a_simulator_that_names_the_rounding_adds_it_to_models_that_round_alone(few_counts):
    evidence = Evidence(few_counts.recorded.as_records(), NOMINAL)
    bare, player = few_counts.bare, evidence.player
    rounds = bare.with_effects({STEP: FEW_COUNTS})
    signals = [np.full((3, r.samples), 0.1) for r in evidence.records.records]
    adding = player.adding(signals)
    [[smooth]], [[counted]] = player.run([bare], [0]), player.run([rounds], [0])
    assert adding.run([bare], [0])[0][0] == pytest.approx(smooth + 0.1)
    assert np.array_equal(adding.run([rounds], [0])[0][0], counted)
    assert np.array_equal(adding.naming().run([bare], [0])[0][0], smooth)
    assert adding.naming().run([rounds], [0])[0][0] == pytest.approx(smooth + 0.1)
    assert position_step([counted[0]]) == pytest.approx(FEW_COUNTS)


def test_a_coarse_encoder_under_few_counts_is_named_and_the_parameters_are_right(few_counts):
    effects = [ROUNDING, "torque_bias", "cogging", "presliding_friction"]
    found = investigated(few_counts.recorded.as_records(), *effects).diagnosis
    assert found.verdict == "effect" and found.effects == [ROUNDING]
    steps = [step.chi2_per_dof for step in found.steps]
    assert steps[1] > 5.0 * steps[2] and steps[2] < 2.0
    assert found.gap_closed is None and found.causes[0].share.low > 0.5
    for name in ("jm", "j", "k0"):
        true = few_counts.truth.plant[name]
        assert found.parameters[name].value == pytest.approx(true, rel=0.03)


def test_a_fine_encoder_is_neither_named_nor_simulated():
    recorded = simulate_case({STEP: 1e-6}, seed=5, **SHORT).recorded.as_records()
    found = investigated(recorded, ROUNDING, "torque_bias")
    assert found.diagnosis.effects == [] and found.diagnosis.verdict == "parameters_only"
    fitter, steps = found.fitted.fitter, found.fitted.found
    assert fitter.evidence.noise.step_rad == pytest.approx(1e-6, rel=1e-9)
    assert not in_few_counts(fitter.evidence)
    assert beside_rounding(fitter, steps) == (fitter, steps)
    told = with_coarse_encoder(fitter, found.nominal, steps, found.diagnosis)
    assert told == (fitter, steps, found.diagnosis)


def chirps(step: float, levels: tuple[int, ...] = (0, 0, 1, 1)) -> RecordSet:
    """Return runs of a chirp at two amplitudes; runs of one level repeat each other."""
    time = np.arange(int(8.0 * RATE_HZ)) / RATE_HZ
    law = pd_filtered.CONTROLLER.check({"sample_rate_hz": RATE_HZ})
    rig = coefficients(PLANT.check(true_parameters(3)))
    records = []
    for run, level in enumerate(levels):
        noise = 2e-5 * np.random.default_rng([7, run]).standard_normal(time.size)
        played = (0.01, 0.03)[level] * chirp(time, 0.3, time[-1], 12.0, phi=-90.0)
        done = simulate(
            played,
            RATE_HZ,
            rig,
            pd_filtered.coefficients(law),
            noise,
            fx.coefficients({STEP: step}),
        )
        description = RecordDescription.of(
            "chirp", sample_rate_hz=RATE_HZ, level=level, levels=2,
            realization=levels[:run].count(level), realizations=levels.count(level),
            controller=pd_filtered.describe(law),
        )  # fmt: skip
        signals = done.reference, done.torque, done.position, None
        records.append(Record(f"chirp_{run}", description, *signals))
    return RecordSet("chirps", RATE_HZ, tuple(records))


def test_the_coarse_encoder_of_a_chirp_that_is_repeated_is_named():
    found = investigated(chirps(1e-3), ROUNDING, "torque_bias", "delay").diagnosis
    assert found.effects == [ROUNDING] and found.causes[0].present >= 0.9
    assert found.evidence.noise == "repeats"


def test_nothing_is_named_where_no_noise_is_seen_beside_the_rounding():
    found = investigated(chirps(1e-3, (0, 1)), ROUNDING, "torque_bias", "delay").diagnosis
    assert found.effects == [] and found.causes == []
