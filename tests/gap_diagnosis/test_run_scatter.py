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
from fjr_kit.least_squares import Solution
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT, coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from fjr_sim_node.simulation.simulator import SIMULATOR
from gap_diagnosis.fits.comparison import CellFit
from gap_diagnosis.fits.estimates import moved_by_scatter
from gap_diagnosis.gates.bag_deviations import deviations, run_errors
from gap_diagnosis.gates.bags_gate import as_bags, drift_of_runs, run_changes, scattering
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.outcome.diagnosis import Bags
from gap_diagnosis.outcome.gap_size import Estimate
from gap_diagnosis.report.randomisation import randomisation_yaml, ranges
from gap_diagnosis.starts.search_space import Space

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


def recorded(share: float, seed: int, effects=None, seconds: float = 6.0, rising=0.0):
    """Return records of a rig whose friction scatters by a share, and each run's factors.

    It may rise as well, by a share for each run.
    """
    rng, runs = np.random.default_rng(seed), []
    factors = 1.0 + share * rng.standard_normal((len(LEVELS_RAD) * RUNS, len(FRICTION)))
    factors += np.reshape(rising, (-1, 1))
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
    return run_changes(evidence, variance, model), evidence


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
        found = as_bags(*changes_of(records)).scatter_percent
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
        errors, blocks = run_errors(evidence, variance)
        found = deviations(errors, len(factors), model, blocks)
        assert found.names[:4] == list(FRICTION)
        std = np.sqrt(np.diagonal(found.covariance, axis1=1, axis2=2))
        deviant.append((found.values - np.pad(factors - 1.0, ((0, 0), (0, 1)))) / std)
    assert 0.5 < np.sqrt(np.mean(np.square(deviant))) < 1.5


def test_a_steady_rig_whose_law_is_not_quite_the_model_scatters_nowhere():
    """What a wrong law leaves is alike in all runs, and differs from block to block."""
    records, _ = recorded(0.0, 5, {"cogging.amplitude_nm": 0.3, "cogging.cycles_per_turn": 40.0})
    changes, evidence = changes_of(records)
    bags = as_bags(changes, evidence)
    assert scattering(bags) == ""
    assert drift_of_runs(bags) == ""


def test_what_a_wrong_law_makes_is_not_told_as_scatter():
    """A torque ripple that the model lacks takes another part of each run's friction."""
    ripple = {"cogging.amplitude_nm": 3.0, "cogging.cycles_per_turn": 20.0}
    found = as_bags(*changes_of(recorded(0.0, 5, ripple)[0]))
    assert found.scatter_percent["fvm"].low > 0.5  # and does not scatter at all
    said = scattering(found)
    assert "is not known" in said and "only 19 % of its misfit" in said and "fvm" not in said
    each = {"fvm": Estimate(value=1.0, low=0.9, high=1.1)}
    assert ranges(each, found)["fvm"].scatter is None
    told = as_bags(*changes_of(recorded(0.02, 5)[0]))
    assert "link Coulomb friction (fs) by" in scattering(told)
    assert ranges(each, told)["fvm"].scatter > 0.0


def test_friction_that_rises_from_run_to_run_is_a_trend_and_one_that_scatters_is_none():
    """Levels are recorded one after the other, so their friction differs as a trend's does."""
    runs = len(LEVELS_RAD) * RUNS
    rising = np.linspace(-0.1, 0.1, runs)
    bags = as_bags(*changes_of(recorded(0.02, 3, rising=rising)[0]))
    said = drift_of_runs(bags)
    assert said.startswith("In the order of the runs friction follows a trend")
    assert "interleaved" in said
    assert bags.trends["friction"].change_percent == pytest.approx(20, abs=5)
    for seed in range(3):
        assert drift_of_runs(as_bags(*changes_of(recorded(0.02, seed)[0]))) == ""


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
    found = ranges(FOUND, bags(fsm=4.0))
    assert set(found) == {"jm", "fsm"}
    assert found["fsm"].value == 6.0 and found["fsm"].scatter == pytest.approx(0.24)
    assert found["fsm"].high == pytest.approx(6.0 + math.hypot(0.1, 1.96 * 0.24), rel=1e-3)
    assert found["jm"].scatter is None


def test_the_file_says_what_is_not_known_and_is_read_back():
    text = randomisation_yaml(ranges(FOUND, bags(fsm=4.0, fs=1.0)), SIMULATOR)
    assert text.startswith("#") and "95 % of runs of this rig lie within" in text
    read = yaml.safe_load(text)["simulator"]
    assert read["jm"]["scatter"] is None and read["fsm"]["scatter"] == pytest.approx(0.24)
    assert read["jm"]["low"] < 0.2 < read["jm"]["high"]


