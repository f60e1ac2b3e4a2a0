"""Causes that show only together, and former ones that hold the others away from their sizes."""

from __future__ import annotations

from dataclasses import replace

import pytest
from test_evidence import NOMINAL, records

from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.which.exchange import drop_hindering, with_the_better_one
from gap_diagnosis.which.extension import Extension
from gap_diagnosis.which.found import Found
from gap_diagnosis.which.stepwise import LEAST_CLOSED, Stepwise

CAUSES = {"torque_bias.torque_nm": 4.0, "delay.time_s": 1e-3}
NAMES = ["torque_bias", "delay", "stribeck_friction_motor"]


@pytest.fixture(scope="module")
def fitted():
    """Return a fitter, the refit, and the fits of a needless law and of two true causes more."""
    fitter = CellFitter(Evidence(records(CAUSES, runs=2, scatter=0.02), NOMINAL), NOMINAL, 0.1)
    fits = [fitter.refit()]
    for effect in ("stribeck_friction_motor", "delay", "torque_bias"):
        _, space, point = fitter.screening(fits[-1], effect).proposals()[0]
        names = (*fits[-1].effects, effect)
        fits.append(fitter.reweighted(names, space, point, fits[-1].variance, (6, 4)))
    return fitter, fits


def test_a_former_cause_without_which_the_others_do_better_goes(fitted):
    fitter, fits = fitted
    hindered = replace(fits[3], left=4.0 * fits[3].left)
    found = Found([*fits[:3], hindered])
    drop_hindering(found, fitter, Extension(fitter, NAMES, lambda _: None))
    assert set(found.best.effects) == {"delay", "torque_bias"}
    assert [fit.effects for fit in found.steps[:2]] == [(), ("delay",)]
    assert fitter.gains(found.best, hindered).sum() > 0.0
    assert found.best.model.effects["torque_bias.torque_nm"] == pytest.approx(4.0, rel=0.05)


def test_a_former_cause_that_does_no_harm_stays_for_the_tests_of_presence(fitted):
    fitter, fits = fitted
    helped = [*fits[:3], replace(fits[3], left=0.25 * fits[3].left)]
    found = Found(list(helped))
    drop_hindering(found, fitter, Extension(fitter, NAMES, lambda _: None))
    assert all(a is b for a, b in zip(found.steps, helped, strict=True))


def test_what_gains_but_closes_too_little_is_tried_in_pairs(fitted, monkeypatch):
    """Beside a first cause a second one repeats, but closes little without a third."""
    fitter, fits = fitted
    search = Stepwise(fitter, NAMES)
    best, both = fits[1], fits[3]
    half = replace(fits[2], left=0.9 * best.left)
    tried = []

    def extended(parent, refit, without=()):
        tried.append(parent.effects)
        return [half] if parent is best else [both] if parent is half else []

    monkeypatch.setattr(search.extension, "extended", extended)
    assert search.extension.gain(half, best).present
    assert search._closes(half, best) < LEAST_CLOSED < search._closes(both, best)
    found = Found([fits[0], best])
    assert search._step(found) and found.best is both
    assert tried == [best.effects, half.effects]


def test_a_search_whose_time_is_up_before_pairs_are_tried_is_not_complete(fitted, monkeypatch):
    fitter, fits = fitted
    search = Stepwise(fitter, NAMES, until=0.0)
    half = replace(fits[2], left=0.9 * fits[1].left)
    monkeypatch.setattr(search.extension, "extended", lambda *_: [half])
    found = Found([fits[0], fits[1]])
    assert not search._step(found) and not found.complete


def test_what_does_surely_better_in_the_place_of_a_cause_takes_it(fitted):
    fitter, fits = fitted
    rival = replace(fits[3], effects=("stribeck_friction_motor", "torque_bias"))
    worse = replace(fits[2], left=2.0 * fits[2].left)
    found = with_the_better_one(Found(fits[:3]), {"delay": [worse, rival]}, fitter)
    assert found is not None and found.best is rival
    assert [fit.effects for fit in found.steps] == [(), ("stribeck_friction_motor",), rival.effects]
    assert found.alternatives == {"torque_bias": ["delay"]}
    assert with_the_better_one(Found(fits[:3]), {"delay": [worse, fits[2]]}, fitter) is None
