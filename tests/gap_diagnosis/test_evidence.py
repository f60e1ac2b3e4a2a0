"""Evidence of records, fits beside a remainder, and the tests of presence, on simulated records."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from controller_node import pd_filtered
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT, coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis.fits import unseen_friction
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.fits.cell_weights import independent
from gap_diagnosis.fits.gains import MOST_P, Gain, _but_one, _p_value, closed, fall, gain
from gap_diagnosis.gates.bag_deviations import GROUPS
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.outcome.gap_size import Figure
from gap_diagnosis.verdict.notes import at_limits
from gap_diagnosis.verdict.tested_causes import causes_with_tests
from gap_diagnosis.which.presence import at_its_bound, beyond_zero, cell_estimates, invariance
from gap_diagnosis.which.stepwise import LEAST_CLOSED, Stepwise

RATE, NOISE = 500.0, 2e-5
LAW = pd_filtered.CONTROLLER.check({"sample_rate_hz": RATE})
NOMINAL = {name: float(value) for name, value in PLANT.defaults().items()}
BIAS = {"torque_bias.torque_nm": 1.5}
SCATTER = dict.fromkeys(GROUPS["friction"], unseen_friction.SCATTER)


def reference(
    seed: int, samples: int, rms_rad: float, band_hz: tuple[float, float] = (0.3, 15.0)
) -> np.ndarray:
    rng = np.random.default_rng(seed)
    lines = np.fft.rfftfreq(samples, 1.0 / RATE)
    spectrum = np.where((lines > band_hz[0]) & (lines < band_hz[1]), 1.0, 0.0) * np.exp(
        2j * np.pi * rng.uniform(size=lines.size)
    )
    signal = np.fft.irfft(spectrum, samples)
    return rms_rad * signal / signal.std() * np.minimum(1.0, np.arange(samples) / 100.0)


def records(
    effects=None, *, runs=1, seconds=8.0, known=True, scatter=0.0, seed=5,
    rms_rad=(0.02, 0.06), band_hz=(0.3, 15.0),
) -> RecordSet:  # fmt: skip
    """Return runs of the paper's rig at two levels; friction may scatter from run to run."""
    made, samples = [], int(seconds * RATE)
    rng = np.random.default_rng(seed)
    for level, rms in enumerate(rms_rad):
        for run in range(runs):
            factor = float(np.exp(scatter * rng.standard_normal()))
            plant = {**NOMINAL, "fs": factor * NOMINAL["fs"], "fsm": factor * NOMINAL["fsm"]}
            signals = simulate(
                reference(10 * level + run, samples, rms, band_hz),
                RATE,
                coefficients(plant),
                pd_filtered.coefficients(LAW),
                NOISE * rng.standard_normal(samples),
                fx.coefficients(effects or {}),
            )
            description = RecordDescription.of(
                "test", sample_rate_hz=RATE, level=level, levels=2, realization=run,
                realizations=runs, controller=pd_filtered.describe(LAW) if known else None,
            )  # fmt: skip
            made.append(
                Record(
                    f"level_{level}_run_{run}",
                    description,
                    signals.reference if known else None,
                    signals.torque,
                    signals.position,
                    None,
                )
            )
    return RecordSet("test", RATE, tuple(made))


@cache
def biased() -> tuple[CellFitter, object, object]:
    """Return a fitter, its refit and the fit with a torque bias, of records that have one."""
    fitter = CellFitter(Evidence(records(BIAS, scatter=0.02), NOMINAL), NOMINAL, 0.1)
    refit = fitter.refit()
    proposals = fitter.screening(refit, "torque_bias").proposals()
    return fitter, refit, fitter.add(refit, "torque_bias", proposals)


@pytest.mark.parametrize(("runs", "whole"), [(1, False), (2, False), (3, True), (4, True)])
def test_every_part_has_one_purpose_and_no_window_two(runs, whole):
    evidence = Evidence(records(runs=runs, seconds=5.0), NOMINAL)
    purposes = {name: evidence.parts_for(name) for name in ("fit", "select", "report")}
    assert sorted(sum(purposes.values(), ())) == list(range(len(evidence.parts)))
    assert all(purposes.values())
    windows = [
        (p.record, w) for p in evidence.parts for w in range(p.windows.start, p.windows.stop)
    ]
    assert len(windows) == len(set(windows))
    of = {name: {evidence.parts[i].record for i in parts} for name, parts in purposes.items()}
    assert whole == (not of["fit"] & of["select"] and not of["fit"] & of["report"]
                     and not of["select"] & of["report"])  # fmt: skip


