"""Which causes of a search are kept, and the steps in which they are shown."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest
from test_evidence import NOMINAL, SCATTER, records

from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.fits.gains import Gain, beside_others
from gap_diagnosis.how_far.ledger import Ledger
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.outcome.cause import LEAST_PRESENT, MOST_SHARE
from gap_diagnosis.outcome.gap_size import Estimate
from gap_diagnosis.outcome.verdict_words import explanation
from gap_diagnosis.searching import _again
from gap_diagnosis.verdict import kept_causes as kept_causes_module
from gap_diagnosis.verdict.kept_causes import kept
from gap_diagnosis.verdict.named_twice import twice
from gap_diagnosis.verdict.not_named import _bent, _changing, _kin, beyond_named
from gap_diagnosis.verdict.notes import unusual
from gap_diagnosis.verdict.spoiling import spoils, unspoiled
from gap_diagnosis.verdict.staying import (
    LEAST_BEARING,
    SURE,
    bases_of,
    bears,
    guesses,
    lacked_frictions,
    with_borne,
)
from gap_diagnosis.verdict.taken_out import _begun_anew, one_by_one
from gap_diagnosis.verdict.tested_causes import causes_with_tests
from gap_diagnosis.which import stepwise
from gap_diagnosis.which.found import Found
from gap_diagnosis.which.presence import beyond_zero, over_usual
from gap_diagnosis.which.torque_timing import Timing

BOTH = ("coulomb_friction", "viscous_friction")
SURELY = Gain(30.0, 25.0, 1.0, 1e-5)
CAUSES = {"torque_bias.torque_nm": 4.0, "delay.time_s": 1e-3}


@pytest.fixture(scope="module")
def searched():
    """Return a fitter, the refit, the fit of a needless and two true causes, and one without it."""
    fitter = CellFitter(Evidence(records(CAUSES, runs=2, scatter=0.02), NOMINAL), NOMINAL, 0.1)
    fits = [fitter.refit()]
    for effect in ("stribeck_friction_motor", "delay", "torque_bias"):
        proposals = fitter.screening(fits[-1], effect).proposals()
        space, point = proposals[0][1:]
        begun = fitter.reweighted(
            (*fits[-1].effects, effect), space, point, fits[-1].variance, (6, 4)
        )
        fits.append(begun)
    return fitter, fits


@pytest.fixture(scope="module")
def tested(searched):
    """Return the tested causes of the last of these fits."""
    fitter, fits = searched
    return tuple(causes_with_tests(fitter, fits[3], fits[0], SCATTER))


def judged_by(monkeypatch, told) -> None:
    """Have causes tested by a function, and nothing tried in their place or named twice."""
    monkeypatch.setattr(kept_causes_module, "causes_with_tests", told)
    monkeypatch.setattr(kept_causes_module, "in_its_place", lambda *_: None)
    monkeypatch.setattr(kept_causes_module, "twice", lambda *_: [])


def test_what_is_left_after_a_first_cause_was_taken_out_is_shown_cause_after_cause(searched):
    fitter, fits = searched
    found, tested = kept(fitter, Found(fits), SCATTER, lambda _: None, fits[-1].effects)
    assert {t.effect for t in tested} == set(found.best.effects) == {"delay", "torque_bias"}
    assert [len(fit.effects) for fit in found.steps] == [0, 1, 2]
    first, both = (fit.model.effects for fit in found.steps[1:])
    stronger = max(tested, key=lambda t: t.gain.mean).effect
    assert found.steps[1].effects == (stronger,) and found.steps[2].effects[0] == stronger
    assert {name.split(".")[0] for name in first} == {stronger}
    assert both["torque_bias.torque_nm"] == pytest.approx(4.0, rel=0.05)
    assert both["delay.time_s"] == pytest.approx(1e-3, rel=0.05)


def test_steps_end_at_the_fit_itself(searched, tested):
    fitter, fits = searched
    steps = one_by_one(fitter, fits[3], tested)
    assert [len(fit.effects) for fit in steps] == [1, 2, 3]
    assert steps[-1].model is fits[3].model
    assert all(set(a.effects) < set(b.effects) for a, b in itertools.pairwise(steps))


def test_a_fit_that_has_lost_a_cause_is_begun_anew_where_that_does_better(searched):
    fitter, fits = searched
    proposals = fitter.screening(fits[0], "torque_bias").proposals()
    alone = fitter.further(fitter.add(fits[0], "torque_bias", proposals))
    astray = replace(alone, left=5.0 * alone.left)
    anew = _begun_anew(fitter, astray, fits[0])
    assert anew is not astray and anew.effects == ("torque_bias",)
    assert fitter.gains(anew, astray).sum() > 0.0
    assert anew.model.effects["torque_bias.torque_nm"] == pytest.approx(4.0, rel=0.2)
    assert _begun_anew(fitter, fits[3], fits[0]) is fits[3]  # more than one cause from there


@pytest.mark.parametrize(("misses", "more"), [(0.05, False), (0.5, True)])
def test_what_promises_less_is_fitted_where_much_of_the_motion_is_missed(
    searched, monkeypatch, misses, more
):
    monkeypatch.setattr(stepwise, "NOTHING_LEFT", 0.0)  # it goes on when both causes are found
    fitter, fits = searched
    tried: list[str] = []
    effects = ["torque_bias", "delay", "quadratic_friction", "stribeck_friction_motor",
               "torque_saturation", "dead_band", "torque_slew_limit"]  # fmt: skip
    found = stepwise.Stepwise(fitter, effects, tried.append, misses=lambda _: misses).run(fits[0])
    assert set(found.best.effects) == {"torque_bias", "delay"}
    last = f"{' + '.join(found.best.effects)} + "
    third = [t.removeprefix(last) for t in tried if t.startswith(last)]
    batches = [t for t in third if "(1 of " in t and " + " not in t]
    assert len(batches) == (2 if more else 1)


def test_why_a_cause_that_closes_much_is_not_named_is_said(tested):
    greatest = max(tested, key=lambda t: t.share.value)
    assert greatest.share.value > 0.5 and _changing(greatest) == []
    (said,) = _changing(replace(greatest, invariance_p=1e-4, own_sizes=0.1))
    assert "not with the same size at all levels (p = 0.0001)" in said
    least = min(tested, key=lambda t: t.share.value)
    other = replace(least, invariance_p=1e-4, own_sizes=0.1)
    assert other.share.value < 0.5 and not other.invariant and _changing(other) == []
    assert replace(greatest, invariance_p=1e-4, own_sizes=0.005).invariant


def test_a_third_cause_must_be_sure(tested):
    gains = [Gain(mean, mean, 1.0, 1e-4) for mean in (30.0, 20.0, 10.0)]
    sure = [replace(t, gain=g, in_band=0.99) for t, g in zip(tested, gains, strict=True)]
    guess = replace(sure[2], in_band=0.5, over_noise_closed=0.5, share=replace_share(sure[2].share))
    assert guess.present < SURE
    assert guesses([*sure[:2], guess]) == [guess]
    assert guesses([guess, replace(sure[0], gain=gains[0])]) == []


def replace_share(share):
    """Return a share that is small and certain."""
    return share.model_copy(update={"value": 0.02, "low": 0.01, "high": 0.03})


@pytest.mark.parametrize(("low", "there"), [(0.0, False), (20.0, True)])
def test_a_limit_is_known_where_its_inverse_is_not_zero(low, there):
    limit = {"torque_saturation.limit_nm": Estimate(value=30.0, low=low, high=60.0 - low)}
    assert beyond_zero("torque_saturation", limit, 0.0) == there


@pytest.mark.parametrize(("fall", "there"), [(5.0, False), (7.0, True)])
def test_several_sizes_are_known_together_where_none_is_alone(fall, there):
    names = ("quadratic_friction.motor_nm_s2_rad2", "quadratic_friction.link_nm_s2_rad2")
    blurred = {name: Estimate(value=1.0, low=-1.0, high=3.0) for name in names}
    assert beyond_zero("quadratic_friction", blurred, fall) == there


@pytest.mark.parametrize(
    ("motion", "over_noise", "share"),
    [(0.2, 0.9, 1.0), (0.9, 0.2, 1.0), (0.4, 0.9, 0.8), (0.9, 0.6, 0.6), (0.6, math.nan, 0.6)],
)
def test_a_cause_is_doubtful_where_most_of_the_error_is_left_however_it_is_counted(
    tested, motion, over_noise, share
):
    sure = max(tested, key=lambda t: t.present)
    assert sure.left < 0.1 and sure.over_noise < 0.1
    closes = replace(
        sure, share=sure.share.model_copy(update={"value": 0.5}), left=0.0, over_noise=0.0
    )
    beside = replace(closes, left=motion, over_noise=over_noise)
    assert beside.present == pytest.approx(share * closes.present, rel=0.02)


def test_the_nearest_kin_of_what_no_effect_explains_is_told_in_a_note(tested):
    sure = max(tested, key=lambda t: t.present)
    assert not sure.nearest_kin and _kin(sure) == []
    share = sure.share.model_copy(update={"value": 0.6, "low": 0.5})
    doubted = replace(
        sure, share=share, left=0.9, over_noise=0.9, in_band=0.6, over_noise_closed=0.6
    )
    assert 0.5 * LEAST_PRESENT < doubted.present < LEAST_PRESENT and doubted.nearest_kin
    (said,) = _kin(doubted)
    assert "60% of what the refit left" in said and "nearest kin" in said
    assert not replace(doubted, certain=False).nearest_kin
    assert not replace(doubted, left=0.1).nearest_kin


@pytest.mark.parametrize(
    ("share", "left", "beside", "factor"),
    [
        (0.02, 0.02, 0.05, 0.6),
        (0.02, 0.0, 0.05, 1.0),
        (0.02, 0.02 / 0.75 - 0.02, 0.05, 0.8),
        (0.1, 0.1, 0.05, 1.0),
        (0.02, 0.02, 0.2, 0.8),
        (0.02, 0.02, math.inf, 1.0),
    ],
)
def test_what_closes_little_and_leaves_as_much_may_be_what_another_law_leaves(
    tested, share, left, beside, factor
):
    sure = max(tested, key=lambda t: t.present)
    closes = replace(
        sure,
        in_band=0.9,
        over_noise_closed=math.nan,
        left=left,
        over_noise=0.0,
        beside_others=beside,
    )
    little = sure.share.model_copy(update={"value": share, "low": 0.5 * share})
    much = sure.share.model_copy(update={"value": 0.9, "low": 0.5 * share})
    doubted, sure = replace(closes, share=little), replace(closes, share=much)
    assert doubted.present == pytest.approx(factor * sure.present)


@pytest.mark.parametrize(
    ("in_band", "over_noise", "there"),
    [(0.6, 0.99, True), (0.99, 0.6, True), (0.6, 0.6, False), (0.6, math.nan, False)],
)
def test_what_closes_most_of_what_is_left_counts_however_that_is_counted(
    tested, in_band, over_noise, there
):
    sure = max(tested, key=lambda t: t.present)
    assert sure.over_noise_closed > 0.9
    one_part_decides = sure.share.model_copy(update={"value": 3e-4, "low": -1e-4, "high": 8e-4})
    closes = replace(
        sure, share=one_part_decides, in_band=in_band, over_noise_closed=over_noise, left=2e-3
    )
    assert closes.passed == there
    beside = replace(closes, beside_others=0.1)
    assert (beside.present >= SURE) == (over_noise == 0.99)


def test_of_near_equivalents_the_one_that_closes_little_beside_the_other_names_it_twice(
    searched, tested
):
    fitter, fits = searched
    best = fits[3]
    tested = causes_with_tests(fitter, best, fits[0], SCATTER)
    assert twice(fitter, best, tested) == []
    found = next(t for t in tested if t.effect == "delay")
    much = found.share.model_copy(update={"value": 0.3})
    alone = replace(found.without, left=1.05 * best.left)  # either does nearly all
    little = replace(found, share=replace_share(much), without=alone)
    delay, lag = (replace(little, effect=e) for e in ("delay", "actuator_lag"))
    assert twice(fitter, best, [delay, lag]) == [delay, lag]
    assert twice(fitter, best, [replace(delay, share=much), lag]) == []
    # what closes nearly all of the rest by a law of its own is there
    of_one_law = [replace(t, over_noise_closed=0.95) for t in (delay, lag)]
    assert twice(fitter, best, of_one_law) == of_one_law
    # what is little of the gap is much of what both close
    assert twice(fitter, best, [delay, replace(lag, without=found.without)]) == []


@pytest.mark.parametrize(("present", "expected"), [(0.99, True), (0.7, False)])
def test_what_is_unsure_stays_if_without_it_a_cause_fails_that_is_sure_beside_it(
    tested, present, expected
):
    sure = max(tested, key=lambda t: t.present)
    failed = replace(sure, certain=False)
    assert sure.passed and sure.present > 0.8 and not failed.passed
    beside = sure if present > 0.8 else replace(sure, gain=replace(sure.gain, share=0.6))
    assert bears([beside], [failed]) == expected
    assert not bears([beside], [sure])


@pytest.mark.parametrize(
    ("share", "breaks", "kept_causes"),
    [(0.7, True, {"delay", "torque_bias", "stribeck_friction_motor"}),
     (0.7, False, {"delay", "torque_bias"}), (0.2, True, set())],
)  # fmt: skip
def test_within_a_search_what_nearly_passes_stays_if_without_it_sure_causes_fail(
    searched, tested, monkeypatch, share, breaks, kept_causes
):
    """A share of 0.7 of the ranks is little less than asked; one of 0.2 is a loss."""
    fitter, fits = searched
    sure = max(tested, key=lambda t: t.present)
    assert sure.passed and sure.present >= SURE

    def told(_fitter, fit, *_):
        whole, found = "stribeck_friction_motor" in fit.effects, []
        for effect in fit.effects:
            one = replace(sure, effect=effect, without=fitter.without(fit, effect))
            if effect == "stribeck_friction_motor":
                p = 0.01 if share > 0.5 else 0.6
                one = replace(one, gain=Gain(5.0, 4.0, share, p))
            found.append(one if whole or not breaks else replace(one, certain=False))
        return found

    judged_by(monkeypatch, told)
    found, left = kept(fitter, Found(fits), SCATTER, lambda _: None, fits[-1].effects)
    assert {t.effect for t in left} == set(found.best.effects) == kept_causes
    assert set(found.doubted) == set(fits[-1].effects) - kept_causes
    assert all(present <= LEAST_PRESENT for present in found.doubted.values())


@pytest.mark.parametrize(
    ("in_time", "together", "p", "right"),
    [
        (True, 0.0, 0.15, True),
        (False, 0.0, 0.15, False),
        (False, 0.5, 0.15, True),
        (False, 0.5, 1.0, False),  # none is brought back that would be named with 0 %
    ],
)
def test_of_causes_that_fail_that_goes_first_which_no_other_misses(
    searched, tested, monkeypatch, in_time, together, p, right
):
    """What gains least may be what others cannot do without, and pass once a needless one went.

    Where there is no time to try that, it comes back if much more is left without all that went.
    """
    fitter, fits = searched
    sure = max(tested, key=lambda t: t.present)
    needless, needed, other = "stribeck_friction_motor", "delay", "torque_bias"

    def told(_fitter, fit, *_):
        found = []
        for effect in fit.effects:
            one = replace(sure, effect=effect, without=fitter.without(fit, effect))
            if effect == needless:
                one = replace(one, gain=Gain(5.0, 4.0, 0.2, 0.6))
            if effect == needed and needless in fit.effects:
                one = replace(one, gain=Gain(2.0, 1.5, 0.7, p))
            if effect == other and needed not in fit.effects:
                one = replace(one, certain=False, gain=Gain(0.1, 0.0, 0.2, 0.9))
            found.append(one)
        return found

    judged_by(monkeypatch, told)
    monkeypatch.setattr(kept_causes_module, "_TOGETHER", together)
    until = math.inf if in_time else 0.0
    found, _ = kept(fitter, Found(fits), SCATTER, lambda _: None, fits[-1].effects, until)
    assert (set(found.best.effects) == {needed, other}) == right


@pytest.mark.parametrize(
    ("against", "stays"), [({}, True), ({"in_band": 0.1, "over_noise_closed": 0.1}, False)]
)
def test_what_repeats_but_is_not_sure_stays_where_what_passes_fails_without_it(
    searched, tested, monkeypatch, against, stays
):
    fitter, fits = searched
    sure = max(tested, key=lambda t: t.present)
    small = replace(sure, share=replace_share(sure.share), left=0.5, beside_others=math.inf)
    passing = replace(small, in_band=0.7, over_noise_closed=0.7)
    unsure = replace(small, in_band=0.5, over_noise_closed=0.5, beside_others=0.0)
    assert passing.passed and passing.present < SURE
    assert unsure.gains_beside_size and LEAST_BEARING < unsure.present < LEAST_PRESENT

    def told(_fitter, fit, *_):
        found = []
        for effect in fit.effects:
            one = unsure if effect == "delay" else passing
            one = replace(one, effect=effect, without=fitter.without(fit, effect))
            if effect == "delay":
                one = replace(one, **against)
            if "delay" not in fit.effects:
                one = replace(one, certain=False)
            found.append(one)
        return found

    judged_by(monkeypatch, told)
    monkeypatch.setattr(kept_causes_module, "guesses", lambda *_: [])
    monkeypatch.setattr(kept_causes_module, "_TOGETHER", 0.0)
    steps = [fits[0], fits[2], fits[3]]
    found, _ = kept(fitter, Found(steps), SCATTER, lambda _: None, fits[-1].effects)
    assert ("delay" in found.best.effects) is stays


def test_what_nearly_passes_has_nothing_else_against_it(tested):
    sure = max(tested, key=lambda t: t.present)
    seldom = replace(sure, gain=Gain(5.0, 4.0, 0.7, 0.01))
    assert not seldom.passed and seldom.nearly_passes
    for other in (
        {"certain": False},
        {"bounded": "delay.time_s"},
        {"gain": Gain(5.0, 4.0, 0.7, 0.06)},
        {"gain": Gain(0.9, 0.8, 0.7, 0.01)},
        {"invariance_p": 1e-4, "own_sizes": 0.1},
    ):
        assert not replace(seldom, **other).nearly_passes


def _named(effects: tuple[str, ...], last: str) -> tuple[str, ...]:
    return tuple(last if effect == "dead_band" else effect for effect in effects)


def test_what_takes_the_place_of_a_cause_must_pass_itself(searched, tested, monkeypatch):
    fitter, fits = searched
    sure = max(tested, key=lambda t: t.present)
    last = fits[3].effects[-1]
    taken = replace(fits[3], effects=(*fits[3].effects[:-1], "dead_band"))
    tried = []

    def told(_fitter, fit, *_):
        tried.append(fit.effects)
        found = []
        for effect in fit.effects:
            named = last if effect == "dead_band" else effect
            without = fitter.without(replace(fit, effects=_named(fit.effects, last)), named)
            one = replace(sure, effect=effect, without=without)
            found.append(
                one if effect not in (last, "dead_band") else replace(one, bounded="delay.time_s")
            )
        return found

    monkeypatch.setattr(kept_causes_module, "causes_with_tests", told)
    monkeypatch.setattr(kept_causes_module, "in_its_place", lambda *_: taken)
    monkeypatch.setattr(kept_causes_module, "twice", lambda *_: [])
    found, _ = kept(fitter, Found(fits), SCATTER, lambda _: None, fits[-1].effects)
    assert taken.effects in tried
    assert set(found.best.effects) == set(fits[3].effects) - {last}


def test_a_law_that_ends_at_a_limit_is_told_if_it_would_be_present_without_that(tested):
    sure = max(tested, key=lambda t: t.present)
    much = replace(sure, share=sure.share.model_copy(update={"value": 0.9, "low": 0.8}))
    ended = replace(much, bounded="hysteresis.displacement_rad", effect="hysteresis")
    assert not ended.passed and not _bent(much)
    (note,) = _bent(ended)
    assert note.startswith("Hysteresis would close 90%") and "displacement_rad ended" in note
    little = ended.share.model_copy(update={"value": 0.3})
    assert not _bent(replace(ended, share=little))
    assert not _bent(replace(ended, in_band=0.0, share=replace_share(little)))
    assert not _bent(replace(ended, gain=replace(ended.gain, share=0.5)))


def test_what_a_cause_closes_beside_what_others_do_in_its_band(searched, tested):
    fitter, fits = searched
    tested = {t.effect: t for t in tested}
    ratio = tested["delay"].beside_others
    assert ratio > 0.0
    alone = tested["delay"].without
    assert beside_others(fitter, fits[3], alone, []) == math.inf
    assert beside_others(fitter, fits[3], alone, [alone]) == pytest.approx(1.0)


@pytest.mark.parametrize(("first", "asked"), [("torque_saturation", 2), ("torque_bias", 1)])
def test_starts_of_effects_are_looked_at_until_one_promises(searched, first, asked):
    fitter, fits = searched
    names = ("torque_saturation", "torque_bias")
    screened = {effect: fitter.screening(fits[0], effect) for effect in names}
    screened[first].gain = 1e6  # a linear prediction that says little
    search = stepwise.Stepwise(fitter, names).extension
    found = search._proposed(fits[0], screened, 1)
    assert len(found) == asked and "torque_bias" in found
    assert fitter.promises(fits[0], found["torque_bias"])


def test_what_fails_again_and_again_ends(searched, monkeypatch):
    """Of two that look alike one stays since others fail without it: then the other one goes."""
    fitter, fits = searched
    calls = []

    def tests_of(*args):
        calls.append(1)
        assert len(calls) < 20
        return causes_with_tests(*args)

    monkeypatch.setattr(kept_causes_module, "causes_with_tests", tests_of)
    monkeypatch.setattr(kept_causes_module, "twice", lambda fitter, best, tested: list(tested))
    monkeypatch.setattr(kept_causes_module, "bears", lambda *_: True)
    monkeypatch.setattr(kept_causes_module, "LEAST_BEARING", 0.0)
    found, tested = kept(fitter, Found(fits), SCATTER, lambda _: None, fits[-1].effects)
    assert len(tested) == len(found.best.effects) <= 2


@pytest.mark.parametrize(("gained", "stays"), [(SURELY, True), (Gain(5.0, 4.0, 0.6, 0.3), False)])
def test_a_cause_whose_shape_blurs_its_size_stays_where_sure_ones_fail_without_it(
    searched, monkeypatch, gained, stays
):
    fitter, fits = searched
    blurred = fits[2].effects[-1]

    def tests_of(*args):
        return [
            replace(t, certain=False, gain=gained, in_band=0.99) if t.effect == blurred else t
            for t in causes_with_tests(*args)
        ]

    monkeypatch.setattr(kept_causes_module, "causes_with_tests", tests_of)
    monkeypatch.setattr(kept_causes_module, "bears", lambda *_: True)
    monkeypatch.setattr(kept_causes_module, "in_its_place", lambda *_: None)
    found, _ = kept(fitter, Found(fits[:3]), SCATTER, lambda _: None, fits[2].effects)
    assert (blurred in found.best.effects) is stays


def test_friction_that_a_datasheet_lacks_stays_unless_something_is_against_it(searched, tested):
    fitter, fits = searched
    tested = causes_with_tests(fitter, fits[-1], fits[0], SCATTER)
    first = max(tested, key=lambda t: t.present)
    seldom = replace(first, effect="viscous_friction", gain=Gain(5.0, 4.0, 0.8, 0.1))
    assert not seldom.passed and seldom.gains and seldom.present >= LEAST_BEARING
    assert lacked_frictions(BOTH, [seldom]) == {"viscous_friction"}
    assert lacked_frictions((), [seldom]) == set()
    grown = seldom.share.model_copy(update={"value": -0.1, "low": -0.2, "high": -0.05})
    drifting = replace(seldom, share=grown)
    assert not drifting.gains and lacked_frictions(BOTH, [drifting]) == set()
    assert lacked_frictions(BOTH, [replace(drifting, gain=SURELY)]) == {"viscous_friction"}
    for other in (
        {"effect": "torque_bias"},
        {"certain": False},
        {"bounded": "viscous_friction.motor_nm_s_rad"},
        {"gain": Gain(0.9, 0.8, 0.8, 0.1)},
        {"gain": Gain(5.0, 4.0, 0.8, 0.2)},
        {"invariance_p": 1e-4, "own_sizes": 0.1},
    ):
        assert lacked_frictions(BOTH, [replace(seldom, **other)]) == set()


def test_what_a_present_cause_modifies_is_as_present_and_lacked_friction_is_no_guess(searched):
    fitter, fits = searched
    first, *_ = causes_with_tests(fitter, fits[-1], fits[0], SCATTER)
    there = replace(first, effect="asymmetric_friction", gain=SURELY, certain=True)
    doubtful = replace(first, effect="coulomb_friction", gain=Gain(0.5, 0.1, 0.6, 0.3))
    assert doubtful.present < there.present
    base, other = with_borne([doubtful, there])
    assert base.present == there.present == other.present
    unsure = [replace(there, effect=e, gain=Gain(m, m, 1.0, 0.04))
              for e, m in (("delay", 9.0), ("viscous_friction", 8.0), ("torque_bias", 2.0),
                           ("cogging", 1.0))]  # fmt: skip
    assert [t.effect for t in guesses(unsure, BOTH)] == ["cogging"]


def test_what_passing_causes_modify_stays_where_the_datasheet_lacks_it(searched, tested):
    fitter, _ = searched
    bare = {**NOMINAL, "fs": 0.0, "fsm": 0.0}
    without = CellFitter(Evidence(records(runs=1, seconds=4.0), bare), bare, 0.1)
    first, second, _ = tested
    base = replace(first, effect="coulomb_friction", certain=True, invariance_p=None)
    falls = replace(second, effect="stribeck_friction_motor", certain=True, gain=SURELY)
    falls = replace(falls, in_band=0.99, bounded=None, left=0.0, over_noise=0.0)
    assert falls.passed
    names = ("coulomb_friction", "stribeck_friction_motor")
    assert bases_of(without, [base, falls], names) == {"coulomb_friction"}
    assert bases_of(without, [replace(base, certain=False), falls], names) == set()
    assert bases_of(without, [base, replace(falls, certain=False)], names) == set()
    assert bases_of(fitter, [base, falls], names) == set()  # whose datasheet has friction


def test_a_size_beyond_what_machines_have_is_doubted_and_this_is_said(tested):
    sure = max(tested, key=lambda t: t.present)
    assert sure.unusual == 0.0 and replace(sure, unusual=1.0).present == sure.present
    assert replace(sure, unusual=3.0).present == pytest.approx(0.6 * sure.present, rel=0.02)
    eccentric = Model(NOMINAL, {"encoder_eccentricity.amplitude_rad": -0.27})
    assert over_usual(eccentric, "encoder_eccentricity") == pytest.approx(5.4)
    assert "0.27 rad is more than machines have" in unusual(eccentric, "encoder_eccentricity")
    assert over_usual(Model(NOMINAL, {"delay.time_s": 1.0}), "delay") == 0.0


def test_what_others_needed_goes_when_they_no_longer_do(searched, tested, monkeypatch):
    """It stayed since a sure cause failed without it, and is nowhere to be seen after that went."""
    fitter, fits = searched
    sure = max(tested, key=lambda t: t.present)
    needless, bearing, last = "stribeck_friction_motor", "delay", "torque_bias"

    def told(_fitter, fit, *_):
        found = []
        for effect in fit.effects:
            one = replace(sure, effect=effect, without=fitter.without(fit, effect))
            if effect == needless:
                seen = bearing in fit.effects
                gain = Gain(5.0, 4.0, 0.7, 0.01) if seen else Gain(-5.0, 4.0, 0.1, 0.9)
                one = replace(one, gain=gain)
            if effect == bearing:
                one = replace(one, certain=False, gain=Gain(9.0, 4.0, 0.7, 0.01))
            found.append(one)
        return found

    judged_by(monkeypatch, told)
    monkeypatch.setattr(
        kept_causes_module, "bears", lambda tested, *_: any(t.effect == bearing for t in tested)
        and tested[0].effect == needless and len(tested) == 3,
    )  # fmt: skip
    found, left = kept(fitter, Found(fits), SCATTER, lambda _: None, fits[-1].effects)
    assert found.best.effects == (last,) == tuple(t.effect for t in left)


@pytest.mark.parametrize("tried", [True, False])
def test_what_was_passed_over_for_a_cause_that_goes_is_added_if_all_pass_beside_it(
    searched, monkeypatch, tried
):
    """A constant torque is there; a needless cause did better, and nothing was put in its place.

    Without that torque the delay, which is there as well, fails too, and passes once it is added.
    """
    fitter, fits = searched
    proposals = fitter.screening(fits[0], "torque_bias").proposals()
    over = fitter.add(fits[0], "torque_bias", proposals)
    monkeypatch.setattr(kept_causes_module, "in_its_place", lambda *_: None)
    rivals = {1: [fits[1], over] if tried else [fits[1]]}
    found = Found(fits[:3], rivals=rivals)
    left, tested = kept(fitter, found, SCATTER, lambda _: None, fits[-1].effects)
    there = {"delay", "torque_bias"} if tried else set()
    assert {t.effect for t in tested} == set(left.best.effects) == there
    assert set(left.doubted) == set(fits[2].effects) - there
    assert ("torque_bias" in left.alternatives) == tried


@pytest.mark.parametrize(("before", "stays"), [(3, True), (0, False)])
def test_what_was_found_stays_where_a_search_with_another_torque_explains_less(
    searched, before, stays
):
    """Of nothing to look for the other search finds nothing, and ends by itself."""
    fitter, fits = searched
    found = Found(fits[: before + 1])
    again = _again(Timing(fitter, fits[0]), found, [], lambda _: None, math.inf)
    assert (len(again.best.effects) == 3) == stays
    assert again.complete


def test_what_would_leave_less_beside_the_named_causes_is_told_whole_or_not_at_all(searched):
    """The sentence speaks of all that the best fit holds, so of no part that spoils other runs."""
    fitter, fits = searched
    best, refit = fits[-1], fits[0]
    (said,) = beyond_named(fitter, best, refit, best.effects)
    assert all(explanation([effect]) in said for effect in best.effects)
    assert "that the refit leaves" in said and " as well" not in said
    (said,) = beyond_named(fitter, best, fits[1], ["delay", "torque_bias", "dead_band"])
    assert explanation([fits[1].effects[0]]) not in said and "dead band" not in said
    assert " as well, " in said and "that the named causes leave" in said
    assert beyond_named(fitter, best, refit, ["delay", "torque_bias"]) == []
    assert beyond_named(fitter, best, best, best.effects) == []


def test_causes_that_spoil_the_runs_which_report_are_taken_away(searched):
    """A delay of 60 ms, where the rig has 1 ms, is what no test on other runs can excuse."""
    fitter, fits = searched
    ledger = Ledger(fitter.evidence)
    assert unspoiled(ledger, fits) == fits
    model = fits[-1].model
    late = Model(model.plant, {**model.effects, "delay.time_s": 0.06})
    spoilt = replace(fits[-1], model=late)
    kept_steps = unspoiled(ledger, [*fits[:-1], spoilt])
    best = min(fits[:-1], key=lambda fit: ledger.squares(fit.model).sum())
    assert kept_steps[-1] is best and len(kept_steps) < len(fits)
    assert "delay" in spoils(["delay"]) and "not named" in spoils(["delay"])


def test_a_model_that_runs_away_without_a_cause_has_a_bounded_share(searched):
    """How far it runs is a matter of where it is stopped, and no share of a gap."""
    fitter, fits = searched
    ledger, model = Ledger(fitter.evidence), fits[-1].model
    away = Model(model.plant, {**model.effects, "delay.time_s": 0.2})
    assert ledger.squares(away).mean() > 100.0 * ledger.squares(fits[0].model).mean()
    share = ledger.share(away, model, fits[0].model)
    assert 0.0 < share.low <= share.value == share.high == MOST_SHARE
