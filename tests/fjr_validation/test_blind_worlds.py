"""Blind cases: what is drawn, how large it is made, what is written."""

import json
import math
from collections import Counter
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fjr_kit.showing import size_showing
from fjr_records import open_experiment
from fjr_sim_node.effects import EFFECTS
from fjr_validation.blind import excitations, rigs, stage
from fjr_validation.blind.answers import WORLDS, Answer
from fjr_validation.blind.causes import FAMILIES, compatible, drawers
from fjr_validation.blind.draw import Scales
from fjr_validation.blind.remainders import laws, scattered, wandering
from fjr_validation.blind.second_laws import SETTINGS
from fjr_validation.blind.visibility import FLOORS, Visibility
from fjr_validation.blind.worlds import KINDS, kind_of, make_case
from gap_diagnosis.model.nominal import read_nominal

SEEDS = st.integers(0, 2**31 - 1)
SCALES = Scales(
    torque=10.0, torque_peak=40.0, torque_rate_peak=4e3, speed=1.0, speed_peak=4.0, angle=0.1,
    deflection=0.01, coulomb=2.0, damping=30.0, link_inertia=0.3, resonance_hz=18.0, band_hz=36.0,
    crossover_hz=4.0,
)  # fmt: skip
NEW = {"coulomb_friction", "viscous_friction", "lugre_friction", "directional_loss",
       "torque_speed_limit", "torque_constant_ripple", "dead_band", "torque_slew_limit",
       "asymmetric_stiffness"}  # fmt: skip
"""Effects that the catalogue is to have."""
EARLIER = {"nonlinear_absorber", "synchronous_disturbance", "frictional_memory",
           "rate_limited_drive", "angle_dependent_stiffness", "drive_dead_band",
           "posture_dependent_inertia"}  # fmt: skip
"""Laws outside the catalogue of earlier checks."""
SHORT = {"closed": 33, "open": 4, "records": 35}
"""Cases of flexible rigs with one or two causes, in short records at low rates."""


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_a_rig_is_drawn_within_its_ranges_and_again_from_the_same_seed(seed):
    rig = rigs.draw_rig(np.random.default_rng(seed))
    again = rigs.draw_rig(np.random.default_rng(seed))
    assert rig == again
    plant = rig.plant
    low, high = rigs.INERTIA_KG_M2
    assert low <= plant["jm"] + plant["j"] <= high * (1 + 1e-9)
    low, high = rigs.INERTIA_RATIO
    assert low * (1 - 1e-9) <= plant["j"] / plant["jm"] <= high * (1 + 1e-9)
    assert 200.0 <= rig.loop.sample_rate_hz <= 5000.0
    if rig.rigid:
        assert math.isinf(plant["k0"])
    else:
        free = math.sqrt(plant["k0"] * (1 / plant["j"] + 1 / plant["jm"])) / (2 * math.pi)
        assert free == pytest.approx(rig.resonance_hz)
        assert 5.0 <= rig.resonance_hz <= 60.0
        assert rig.loop.sample_rate_hz >= 12.0 * rig.resonance_hz


@settings(max_examples=25, deadline=None)
@given(SEEDS)
def test_an_excitation_has_levels_runs_and_lengths_within_its_ranges(seed):
    rng = np.random.default_rng(seed)
    rig = rigs.draw_rig(rng)
    periodic = seed % 2 == 0
    drawn = (
        excitations.draw_multisine(rng, rig)
        if periodic
        else excitations.draw_records(rng, rig, controller_known=False)
    )
    levels = [run.level for run in drawn.runs]
    assert levels == sorted(levels) and len(drawn.firsts) == levels[-1] + 1 in (2, 3)
    assert 1 <= len(drawn.runs) / len(drawn.firsts) <= 3
    seconds = drawn.runs[0].reference.size / rig.loop.sample_rate_hz
    assert 9.9 <= seconds <= 30.1
    rms = [float(np.std(run.reference)) for run in drawn.firsts]
    assert all(1.4 < b / a < 3.3 for a, b in pairwise(rms))
    assert rms[-1] < 1.1 * excitations.LARGEST_RAD[1]
    assert (drawn.kind == "multisine") is periodic
    if not periodic:
        assert all(run.description.controller is None for run in drawn.runs)
        for run in drawn.runs:
            first = drawn.firsts[run.level].reference
            assert (run.description.repeat_of is None) or np.array_equal(run.reference, first)


