"""Of a joint whose datasheet lacks all friction, one law that does as well is not the end."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from fjr_records.records import read_records
from fjr_sim_node.simulation.closed_loop import simulate_law
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.model.record_rig import _NOTHING
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.outcome.diagnosis import Diagnosis
from gap_diagnosis.outcome.gap_size import Estimate, Gaps
from gap_diagnosis.report.gap_tables import parameters
from gap_diagnosis.which import stepwise
from gap_diagnosis.which.equivalents import holders
from gap_diagnosis.which.found import Found
from gap_diagnosis.which.stepwise import Stepwise

RATE, INERTIA, COULOMB, VISCOUS = 200.0, 0.05, 0.4, 0.3
BOTH = ["coulomb_friction", "viscous_friction"]


@pytest.fixture(scope="module")
def fitter(tmp_path_factory) -> CellFitter:
    folder: Path = tmp_path_factory.mktemp("joint")
    rng, files = np.random.default_rng(4), []
    model = Model({"jm": INERTIA, "fsm": COULOMB, "fvm": VISCOUS}, {})
    stamps = np.arange(int(12.0 * RATE)) / RATE
    for number in range(3):
        waves = [
            np.sin(2.0 * np.pi * (hertz * stamps + rng.uniform()))
            for hertz in rng.uniform(0.2, 4.0, 6)
        ]
        torque = 0.5 * np.sum(waves, axis=0)
        nothing = np.zeros(stamps.size)
        run = simulate_law(
            nothing, RATE, model.plant_coefficients, _NOTHING, None, model.effect_coefficients,
            command=torque,
        )  # fmt: skip
        table = [stamps, run.position + 1e-5 * rng.standard_normal(stamps.size), torque]
        files.append(folder / f"run_{number}.csv")
        np.savetxt(files[-1], np.column_stack(table), delimiter=",", header="t,q,u", comments="")
    columns = parse_map(["time=t", "torque=u", "position=q"])
    import_files(files, folder / "bags", ImportOptions(columns=columns))
    nominal = datasheet({"jm": 0.95 * INERTIA, "k0": math.inf}, "joint")
    records = read_records(folder / "bags")
    return CellFitter(Evidence(records, nominal), Model.nominal(nominal).plant, 0.1)


def test_a_search_that_ended_with_one_friction_begins_anew_from_both(fitter):
    refit = fitter.refit()
    search = Stepwise(fitter, BOTH)
    fits = search.extension.extended(refit, [refit])
    one = next(fit for fit in fits if fit.effects == ("viscous_friction",))
    both = [fit for fit in fits if {*fit.effects} >= {*BOTH}]
    assert both
    anew = search._from_both_frictions(Found([refit, one], rivals={1: fits}))
    assert anew is not None and {*anew.best.effects} == {*BOTH}
    assert search.extension.gain(anew.best, one).present
    sizes = anew.best.model.effects
    assert sizes["coulomb_friction.motor_nm"] == pytest.approx(COULOMB, rel=0.05)
    assert sizes["viscous_friction.motor_nm_s_rad"] == pytest.approx(VISCOUS, rel=0.05)
    assert search._from_both_frictions(Found([refit, both[0]], rivals={1: fits})) is None
    alone = Stepwise(fitter, ["viscous_friction"])
    assert alone._from_both_frictions(Found([refit, one], rivals={1: fits})) is None
    assert search._from_both_frictions(Found([refit, one], rivals={1: [one]})) is None


def test_of_what_does_as_well_none_lacks_a_friction_that_repeats(fitter):
    refit = fitter.refit()
    extension = Stepwise(fitter, BOTH).extension
    fits = extension.extended(refit, [refit])
    one = next(fit for fit in fits if fit.effects == ("viscous_friction",))
    both = next(fit for fit in fits if {*fit.effects} == {*BOTH})
    assert extension._lacks_friction(one, both)
    assert not extension._lacks_friction(both, both)
    assert not extension._lacks_friction(both, one)


def test_a_fit_of_an_earlier_step_stands_where_adding_a_cause_ends_elsewhere(fitter):
    """Its causes are those of the step, in the order of the step."""
    refit = fitter.refit()
    search = Stepwise(fitter, BOTH)
    fits = search.extension.extended(refit, [refit])
    both = next(fit for fit in fits if {*fit.effects} == {*BOTH})
    order = tuple(reversed(both.effects))
    worse = replace(both, effects=order, left=3.0 * both.left)
    known = search._or_known(worse, Found([refit], rivals={1: fits}))
    assert known.model is both.model and known.effects == order
    assert search._or_known(worse, Found([refit], rivals={1: [worse]})) is worse
    others = [fit for fit in fits if {*fit.effects} != {*BOTH}]
    assert search._or_known(worse, Found([refit], rivals={1: others})) is worse


def test_laws_of_friction_are_paired_where_the_datasheet_lacks_friction(fitter, monkeypatch):
    """Whether or not most of what is missing goes with velocity: a joint rests by them as well."""
    refit, asked = fitter.refit(), []
    search = Stepwise(fitter, [*BOTH, "stribeck_friction_motor", "presliding_friction", "cogging"])
    added = [replace(refit, effects=(e,)) for e in ("stribeck_friction_motor", "cogging")]
    monkeypatch.setattr(stepwise, "lacks_friction", lambda *_: False)
    monkeypatch.setattr(search, "_pairs", lambda *given: asked.append(given) or added)
    found = Found([refit])
    assert search._frictions(added, found) == added
    assert asked == [(added[:1], found, ["cogging"])]  # beside laws of friction, no others
    monkeypatch.setattr(search, "_lacked", set())
    assert search._frictions(added, found) == []


def test_a_law_of_several_parts_is_not_tried_beside_one_of_them():
    """It would name that part twice; what it has beyond it is an effect of its own."""
    names = [*BOTH, "stribeck_friction_motor", "presliding_friction"]
    for part, other in (names[2:], names[:1:-1]):
        assert holders([part], names, BOTH) == ["lugre_friction"]
        assert holders([part], names, [*BOTH, other]) == []
        assert holders([part], [*BOTH, part], BOTH) == []


def test_friction_that_is_lacked_is_fitted_whatever_its_start_promises(fitter):
    refit = fitter.refit()
    proposals = fitter.screening(refit, "coulomb_friction").proposals()
    dear = [(cost + 1e6, space, point) for cost, space, point in proposals]
    assert fitter.add(refit, "coulomb_friction", dear) is not None
    bias = fitter.screening(refit, "torque_bias").proposals()
    assert fitter.add(refit, "torque_bias", [(c + 1e6, s, p) for c, s, p in bias]) is None


def test_the_report_says_where_updated_yaml_holds_a_friction_that_the_datasheet_lacks(fitter):
    refit = fitter.refit()
    fit = fitter.add(refit, BOTH[0], fitter.screening(refit, BOTH[0]).proposals())
    nothing = Gaps(nominal=None, refit=None, explained=None, noise_floor=None)
    found = {
        n: Estimate(value=v, low=v, high=v)
        for n, v in {**fit.model.plant, **fit.model.effects}.items()
    }
    told = Diagnosis(verdict="effect", confidence=0.9, gap=nothing, parameters=found)
    rows = {row[0]: row for row in parameters(fit.space, told, fitter.nominal)}
    size = fit.model.effects["coulomb_friction.motor_nm"]
    assert rows["coulomb_friction.motor_nm"][-2] == "in fsm"
    assert rows["fsm"][-2] == f"{size:.5g}" and rows["jm"][-2] == ""
