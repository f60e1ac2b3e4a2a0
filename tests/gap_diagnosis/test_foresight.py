"""What a plan promises, held against diagnoses and refits of simulated bags."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gap_cases import SHORT, fitter_of, simulate_case, with_other_noise

from excitation_node.record_experiment import RECORD, describe_record
from fjr_bringup import Campaign
from fjr_bringup.design.planned import planned_record
from fjr_kit.errors import InputError
from fjr_kit.showing import BareRefit
from fjr_records.records import RecordSet
from fjr_sim_node.plant import PLANT
from gap_diagnosis import Foresight, foresee, investigate
from gap_diagnosis.foresight.sight import Sight
from gap_diagnosis.model.nominal import refuse_too_stiff

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


def test_what_shows_ten_times_as_much_is_larger_and_a_limit_lower():
    """A delay shows in proportion to itself; of a saturation less is needed the lower it lies."""
    recorded, names = planned_record(planned(1e-4)), ["delay", "torque_saturation"]
    once, often = (foresee(recorded, NOMINAL, effects=names, showing=k) for k in (1.0, 10.0))
    ratio = {a.effect: b.limit / a.limit for a, b in zip(once.effects, often.effects, strict=True)}
    assert ratio["delay"] == pytest.approx(10.0, rel=0.1)
    assert 0.3 < ratio["torque_saturation"] < 0.99


def test_a_plan_that_a_gate_would_stop_says_so():
    short = {"amplitudes_rad": (2e-3, 2e-2), "transient_periods": 1}
    for what, stopped in ((short, True), ({}, False)):
        notes = foresee(planned_record(planned(2e-5, **what)), NOMINAL, effects=["delay"]).notes
        assert any("still transient" in note for note in notes) == stopped, notes


def test_records_of_a_rigid_axis_have_limits():
    rigid = {"jm": 0.5, "fsm": 5.0, "fvm": 3.0, "j": 0.0, "fs": 0.0, "fv": 0.0, "k1": 0.0}
    rigid["k0"] = math.inf
    records = simulate_case({}, seed=3, plant={"k0": math.inf}, **SHORT).recorded.as_records()
    seen = foresee(records, rigid, effects=["torque_bias"])
    (one,) = seen.effects
    assert 0.0 < one.limit < 5.0 and {p.name for p in seen.parameters} == {"jm", "fsm", "fvm"}


def test_standard_errors_are_those_of_repeated_refits():
    noise = 1e-3  # so that the simulation's own budget of 0.1 % does not count
    case = simulate_case(seed=4, off=0.0, noise_rad=noise, **SHORT)
    seen = foresee(planned_record(planned(noise)), NOMINAL, effects=["backlash"])
    found = []
    for seed in range(12):
        recorded = with_other_noise(case, 100 + seed)
        found.append(fitter_of(recorded, NOMINAL).refit().solution.x)
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
        # of two runs of a level one is fitted, of eight every third
        assert other.error_percent == pytest.approx(one.error_percent / math.sqrt(8.0 / 3.0))
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


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"jm": 1e-4, "j": 1e-4}, "fv / j is 4e+04 1/s"),
        ({"fvm": 2e4}, "check values and units of fvm and jm."),
        ({"k0": 1.5e7}, "the root of k0 / jm is 8.66e+03 1/s"),
        ({"k0": math.inf, "jm": 1e-5, "j": 1e-5}, "fvm / jm is 3e+05 1/s"),
    ],
)
def test_a_nominal_that_moves_too_fast_for_the_samples_is_refused(values, words):
    recorded = planned_record(planned(1e-4))
    with pytest.raises(InputError, match="too fast to be simulated at 1000 samples") as refused:
        foresee(recorded, {**NOMINAL, **values})
    assert words in str(refused.value)


def test_a_stiff_axis_whose_motion_samples_can_show_is_not_refused():
    refuse_too_stiff({**NOMINAL, "k0": 1.5e6}, 1000.0, "sheet.yaml")
    refuse_too_stiff({**NOMINAL, "k0": math.inf}, 100.0, "sheet.yaml")


def test_nothing_that_takes_too_long_is_played(monkeypatch):
    """A lag is the stiffer the shorter it is, and this record shows one of microseconds."""
    played, errors = [], Sight.errors

    def watched(sight, models):
        played.extend((sight, model) for model in models)
        return errors(sight, models)

    monkeypatch.setattr(Sight, "errors", watched)
    long = planned_record(planned(1e-6, transient_periods=8, amplitudes_rad=(2e-2,)))
    (one,) = foresee(long, NOMINAL, effects=["actuator_lag"]).effects
    assert not any(sight.too_stiff(model) for sight, model in played)
    assert sum(bool(model.effects) for _, model in played) > 3
    sight, bare = played[0]
    shorter = bare.with_effects({"actuator_lag.time_constant_s": 0.8 * one.limit})
    assert sight.too_stiff(shorter), "the shortest lag that can be played shows"


def test_an_effect_that_cannot_be_played_beside_a_nominal_has_a_reason(monkeypatch):
    monkeypatch.setattr(Sight, "too_stiff", lambda _, model: bool(model.effects))
    (one,) = foresee(planned_record(planned(1e-4)), NOMINAL, effects=["delay"]).effects
    assert one.limit is None and "moves too fast to be simulated" in one.why_not


def test_an_effect_that_is_none_is_refused():
    with pytest.raises(InputError, match="no effect 'backlsh'; did you mean backlash"):
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


def chirps(noise_rad: float, rig=None) -> RecordSet:
    """Return three sweeps of a rig."""
    campaign = planned(noise_rad, rig, amplitudes_rad=(2e-2,), realizations=3)
    law = campaign.experiment(0, 0).controller
    values = RECORD.check({"duration_s": 10.0}, "record")
    runs = [
        describe_record("chirp", campaign.values["excitation"], values, *run, law)
        for run in campaign.runs
    ]
    recorded = planned_record(campaign, runs)
    assert isinstance(recorded, RecordSet)
    return recorded


def test_records_show_an_effect_above_their_limit():
    noise, only = 1e-4, ["backlash"]
    (one,) = foresee(chirps(noise), NOMINAL, effects=only).effects
    found = [
        investigate(chirps(noise, sized(one, factor)), NOMINAL, effects=only).diagnosis
        for factor in (5.0, 0.2)
    ]
    assert [diagnosis.effects for diagnosis in found] == [only, []]


def test_short_ways_hardly_show_an_eccentric_encoder():
    """It scales all parameters about one angle, and what it reads at the start shows nothing."""
    (one,) = foresee(chirps(1e-5), NOMINAL, effects=["encoder_eccentricity"]).effects
    assert one.limit > 0.03
