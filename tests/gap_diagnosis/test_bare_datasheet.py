"""Rigs whose datasheet holds inertias and stiffness alone: all friction is to be found at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_evidence import NOMINAL, records

from gap_diagnosis.any_record import investigate
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.fits.gains import left_of
from gap_diagnosis.investigation import Investigation, Order, investigate_runs
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.outcome.verdict_words import LOST
from gap_diagnosis.which.equivalents import founded
from gap_diagnosis.which.exchange import replace_bounded
from gap_diagnosis.which.extension import Extension
from gap_diagnosis.which.found import Found
from gap_diagnosis.which.presence import LEAST_INVARIANCE_P, at_its_bound, invariance

BARE = {**NOMINAL, "fs": 0.0, "fsm": 0.0, "fv": 0.0, "fvm": 0.0}
LOOKED_FOR = (
    "coulomb_friction", "viscous_friction", "quadratic_friction", "asymmetric_friction",
    "torque_bias",
)  # fmt: skip
BIAS_NM = 6.0


@pytest.fixture(scope="module")
def found() -> Investigation:
    made = records({"torque_bias.torque_nm": BIAS_NM}, runs=3, scatter=0.03, seconds=6.0)
    return investigate(made, BARE, effects=LOOKED_FOR)


def test_the_whole_friction_is_named_and_no_part_of_it_in_its_place(found):
    named = [{cause.effect, *cause.others} for cause in found.diagnosis.causes]
    assert [own for own in named if "coulomb_friction" in own] == [{"coulomb_friction"}]
    assert any("viscous_friction" in own for own in named)
    assert any("torque_bias" in own for own in named)
    sizes = {n: v for cause in found.diagnosis.causes for n, v in cause.parameters.items()}
    both = sizes["coulomb_friction.motor_nm"].value + sizes["coulomb_friction.link_nm"].value
    assert both == pytest.approx(NOMINAL["fs"] + NOMINAL["fsm"], rel=0.1)


def test_a_datasheet_whose_friction_is_far_off_hides_no_cause():
    made = records({"torque_bias.torque_nm": BIAS_NM}, runs=3, scatter=0.03, seconds=6.0)
    half = {name: NOMINAL[name] / 2.0 for name in ("fs", "fsm", "fv", "fvm")}
    diagnosis = investigate(made, {**NOMINAL, **half}, effects=LOOKED_FOR).diagnosis
    assert diagnosis.effects == ["torque_bias"]
    sizes = {name: found.value for name, found in diagnosis.parameters.items()}
    assert abs(sizes["torque_bias.torque_nm"]) == pytest.approx(BIAS_NM, rel=0.1)
    assert sizes["fs"] + sizes["fsm"] == pytest.approx(NOMINAL["fs"] + NOMINAL["fsm"], rel=0.1)


def test_what_changes_friction_waits_for_it_only_where_the_datasheet_has_none():
    every = [*LOOKED_FOR, "position_friction"]
    waiting = ["asymmetric_friction", "position_friction"]
    smooth = {**BARE, "fv": 0.1}
    assert founded(every, (), smooth, every) == [e for e in every if e not in waiting]
    assert founded(every, ("coulomb_friction",), smooth, every) == every
    assert founded(every, (), {**smooth, "fs": 0.1}, every) == every
    assert founded(waiting, (), BARE, waiting) == waiting  # nobody looks for the whole


def test_drag_waits_for_the_viscous_friction_that_a_datasheet_lacks():
    every = ["viscous_friction", "quadratic_friction"]
    assert founded(every, (), BARE, every) == every[:1]
    assert founded(every, every[:1], BARE, every) == every
    assert founded(every, (), {**BARE, "fvm": 0.1}, every) == every


def test_all_effects_are_screened_anew_once_a_cause_has_closed_most_of_the_error():
    made = records({"torque_bias.torque_nm": BIAS_NM}, runs=2)
    fitter = CellFitter(Evidence(made, NOMINAL), NOMINAL, 0.1)
    refit = fitter.refit()
    fit = fitter.add(refit, "torque_bias", fitter.screening(refit, "torque_bias").proposals())
    others = [f"effect_{k}" for k in range(12)]
    looked: list[str] = []

    class Noted:
        gain = 1.0

        def gain_beside(self, *_):
            return 1.0

    extension = Extension(fitter, others, lambda _: None)
    fitter.screening = lambda _, effect: looked.append(effect) or Noted()
    assert left_of(fitter, fit, refit) < 0.1
    extension._first = refit, dict.fromkeys(others, Noted())
    assert set(extension.screened(fit, others)) == set(looked) == set(others)


@pytest.mark.parametrize("scatter", [0.0, 0.15])
def test_friction_that_scatters_may_differ_between_levels_of_one_run(scatter):
    """Friction of a level's one run is two fifths off: too much, unless it scatters."""
    made = records(runs=1, seconds=10.0)
    fitter = CellFitter(Evidence(made, BARE), BARE, 0.1)
    fit = fitter.refit()
    for effect in ("coulomb_friction", "viscous_friction"):
        fit = fitter.add(fit, effect, fitter.screening(fit, effect).proposals())
    level = np.array([fitter.evidence.parts[p].level for p in fitter.groups])
    columns = [
        len(fit.space.nominal) + k
        for k, name in enumerate(fit.space.effects)
        if name.startswith("coulomb_friction.")
    ]
    own = fit.solution.jacobian[:, columns] @ fit.solution.x[columns]
    moved = fit.solution.residuals - 0.4 * own * (level == 1)
    fit = replace(fit, solution=replace(fit.solution, residuals=moved))
    friction = dict.fromkeys(("fs", "fsm", "fv", "fvm"), scatter)
    p = invariance(fitter, fit, "coulomb_friction", friction).p
    assert p > 3.0 * LEAST_INVARIANCE_P if scatter else p < LEAST_INVARIANCE_P