def test_kinds_have_their_shares():
    for world in WORLDS:
        counts = Counter(kind_of(201, number, world) for number in range(4000))
        for kind, share in KINDS[world].items():
            assert counts[kind] / 4000 == pytest.approx(share, abs=4 * math.sqrt(share / 4000))


def test_causes_are_those_of_the_catalogue_and_laws_of_the_remainder_are_not():
    rng = np.random.default_rng(0)
    every = {draw(rng, SCALES).name for draw in drawers(rigid=False, stationary=False)}
    for _ in range(30):
        every |= {draw(rng, SCALES).name for draw in drawers(rigid=False, stationary=False)}
    assert every == (set(EFFECTS) | NEW) - {"torque_gain", "transmission_stiffness"}
    outside = {draw(rng, SCALES).name for draw in laws(rigid=False)}
    assert not outside & (set(EFFECTS) | NEW | EARLIER)
    assert {name for family in FAMILIES for name in family} <= every


def test_every_setting_is_drawn_by_some_effect():
    drawn: set[str] = set()
    for seed in range(20):
        rng = np.random.default_rng(seed)
        for draw in (*drawers(rigid=False, stationary=False), *laws(rigid=False)):
            drawn |= set(draw(rng, SCALES).settings(0.1))
    assert drawn - {"fs", "fsm", "fvm", "k1"} == set(SETTINGS)


def test_two_causes_are_never_near_each_other():
    assert not compatible(["gravity"], "torque_bias")
    assert not compatible(["delay"], "delay")
    assert compatible(["delay"], "gravity")
    assert compatible([], "gravity")


def test_friction_scatters_from_run_to_run_as_said():
    plant = {"jm": 1.0, "fs": 2.0, "fsm": 3.0, "fv": 4.0, "fvm": 5.0, "k0": 6.0}
    drawn = [scattered(plant, 0.04, np.random.default_rng([7, i])) for i in range(4000)]
    assert {d["jm"] for d in drawn} == {1.0} and {d["k0"] for d in drawn} == {6.0}
    for name in ("fs", "fv"):
        ratio = np.array([d[name] / plant[name] for d in drawn])
        assert np.mean(ratio) == pytest.approx(1.0, abs=3e-3)
        assert np.std(ratio) == pytest.approx(0.04, rel=0.05)
        twin = {"fs": "fsm", "fv": "fvm"}[name]
        assert np.allclose(ratio, [d[twin] / plant[twin] for d in drawn])
    coulomb, viscous = ([d[name] for d in drawn] for name in ("fs", "fv"))
    assert abs(np.corrcoef(coulomb, viscous)[0, 1]) < 0.06
    assert scattered(plant, 0.0, np.random.default_rng(1)) == plant


def test_a_wandering_torque_has_unit_variance_and_its_time():
    wander = wandering(np.random.default_rng(3), 400_000, 1000.0, 0.2)
    assert np.std(wander) == pytest.approx(1.0, rel=0.1)
    late = np.mean(wander[200:] * wander[:-200])
    assert late == pytest.approx(math.exp(-1.0), abs=0.1)


def test_the_size_that_shows_as_much_as_is_wanted_is_found():
    assert size_showing(lambda s: 3.0 * s, 0.6, 0.01, 1.0) == pytest.approx(0.2, rel=0.1)
    assert size_showing(lambda s: s**3, 1e-3, 0.9, 1.0) == pytest.approx(0.1, rel=0.05)
    assert size_showing(lambda s: math.inf if s > 0.5 else s, 0.3, 0.4, 1.0) == pytest.approx(
        0.3, rel=0.1
    )
    assert size_showing(lambda s: 0.1 * s, 0.6, 0.01, 1.0) is None


@pytest.fixture(scope="module")
def drawn() -> stage.Stage:
    for attempt in range(20):
        try:
            return stage.draw_stage((5, attempt), periodic=True)
        except stage.Unsuitable:
            continue
    raise AssertionError("nothing suitable in twenty draws")


