"""What a plan promises, held against diagnoses and refits of simulated bags."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gap_cases import SHORT, simulate_case, with_other_noise

from fjr_bringup import Campaign
from fjr_bringup.design.planned import planned_record
from fjr_kit.errors import InputError
from fjr_kit.showing import BareRefit
from fjr_records.noise import noise_levels
from fjr_sim_node.plant import PLANT
from gap_diagnosis import Foresight, foresee, investigate
from gap_diagnosis.model.simulated_rig import Simulator
from gap_diagnosis.record_investigation import investigate_records
from gap_diagnosis.which.fits import Fitter

NOMINAL = {name: float(value) for name, value in PLANT.defaults().items()}
EXCITATION = {
    "base_frequency_hz": 0.5,
    "f_min_hz": 0.5,
    "amplitudes_rad": (5e-3, 2e-2),
    "realizations": 2,
    "periods": 2,
    "transient_periods": 2,
}


def planned(noise_rad: float, rig=None, **excitation) -> Campaign:
    simulator = {"noise_std_rad": noise_rad, **(rig or {})}
    values = {"excitation": {**EXCITATION, **excitation}, "simulator": simulator}
    return Campaign.create(overrides=values)


def sized(one, factor: float) -> dict[str, float]:
    """Return an effect at a multiple of its limit, in the shape that the limit is of."""
    return {one.parameter: factor * one.limit, **one.shape}


@pytest.mark.parametrize("effect", ["backlash", "dead_band", "transmission_damping", "delay"])
def test_an_effect_is_named_above_its_limit_and_not_below(effect):
    noise = 1e-4
    seen = foresee(planned_record(planned(noise)), NOMINAL, effects=[effect])
    (one,) = seen.effects
    named = []
    for factor in (5.0, 0.2):
        case = simulate_case(sized(one, factor), seed=3, off=0.0, noise_rad=noise, **SHORT)
        found = investigate(case.recorded, NOMINAL, effects=[effect]).diagnosis
        named.append(found.effects)
    assert named == [[effect], []]


def test_standard_errors_are_those_of_repeated_refits():
    noise = 1e-3  # so that the simulation's own budget of 0.1 % does not count
    case = simulate_case(seed=4, off=0.0, noise_rad=noise, **SHORT)
    seen = foresee(planned_record(planned(noise)), NOMINAL, effects=["backlash"])
    found = []
    for seed in range(12):
        recorded = with_other_noise(case, 100 + seed)
        std = noise_levels(recorded).of_outputs(recorded)
        fitter = Fitter(recorded, Simulator(recorded), std, NOMINAL, (0, 2), (1, 3))
        found.append(fitter.refit().solution.x)
    scatter = 100.0 * np.std(found, axis=0, ddof=1)
    predicted = np.array([one.error_percent for one in seen.parameters])
    ratio = scatter / predicted
    assert 0.7 < math.exp(np.mean(np.log(ratio))) < 1.4
    assert np.all((ratio > 0.4) & (ratio < 2.0))  # 12 refits know a scatter to some 20 %


def test_more_realizations_know_parameters_better_and_find_smaller_effects():
    few, many = (
        foresee(planned_record(planned(1e-3)), NOMINAL, realizations=count, effects=["backlash"])
        for count in (2, 8)
    )
    for one, other in zip(few.parameters, many.parameters, strict=True):
        assert other.error_percent == pytest.approx(one.error_percent / 2.0)
    assert many.effects[0].limit <= 1.05 * few.effects[0].limit
    assert Foresight.from_json(many.to_json(), "text") == many


def test_what_moves_too_little_tells_only_sums():
    """Slow motion shows both inertias and both frictions as one."""
    slow = planned(1e-3, amplitudes_rad=(5e-2,), f_max_hz=2.0)
    seen = foresee(planned_record(slow), NOMINAL, effects=["torque_gain"], tolerance=0.05)
    by_name = {one.name: one for one in seen.parameters}
    assert by_name["k1"].identifiable != "alone" or by_name["k0"].identifiable != "alone"
    tied = [one for one in seen.parameters if one.identifiable == "in combination"]
    assert all(one.tied_to and one.name not in one.tied_to for one in tied)
    (gain,) = seen.effects
    assert gain.limit is None and "scaled by one factor" in gain.why_not


def test_what_could_be_taken_for_what():
    seen = foresee(
        planned_record(planned(2e-5)), NOMINAL,
        effects=["delay", "actuator_lag", "torque_bias", "gravity", "transmission_damping"],
    )  # fmt: skip
    told = {one.effect: one.not_told_from for one in seen.effects}
    assert told["delay"] == ["actuator_lag"] and "delay" in told["actuator_lag"]
    assert "gravity" in told["torque_bias"]
    assert told["transmission_damping"] == []


def test_an_effect_that_is_none_is_refused():
    with pytest.raises(InputError, match="backlsh is no effect"):
        foresee(planned_record(planned(0.0)), NOMINAL, effects=["backlsh"])


def test_a_refit_takes_over_what_its_slopes_span():
    slopes = np.random.default_rng(0).standard_normal((50, 2))
    refit = BareRefit({"a": 2.0, "b": 3.0}, ["a", "b"], slopes)
    assert np.linalg.norm(refit.left(slopes @ [0.3, -0.2])) < 1e-12
    other = np.random.default_rng(1).standard_normal(50)

    def change_from(plant):
        moved = np.array([plant["a"] / 2.0 - 1.0, plant["b"] / 3.0 - 1.0])
        return other + slopes @ ([0.3, -0.2] - moved)

    left = refit.left_by_refit(change_from, np.linalg.norm)
    assert left == pytest.approx(refit.left(other), abs=1e-9)


def test_records_show_an_effect_above_their_limit():
    from excitation_node.record_experiment import RECORD, describe_record

    noise = 1e-4
    seen = {}
    for factor in (0.0, 5.0, 0.2):
        rig = {} if not factor else sized(seen["one"], factor)
        campaign = planned(noise, rig, amplitudes_rad=(2e-2,), realizations=3)
        law = campaign.experiment(0, 0).controller
        values = RECORD.check({"duration_s": 10.0}, "record")
        runs = [
            describe_record("chirp", campaign.values["excitation"], values, *run, law)
            for run in campaign.runs
        ]
        records = planned_record(campaign, runs)
        if factor:
            found = investigate_records(records, NOMINAL, effects=["backlash"]).diagnosis
            seen[factor] = found.effects
        else:
            (seen["one"],) = foresee(records, NOMINAL, effects=["backlash"]).effects
    assert seen[5.0] == ["backlash"] and seen[0.2] == []
