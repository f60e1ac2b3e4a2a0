"""Blind cases: what is drawn, how large it is made, what is written."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from fjr_records.recorded import read_experiment
from fjr_validation.blind.cases import NOMINAL, Answer, CaseMaker, Plan, plans
from fjr_validation.blind.draws import COMBINED, SINGLE, Draw
from fjr_validation.blind.limits import FLOORS, Run, Sizes, Visibility, play


def test_plans_follow_from_the_seed_alone():
    assert plans(60, 4) == plans(60, 4)
    assert plans(60, 4) != plans(60, 5)


def test_kinds_have_their_shares_and_effects_their_turns():
    made = plans(120, 1)
    assert Counter(plan.kind for plan in made) == {
        "single": 55, "outside": 20, "two": 15, "parameters": 15, "none": 10, "nonstationary": 5,
    }  # fmt: skip
    singles = Counter(plan.drawers[0] for plan in made if plan.kind == "single")
    assert set(singles) == set(range(len(SINGLE)))
    assert set(singles.values()) == {2, 3}
    assert [plan.kind for plan in made] != sorted(plan.kind for plan in made)


def test_sizes_of_single_effects_are_spread_around_the_limit():
    sizes = np.array([p.relative[0] for p in plans(240, 2) if p.kind == "single"])
    counts = np.histogram(sizes, [0.3, 0.71, 1.42, 2.83, 5.66, 12.0])[0]
    assert counts.sum() == sizes.size
    assert counts.min() > 0.1 * sizes.size


def test_two_effects_can_be_told_apart_and_seen():
    names = [drawer(np.random.default_rng(0)).name for drawer in COMBINED]
    for plan in plans(800, 3):
        if plan.kind == "two":
            pair = {names[index] for index in plan.drawers}
            assert len(pair) == 2
            assert not pair <= {"torque_bias", "asymmetric_friction", "gravity"}
            assert not pair <= {"backlash", "piecewise_stiffness"}
            assert min(plan.relative) >= 3.0


def short_run(level_rad: float, noise_rad: float) -> Run:
    rng = np.random.default_rng(1)
    time = np.arange(3000) / 1000.0
    phases = rng.uniform(0, 6, 10)
    reference = sum(level_rad * np.cos(2 * np.pi * (2 * i + 1) * time + phases[i])
                    for i in range(10))  # fmt: skip
    return Run(reference, noise_rad * rng.standard_normal(3000), 0.0, 1000, 2, 21)


@pytest.fixture(scope="module")
def visibility() -> Visibility:
    return Visibility([short_run(1e-2, 2e-5), short_run(3e-2, 2e-5)], NOMINAL)


def test_a_bias_shows_as_its_static_deflection_over_the_floor(visibility):
    bias = 0.2
    floor = min(visibility._floors)
    # u = P e in the mean, so y moves by bias/P; its DC line of 21 is twice that
    expected = 2.0 * bias / 200.0 / np.sqrt(21) / floor
    assert visibility.of({"bias_nm": bias}) == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("size", [0.01, 0.1, 0.3])
def test_what_a_refit_absorbs_does_not_show_however_large_it_is(visibility, size):
    seen = visibility.of({"gain_error": size})
    without_refit = visibility._change(NOMINAL, {"gain_error": size})
    assert seen < 0.05 * np.sqrt(np.mean(np.abs(without_refit) ** 2))
    assert seen < FLOORS


def test_an_eccentric_encoder_shows_by_more_than_its_gain(visibility):
    # y = th + a sin(th + phase): at phase 0 a gain of 1 + a to first order, else a constant too
    gain = visibility.of({"eccentricity_rad": 0.15, "eccentricity_phase_rad": 0.0})
    constant = visibility.of({"eccentricity_rad": 0.15, "eccentricity_phase_rad": 1.57})
    assert gain < FLOORS < constant


def test_the_limit_shows_three_floors(visibility):
    sizes = Sizes(Draw("torque_bias", {"bias_nm": 1.0}, 0.2, 5.0), visibility)
    assert sizes.limit is not None
    assert visibility.of({"bias_nm": sizes.limit}) == pytest.approx(FLOORS, rel=0.1)
    assert sizes.relative(sizes.showing(4.0)) == pytest.approx(4.0, rel=0.1)


def test_what_can_never_be_seen_has_no_limit(visibility):
    tiny = Sizes(Draw("torque_bias", {"bias_nm": 1.0}, 1e-9, 1e-8), visibility)
    gain = Sizes(Draw("torque_gain", {"gain_error": 1.0}, 0.05, 0.1), visibility)
    assert tiny.limit is None
    assert gain.limit is None


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> tuple[Path, Answer]:
    folder = tmp_path_factory.mktemp("case") / "case_000"
    return folder, CaseMaker(8, 0, Plan("parameters")).make(folder)


def test_a_case_is_an_experiment_of_the_interface(made):
    folder, answer = made
    recorded = read_experiment(folder)
    assert len(recorded.realizations) == 6
    assert recorded.levels == (0, 1, 2)
    assert recorded.experiment.periods == 2
    assert recorded.experiment.samples_per_period == 4000
    errors = [abs(answer.plant[name] / NOMINAL[name] - 1.0) for name in NOMINAL]
    assert min(errors) > 0.0
    assert max(errors) <= 0.1


def test_the_noise_is_the_answer_s(made):
    folder, answer = made
    realization = read_experiment(folder).realizations[4]
    first, second = realization.kept(realization.position)
    spectrum = np.fft.rfft(first - second)[1500:]  # above the loop, only noise is left
    std = np.sqrt(np.mean(np.abs(spectrum) ** 2) / first.size / 2.0)
    assert std == pytest.approx(answer.noise_rad, rel=0.1)


def test_the_same_seed_makes_the_same_bags(made, tmp_path):
    folder, answer = made
    again = CaseMaker(8, 0, Plan("parameters")).make(tmp_path / "case_000")
    assert again == answer
    for file in sorted(folder.rglob("*.mcap")):
        assert file.read_bytes() == (tmp_path / "case_000" / file.relative_to(folder)).read_bytes()


def test_nothing_in_the_bags_tells_what_the_case_holds(tmp_path):
    answer = CaseMaker(2, 5, Plan("single", (3,), (4.0,))).make(tmp_path / "case")
    assert answer.effects[0].name == "torque_bias"
    assert answer.effects[0].relative == pytest.approx(4.0, rel=0.1)
    assert answer.effects[0].catalogue["torque_bias.torque_nm"] == answer.settings["bias_nm"]
    for file in (tmp_path / "case").rglob("metadata.yaml"):
        assert "bias" not in file.read_text()


def test_an_answer_survives_its_json(made):
    assert Answer.from_json(made[1].to_json()) == made[1]


@pytest.mark.parametrize(
    ("effect", "settings"),
    [
        ("torque_gain", {"gain_error": -0.2}),
        ("encoder_eccentricity", {"eccentricity_rad": 0.2, "eccentricity_phase_rad": np.pi}),
    ],
)
def test_gains_scale_the_bare_parameters_that_the_loop_sees(effect, settings):
    run = short_run(1e-2, 0.0)
    answer = Answer("single", [], NOMINAL, 0.0, settings)
    there = play(run, NOMINAL, settings).y[1000:]
    seen = play(run, answer.plant_seen(), {}).y[1000:]
    bare = play(run, answer.plant_seen([effect]), {}).y[1000:]
    assert np.std(seen - there) < 3e-3 * np.std(there)
    assert np.std(bare - there) > 3e-2 * np.std(there)