@pytest.mark.parametrize("runs", [1, 2, 3])
def test_a_single_run_of_a_level_shows_as_many_unseen_parts_as_several_do(runs):
    evidence = Evidence(records(runs=runs), NOMINAL)
    levels = [evidence.parts[i].level for i in evidence.parts_for("select")]
    assert min(levels.count(level) for level in (0, 1)) >= 5


@pytest.mark.parametrize("known", [True, False])
def test_the_true_model_leaves_noise_alone(known):
    evidence = Evidence(records(BIAS, known=known), NOMINAL)
    assert evidence.simulator.loop.kind == ("known" if known else "unknown")
    parts = tuple(range(len(evidence.parts)))
    errors = evidence.errors([Model(NOMINAL, BIAS), Model(NOMINAL, {})], parts)
    left = np.sqrt(np.mean(errors**2, axis=1)) / NOISE
    assert 0.8 < left[0] < 1.6  # the loop amplifies encoder noise
    assert left[1] > 3.0 * left[0]


def test_a_motion_that_diverges_is_a_bad_value_and_no_error():
    evidence = Evidence(records(seconds=5.0), NOMINAL)
    unstable = Model({**NOMINAL, "jm": 1e-5, "j": 1e-5, "k0": 1e8}, {})
    assert np.isfinite(evidence.errors([unstable], evidence.parts_for("fit"))).all()


def test_a_cause_is_fitted_beside_friction_that_scatters():
    fitter, refit, fit = biased()
    found = gain(fitter, fit, refit)
    assert found.present and found.share == 1.0
    found = cell_estimates(fit, fitter, SCATTER, {"torque_bias": refit})
    bias = found["torque_bias.torque_nm"]
    assert bias.low <= 1.5 <= bias.high and bias.high - bias.low < 0.3
    assert beyond_zero("torque_bias", found, fall(fitter, fit, refit))
    assert not at_its_bound(fit, "torque_bias")


def test_intervals_of_few_runs_allow_for_friction_that_scatters():
    """Without that, the interval of fs holds the truth on five rigs of twelve."""
    held = {"fs": 0, "fsm": 0, "torque_bias.torque_nm": 0}
    truth = {**NOMINAL, **BIAS}
    for seed in range(100, 110):
        fitter = CellFitter(Evidence(records(BIAS, scatter=0.02, seed=seed), NOMINAL), NOMINAL, 0.1)
        refit = fitter.refit()
        fit = fitter.add(refit, "torque_bias", fitter.screening(refit, "torque_bias").proposals())
        found = cell_estimates(fit, fitter, SCATTER, {"torque_bias": refit})
        for name in held:
            held[name] += found[name].low <= truth[name] <= found[name].high
    assert held["fs"] >= 8 and held["fsm"] >= 8, held
    assert held["torque_bias.torque_nm"] >= 7, held


def test_an_effect_must_repeat_only_where_it_acts():
    limit = {"torque_saturation.limit_nm": 160.0}  # the lower level asks for 80 N m
    fitter = CellFitter(Evidence(records(limit, runs=3, scatter=0.05), NOMINAL), NOMINAL, 0.1)
    refit = fitter.refit()
    proposals = fitter.screening(refit, "torque_saturation").proposals()
    fit = fitter.add(refit, "torque_saturation", proposals)
    levels = np.array([fitter.evidence.parts[part].level for part in fitter.select_parts])
    assert not fit.acts[levels == 0].any() and fit.acts[levels == 1].all()
    where_it_acts = gain(fitter, fit, refit, fit.acts)
    held = np.sum(fitter.weights.counts * refit.left, axis=1)
    counted = np.sum(fit.acts & (held >= 0.02 * held.max()))  # it closes nearly all of the error
    assert 5 <= counted < np.sum(levels == 1)
    assert where_it_acts.present and where_it_acts.p == 0.5**counted


