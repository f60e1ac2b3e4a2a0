"""The controller as a discrete transfer function: its law, its description, its loop, its check."""

import math
import sys
from dataclasses import replace

import effect_rig
import gap_cases
import numpy as np
import pytest
from processes import completed
from scipy.signal import lfilter

from controller_node import pd_filtered, transfer_function
from controller_node.law import as_transfer_function, law_of
from controller_node.transfer_function import TransferFunction
from fjr_kit.errors import InputError
from fjr_records.periodic import RecordedExperiment
from fjr_sim_node import effects, plant
from fjr_sim_node.simulation import closed_loop
from gap_diagnosis.model.controller_check import check_controller
from gap_diagnosis.model.discretisation import discretisation_error
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.simulated_rig import Simulator

PD = pd_filtered.coefficients(pd_filtered.CONTROLLER.defaults())
LEAD_WITH_INTEGRATOR = {
    "kind": "transfer_function",
    "numerator": [1650.0, -3270.0, 1620.5],
    "denominator": [1.0, -1.96, 0.96],
    "torque_limit_nm": None,
}


def response(law: TransferFunction, r: np.ndarray, y: np.ndarray) -> np.ndarray:
    x, out = np.zeros(law.states + 1), []
    for each in zip(r, y, strict=True):
        out.append(transfer_function.step(x, *each, *law.coefficients))
    return np.array(out)


@pytest.mark.parametrize(
    ("b", "a"),
    [([2.0], [1.0]), ([3.0, -1.0], [2.0, -1.0, 0.3]), ([0.0, 0.0, 1.0], [1.0, -0.5])],
)
def test_the_step_is_scipys_filter(b, a):
    r, y = np.random.default_rng(1).standard_normal((2, 200))
    expected = lfilter(b, a, r - y)
    assert np.allclose(response(TransferFunction.of(b, a), r, y), expected, atol=1e-12)


def test_the_torque_is_clamped_and_the_state_is_not():
    r, y = np.random.default_rng(2).standard_normal((2, 200))
    free = lfilter([3.0, -1.0], [1.0, -0.9], r - y)
    law = TransferFunction.of([3.0, -1.0], [1.0, -0.9], 1.5)
    assert np.allclose(response(law, r, y), np.clip(free, -1.5, 1.5), atol=1e-12)
    assert np.abs(free).max() > 1.5


def test_the_default_law_as_a_transfer_function_closes_the_same_loop():
    reference = effect_rig.multisine_reference(0.01)
    noise = 1e-5 * np.random.default_rng(3).standard_normal(reference.size)
    coefficients = plant.coefficients(plant.PLANT.defaults())
    for e in (None, effects.coefficients({"backlash.half_gap_rad": 1e-3})):
        runs = [
            closed_loop.simulate(reference, 1000.0, coefficients, law, noise, e)
            for law in (PD, TransferFunction.of_pd(PD))
        ]
        for name in ("position", "torque", "link"):
            a, b = (getattr(run, name) for run in runs)
            assert effect_rig.relative_rms(b, a) < 1e-9


def test_an_observer_with_the_true_model_follows_the_record_exactly():
    """The recorded torque drives it; the recorded position has nothing to correct."""
    reference = effect_rig.multisine_reference(0.01)
    coefficients = plant.coefficients(plant.PLANT.defaults())
    run = closed_loop.simulate(reference, 1000.0, coefficients, PD)
    observer = TransferFunction.of([50.0, -45.0], [1.0, -0.9])
    again = closed_loop.simulate_law(
        run.position, 1000.0, coefficients, observer, command=run.torque
    )
    assert np.array_equal(again.position, run.position)
    assert np.array_equal(again.torque, run.torque)


