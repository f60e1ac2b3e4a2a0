"""Scatter from run to run of records: found, pooled into intervals, given as ranges."""

from __future__ import annotations

import math

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from controller_node import pd_filtered
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT, coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis.gates.bag_deviations import deviations, record_errors
from gap_diagnosis.gates.bags_gate import as_bags, record_changes, scattering
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.simulated_rig import Model
from gap_diagnosis.outcome.diagnosis import Bags, Estimate
from gap_diagnosis.report.randomisation import randomisation_yaml, ranges
from gap_diagnosis.which.estimates import with_scatter

RATE_HZ = 500.0
LAW = pd_filtered.CONTROLLER.check({"sample_rate_hz": RATE_HZ})
FRICTION = ("fs", "fsm", "fv", "fvm")
WELL_SEEN = ("fsm", "fv")
"""Each run shows these within a share of their scatter; the others within their scatter or so."""
LEVELS_RAD = (0.03, 0.1)
RUNS = 6  # of each level


def noise_like(seed: int, samples: int) -> np.ndarray:
    """Return noise from 0.3 to 20 Hz of rms 1."""
    rng = np.random.default_rng(seed)
    frequency = np.fft.rfftfreq(samples, 1.0 / RATE_HZ)
    lines = (frequency > 0.3) & (frequency < 20.0)
    spectrum = lines * np.exp(2j * np.pi * rng.random(frequency.size))
    signal = np.fft.irfft(spectrum, samples)
    return signal / signal.std()


def recorded(share: float, seed: int, effects=None, seconds: float = 6.0):
    """Return records of a rig whose friction scatters by a share, and each run's factors."""
    rng, runs = np.random.default_rng(seed), []
    factors = 1.0 + share * rng.standard_normal((len(LEVELS_RAD) * RUNS, len(FRICTION)))
    for run, row in enumerate(factors):
        level = run // RUNS
        values = PLANT.defaults() | {
            name: factor * PLANT[name].default for name, factor in zip(FRICTION, row, strict=True)
        }
        reference = LEVELS_RAD[level] * noise_like(1000 * seed + run, int(seconds * RATE_HZ))
        signals = simulate(
            reference, RATE_HZ, coefficients(values), pd_filtered.coefficients(LAW),
            1e-5 * rng.standard_normal(reference.size), fx.coefficients(effects or {}),
        )  # fmt: skip
        description = RecordDescription.of(
            "run", sample_rate_hz=RATE_HZ, level=level, levels=len(LEVELS_RAD),
            realization=run % RUNS, realizations=RUNS, controller=pd_filtered.describe(LAW),
        )  # fmt: skip
        runs.append(
            Record(f"run_{run}", description, reference, signals.torque, signals.position, None)
        )
    return RecordSet("memory", RATE_HZ, tuple(runs)), factors


def weighed(records: RecordSet):
    """Return evidence, true mean model, and what that leaves in each cell."""
    model = Model.nominal(PLANT.defaults())
    evidence = Evidence(records, model.plant)
    every = tuple(range(len(evidence.parts)))
    errors = evidence.errors([model], every)[0]
    variance = np.maximum(evidence.mean_squares(errors, every), evidence.floor(every))
    return evidence, model, variance


def changes_of(records: RecordSet):
    evidence, model, variance = weighed(records)
    return record_changes(evidence, variance, model)


def drawn_scatter(factors: np.ndarray) -> np.ndarray:
    """Return the standard deviation within levels, in percent, of each parameter."""
    within = [level - level.mean(0) for level in np.split(factors, len(LEVELS_RAD))]
    degrees = len(factors) - len(LEVELS_RAD)
    return 100.0 * np.sqrt(sum((part**2).sum(0) for part in within) / degrees)


@pytest.mark.parametrize("share", [0.02, 0.05])
def test_scatter_of_friction_is_found_and_that_of_stiffness_is_none(share):
    held = []
    for seed in range(3):
        records, factors = recorded(share, seed)
        found = as_bags(changes_of(records), 0.0).scatter_percent
        did = dict(zip(FRICTION, drawn_scatter(factors), strict=True))
        for name in WELL_SEEN:
            assert found[name].value == pytest.approx(did[name], rel=0.25, abs=0.25)
        held += [found[name].low <= 100.0 * share <= found[name].high for name in FRICTION]
        assert found["stiffness"].low < 0.1
    assert np.mean(held) >= 0.75