@pytest.mark.parametrize(("left", "present"), [(0.01, True), (0.5, False)])
def test_what_closes_nearly_all_of_the_error_must_repeat_where_that_is(left, present):
    """A chirp shows a delay in its fast half; elsewhere a refit did a little better."""
    fitter, refit, fit = biased()
    parts = len(fitter.select_parts)
    much = np.arange(parts) % 2 == 0
    before = np.where(much, 1e3, 1.0)[:, None] * np.ones_like(refit.left)
    after = before * np.where(much, left, 1.6)[:, None]
    changed = replace(refit, left=before), replace(fit, left=after)
    assert gain(fitter, changed[1], changed[0]).present == present


def test_a_leading_fit_is_taken_to_its_end_before_it_is_compared(monkeypatch):
    monkeypatch.setattr("gap_diagnosis.fits.cell_fits._ADDED_ROUNDS", (3,))
    limit = {"torque_saturation.limit_nm": 60.0}
    evidence = Evidence(records(limit, runs=2, seconds=5.0, scatter=0.02), NOMINAL)
    fitter = CellFitter(evidence, NOMINAL, 0.1)
    refit = fitter.refit()
    proposals = fitter.screening(refit, "torque_saturation").proposals()
    assert not fitter.add(refit, "torque_saturation", proposals).solution.converged
    (fit,) = Stepwise(fitter, ["torque_saturation"]).extension.extended(refit, [refit])
    assert fit.solution.converged
    assert fit.model.effects["torque_saturation.limit_nm"] == pytest.approx(60.0, rel=0.01)


@pytest.mark.parametrize(("grown", "counts"), [(1.0, True), (2.0, False)])
def test_a_cause_of_the_small_motions_closes_what_is_left_of_them(grown, counts):
    """Friction is most of the error of a low level and little of all; unless all grows by it."""
    fitter, refit, fit = biased()
    low = fitter.weights.select_levels == 0
    assert low.any() and not low.all()
    before = np.where(low, 1.0, 1e4)[:, None] * np.full(refit.left.shape, 1e3 * NOISE**2)
    after = before * np.where(low, 0.1, grown)[:, None]
    quiet = replace(fit, left=after), replace(refit, left=before)
    in_band = fitter.weights.gained(after, before).sum(axis=0).argmax()
    squares = [(fitter.weights.counts * left)[:, in_band].sum() for left in (after, before)]
    assert squares[0] > 0.99 * squares[1]
    assert (closed(fitter, *quiet) == pytest.approx(0.9)) == counts


def test_what_gains_but_closes_little_does_not_end_the_search(monkeypatch):
    """A lag shows in quiet parts; the limit beside which it does holds nearly all of the gap."""
    fitter, refit, fit = biased()
    levels = fitter.weights.select_levels
    loudest = np.zeros(refit.left.shape, bool)
    for level in np.unique(levels):
        own = refit.left[levels == level]
        loudest[levels == level] = own == own.max(axis=0)
    left = np.where(loudest, 10.0, 1e-6) * refit.left
    quiet = replace(fit, effects=("delay",), left=left, acts=None)
    assert gain(fitter, quiet, refit).mean > gain(fitter, fit, refit).mean
    assert closed(fitter, quiet, refit) < LEAST_CLOSED < closed(fitter, fit, refit)
    search = Stepwise(fitter, ["torque_bias", "delay"])
    found = [quiet, fit]
    fits = lambda parent, *_: [] if parent.effects else found  # noqa: E731
    monkeypatch.setattr(search.extension, "extended", fits)
    assert search.run(refit).best is fit


@pytest.mark.parametrize("bias", [0.05, 0.1])
def test_an_offset_promises_more_than_one_line_of_many(bias):
    sized = {"torque_bias.torque_nm": bias}
    evidence = Evidence(records(sized, runs=3, seconds=16.0, scatter=0.02), NOMINAL)
    fitter = CellFitter(evidence, NOMINAL, 0.1)
    refit = fitter.refit()
    screening = fitter.screening(refit, "torque_bias")
    cost, space, point = screening.proposals()[0]
    errors = evidence.errors([space.model(point)], fitter.fit_parts)[0]
    one_line = refit.solution.cost / evidence.lines  # all that a sum of squares could gain
    assert screening.gain > 3.0 * one_line and -cost > 3.0 * one_line
    fit = fitter.add(refit, "torque_bias", [(cost, space, point)])
    assert np.mean(errors**2) < np.mean(evidence.errors([refit.model], fitter.fit_parts) ** 2)
    assert fit.model.effects["torque_bias.torque_nm"] == pytest.approx(bias, rel=0.02)


