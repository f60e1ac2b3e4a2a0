"""What a diagnosis writes: report, diagnosis.json, updated.yaml; whole or not at all."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Sequence

import numpy as np
import pytest
from gap_cases import simulate_case
from html_page import EVIL, Page
from plotly.offline import get_plotlyjs

from controller_node import pd_filtered
from fjr_bringup.campaign.plan import Campaign
from fjr_interface.experiment import RecordDescription
from fjr_interface.parameter_file import load_parameter_file
from fjr_kit.errors import InputError
from fjr_kit.plots import BARRED
from fjr_records.records import Record, RecordSet
from fjr_sim_node.effects import EFFECTS
from fjr_sim_node.plant import PLANT
from gap_diagnosis.any_record import investigate
from gap_diagnosis.how_far.bla_comparison import bla_distance_db, compare
from gap_diagnosis.investigation import Investigation
from gap_diagnosis.outcome.contender import Contender
from gap_diagnosis.outcome.diagnosis import Diagnosis, NextExperiment
from gap_diagnosis.outcome.verdict_words import WORDS
from gap_diagnosis.report.gap_output import write_diagnosis
from gap_diagnosis.report.gap_report import compared, render_gap_report
from gap_diagnosis.report.outcome_values import caption
from gap_diagnosis.report.updated_parameters import updated_values
from gap_diagnosis.report.waterfall import bars, draw_waterfall, waterfall_plot

GAP = {"backlash.half_gap_rad": 1.5e-3}
SHORT = {"base_frequency_hz": 0.5, "transient_periods": 2, "levels_rad": (3e-3, 1e-2)}


@pytest.fixture(scope="module")
def found() -> Investigation:
    """Return the investigation of a rig with backlash, an experiment proposed and a note added."""
    case = simulate_case(GAP, seed=12, **SHORT)
    looked_for = ("backlash", "piecewise_stiffness", "delay")
    made = investigate(case.recorded, PLANT.defaults(), effects=looked_for)
    assert made.diagnosis.effects == ["backlash"]
    told = {
        "verdict": "ambiguous",
        "equivalent": [["backlash", "piecewise_stiffness"]],
        "confidence": 0.9,
        "causes": [
            made.diagnosis.causes[0].model_copy(
                update={"others": ["piecewise_stiffness"], "present": 0.9}
            )
        ],
        "contenders": [
            Contender(effects=[name], held_out_chi2=0.802, gain=gain, converged=True)
            for name, gain in (("backlash", 0.0), ("piecewise_stiffness", -0.0123))
        ],
        "next_experiment": NextExperiment(
            kind="amplitude",
            description="Play 0.5 mrad.",
            separates=["backlash", "piecewise_stiffness"],
            predicted_sigma=12.0,
            rig_time_s=36.0,
            settings={"amplitude_rad": 5e-4},
        ),
        "notes": ["A note that must be seen."],
    }
    return dataclasses.replace(made, diagnosis=made.diagnosis.model_copy(update=told))


def rendered(investigation: Investigation, provenance: dict[str, str]) -> str:
    return render_gap_report(investigation, compared(investigation), provenance)


@pytest.fixture(scope="module")
def page(found) -> Page:
    return Page(rendered(found, {"command": "fjr diagnose x"}))


def test_every_plot_has_its_place_and_every_place_a_plot(page):
    places = {attrs["id"] for _, attrs in page.tags if attrs.get("class") == "plot"}
    plots = page.data()
    assert places == set(plots["overview"]) | set(plots["levels"][0])
    assert len(plots["levels"]) == 2


def test_one_frequency_axis_serves_all_plots_over_frequency(page):
    plots = page.data()["overview"] | page.data()["levels"][0]
    over_frequency = {"where-position", "where-torque", "bla", "distortion", "sigma"}
    assert {name for name, plot in plots.items() if plot.get("linked")} == over_frequency
    assert ("nav", {"class": "switches", "aria-label": "Frequency axis"}) in page.tags


def test_verdict_doubt_notes_sets_and_next_experiment_are_said(page, found):
    text = " ".join(" ".join(page.texts).split())
    assert "backlash or piecewise stiffness" in text and "confidence 90%" in text
    assert WORDS["ambiguous"].doubt in text and "A note that must be seen." in text
    assert "Play 0.5 mrad." in text and "36 s of rig time" in text
    assert "fjr diagnose x" in text
    assert all(gate.sentence in text for gate in found.steady.gates.gates)


def test_the_held_out_gap_is_told_once_with_misfit_and_intervals(page, found):
    text = " ".join(" ".join(page.texts).split())
    refit = found.diagnosis.gap_figures.position.refit
    told = f"{100.0 * refit.value:.3g} [{100.0 * refit.low:.3g}, {100.0 * refit.high:.3g}]"
    assert text.count(told) == 1
    gap = found.diagnosis.gap
    misfits = [f"{g.chi2_per_dof:.4g}" for g in (gap.nominal, gap.refit, gap.explained)]
    assert f"misfit per degree of freedom {' '.join(misfits)} 1" in text


def test_the_waterfall_goes_from_the_nominal_to_the_noise_and_each_bar_begins_where_one_ended(
    page, found
):
    gap = found.diagnosis.gap
    stages = (gap.nominal, gap.refit, gap.explained)
    nominal, refit, best = (100.0 * stage.nrmse_position for stage in stages)
    assert [(b.name, b.kind, b.start, b.end) for b in bars(found.diagnosis)] == [
        ("nominal", "whole", 0.0, nominal),
        ("refit", "less", nominal, refit),
        ("+ backlash", "less", refit, best),
        ("remainder", "left", 0.0, best),
        ("noise", "noise", 0.0, 100.0 * gap.noise_floor.nrmse_position),
    ]
    plot = page.data()["overview"]["waterfall"]
    closed = next(trace for trace in plot["data"] if trace["name"] == "closed")
    assert np.allclose(closed["base"], [refit, best], rtol=1e-5)
    assert np.allclose(np.add(closed["base"], closed["x"]), [nominal, refit], rtol=1e-4)
    assert plot["layout"]["xaxis"]["type"] == "log"  # the nominal is far above the noise


def gaps_of(diagnosis: Diagnosis, nrmse: Sequence[float], noise: float) -> Diagnosis:
    stages = [
        step.model_copy(update={"nrmse_position": value})
        for step, value in zip(diagnosis.steps, nrmse, strict=True)
    ]
    floor = diagnosis.gap.noise_floor.model_copy(update={"nrmse_position": noise})
    gap = diagnosis.gap.model_copy(update={"noise_floor": floor})
    return diagnosis.model_copy(update={"steps": stages, "gap": gap})


@pytest.mark.parametrize("nominal", [0.12, 3e-17])
def test_a_gap_that_is_nothing_but_rounding_is_shown_as_less_than_what_matters(found, nominal):
    diagnosis = gaps_of(found.diagnosis, [nominal, 2.4e-17, 1e-17], 0.0)
    labels = [bar.label for bar in bars(diagnosis)]
    first = "12%" if nominal > 0.1 else "<0.001%"
    assert labels == [first, "to <0.001%", "to <0.001%", "<0.001%", "0%"]
    plot = waterfall_plot(diagnosis)
    axis = plot["layout"]["xaxis"]
    if nominal > 0.1:
        assert axis["type"] == "log" and axis["range"][0] > -4.0
    else:
        assert axis["range"][1] >= 1e-3
    longest = max(x for trace in plot["data"] for x in trace["x"])
    assert longest == pytest.approx(100.0 * nominal, rel=0.01)
    axes = draw_waterfall(diagnosis).axes[0]
    ticks = [axes.xaxis.get_major_formatter()(x, 0) for x in (0.01, 1.0, 10.0)]
    assert ticks == ["0.01", "1", "10"]  # no mathematics in dollars, which nothing here sets
    assert axes.get_xlim()[1] >= 1e-3


def test_causes_and_evidence_are_said(page):
    text = " ".join(" ".join(page.texts).split())
    assert "backlash or piecewise stiffness 90%" in text
    assert "Steady periods were compared. The controller is known" in text


def test_causes_that_did_not_pass_every_test_are_not_said_to_have_passed(found):
    passed = found.diagnosis
    assert caption(passed).startswith("Causes that passed every test")
    first, *others = passed.causes
    unsure = [first.model_copy(update={"present": 0.18}), *others]
    told = caption(passed.model_copy(update={"causes": unsure}))
    assert "less than 50% did not pass every test" in told
    assert caption(passed.model_copy(update={"causes": []})) == "Named causes."


def test_each_cause_is_shown_over_the_quantity_of_its_telltale(page, found):
    text = " ".join(" ".join(page.texts).split())
    for name in ("backlash", "piecewise_stiffness"):  # a cause and what is not told from it
        assert EFFECTS[name].telltale.words in text
    plot = page.data()["overview"]["telltale-backlash"]
    assert "deflection" in plot["layout"]["xaxis"]["title"]["text"]
    _, left, added, without = (np.array(trace["y"]) for trace in plot["data"])
    deflection = np.array(plot["data"][2]["x"])
    assert np.std(left) < 0.3 * np.std(without)
    assert np.corrcoef(without, added)[0, 1] > 0.9 and np.corrcoef(added, deflection)[0, 1] < 0.0


def test_the_explanations_of_a_set_stand_beside_each_other_on_the_data_that_select(page):
    text = " ".join(" ".join(page.texts).split())
    named = "as named 0.802 0 converged"
    assert f"{named} piecewise stiffness for backlash 0.802 \N{MINUS SIGN}0.0123" in text
    assert "of the data that select among explanations; the figures above are of other" in text


def test_the_page_asks_nothing_of_any_network(found):
    own = rendered(found, {}).replace(get_plotlyjs(), "")
    assert not re.search(r"https?:|//[\w.]+\.\w+/|@import|url\(", own)


def test_texts_from_bags_cannot_become_code(found):
    bags = tuple(dataclasses.replace(r, name=EVIL) for r in found.recorded.realizations)
    recorded = dataclasses.replace(found.recorded, source=EVIL, realizations=bags)
    view = dataclasses.replace(found.steady, recorded=recorded)
    proposed = found.diagnosis.next_experiment.model_copy(
        update={"description": EVIL, "separates": [EVIL], "settings": {EVIL: EVIL}}
    )
    diagnosis = found.diagnosis.model_copy(update={"notes": [EVIL], "next_experiment": proposed})
    hostile = dataclasses.replace(found, recorded=recorded, steady=view, diagnosis=diagnosis)
    made = Page(rendered(hostile, {"command": EVIL}))
    assert len(made.scripts) == 3 and not any(tag == "img" for tag, _ in made.tags)
    assert made.texts.count(EVIL) == 5  # folder, command, note, proposal, bags


def test_the_maps_hold_sigma_of_every_line(page, found):
    traces = page.data()["overview"]["where-position"]["data"]
    assert len(traces) == 3
    lines = 2 * (found.recorded.lines - 1)
    assert all(len(t["x"]) == lines for t in traces)
    colors = [np.mean(t["marker"]["color"]) for t in traces]
    assert colors[0] > colors[2] + 0.5 and colors[1] > colors[2] + 0.5
    sigma = found.steady.maps["refit"].signals["position"].sigma[:, 1:]
    expected = np.clip(np.log10(np.maximum(sigma, 1e-3)), 0.0, 4.0)
    assert np.isclose(np.mean(traces[1]["marker"]["color"]), expected.mean(), rtol=1e-4)


def test_the_tools_of_a_map_lie_above_its_colour_bar(page):
    for name in ("where-position", "where-torque"):
        plot = page.data()["overview"][name]
        assert plot["data"][-1]["marker"]["showscale"]
        assert plot["layout"].items() >= BARRED.items()


def test_the_true_model_has_the_rigs_bla_and_distortion_and_the_bare_one_has_not(found):
    for level in compare(found.recorded, found.steady.signals, found.steady.held):
        far = {name: bla_distance_db(level.rig, one) for name, one in level.models.items()}
        assert far["explained"] < 0.05 and far["refit"] > 10 * far["explained"]
        rig, model = level.rig.odd.corrected, level.models["explained"].odd.corrected
        assert np.median(np.abs(20 * np.log10(model / rig))) < 0.5
        error = level.position["explained"] - level.position["rig"]
        assert np.std(error) < 3e-5  # the encoder noise is 2e-5 in each of two periods


def test_the_folder_holds_all_that_was_promised_and_earlier_files_go(found, tmp_path):
    out = tmp_path / "out"
    (out / "figures").mkdir(parents=True)
    for name in ("figures/old.png", "updated.yaml", "mine.txt"):
        (out / name).write_text("old")
    report = write_diagnosis(found, out, command="fjr diagnose x", date="2026-01-02")
    assert report == out / "report.html" and report.read_text().startswith("<!DOCTYPE html>")
    assert Diagnosis.read(out / "diagnosis.json").to_json() == found.diagnosis.to_json()
    assert not (out / "figures" / "old.png").exists() and (out / "mine.txt").read_text() == "old"
    stems = {path.stem for path in (out / "figures").iterdir()}
    assert stems == {
        "waterfall", "where_position", "where_torque", "sigma_refit", "residual_torque",
        "error_by_band", "missing_torque",
    }  # fmt: skip
    for stem in stems:
        assert (out / "figures" / f"{stem}.pdf").stat().st_size > 1000
    assert not list(tmp_path.glob(".*")) and not list(out.glob(".*"))


def test_diagnosis_json_has_the_fields_of_its_schema_and_no_other(found):
    text = json.loads(found.diagnosis.to_json())
    assert list(text) == [
        "schema", "verdict", "effects", "equivalent", "confidence", "evidence", "causes",
        "doubted", "steps",
        "remainder", "gap", "gap_closed", "gap_figures", "bags", "where",
        "contenders", "ranking", "parameters", "next_experiment", "notes",
    ]  # fmt: skip
    assert text["schema"] == "fjr_rig/diagnosis/2"
    assert set(text["gap"]) == {"nominal", "refit", "explained", "noise_floor"}
    assert set(text["where"][0]) == {"level", "band_hz", "lines", "signal", "sigma"}


def test_a_folder_that_cannot_be_written_is_one_sentence(found, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file; name a folder"):
        write_diagnosis(found, tmp_path / "file")


def test_the_updated_file_is_a_campaign_of_the_better_simulation(found, tmp_path):
    out = tmp_path / "out"
    write_diagnosis(found, out)
    campaign = Campaign.create(out / "updated.yaml")
    values = updated_values(found.recorded, found.diagnosis)
    simulator = campaign.values["simulator"]
    for name, estimate in found.diagnosis.parameters.items():
        assert simulator[name] == estimate.value
    assert simulator["noise_std_rad"] == 0.0
    assert campaign.values["controller"] == values["controller"]
    made, recorded = campaign.experiment(1, 0), found.recorded.experiment
    assert made.samples_per_period == recorded.samples_per_period
    assert made.amplitude_rad == pytest.approx(1e-2)
    assert len(made.excited_harmonics) == len(recorded.excited_harmonics)
    assert load_parameter_file(out / "updated.yaml").keys() == values.keys()


@pytest.mark.parametrize("rate", [7.0, 50.0, 250.5, 1000.0 / 3.0, 1000.0, 50_000.0])
def test_the_updated_file_of_records_is_a_campaign_at_their_rate(found, rate):
    law = pd_filtered.describe(pd_filtered.CONTROLLER.check({}))
    description = RecordDescription.of("log", sample_rate_hz=rate, controller=law)
    still = np.zeros(100)
    records = RecordSet("memory", rate, (Record("log", description, still, still, still, None),))
    values = updated_values(records, found.diagnosis)
    campaign = Campaign.create(overrides=values)
    made = campaign.experiment(0, 0)
    assert made.sample_rate_hz == min(rate, 20_000.0)
    assert made.excited_harmonics[-1] * made.base_frequency_hz < 0.5 * made.sample_rate_hz
    assert made.base_frequency_hz == pytest.approx(0.1, rel=0.35)
    if rate == 1000.0:
        assert values["excitation"] == {"sample_rate_hz": rate}


def test_bad_data_is_reported_with_the_rig_alone(tmp_path):
    recorded = simulate_case(seed=1, **SHORT).recorded
    bags = list(recorded.realizations)
    bags[0] = dataclasses.replace(bags[0], torque=1.2 * bags[0].torque)
    broken = dataclasses.replace(recorded, realizations=tuple(bags))
    found = investigate(broken, PLANT.defaults())
    assert found.diagnosis.verdict == "bad_data"
    assert any("1.2 times that of the law" in note for note in found.diagnosis.notes)
    report = write_diagnosis(found, tmp_path / "out")
    page = Page(report.read_text())
    assert page.data()["overview"] == {} and "bla" in page.data()["levels"][0]
    headings = re.findall("<h2>(.*?)</h2>", report.read_text())
    assert "How far" in headings and not {"Where", "Which"} & {*headings}
    assert not (tmp_path / "out" / "updated.yaml").exists()
    assert Diagnosis.read(tmp_path / "out" / "diagnosis.json").verdict == "bad_data"
