"""Standard errors of fits whose law is right, and of fits whose law is not quite right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_cases import SHORT, fitter_of, simulate_case
from hypothesis import given
from hypothesis import strategies as st

from fjr_kit.least_squares import Solution
from gap_diagnosis.fits.comparison import CellFit
from gap_diagnosis.fits.estimates import (
    form,
    inverted,
    kept_from_zero,
    linear_estimates,
    standard_errors,
)
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.outcome.cause_words import digits, percent
from gap_diagnosis.outcome.gap_size import Estimate
from gap_diagnosis.starts.scales import Scales
from gap_diagnosis.starts.search_space import Space
from gap_diagnosis.which.presence import beyond_zero, cell_estimates

LINES, GROUPS = 600, 12
AT = np.linspace(0.0, 1.0, LINES)
GROUP = np.arange(LINES) * GROUPS // LINES
JACOBIAN = 30.0 * np.stack([np.ones(LINES), AT], axis=1)
RUNS = 400


def coverage(law: np.ndarray, seed: int) -> np.ndarray:
    """Return how often 1.96 standard errors hold the truth, zero, when the data hold a law too."""
    rng = np.random.default_rng(seed)
    inside = np.zeros(2)
    for _ in range(RUNS):
        data = rng.standard_normal(LINES) + law * rng.standard_normal()
        x = np.linalg.lstsq(JACOBIAN, data, rcond=None)[0]
        std = standard_errors(JACOBIAN, JACOBIAN @ x - data, GROUP)
        inside += np.abs(x) < 1.96 * std
    return inside / RUNS


def test_intervals_of_a_right_law_hold_the_truth_as_often_as_they_say():
    assert (coverage(np.zeros(LINES), 1) >= 0.93).all()
    assert (coverage(np.zeros(LINES), 1) <= 0.995).all()


def test_intervals_widen_where_neighbouring_lines_err_alike():
    law = 2.0 * np.sin(2.0 * np.pi * 1.3 * AT + 0.4)
    assert (coverage(law, 2) >= 0.85).all()
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(LINES)
    left = noise - JACOBIAN @ np.linalg.lstsq(JACOBIAN, noise, rcond=None)[0]
    alike = left + law - JACOBIAN @ np.linalg.lstsq(JACOBIAN, law, rcond=None)[0]
    shuffled = rng.permutation(alike)
    together = standard_errors(JACOBIAN, alike, GROUP)
    assert (together > 1.5 * standard_errors(JACOBIAN, shuffled, GROUP)).all()


def test_a_parameter_that_one_group_alone_tells_is_not_called_certain():
    jacobian = np.stack([np.ones(LINES), (GROUP == 3).astype(float)], axis=1)
    residuals = np.random.default_rng(4).standard_normal(LINES)
    residuals -= jacobian @ np.linalg.lstsq(jacobian, residuals, rcond=None)[0]
    std = standard_errors(jacobian, residuals, GROUP)
    assert np.isfinite(std).all()
    assert std[1] >= 0.9 * np.sqrt(1.0 / np.count_nonzero(GROUP == 3)) == pytest.approx(0.127, 0.01)


def test_a_parameter_that_one_group_nearly_alone_tells_is_as_uncertain_as_that_group_says():
    """Left out, what the other groups hint at would stand in for it, however wildly."""
    jacobian = np.stack([np.ones(LINES), np.where(GROUP == 3, 1.0, 0.01)], axis=1)
    residuals = np.random.default_rng(4).standard_normal(LINES)
    residuals += 3.0 * np.sin(2.0 * np.pi * 1.3 * AT)
    residuals -= jacobian @ np.linalg.lstsq(jacobian, residuals, rcond=None)[0]
    alone = np.sqrt(np.mean(residuals**2) / np.count_nonzero(GROUP == 3))
    assert alone < standard_errors(jacobian, residuals, GROUP)[1] < 12.0 * alone


def fit_of(effects, model: Model, space: Space, solution: Solution) -> CellFit:
    """Return a fit without evidence."""
    return CellFit(effects, space, model, solution, np.ones(1), np.ones((1, 1)))


def intervals(fit: CellFit) -> dict[str, Estimate]:
    """Return the linear intervals of a fit to the lines above."""
    solution = fit.solution
    return linear_estimates(fit, standard_errors(solution.jacobian, solution.residuals, GROUP))


def fitted(names: tuple[str, ...], values: tuple[float, ...], stds: tuple[float, ...]) -> CellFit:
    """Return a fit of effects whose parameters have these values and standard errors."""
    rng = np.random.default_rng(6)
    columns = np.linalg.qr(rng.standard_normal((LINES, len(names))))[0] / np.array(stds)
    residuals = 0.5 * rng.standard_normal(LINES)
    effects = tuple(dict.fromkeys(name.split(".")[0] for name in names))
    model = Model({}, dict(zip(names, values, strict=True)))
    solution = Solution(np.array(values), 0.0, columns, residuals, True)
    return fit_of(effects, model, Space({}, names, (1.0,) * len(names)), solution)


def scales_of(travel_rad: float) -> Scales:
    return Scales(100.0, 5.0, 0.05, 0.05, 1e-3, 50.0, 0.5, 300.0, travel_rad)


def test_the_period_of_a_ripple_is_known_as_the_fit_knows_it_and_its_size_as_its_law():
    names = ("cogging.amplitude_nm", "cogging.cycles_per_turn", "cogging.phase_rad")
    ripple = fitted(names, (0.5, 200.0, 0.3), (1e-3, 0.01, 1e-3))
    assert form(ripple, 0.03, scales_of(0.1)) == pytest.approx([0.015, 0.0, 0.03])
    part_of_one = form(ripple, 0.03, scales_of(2.0 * np.pi / 200.0 / 4.0))
    assert part_of_one == pytest.approx([0.015, 0.03 * 200.0 * 4.0, 0.03])


BIAS, ECCENTRIC = "torque_bias.torque_nm", "encoder_eccentricity.amplitude_rad"
PHASE = "encoder_eccentricity.phase_rad"
PRESLIDING = ("presliding_friction.motor_rad", "presliding_friction.link_rad")


@pytest.mark.parametrize(
    ("names", "values", "stds", "there"),
    [
        ((BIAS,), (-1.0,), (0.1,), True),
        ((BIAS,), (-1.0,), (2.0,), False),
        ((ECCENTRIC, PHASE), (0.1, 0.0), (0.01, 0.1), True),  # a phase may be zero
        ((ECCENTRIC, PHASE), (0.1, 1.0), (0.2, 0.1), False),
        (PRESLIDING, (1e-2, 0.0), (1e-3, 1e-3), True),  # one side is enough
        (PRESLIDING, (1e-2, 1e-2), (1e-1, 1e-1), False),
        ((BIAS, ECCENTRIC, PHASE), (1.0, 0.1, 1.0), (0.1, 0.2, 0.1), False),
    ],
)
def test_an_effect_whose_size_may_be_zero_is_not_sure(names, values, stds, there):
    fit = fitted(names, values, stds)
    found = intervals(fit)
    assert all(beyond_zero(effect, found, 0.0) for effect in fit.effects) is there


def test_a_gain_is_known_as_far_as_the_datasheet_is():
    """It scales all other parameters, so data alone say nothing of its size."""
    gain = "torque_gain.relative_error"
    fitter = fitter_of(simulate_case(seed=3, off=0.0, **SHORT).recorded)
    refit = fitter.refit()
    own = refit.solution.jacobian
    for size, there in ((0.3, True), (0.02, False)):
        solution = replace(
            refit.solution,
            x=np.append(refit.solution.x, size),
            jacobian=np.column_stack([own, -own.sum(axis=1)]),
        )
        space = replace(refit.space, effects=(gain,), units=(1.0,))
        model = refit.model.with_effects({gain: size})
        fit = replace(refit, effects=("torque_gain",), space=space, model=model, solution=solution)
        found = cell_estimates(fit, fitter, {}, {"torque_gain": refit})
        assert 0.05 < found[gain].high - found[gain].low < 0.2
        assert beyond_zero("torque_gain", found, 0.0) is there


def test_intervals_tell_of_a_valley_along_which_parameters_replace_each_other():
    """Seen from zero, an eccentric encoder errs in gain, which scales all but Coulomb friction."""
    truth = {"encoder_eccentricity.amplitude_rad": 0.15, "encoder_eccentricity.phase_rad": -1.25}
    case = simulate_case(truth, seed=3, noise_rad=5e-4, **SHORT)
    fitter = fitter_of(case.recorded)
    refit = fitter.refit()
    screening = fitter.screening(refit, "encoder_eccentricity")
    fit = fitter.further(fitter.add(refit, "encoder_eccentricity", screening.proposals()))
    assert fitter.misfit(fit) < 1.3
    found = cell_estimates(fit, fitter, {}, {"encoder_eccentricity": refit})
    for name, value in case.truth.plant.items():
        std = (found[name].high - found[name].low) / 3.92
        assert abs(found[name].value - value) < 4.0 * std, name
    assert found["jm"].high - found["jm"].low > 0.02 * found["jm"].value


def test_the_jacobian_that_intervals_rest_on_is_exact_where_the_loop_bends_soon():
    fitter = fitter_of(simulate_case(seed=0, **SHORT).recorded)
    fit = fitter.refit()
    x, half = fit.solution.x, 1e-6
    points = [x + sign * half * row for row in np.eye(x.size) for sign in (1.0, -1.0)]
    models = [fit.space.model(point) for point in points]
    errors = fitter.evidence.errors(models, fitter.fit_parts) * fitter.weights.weight(fit.variance)
    central = ((errors[0::2] - errors[1::2]) / (2.0 * half)).T
    off = np.linalg.norm(fit.solution.jacobian - central, axis=0)
    assert (off < 1e-3 * np.linalg.norm(central, axis=0)).all()


def test_a_size_that_its_shape_hides_is_kept_from_zero_by_the_fit_without_it():
    """With two parameters that replace each other, the linear interval of the size holds zero."""
    x = np.array([1.0, 0.5])
    jacobian = np.array([[1.0, 1.0], [0.0, 1e-3], [0.0, 0.0]])
    solution = Solution(x, 3.0, jacobian, np.array([1.0, 1.0, 1.0]), True)
    names = ("backlash.half_gap_rad", "piecewise_stiffness.soft_ratio")
    space = Space({}, names, (1e-3, 1.0))
    model = Model({}, dict(zip(names, (1e-3, 0.5), strict=True)))
    std = standard_errors(jacobian, solution.residuals, np.array([0, 1, 2]))
    linear = linear_estimates(fit_of(("backlash",), model, space, solution), std)
    hidden = linear["backlash.half_gap_rad"]
    assert hidden.low == 0.0 and not beyond_zero("backlash", linear, 0.0)
    assert kept_from_zero(linear, {"backlash": 3.0}) == linear
    strong = kept_from_zero(linear, {"backlash": 4.0 * 1.96**2})
    seen = strong["backlash.half_gap_rad"]
    assert seen.low == pytest.approx(0.5e-3) and seen.high == hidden.high
    assert beyond_zero("backlash", strong, 0.0)


def test_a_value_that_is_rounded_to_zero_has_no_sign():
    shown = digits(Estimate(value=-1e-9, low=-1.2e-5, high=1.2e-5))
    assert shown == ("0.000000", "-0.000012", "0.000012")


def test_a_share_that_is_too_small_to_matter_is_said_to_be_so():
    assert [percent(v) for v in (2.4e-17, -2.4e-17, 0.0)] == ["<0.001%", "0%", "0%"]
    assert [percent(v) for v in (1.2e-5, 3.5e-6, 0.12, -0.002)] == [
        "0.0012%",
        "<0.001%",
        "12%",
        "-0.20%",
    ]


def test_what_two_parameters_do_alike_is_known_of_neither():
    """Only the sum of Coulomb friction and a constant torque shows where a motor never turns."""
    rng = np.random.default_rng(4)
    one, other = rng.standard_normal((2, 4000))
    group = np.arange(4000) // 400
    apart = standard_errors(np.column_stack([one, other]), rng.standard_normal(4000), group)
    alike = standard_errors(np.column_stack([one, other, one]), rng.standard_normal(4000), group)
    assert (alike[[0, 2]] > 1e3 * apart[0]).all()
    assert alike[1] == pytest.approx(apart[1], rel=0.3)


@given(st.integers(0, 1000))
def test_a_covariance_is_the_inverse_of_the_normal_matrix_and_zero_for_what_does_nothing(seed):
    rng = np.random.default_rng(seed)
    jacobian = rng.standard_normal((30, 4)) * 10.0 ** rng.uniform(-6, 6, 4)
    found = inverted(jacobian.T @ jacobian)
    exact = np.linalg.inv(jacobian.T @ jacobian)
    assert np.abs(found / exact - 1.0).max() < 1e-6
    jacobian[:, 2] = 0.0
    found = inverted(jacobian.T @ jacobian)
    assert not found[2].any() and not found[:, 2].any() and found[0, 0] > 0.0
