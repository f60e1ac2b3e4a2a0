"""Changes from bag to bag: scatter is measured and passes, a trend is a drift."""

from __future__ import annotations

import numpy as np
import pytest
from gap_cases import changes_of, simulate_case, vary

from gap_diagnosis.any_record import investigate
from gap_diagnosis.gates.bag_changes import TREND_FALSE_ALARM
from gap_diagnosis.gates.bags_gate import as_bags, bags_gate, scattering
from gap_diagnosis.outcome.diagnosis import Bags, Diagnosis
from gap_diagnosis.outcome.gap_size import Estimate

FRICTION = ("fs", "fsm", "fv", "fvm")


@pytest.fixture(scope="module")
def case():
    """Three levels of four bags, interleaved."""
    return simulate_case(
        seed=3, realizations=4, base_frequency_hz=0.5, transient_periods=2, order="interleaved"
    )


def scattered(case, share: float, seed: int, names=FRICTION, apart=True):
    """Record a case with parameters that scatter; return it and how far they did within levels."""
    rng = np.random.default_rng([seed, round(1e4 * share)])
    count = len(case.recorded.realizations)
    drawn = rng.normal(0.0, share, (count, len(names) if apart else 1))
    drawn = np.broadcast_to(drawn, (count, len(names)))
    factors = [dict(zip(names, 1.0 + row, strict=True)) for row in drawn]
    levels = np.array([r.level for r in case.recorded.realizations])
    apart_from_level = [
        drawn[levels == level] - drawn[levels == level].mean(0) for level in set(levels)
    ]
    squares = sum((part**2).sum(0) for part in apart_from_level)
    return vary(case, factors), np.sqrt(squares / (count - len(set(levels))))


def gate_of(recorded, model):
    """Return the gate on trends, with what changes."""
    changes, evidence = changes_of(recorded, model)
    bags = None if changes is None else as_bags(changes, evidence)
    return bags_gate(bags, recorded), bags, "" if bags is None else scattering(bags)


@pytest.mark.parametrize("apart", [True, False], ids=["each by itself", "all together"])
@pytest.mark.parametrize("share", [0.01, 0.02, 0.03, 0.05])
def test_friction_that_scatters_is_no_drift_and_its_scatter_is_found(case, share, apart):
    held = []
    for seed in range(5):
        recorded, drawn = scattered(case, share, seed, apart=apart)
        gate, bags, said = gate_of(recorded, case.truth)
        assert gate.passed and said
        found = bags.scatter_percent
        for name, did in zip(FRICTION, drawn, strict=True):
            assert found[name].value == pytest.approx(100.0 * did, rel=0.15, abs=0.1)
        held += [found[name].low <= 100.0 * share <= found[name].high for name in FRICTION]
        assert found["stiffness"].value < 0.1
    assert np.mean(held) >= 0.75  # intervals of 95 %; those of one record are alike if not apart


def test_the_parameter_that_scatters_is_told_from_those_that_do_not(case):
    gate, bags, said = gate_of(scattered(case, 0.03, 5, names=("fsm",))[0], case.truth)
    found = bags.scatter_percent
    assert gate.passed and found["fsm"].low <= 3.0 <= found["fsm"].high
    assert all(found[name].value < 0.3 for name in ("fs", "stiffness"))
    assert "(fsm) by" in said and "(fs)" not in said


def test_bags_of_a_steady_rig_show_neither_scatter_nor_trend(case):
    alarms = 0
    for seed in range(6):
        recorded, _ = scattered(case, 1e-9, seed)
        gate, bags, _ = gate_of(recorded, case.truth)
        alarms += not gate.passed
        assert all(each.value < 0.2 for each in bags.scatter_percent.values())
    assert alarms == 0


@pytest.mark.parametrize("realizations", [2, 4])
@pytest.mark.parametrize("order", ["levels", "interleaved"])
def test_friction_that_falls_from_record_to_record_is_a_drift(realizations, order):
    case = simulate_case(seed=3, realizations=realizations, base_frequency_hz=0.5,
                         transient_periods=2, order=order)  # fmt: skip
    starts = np.argsort([r.experiment.elapsed_s for r in case.recorded.realizations])
    played = np.argsort(starts)  # place of each bag in the order of the record
    falls = 1.0 + 0.1 * np.exp(-played / 3.0)
    recorded = vary(case, [dict.fromkeys(FRICTION, f) for f in falls])
    gate, bags, _ = gate_of(recorded, case.truth)
    assert not gate.passed and gate.hint == "nonstationary"
    assert "friction follows a trend" in gate.sentence
    assert bags.trends["friction"].change_percent < 0.0
    assert bags.trends["friction"].p_value < TREND_FALSE_ALARM


def test_scatter_is_seldom_taken_for_a_trend(case):
    """Scatter of one size at all bags, told by its own statistic: at most 2 % of rigs."""
    alarms = 0
    for seed in range(20):
        recorded, _ = scattered(case, 0.02, 100 + seed, apart=bool(seed % 2))
        changes, _ = changes_of(recorded, case.truth)
        alarms += any(trend.p_value < TREND_FALSE_ALARM for trend in changes.trends)
    assert alarms <= 2  # of a binomial of 2 %, more in 0.7 % of draws


def test_one_bag_more_than_levels_cannot_tell_a_trend_from_scatter():
    case = simulate_case(levels_rad=(7e-3,), base_frequency_hz=0.5)
    gate, bags, _ = gate_of(case.recorded, case.truth)
    assert gate.passed and np.isnan(gate.value) and bags is None
    assert "not tested" in gate.sentence


def test_a_diagnosis_of_a_rig_whose_friction_scatters_tells_the_scatter(tmp_path):
    small = simulate_case(seed=3, realizations=4, base_frequency_hz=0.5, levels_rad=(5e-3, 2e-2))
    recorded, drawn = scattered(small, 0.02, 1)
    few = ("presliding_friction", "stribeck_friction_motor", "torque_gain")
    diagnosis = investigate(recorded, {**small.truth.plant}, effects=few).diagnosis
    assert diagnosis.verdict != "nonstationary"
    assert any("scatters" in note for note in diagnosis.notes)
    path = tmp_path / "diagnosis.json"
    path.write_text(diagnosis.to_json())
    assert Diagnosis.read(path).bags == diagnosis.bags
    for name, did in zip(FRICTION, drawn, strict=True):
        found = diagnosis.bags.scatter_percent[name]
        assert found.low <= 100.0 * did <= found.high


def test_percents_are_written_as_people_write_them():
    found = {
        "fs": Estimate(value=23.4, low=12.0, high=150.4),
        "fvm": Estimate(value=5.0, low=0.1, high=99.96),
    }
    bags = Bags(trends={}, scatter_percent=found, accounted=1.0)
    said = "What scatters from run to run: link Coulomb friction (fs) by 23 % (12 to 150 %)."
    assert scattering(bags) == said


def test_bags_in_which_the_link_never_moves_are_not_compared():
    loose = simulate_case(
        {"backlash.half_gap_rad": 0.05}, seed=3, realizations=2, levels_rad=(1e-3, 4e-3),
        base_frequency_hz=0.5,
    )  # fmt: skip
    gate, bags, _ = gate_of(loose.recorded, loose.truth)
    assert gate.passed and bags is None and "not tested" in gate.sentence
