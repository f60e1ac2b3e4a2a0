"""The gap with intervals: what the figures are, and what the bootstrap says of them."""

from __future__ import annotations

import numpy as np
import pytest
from gap_cases import simulate_case

from fjr_sim_node.plant import PLANT
from gap_diagnosis.how_far.bla_gap import bla_gap
from gap_diagnosis.how_far.ledger import Ledger
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.simulated_rig import Simulator
from gap_diagnosis.model.steady_runs import steady_runs

GAP = {"backlash.half_gap_rad": 1.5e-3}
SHORT = {"base_frequency_hz": 0.5, "transient_periods": 2, "levels_rad": (3e-3, 1e-2)}
FIGURES = ("position", "torque", "bla_sigma", "distortion_db")
HELD = (1, 3)


def models_of(case):
    return {"nominal": Model(PLANT.defaults(), {}), "refit": case.bare, "explained": case.truth}


def figures(case, held=HELD):
    """Return all figures by name, and the simulated signals."""
    simulator, models = Simulator(case.recorded), models_of(case)
    signals = {name: simulator.signals(model) for name, model in models.items()}
    found = bla_gap(case.recorded, held, signals, closes=True)
    return {**ledger(case).figures(models, closes=True), **found}, signals


def ledger(case) -> Ledger:
    return Ledger(Evidence(steady_runs(case.recorded), PLANT.defaults()))


@pytest.fixture(scope="module")
def case():
    return simulate_case(GAP, seed=12, **SHORT)


@pytest.fixture(scope="module")
def found(case):
    return figures(case)


def test_the_true_model_comes_down_to_the_noise_floor(found):
    for name in FIGURES[:3]:
        figure = found[0][name]
        assert figure.nominal.value > figure.refit.value > figure.explained.value
        assert figure.closed.value > 0.95
    position = found[0]["position"]
    assert position.explained.value < 1.3 * position.noise_floor.value
    distortion = found[0]["distortion_db"]
    assert distortion.explained.value < 0.2 < distortion.refit.value


def test_every_value_lies_in_its_interval(found):
    for name in FIGURES:
        stages = found[0][name]
        assert stages.refit.low < stages.refit.high
        for stage in ("nominal", "refit", "explained", "closed"):
            figure = getattr(stages, stage)
            assert figure.low <= figure.value <= figure.high


def test_the_position_is_that_of_the_realizations_that_no_fit_has_seen(case, found):
    errors = []
    for index in HELD:
        r = case.recorded.realizations[index]
        mean = r.kept(r.position).mean(0)
        errors.append(np.mean((found[1]["refit"][0][index] - mean) ** 2) / np.var(mean))
    whole = np.sqrt(np.mean(errors))
    assert found[0]["position"].refit.value == pytest.approx(whole, rel=0.25)  # of half the blocks


def test_the_gap_of_a_step_is_the_figure_without_its_interval(case, found):
    own = ledger(case)
    for stage, model in models_of(case).items():
        step = own.step(model, None, "refit")
        assert step.nrmse_position == getattr(found[0]["position"], stage).value
        assert step.nrmse_torque == getattr(found[0]["torque"], stage).value
    assert own.noise().nrmse_position == found[0]["position"].noise_floor.value


def test_one_realization_at_each_level_has_no_interval_of_its_bla():
    single = simulate_case(GAP, seed=12, realizations=1, **SHORT)
    result, _ = figures(single, held=(0, 1))
    assert result["bla_sigma"].refit.value > 0.0
    assert result["bla_sigma"].refit.low is None and result["bla_sigma"].closed.high is None
    assert result["position"].refit.low < result["position"].refit.high


def test_a_share_that_means_nothing_is_none(case, found):
    models = models_of(case)
    worse = ledger(case).figures({**models, "explained": models["nominal"]}, closes=True)
    assert worse["position"].explained.value > worse["position"].refit.value
    assert worse["position"].closed is None and worse["torque"].closed is None
    floor = ledger(case).figures({**models, "refit": models["explained"]}, closes=True)
    assert floor["position"].closed is None  # the refit leaves nothing but noise


def test_one_period_has_no_noise_floor_of_its_bla():
    result, _ = figures(simulate_case(GAP, seed=12, periods=1, **SHORT))
    assert result["bla_sigma"].noise_floor is None
    assert result["position"].refit.low < result["position"].refit.high


def test_a_motion_that_diverges_has_no_figure(case, found):
    signals = {name: tuple(s.copy() for s in pair) for name, pair in found[1].items()}
    signals["nominal"][0][1] = np.nan
    result = bla_gap(case.recorded, HELD, signals, closes=False)
    assert result["bla_sigma"].nominal is None and result["bla_sigma"].refit is not None
    assert result["bla_sigma"].closed is None


def test_a_training_realization_that_diverges_takes_no_figure_from_the_held_out_ones(case, found):
    signals = {name: tuple(s.copy() for s in pair) for name, pair in found[1].items()}
    signals["nominal"][0][0] = np.nan
    result = bla_gap(case.recorded, HELD, signals, closes=True)
    assert result["bla_sigma"].nominal.value == found[0]["bla_sigma"].nominal.value
    assert result["bla_sigma"].refit == found[0]["bla_sigma"].refit