def test_a_law_whose_shape_comes_to_a_bound_gives_way_to_the_law_that_it_is_there():
    """A cable that yields at once resists velocity, as viscous friction does."""
    fitter = CellFitter(Evidence(records(runs=2), BARE), BARE, 0.1)
    fits = [fitter.refit()]
    for effect in ("cable", "coulomb_friction"):
        proposals = fitter.screening(fits[-1], effect).proposals()
        fits.append(fitter.further(fitter.add(fits[-1], effect, proposals)))
    assert at_its_bound(fits[-1], "cable")
    names = ["cable", "viscous_friction", "coulomb_friction"]
    found = Found(fits)
    replace_bounded(found, fitter, Extension(fitter, names, lambda _: None))
    assert [fit.effects for fit in found.steps[1:]] == [
        ("coulomb_friction",),
        ("coulomb_friction", "viscous_friction"),
    ]
    expected = {"fsm": "coulomb_friction.motor_nm", "fs": "coulomb_friction.link_nm",
                "fvm": "viscous_friction.motor_nm_s_rad"}  # fmt: skip
    for friction, name in expected.items():
        assert found.best.model.effects[name] == pytest.approx(NOMINAL[friction], rel=0.01)


def test_where_the_refit_misses_far_more_than_the_motion_nothing_is_searched():
    absurd = {**NOMINAL, "jm": 1e-4, "k0": 5.0, "fsm": 0.0, "fvm": 0.01}
    tried = investigate_runs(records(), Order(absurd))
    assert LOST in tried.diagnosis.notes and tried.diagnosis.verdict == "unexplained"
    assert len(tried.fitted.found.steps) == 1 and not tried.fitted.found.rivals


def test_what_came_with_lacking_friction_does_not_keep_its_near_equivalents_out():
    """Of causes that came at once it is not known which closed what, so cogging may still come."""
    fitter = CellFitter(Evidence(records(seconds=4.0), BARE), BARE, 0.1)
    refit = fitter.refit()
    extension = Extension(fitter, ("coulomb_friction", "torque_bias", "cogging"), lambda _: None)
    friction = replace(refit, effects=("coulomb_friction",), left=0.5 * refit.left)
    both = replace(refit, effects=("coulomb_friction", "torque_bias"), left=1e-4 * refit.left)
    assert fitter.misfit(both) < 0.01 * fitter.misfit(friction)
    assert "cogging" in extension._one_cause(both, [refit, friction])
    assert "cogging" in extension._one_cause(both, [refit, friction, both])
    assert "cogging" not in extension._one_cause(both, [refit])
    assert "cogging" not in extension._one_cause(both, [refit, both])
