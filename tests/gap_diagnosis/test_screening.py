"""Where an effect promises something: by a linear prediction, or by a seed as it is."""

from __future__ import annotations

import numpy as np
from test_evidence import NOMINAL as RIG
from test_evidence import records

from fjr_kit.least_squares import Solution
from fjr_sim_node.plant import PLANT
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.starts.screening import LARGEST, Screening
from gap_diagnosis.starts.search_space import Space
from gap_diagnosis.which.extension import Extension

NOMINAL = PLANT.defaults()
HALF = 50
SEED = {
    "stribeck_friction_motor.torque_nm": 2.0,
    "stribeck_friction_motor.velocity_rad_s": 0.1,
}


def errors(models: list[Model]) -> np.ndarray:
    """Return errors of two cells; the effect at its seed clears the first, and the second grows."""
    found = np.ones((len(models), 2 * HALF))
    for row, model in zip(found, models, strict=True):
        size = model.effects.get("stribeck_friction_motor.torque_nm", 0.0) / 2.0
        row[:HALF] -= size
        row[HALF:] += 1.2 * size
    return found


def costs(rows: np.ndarray) -> np.ndarray:
    cells = rows.reshape(len(rows), 2, HALF)
    return np.asarray(HALF * np.log(np.maximum(np.mean(cells**2, axis=2), 1e-4)).sum(axis=1))


def test_a_seed_that_explains_much_as_it_is_counts_though_no_linear_prediction_does():
    model = Model(NOMINAL, {})
    base = len(NOMINAL)
    jacobian = np.zeros((2 * HALF, base))
    parent = Solution(np.zeros(base), 2.0 * HALF, jacobian, errors([model])[0], True)
    space = Space(NOMINAL, tuple(SEED), tuple(SEED.values()))
    screening = Screening(parent, model, [SEED], lambda _: space, errors, costs)
    cleared = HALF * np.log(1e4) - 2 * HALF * np.log(2.2)
    assert np.isclose(screening.gain, cleared)
    cost, _, point = screening.proposals()[0]
    assert np.isclose(cost, -cleared)
    assert space.model(point).effects == SEED
    assert np.isclose(screening.gain_beside(parent, np.ones(2 * HALF), costs), cleared)


def test_a_size_beyond_the_largest_is_tried_at_the_largest():
    size = "torque_bias.torque_nm"
    tiny = 1e-3

    tried: list[float] = []

    def linear(models: list[Model]) -> np.ndarray:
        tried.extend(model.effects[size] for model in models if size in model.effects)
        sizes = np.array([model.effects.get(size, 0.0) for model in models])
        return (1.0 - sizes)[:, None] * np.ones(2 * HALF)

    def squares(rows: np.ndarray) -> np.ndarray:
        return np.sum(rows**2, axis=1)

    model = Model(NOMINAL, {})
    base = len(NOMINAL)
    parent = Solution(
        np.zeros(base), 2.0 * HALF, np.zeros((2 * HALF, base)), linear([model])[0], True
    )
    space = Space(NOMINAL, (size,), (1.0,))
    found = Screening(parent, model, [{size: tiny}], lambda _: space, linear, squares)
    point = found.proposals()[0][2]
    assert np.isclose(space.model(point).effects[size], LARGEST * tiny)
    assert np.allclose(sorted(tried), [tiny, tiny, LARGEST * tiny])  # no size twice but the seed's


def test_an_effect_without_hope_is_tried_at_no_further_size():
    size = "torque_bias.torque_nm"
    tried: list[float] = []

    def bent(models: list[Model]) -> np.ndarray:
        """Return errors that a size of 1 halves and one of 0.2 clears; 2 is predicted."""
        tried.extend(model.effects[size] for model in models if size in model.effects)
        sizes = np.array([model.effects.get(size, 0.0) for model in models])
        return (1.0 - 6.0 * sizes + 5.5 * sizes**2)[:, None] * np.ones(2 * HALF)

    def screened() -> Screening:
        model, base = Model(NOMINAL, {}), len(NOMINAL)
        parent = Solution(
            np.zeros(base), 2.0 * HALF, np.zeros((2 * HALF, base)), bent([model])[0], True
        )
        space = Space(NOMINAL, (size,), (1.0,))
        return Screening(parent, model, [{size: 1.0}], lambda _: space, bent, costs)

    alone = screened().proposals(scaled=False)
    few, tried[:] = len(tried), []
    scaled = screened().proposals()
    assert len(tried) > few
    assert scaled[0][0] < alone[0][0]
    assert {cost for cost, *_ in alone} < {cost for cost, *_ in scaled}


def test_the_cause_is_tried_at_more_sizes_and_what_promises_nothing_is_not(monkeypatch):
    scaled: dict[str, bool] = {}
    proposals = Screening.proposals

    def told(self: Screening, **given: bool) -> list:
        scaled[next(iter(self._seeds[0])).split(".")[0]] = given.get("scaled", True)
        return proposals(self, **given)

    monkeypatch.setattr(Screening, "proposals", told)
    fitter = CellFitter(Evidence(records({"torque_bias.torque_nm": 3.0}, runs=2), RIG), RIG, 0.1)
    refit = fitter.refit()
    effects = ["torque_bias", "extra_mode", "delay"]
    found = Extension(fitter, effects, lambda _: None).extended(refit, [refit])
    assert found[0].effects == ("torque_bias",)
    assert scaled["torque_bias"] and not all(scaled.values())
