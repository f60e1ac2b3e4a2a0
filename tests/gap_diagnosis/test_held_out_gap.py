"""The gap with intervals: what the figures are, and what the bootstrap says of them."""

from __future__ import annotations

import numpy as np
import pytest
from gap_cases import simulate_case

from fjr_sim_node.plant import PLANT
from gap_diagnosis.how_far.held_out_gap import STAGES, held_out_gap
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.simulated_rig import Simulator

GAP = {"backlash.half_gap_rad": 1.5e-3}
SHORT = {"base_frequency_hz": 0.5, "transient_periods": 2, "levels_rad": (3e-3, 1e-2)}
FIGURES = ("position", "torque", "bla_sigma", "distortion_db")
HELD = (1, 3)


def figures(case, held=HELD):
    simulator = Simulator(case.recorded)
    models = {"nominal": Model(PLANT.defaults(), {}), "refit": case.bare, "explained": case.truth}
    signals = {name: simulator.signals(model) for name, model in models.items()}
    return gap_figures(case.recorded, held, signals), signals


def gap_figures(recorded, held, signals, closes=True):
    misfits = dict.fromkeys(STAGES, 3.0)
    gaps, found = held_out_gap(recorded, held, signals, misfits, closes)
    for name in (*STAGES, "noise_floor"):  # the gap is these figures once more, without intervals
        gap, parts = getattr(gaps, name), [getattr(found.position, name)]
        parts.append(getattr(found.torque, name))
        if gap is None:
            assert name == "noise_floor" and parts == [None, None]
            continue
        values = [None if part is None else part.value for part in parts]
        assert [gap.nrmse_position, gap.nrmse_torque] == values
        assert gap.chi2_per_dof == (1.0 if name == "noise_floor" else 3.0)
    return found


@pytest.fixture(scope="module")
def case():
    return simulate_case(GAP, seed=12, **SHORT)


@pytest.fixture(scope="module")
def found(case):
    return figures(case)


def test_the_true_model_comes_down_to_the_noise_floor(found):
    for name in FIGURES[:3]:
        figure = getattr(found[0], name)
        assert figure.nominal.value > figure.refit.value > figure.explained.value
        assert figure.closed.value > 0.95
    assert found[0].position.explained.value < 1.3 * found[0].position.noise_floor.value
    assert found[0].distortion_db.explained.value < 0.2 < found[0].distortion_db.refit.value


def test_every_value_lies_in_its_interval(found):
    for name in FIGURES:
        stages = getattr(found[0], name)
        assert stages.refit.low < stages.refit.high
        for stage in ("nominal", "refit", "explained", "closed"):
            figure = getattr(stages, stage)
            assert figure.low <= figure.value <= figure.high


def test_the_position_is_that_of_the_held_out_realizations(case, found):
    errors = []
    for index in HELD:
        r = case.recorded.realizations[index]
        mean = r.kept(r.position).mean(0)
        errors.append(np.mean((found[1]["refit"][0][index] - mean) ** 2) / np.mean(mean**2))
    assert found[0].position.refit.value == pytest.approx(np.sqrt(np.mean(errors)), rel=1e-9)


def test_one_realization_at_each_level_has_no_interval():
    single = simulate_case(GAP, seed=12, realizations=1, **SHORT)
    result, _ = figures(single, held=(0, 1))
    assert result.position.refit.value > 0.0
    assert result.position.refit.low is None and result.position.closed.high is None


def test_a_share_that_means_nothing_is_none(case, found):
    signals = found[1]
    worse = {**signals, "explained": signals["nominal"]}
    result = gap_figures(case.recorded, HELD, worse)
    assert result.position.explained.value > result.position.refit.value
    assert result.position.closed is None and result.torque.closed is None
    floor = {**signals, "refit": signals["explained"]}  # the refit leaves nothing but noise
    assert gap_figures(case.recorded, HELD, floor).position.closed is None


def test_one_period_has_no_noise_floor():
    result, _ = figures(simulate_case(GAP, seed=12, periods=1, **SHORT))
    assert result.position.noise_floor is None
    assert result.position.refit.low < result.position.refit.high


def test_a_motion_that_diverges_has_no_figure(case, found):
    signals = {name: tuple(s.copy() for s in pair) for name, pair in found[1].items()}
    signals["nominal"][0][1] = np.nan
    result = gap_figures(case.recorded, HELD, signals, closes=False)
    assert result.position.nominal is None and result.position.refit is not None
    assert result.position.closed is None


def test_a_training_realization_that_diverges_takes_no_figure_from_the_held_out_ones(case, found):
    signals = {name: tuple(s.copy() for s in pair) for name, pair in found[1].items()}
    signals["nominal"][0][0] = np.nan
    result = gap_figures(case.recorded, HELD, signals)
    assert result.position.nominal.value == found[0].position.nominal.value
    assert result.position.refit == found[0].position.refit