def test_the_deviation_of_each_run_is_as_uncertain_as_it_says():
    deviant = []
    for seed in range(3):
        records, factors = recorded(0.03, 20 + seed)
        evidence, model, variance = weighed(records)
        errors, blocks = record_errors(evidence, variance)
        found = deviations(errors, len(factors), model, blocks)
        assert found.names[:4] == list(FRICTION)
        std = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
        deviant.append((found.values - np.pad(factors - 1.0, ((0, 0), (0, 1)))) / std)
    assert 0.5 < np.sqrt(np.mean(np.square(deviant))) < 1.5


def test_a_steady_rig_whose_law_is_not_quite_the_model_scatters_nowhere():
    """What a wrong law leaves is alike in all runs, and differs from block to block."""
    records, _ = recorded(0.0, 5, {"cogging.amplitude_nm": 0.3, "cogging.cycles_per_turn": 40.0})
    changes = changes_of(records)
    assert scattering(changes) == ""
    assert changes.trends == ()


NOTHING = Bags(trends={}, scatter_percent={}, accounted=1.0)
FOUND = {
    "jm": Estimate(value=0.2, low=0.19, high=0.21),
    "fsm": Estimate(value=0.0, low=0.0, high=0.0),
    "coulomb_friction.motor_nm": Estimate(value=6.0, low=5.9, high=6.1),
    "torque_saturation.limit_nm": Estimate(value=math.inf, low=math.inf, high=math.inf),
}


def bags(**percent: float) -> Bags:
    each = {n: Estimate(value=p, low=0.5 * p, high=2.0 * p) for n, p in percent.items()}
    return NOTHING.model_copy(update={"scatter_percent": each})


def test_a_friction_that_the_datasheet_lacks_scatters_as_the_one_that_it_adds_to():
    widened = with_scatter(FOUND, bags(fsm=4.0), runs=4)
    expected = math.hypot(0.1, 1.96 * 0.04 * 6.0 / 2.0)
    own = widened["coulomb_friction.motor_nm"]
    assert own.high - 6.0 == pytest.approx(expected) == 6.0 - own.low
    assert widened["jm"] == FOUND["jm"]
    found = ranges(FOUND, bags(fsm=4.0))
    assert set(found) == {"jm", "fsm"}
    assert found["fsm"].value == 6.0 and found["fsm"].scatter == pytest.approx(0.24)
    assert found["fsm"].high == pytest.approx(6.0 + math.hypot(0.1, 1.96 * 0.24), rel=1e-3)
    assert found["jm"].scatter is None


def test_the_file_says_what_is_not_known_and_is_read_back():
    text = randomisation_yaml(ranges(FOUND, bags(fsm=4.0, fs=1.0)))
    assert text.startswith("#") and "95 % of runs" in text
    read = yaml.safe_load(text)["simulator"]
    assert read["jm"]["scatter"] is None and read["fsm"]["scatter"] == pytest.approx(0.24)
    assert read["jm"]["low"] < 0.2 < read["jm"]["high"]


@given(st.floats(0.0, 50.0), st.floats(1e-3, 1e3), st.floats(0.0, 1.0), st.integers(1, 40))
def test_intervals_only_widen_and_ranges_hold_them(percent, value, width, runs):
    found = {"fsm": Estimate(value=value, low=value * (1 - width), high=value * (1 + width))}
    own = with_scatter(found, bags(fsm=percent), runs)["fsm"]
    assert own.low <= found["fsm"].low and own.high >= found["fsm"].high
    wide = ranges(found, bags(fsm=percent))["fsm"]
    assert wide.low <= own.low + 1e-9 * value and wide.high >= own.high * (1 - 1e-5)


def test_ranges_hold_the_runs_of_a_rig_that_scatters():
    records, factors = recorded(0.05, 7)
    truth = {n: PLANT[n].default for n in WELL_SEEN}
    found = {n: Estimate(value=v, low=0.99 * v, high=1.01 * v) for n, v in truth.items()}
    each = ranges(found, as_bags(changes_of(records), 0.0))
    inside = [
        each[n].low <= f * truth[n] <= each[n].high
        for row in factors
        for n, f in zip(FRICTION, row, strict=True)
        if n in WELL_SEEN
    ]
    assert 0.88 <= np.mean(inside) <= 1.0
