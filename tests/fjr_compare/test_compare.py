"""`fjr compare`: diagnoses side by side, files, page, exit status, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from html_page import EVIL, Page
from rich.console import Console
from typer.testing import CliRunner

from fjr_cli.app import app
from fjr_cli.compare_summary import print_comparison
from fjr_compare import Comparison, compare, write_comparison
from fjr_compare.comparing import judged_pairs
from fjr_compare.diagnoses import compared_diagnoses
from fjr_kit.errors import InputError
from gap_diagnosis.gates.bag_deviations import SCATTERING
from gap_diagnosis.outcome.cause import Cause
from gap_diagnosis.outcome.diagnosis import Bags, Diagnosis
from gap_diagnosis.outcome.gap_size import Estimate, Gap, Gaps

TRUTH = {"jm": 0.2, "j": 0.3, "k0": 1500.0, "fs": 5.0, "fsm": 6.0, "fv": 4.0}
STD = 0.005  # relative
GAP = Gap(nrmse_position=0.05, nrmse_torque=0.04, chi2_per_dof=1.1)


def diagnosis(seed: int, scatter: float | None = None, **changes) -> Diagnosis:
    """Return a diagnosis whose parameters are drawn about a truth, with intervals that hold."""
    rng = np.random.default_rng(seed)
    truth = {**TRUTH, **changes.pop("truth", {})}
    found = {}
    for name, value in truth.items():
        drawn = value * (1.0 + STD * rng.normal())
        half = 1.96 * STD * value
        found[name] = Estimate(value=drawn, low=drawn - half, high=drawn + half)
    bags = None
    if scatter is not None:
        stated = Estimate(value=scatter, low=scatter, high=scatter)
        bags = Bags(trends={}, scatter_percent=dict.fromkeys(SCATTERING, stated), accounted=0.5)
    gap = Gaps(nominal=GAP, refit=GAP, explained=GAP, noise_floor=None)
    values = {"verdict": "parameters_only", "confidence": 0.9, **changes}
    return Diagnosis(gap=gap, parameters=found, bags=bags, **values)


def of(*diagnoses: Diagnosis) -> Comparison:
    pairs = [compared_diagnoses(("a", "b"), diagnoses[0], other) for other in diagnoses[1:]]
    return judged_pairs("diagnoses", "a", pairs, 0.05)


def test_diagnoses_of_one_rig_are_seldom_called_different():
    found = [of(diagnosis(2 * i), diagnosis(2 * i + 1)).changed for i in range(600)]
    assert 0.02 < np.mean(found) < 0.08


def test_a_stiffness_that_changed_by_three_percent_is_named():
    found = of(diagnosis(1), diagnosis(2, truth={"k0": 1455.0}))
    assert found.changed and len(found.changes) == 1
    assert found.changes[0].startswith("b: k0 changed by -") and "N m/rad" in found.changes[0]
    changed = next(one for one in found.pairs[0].parameters if one.changed)
    assert changed.low < -45.0 < changed.high < 0.0 and changed.unit == "N m/rad"


def test_what_scatters_between_runs_by_as_much_has_not_changed():
    found = of(diagnosis(1, scatter=3.0), diagnosis(2, truth={"k0": 1455.0}))
    assert not found.changed
    stated = {p.name: p.scatter_percent for p in found.pairs[0].parameters}
    assert stated["k0"] == pytest.approx(3.0)  # what a diagnosis tells of the stiffness
    assert stated["jm"] is None  # inertia does not scatter, and none is told


def test_many_diagnoses_share_one_rate_of_false_alarms():
    found = [of(*(diagnosis(10 * i + k) for k in range(4))).changed for i in range(300)]
    assert np.mean(found) < 0.09  # the three pairs share their first


def test_causes_of_one_alone_are_found_and_equivalents_are_one():
    gone = Cause(effect="backlash", others=["piecewise_stiffness"], present=0.99)
    unsure = Cause(effect="delay", present=0.7)
    there = diagnosis(1, verdict="effect", effects=["backlash"], causes=[gone, unsure])
    other = diagnosis(2)
    found = of(there, other)
    assert found.changes == ["b: backlash or piecewise_stiffness is gone."]
    assert of(other, there).changes == [
        "b: backlash or piecewise_stiffness is there, and was not before."
    ]
    named = Cause(effect="piecewise_stiffness", present=0.96)
    again = diagnosis(3, verdict="effect", effects=["piecewise_stiffness"], causes=[named])
    assert not of(there, again).changed
    bad = diagnosis(4, verdict="bad_data")
    silent = of(there, bad)
    assert not any("backlash" in change for change in silent.changes)
    assert "b ends in bad_data, so it names no causes." in silent.pairs[0].notes


def test_a_parameter_without_interval_is_shown_and_not_judged():
    first = diagnosis(1)
    nowhere = Estimate(value=1500.0, low=float("nan"), high=float("nan"))
    other = first.model_copy(update={"parameters": {**first.parameters, "k0": nowhere}})
    found = of(first, other)
    k0 = next(one for one in found.pairs[0].parameters if one.name == "k0")
    assert k0.p_value is None and not k0.changed and found.tests == len(TRUTH) - 1


def write(place: Path, found: Diagnosis) -> Path:
    place.mkdir(parents=True)
    (place / "diagnosis.json").write_text(found.to_json(), encoding="utf-8")
    return place


def text_of(page: str) -> str:
    """Return what a reader of a page reads; fails where its HTML is broken."""
    return "".join(Page(page).texts)


def fjr(*arguments: str | Path):
    return CliRunner().invoke(app, ["compare", *map(str, arguments)])


def test_the_command_ends_as_ci_needs_it_and_writes_its_files(tmp_path):
    a, b = write(tmp_path / "a", diagnosis(1)), write(tmp_path / "b", diagnosis(3))
    c = write(tmp_path / "c", diagnosis(2, truth={"k0": 1400.0}))
    same = fjr(a, b, "--fail-on-change")
    assert same.exit_code == 0 and "No change that can be told from chance" in same.output
    other = fjr(a, c, "--fail-on-change", "--out", tmp_path / "out")
    assert other.exit_code == 3 and "k0 changed by -" in other.output
    assert fjr(a, c).exit_code == 0
    found = Comparison.read(tmp_path / "out" / "compare.json")
    assert found == compare([a, c]) and found.kind == "diagnoses"
    page = text_of((tmp_path / "out" / "compare.html").read_text(encoding="utf-8"))
    assert "k0" in page and "1 change beyond chance" in page


def test_nothing_that_can_be_judged_is_no_success(tmp_path):
    a = write(tmp_path / "a", diagnosis(1, verdict="bad_data").model_copy(
        update={"parameters": {}}))  # fmt: skip
    said = fjr(a, a, "--fail-on-change")
    assert said.exit_code == 2 and "nothing to go by" in said.output
    assert "cannot be judged" in fjr(a, a).output


def test_names_of_folders_cannot_write_into_the_page(tmp_path):
    first = diagnosis(1)
    pairs = [compared_diagnoses((EVIL, EVIL), first, diagnosis(2))]
    made = write_comparison(judged_pairs("diagnoses", EVIL, pairs, 0.05), tmp_path / "out")
    page = text_of(made.read_text(encoding="utf-8"))
    assert EVIL in page


def test_bad_input_is_one_sentence(tmp_path, campaign_result):
    a = write(tmp_path / "a", diagnosis(1))
    (tmp_path / "empty").mkdir()
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "diagnosis.json").write_text("{", encoding="utf-8")
    for places, sentence in (
        ([a], "Name two or more campaigns or diagnoses"),
        ([a, tmp_path / "none"], "is not a readable folder"),
        ([a, tmp_path / "empty"], "holds no bag"),
        ([a, broken], "not a fjr_rig/diagnosis/2 file"),
        ([a, campaign_result], "is a diagnosis and"),
    ):
        said = fjr(*places, "--out", tmp_path / "out")
        assert said.exit_code == 2 and sentence in said.output, said.output
        assert "Traceback" not in said.output and not (tmp_path / "out").exists()
    with pytest.raises(InputError, match="rate of false alarms"):
        compare([a, a], false_alarm=2.0)


@pytest.fixture
def campaign_result(tmp_path: Path) -> Path:
    """Write an analysis without bags."""
    from synthetic_result import make_result

    place = tmp_path / "analysed"
    place.mkdir()
    (place / "result.json").write_text(make_result().to_json(), encoding="utf-8")
    return place


def test_a_campaign_beside_itself_has_not_changed(campaign_result, tmp_path):
    found = compare([campaign_result, campaign_result])
    assert not found.changed and len(found.pairs[0].levels) == 3
    assert found.pairs[0].other == f"{campaign_result} (2)"
    page = Page(write_comparison(found, tmp_path / "out").read_text(encoding="utf-8"))
    assert "No change that can be told from chance" in "".join(page.texts)
    assert all(plot["linked"] for plot in page.data()["overview"].values())
    assert ("nav", {"class": "switches", "aria-label": "Frequency axis"}) in page.tags


def test_a_change_that_is_rounded_to_zero_has_no_sign(campaign_result):
    found = compare([campaign_result, campaign_result])
    [pair] = found.pairs
    level = pair.levels[0]
    powers = [power.model_copy(update={"change_db": -0.02}) for power in level.powers]
    pair = pair.model_copy(update={"levels": [level.model_copy(update={"powers": powers})]})
    console = Console(record=True, width=200)
    print_comparison(found.model_copy(update={"pairs": [pair]}), console)
    text = console.export_text()
    assert " 0.0 " in text and "-0.0 " not in text