def test_a_cause_without_which_nothing_of_the_gap_comes_back_is_not_present():
    fitter, refit, fit = biased()
    (tested,) = causes_with_tests(fitter, fit, refit, SCATTER)
    little = Figure(value=0.01, low=0.005, high=0.015)
    closes_little = replace(tested, in_band=0.01, over_noise_closed=0.01, share=little)
    assert replace(tested, in_band=0.01).passed  # it closes the gap as a whole
    assert tested.passed and closes_little.present < 0.1 and not closes_little.passed
    assert 0.5 < tested.share.low < tested.share.high < 1.05
    tested = replace(tested, gain=Gain(mean=10.0, without_best=8.0, share=1.0, p=0.002))
    assert tested.passed
    blurred = replace(tested, certain=False)
    assert blurred.passes_beside_size and not blurred.passed
    closes_nothing = Figure(value=-0.02, low=-0.03, high=-0.01)
    assert not replace(tested, share=closes_nothing).passed
    unsure = replace(tested, share=Figure(value=0.6, low=-0.7, high=0.8))  # one part decides
    little = {"in_band": 0.7, "over_noise_closed": 0.7}
    assert unsure.passed and not replace(unsure, **little).passed


def test_a_true_cause_is_the_same_at_all_levels_and_a_substitute_is_not():
    fitter, _, fit = biased()
    assert invariance(fitter, fit, "torque_bias", {}).p > 0.01
    # A size that is wrong at one level: the residuals of that level are those of another bias.
    level = np.array([fitter.evidence.parts[p].level for p in fitter.groups])
    column = len(fit.space.nominal)
    shift = np.where(level == 1, 0.5 * fit.solution.x[column], 0.0)
    moved = fit.solution.residuals + shift * fit.solution.jacobian[:, column]
    wrong = replace(fit, solution=replace(fit.solution, residuals=moved))
    assert invariance(fitter, wrong, "torque_bias", {}).p < 1e-3


@pytest.mark.parametrize(("stated", "words"), [(1.0, None), (3.0, "(jm 41 % below it)")])
def test_a_datasheet_in_a_wrong_unit_is_told_by_the_bound_at_which_the_fit_ends(stated, words):
    nominal = {**NOMINAL, "jm": stated * NOMINAL["jm"]}
    refit = CellFitter(Evidence(records(seconds=5.0), nominal), nominal, 0.1).refit()
    said = at_limits(refit.space, refit.solution.x, refit.model.plant, ("jm", "j", "k0"))
    assert len(said) == (words is not None)
    assert words is None or words in said[0]


def test_a_gain_by_one_part_or_one_that_does_not_repeat_is_no_presence():
    assert Gain(mean=10.0, without_best=8.0, share=1.0, p=0.002).present
    assert not Gain(mean=10.0, without_best=0.1, share=1.0, p=0.002).present
    assert not Gain(mean=10.0, without_best=8.0, share=0.6, p=0.002).present
    assert not Gain(mean=10.0, without_best=8.0, share=1.0, p=0.2).present
    assert not Gain(mean=0.5, without_best=0.4, share=1.0, p=0.002).present


@pytest.mark.parametrize(
    ("gains", "p", "but_one"),
    [
        ([5.4, -5.5, 28.4, 4.7, 16.6, 23.1], 5 / 64, True),
        ([5.4, 5.5, 28.4, 4.7, 16.6, 23.1], 1 / 64, False),
        ([5.4, -22.0, 28.4, 4.7, 16.6, 23.1], 7 / 64, False),  # a loss counts whole
        ([5.4, -1.5, 28.4, -1.7, 16.6, 23.1], 5 / 64, False),  # two lose
        ([5.4, -5.5, 28.4, 16.6], 1.0, False),
        ([-800.0, -9e3, 1.0, 2.0, 3.0, -7.0], 54 / 64, False),
    ],
)
def test_of_few_parts_one_may_lose_where_the_others_gain_much(gains, p, but_one):
    found = np.array(gains)
    assert _p_value(found) == pytest.approx(p)
    assert _but_one(found) == but_one
    seen = Gain(mean=12.0, without_best=9.0, share=0.86, p=p, but_one=but_one)
    assert seen.present == (but_one or p < MOST_P) and seen.surely_present == (p < MOST_P)