def test_a_file_without_scatter_says_that_runs_may_lie_beyond_its_ranges():
    for known in (None, bags(fsm=4.0).model_copy(update={"scatter_known": False})):
        text = randomisation_yaml(ranges(FOUND, known), SIMULATOR)
        assert "lie within" not in text and "runs may lie beyond" in text
        assert yaml.safe_load(text)["simulator"]["fsm"]["scatter"] is None


def test_the_place_of_a_ripple_is_not_drawn_and_units_stand_beside_what_is():
    each = Estimate(value=1.0, low=0.9, high=1.1)
    names = [p for e in ("cogging", "gravity") for p in fx.EFFECTS[e].names]
    found = ranges({"jm": each, **dict.fromkeys(names, each)}, None)
    assert set(found) == {
        "jm", "cogging.amplitude_nm", "cogging.second_ratio", "gravity.torque_nm",
        "gravity.angle_rad",
    }  # fmt: skip
    assert "high: 1.1}  # kg m2\n" in randomisation_yaml(found, SIMULATOR)
    linear = randomisation_yaml(found, SIMULATOR.of_linear_axis())
    assert "high: 1.1}  # kg\n" in linear and "high: 1.1}  # N\n" in linear


@given(st.floats(0.0, 50.0), st.floats(1e-3, 1e3), st.floats(0.0, 1.0))
def test_ranges_hold_the_intervals(percent, value, width):
    found = {"fsm": Estimate(value=value, low=value * (1 - width), high=value * (1 + width))}
    wide = ranges(found, bags(fsm=percent))["fsm"]
    assert wide.low <= found["fsm"].low + 1e-9 * value
    assert wide.high >= found["fsm"].high * (1 - 1e-5)


def linear(jacobian: np.ndarray, *, lacking: bool = False) -> CellFit:
    """Return a fit of motor inertia and motor friction; the datasheet may lack the friction."""
    x, space = np.zeros(2), Space({"jm": 0.2, "fsm": 6.0})
    if lacking:
        x = np.array([0.0, 3.0])
        space = Space({"jm": 0.2, "fsm": 0.0}, ("coulomb_friction.motor_nm",), (2.0,))
        x, jacobian = np.array([0.0, 0.0, 3.0]), np.insert(jacobian, 1, 0.0, axis=1)
    solution = Solution(x, 1.0, jacobian, np.zeros(len(jacobian)), True)
    return CellFit((), space, space.model(x), solution, np.ones(1), np.ones((1, 1)))


RUN_OF = np.repeat(np.arange(4), 50)


@pytest.mark.parametrize("lacking", [False, True])
def test_what_scatters_alike_in_all_runs_is_known_by_the_root_of_their_number(lacking):
    rng = np.random.default_rng(3)
    jacobian = np.tile(rng.standard_normal((50, 2)), (4, 1))
    moved = moved_by_scatter(linear(jacobian, lacking=lacking), RUN_OF, {"fsm": 0.04})
    # The fit found 6 N m of friction that the datasheet lacks, in units of 2 N m.
    size = 3.0 if lacking else 1.0
    assert moved[[0, -1]] == pytest.approx([0.0, 0.04 * size / 2.0], abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_what_scatters_moves_all_parameters_as_refits_show(seed):
    """Against least-squares fits of runs whose friction deviates by draws."""
    rng = np.random.default_rng(seed)
    jacobian = rng.standard_normal((RUN_OF.size, 2)) + rng.standard_normal((4, 2))[RUN_OF]
    moved = moved_by_scatter(linear(jacobian), RUN_OF, {"fsm": 0.04})
    draws = 0.04 * rng.standard_normal((4000, 4))
    ends = np.linalg.lstsq(jacobian, (draws[:, RUN_OF] * jacobian[:, 1]).T, rcond=None)[0]
    assert moved == pytest.approx(ends.std(axis=1), rel=0.06)


def test_ranges_hold_the_runs_of_a_rig_that_scatters():
    records, factors = recorded(0.05, 7)
    truth = {n: PLANT[n].default for n in WELL_SEEN}
    found = {n: Estimate(value=v, low=0.99 * v, high=1.01 * v) for n, v in truth.items()}
    each = ranges(found, as_bags(*changes_of(records)))
    inside = [
        each[n].low <= f * truth[n] <= each[n].high
        for row in factors
        for n, f in zip(FRICTION, row, strict=True)
        if n in WELL_SEEN
    ]
    assert 0.88 <= np.mean(inside) <= 1.0