def test_finer_substeps_change_a_smooth_motion_only_by_the_discretisation():
    reference = effect_rig.multisine_reference(0.02)
    coefficients = plant.coefficients(plant.PLANT.defaults())
    law = TransferFunction.of_pd(PD)
    coarse, fine = (
        closed_loop.simulate_law(reference, 1000.0, coefficients, law, substeps=n).position
        for n in (1, 8)
    )
    assert 0.0 < effect_rig.relative_rms(coarse, fine) < 1e-3


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"numerator": []}, "numerator: must have at least 1 item"),
        ({"numerator": None}, "numerator: must be a valid list"),
        ({"denominator": [1.0, "a"]}, "denominator.1: must be a number"),
        ({"denominator": [1.0, math.inf]}, "denominator.1: must be a finite number"),
        ({"denominator": [0.0, 1.0]}, "is not causal"),
        ({"denominator": [1.0, -2.5]}, "pole of magnitude 2.5 outside the unit circle"),
        ({"numerator": [1e308], "denominator": [1e-308]}, "coefficients that are not finite"),
        ({"torque_limit_nm": 0.0}, "torque_limit_nm: must be greater than 0"),
        ({"kind": "fuzzy"}, "kind is 'fuzzy'; known are pd, pid, p_pi"),
        ({"kind": ["pd"]}, "kind is"),
    ],
    ids=str,
)
def test_a_bad_description_is_one_sentence(change, words):
    with pytest.raises(InputError) as raised:
        law_of({**LEAD_WITH_INTEGRATOR, **change}, 1000.0)
    message = str(raised.value)
    assert message.startswith("experiment description: controller") and message.endswith(".")
    assert words in message


def test_both_kinds_of_description_give_their_law():
    pd = law_of({"kind": "pd_filtered", "p": 200.0, "d": 60.0, "n": 24.0}, 1000.0)
    assert np.array_equal(pd, PD)
    law = law_of({**LEAD_WITH_INTEGRATOR, "torque_limit_nm": 40.0}, 1000.0)
    assert law.limit_nm == 40.0 and law.slowest_pole == pytest.approx(1.0, abs=1e-9)
    assert as_transfer_function(law) is law


@pytest.fixture(scope="module")
def case():
    return gap_cases.simulate_case(
        seed=3, levels_rad=(7e-3,), realizations=1, controller=LEAD_WITH_INTEGRATOR
    )


def test_the_model_repeats_a_rig_with_such_a_controller(case):
    position, torque = Simulator(case.recorded).signals(case.truth)
    realization = case.recorded.realizations[0]
    for simulated, name in ((position, "position"), (torque, "torque")):
        measured = realization.kept(getattr(realization, name)).mean(0)
        assert effect_rig.relative_rms(simulated[0], measured) < 5e-2


def test_the_gates_hold_for_such_a_controller(case):
    realization = case.recorded.realizations[0]
    assert check_controller(realization).passed
    assert discretisation_error(case.recorded, case.truth)[0] < 1e-3
    late = replace(realization, torque=np.roll(realization.torque, 1))
    assert not check_controller(late).passed
    diverges = Model({**case.truth.plant, "jm": 1e-6, "k0": 1e8}, {})
    assert math.isnan(discretisation_error(case.recorded, diverges)[0])


def test_a_record_that_begins_in_the_middle_is_still_checked(case):
    """The integrator's state at its first sample is not known, and is never forgotten."""
    realization = case.recorded.realizations[0]
    tail = replace(
        realization,
        **{n: getattr(realization, n)[1:] for n in ("reference", "torque", "position")},
    )
    assert check_controller(tail).passed
    wrong = {**LEAD_WITH_INTEGRATOR, "numerator": [1640.0, -3270.0, 1630.5]}
    described = realization.experiment.model_copy(update={"controller": wrong})
    assert not check_controller(replace(tail, experiment=described)).passed
    assert RecordedExperiment("one", (tail,)).lines > 100


def test_what_only_simulates_starts_without_scipy_signal():
    """It takes as long to load as all else together, in every worker process."""
    code = "import sys, fjr_bringup.campaign.batch_run; print('scipy.signal' in sys.modules)"
    done = completed(sys.executable, "-c", code)
    assert done.stdout == "False\n", done.stderr