def test_a_stage_has_friction_and_noise_within_their_ranges(drawn):
    low, high = stage.FRICTION
    assert 0.8 * low <= drawn.facts["friction_over_torque"] <= 1.2 * high
    run = drawn.excitation.firsts[-1]
    clean = drawn.record(run, drawn.plant, {})
    noisy = drawn.record(run, drawn.plant, {}, noisy=True)
    assert np.std(noisy.y - noisy.th) == pytest.approx(drawn.noise_rad, rel=0.05)
    assert np.array_equal(clean.y, clean.th)


def test_only_the_runs_of_one_stage_differ_in_their_friction(drawn):
    first, second = drawn.excitation.runs[:2]
    same = drawn.record(first, drawn.plant, {}, scatter=0.03).y
    assert np.array_equal(same, drawn.record(first, drawn.plant, {}, scatter=0.03).y)
    assert not np.array_equal(same, drawn.record(first, drawn.plant, {}).y)
    twin = replace(second, reference=first.reference)
    runs = (first, twin, *drawn.excitation.runs[2:])
    other = replace(drawn, excitation=replace(drawn.excitation, runs=runs))
    assert not np.array_equal(same, other.record(twin, drawn.plant, {}, scatter=0.03).y)


def test_what_a_refit_takes_over_does_not_show(drawn):
    firsts = drawn.excitation.firsts
    seen = Visibility(firsts, drawn.positions, drawn.plant, drawn.noise_rad)
    for name in ("jm", "fsm", "fvm", "k0"):
        more = {**drawn.plant, name: 1.02 * drawn.plant[name]}
        assert seen.relative(seen.change(more, {})) < 0.05  # of the detection limit
    delayed = seen.change(drawn.plant, {"delay_s": 5e-5})
    twice = seen.change(drawn.plant, {"delay_s": 1e-4})
    assert seen.relative(twice) == pytest.approx(2.0 * seen.relative(delayed), rel=0.2)
    assert FLOORS * seen.relative(delayed) * 1e-3 <= 2.0 * math.sqrt(len(firsts)) * seen.share(
        seen.left(delayed)
    )


def test_a_large_change_that_a_refit_takes_over_is_left_to_it_however_far_it_bends(drawn):
    """As an eccentric encoder scales all parameters: slopes alone would call that visible."""
    seen = Visibility(drawn.excitation.firsts, drawn.positions, drawn.plant, drawn.noise_rad)
    target = drawn.positions({name: 1.4 * value for name, value in drawn.plant.items()}, {})
    linear = seen.left(seen.between(target, drawn.positions(drawn.plant, {})))
    refitted = seen.left_by_refit(target, lambda plant: drawn.positions(plant, {}))
    assert seen.relative(linear) > 1.0  # of the detection limit
    assert seen.relative(refitted) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("world", WORLDS)
def test_a_case_is_made_again_from_its_number_and_reads_as_an_experiment(world, tmp_path):
    number = SHORT[world]
    answers = [make_case(202, number, world, tmp_path / name) for name in ("one", "two")]
    assert answers[0] == answers[1]
    files = [sorted((tmp_path / name).rglob("*.mcap")) for name in ("one", "two")]
    assert [f.read_bytes() for f in files[0]] == [f.read_bytes() for f in files[1]]
    answer = answers[0]
    sealed = json.loads((tmp_path / "one" / "answer.json").read_text())
    assert Answer.from_json(sealed) == answer
    assert (answer.scatter > 0.0) is (world != "closed") is bool(answer.laws)
    nominal = read_nominal(tmp_path / "one" / "nominal.yaml")
    lacking = {name for name, value in nominal.items() if value == 0.0}
    brought = {"fs", "fsm", "fv", "fvm"} & set(answer.settings)
    assert lacking <= brought | {"fs", "fv", "k1"}
    for name, value in nominal.items():
        if value and math.isfinite(value):
            assert abs(answer.plant[name] / value - 1.0) < stage.DATASHEET + 1e-3
    assert len(list((tmp_path / "one").glob("level_*"))) == answer.facts["runs"]
    if world != "records":
        assert len(open_experiment(tmp_path / "one").bags) == answer.facts["runs"]
    assert answer.world == world and answer.kind == kind_of(202, number, world)