def test_parts_whose_gains_are_chance_pass_as_seldom_as_they_must():
    """Log-likelihood ratios of a normal that is off against the true one, on 5 to 7 parts."""
    rng = np.random.default_rng(3)
    for parts in (5, 6, 7):
        seen = 2.0 * rng.standard_normal((400, parts)) - 2.0  # off by two standard deviations
        passed = [_p_value(row) <= MOST_P or _but_one(row) for row in seen]
        assert np.mean(passed) <= MOST_P


def test_nothing_is_gained_by_an_effect_that_is_not_there():
    fitter = CellFitter(Evidence(records(scatter=0.02), NOMINAL), NOMINAL, 0.1)
    refit = fitter.refit()
    for effect in ("torque_bias", "gravity", "quadratic_friction"):
        proposals = fitter.screening(refit, effect).proposals()
        fit = fitter.add(refit, effect, proposals) if proposals else None
        assert fit is None or not gain(fitter, fit, refit).present, effect


def test_noise_counts_line_by_line_and_a_remainder_as_a_few_numbers():
    """By the moments of chi-squares: independent noise on all lines, one factor for the rest."""
    rng = np.random.default_rng(7)
    lines, draws, modes = 60, 4000, 4
    basis = np.linalg.qr(rng.standard_normal((lines, modes)))[0] * np.sqrt(lines / modes)
    for share in (0.0, 0.1, 0.5, 1.0):
        noise = np.sqrt(share) * rng.standard_normal((draws, lines))
        rest = np.sqrt(1.0 - share) * rng.standard_normal((draws, modes)) @ basis.T
        squares = np.mean((noise + rest) ** 2, axis=1)
        seen = 2.0 * np.mean(squares) ** 2 / np.var(squares)
        said = independent(np.array(share), np.array(lines), np.array(modes))
        assert said == pytest.approx(seen, rel=0.25)


def test_fine_lines_of_a_fitted_run_do_not_outweigh_an_offset_of_all_runs():
    fitter = CellFitter(Evidence(records(runs=3, scatter=0.02), NOMINAL), NOMINAL, 0.1)
    refit = fitter.refit()
    left = np.full_like(refit.left, 1e4 * refit.left.max())
    change = np.ones(left.shape[1])
    change[0], change[-1] = 0.1, 1.5  # an offset is gone, the finest lines are worse
    before, after = replace(refit, left=left), replace(refit, left=left * change)
    assert fitter.gains(after, before).min() > 1.0


def test_lines_of_a_single_run_count_as_its_parts_differ():
    rng = np.random.default_rng(3)
    one, three = (
        CellFitter(Evidence(records(runs=runs), NOMINAL), NOMINAL, 0.1) for runs in (1, 3)
    )
    noise = rng.standard_normal(one.runs.size)
    lines = one.weights.counts[0]
    seen = one.weights.coherence(noise).mean(axis=0)[2:] / lines[2:]
    assert seen == pytest.approx(np.ones(seen.size), rel=0.7)
    factor = rng.standard_normal(len(one.evidence.parts))[one.evidence.part_of(one.fit_parts)]
    assert np.unique(one.weights.coherence(factor)) == [4.0]
    assert np.unique(three.weights.coherence(rng.standard_normal(three.runs.size))) == [4.0]


def test_what_closes_nearly_all_is_tried_though_it_gains_most_where_noise_is():
    """Many lines at the noise, each a little better, gain more than one slow error that is gone."""
    fitter, refit, fit = biased()
    noise, counts = NOISE**2, fitter.weights.counts
    left = np.full(counts.shape, 1e4 * noise)
    many = int(np.argmax(counts.sum(axis=0)))
    left[:, many] = 1.25 * noise
    after = left.copy()
    after[:, many], after[:, 0] = noise, 1e3 * noise
    before, after_it = replace(refit, left=left), replace(fit, left=after)
    small = np.ones(counts.shape[1], bool)
    small[[0, many]] = False
    before.left[:, small] = after_it.left[:, small] = noise
    gained = fitter.weights.gained(after_it.left, before.left).sum(axis=0)
    assert np.argmax(gained) == many
    assert closed(fitter, after_it, before) < LEAST_CLOSED
    search = Stepwise(fitter, [], lambda _: None, np.inf)
    assert search._closes(after_it, before) > 0.8
