"""Records that do not repeat, from real bags through the command line to causes and report."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from html_page import Page

from controller_node import pd_filtered
from fjr_bringup import Campaign
from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import RecordDescription
from fjr_interface.parameter_file import load_parameter_file
from fjr_records.records import read_records
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT, coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis import diagnose, read_nominal
from gap_diagnosis.outcome.diagnosis import Diagnosis

RATE_HZ = 500.0
NOISE_RAD = 2e-5
GRAVITY_NM = 8.0
LAW = pd_filtered.CONTROLLER.check({"sample_rate_hz": RATE_HZ})
OFF = {"fsm": 6.3, "j": 0.31, "k0": 1550.0}
SCHEMA = Path(__file__).parents[2] / "docs" / "schemas" / "diagnosis.schema.json"

LIMITS = ("torque_saturation", "torque_speed_limit")


def band_noise(seed: int, samples: int, rms_rad: float) -> np.ndarray:
    """Return noise from 0.3 to 15 Hz that begins and ends at zero."""
    rng = np.random.default_rng(seed)
    frequency = np.fft.rfftfreq(samples, 1.0 / RATE_HZ)
    lines = (frequency > 0.3) & (frequency < 15.0)
    spectrum = np.zeros(frequency.size, complex)
    spectrum[lines] = rng.standard_normal(lines.sum()) + 1j * rng.standard_normal(lines.sum())
    signal = np.fft.irfft(spectrum, samples)
    rise = np.minimum(1.0, np.arange(samples) / (0.3 * RATE_HZ))
    signal *= rise * rise[::-1]
    return rms_rad * signal / signal.std()


def write_records(folder, effects, *, levels=(0, 0, 1, 1), seconds=4.0, described=True) -> Path:
    """Record a rig that differs from the paper's, one run for each entry of `levels`."""
    samples = int(seconds * RATE_HZ)
    for run, level in enumerate(levels):
        signals = simulate(
            band_noise(10 + run, samples, (0.02, 0.06)[level]), RATE_HZ,
            coefficients(PLANT.check(OFF)), pd_filtered.coefficients(LAW),
            NOISE_RAD * np.random.default_rng([7, run]).standard_normal(samples),
            fx.coefficients(effects),
        )  # fmt: skip
        description = RecordDescription.of(
            "run", sample_rate_hz=RATE_HZ, level=level, levels=max(levels) + 1,
            realization=levels[:run].count(level), realizations=levels.count(level),
            controller=pd_filtered.describe(LAW) if described else None,
        )  # fmt: skip
        with BagWriter(folder / f"run_{run}", description) as bag:
            bag.write_arrays(r=signals.reference, y=signals.position, u=signals.torque)
    return folder


@dataclass(frozen=True)
class Done:
    """A finished diagnosis: its folder, what it printed, what it found."""

    out: Path
    text: str
    diagnosis: Diagnosis


def diagnosed(run, folder, out, *options) -> Done:
    done = run("diagnose", folder, "--nominal", "paper", "--out", out, *options)
    assert done.exit_code == 0, done.output
    text = " ".join(done.stdout.split())
    return Done(out, text, Diagnosis.read(out / "diagnosis.json"))


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    return tmp_path_factory.mktemp("records")


@pytest.fixture(scope="module")
def bags(folders):
    return write_records(folders / "rig", {"gravity.torque_nm": GRAVITY_NM})


@pytest.fixture(scope="module")
def gravity(bags, folders):
    from typer.testing import CliRunner

    from fjr_cli.app import app

    def run(*arguments):
        return CliRunner().invoke(app, [str(a) for a in arguments])

    return diagnosed(run, bags, folders / "out", "--effects", "gravity, torque_bias")


def test_a_cause_is_named_with_its_size_and_its_share(gravity):
    found = gravity.diagnosis
    assert found.verdict in ("effect", "partly_explained")
    [cause] = found.causes
    assert cause.effect == "gravity" and not cause.others and cause.present > 0.8
    size = cause.parameters["gravity.torque_nm"]
    assert size.value == pytest.approx(GRAVITY_NM, rel=0.05) and size.low > 0.0
    assert cause.share.value > 0.8 and cause.invariance_p > 0.01
    assert found.evidence.excitation == "record" and found.evidence.controller == "known"
    assert found.evidence.reported_on in ("records", "blocks")
    assert found.evidence.noise == "residual"


def test_the_gap_shrinks_step_by_step_to_the_noise(gravity):
    steps = gravity.diagnosis.steps
    assert [(s.stage, s.added) for s in steps] == [
        ("nominal", None), ("refit", None), ("cause", "gravity")
    ]  # fmt: skip
    gaps = [s.nrmse_position for s in steps]
    assert gaps[0] > gaps[1] > 3.0 * gaps[2]
    floor = gravity.diagnosis.gap.noise_floor.nrmse_position
    assert 0.7 * gaps[2] < floor < 1.1 * gaps[2]


def test_the_summary_names_cause_share_remainder_and_evidence(gravity):
    assert "Missing: gravity" in gravity.text and "present" in gravity.text
    assert "with gravity" in gravity.text and "noise floor" in gravity.text
    assert "of the motion remains, which noise explains." in gravity.text
    assert "The controller is known, so the closed loop was simulated." in gravity.text
    assert f"{gravity.out}/report.html".replace(" ", "") in gravity.text.replace(" ", "")


def test_the_json_is_true_of_its_schema(gravity):
    text = (gravity.out / "diagnosis.json").read_text()
    found, schema = json.loads(text), json.loads(SCHEMA.read_text())
    assert list(found) == schema["required"] and gravity.diagnosis.to_json() == text
    for field, kind in (("causes", "Cause"), ("steps", "Step"), ("where", "Place")):
        assert [list(one) for one in found[field]] == [
            schema["$defs"][kind]["required"] for _ in found[field]
        ]
    assert list(found["evidence"]) == schema["$defs"]["EvidenceKind"]["required"]


def test_the_updated_file_holds_refit_cause_controller_and_the_rate_and_can_be_simulated(gravity):
    values = load_parameter_file(gravity.out / "updated.yaml")
    assert set(values) == {"simulator", "controller", "excitation"}
    assert set(values["excitation"]) <= {"sample_rate_hz", "f_max_hz"}
    assert Campaign.create(gravity.out / "updated.yaml").experiment(0, 0).sample_rate_hz == RATE_HZ
    simulator = values["simulator"]
    for name, estimate in gravity.diagnosis.parameters.items():
        assert simulator[name] == estimate.value
    assert simulator["gravity.torque_nm"] == pytest.approx(GRAVITY_NM, rel=0.05)
    assert simulator["sample_rate_hz"] == RATE_HZ and values["controller"]["p"] == LAW["p"]


def test_the_report_has_waterfall_causes_and_a_place_for_every_plot(gravity):
    page = Page((gravity.out / "report.html").read_text())
    plots = page.data()
    places = {attrs["id"] for _, attrs in page.tags if attrs.get("class") == "plot"}
    assert places == set(plots["overview"]) | set(plots["levels"][0])
    assert len(plots["levels"]) == 2
    waterfall = plots["overview"]["waterfall"]
    assert waterfall["layout"]["yaxis"]["ticktext"] == [
        "nominal", "refit", "+ gravity", "remainder", "noise"
    ]  # fmt: skip
    text = " ".join(" ".join(page.texts).split())
    for words in ("Missing: gravity", "invariance", "Evidence", "run_3 (to "):
        assert words in text, words
    stems = {path.stem for path in (gravity.out / "figures").iterdir()}
    assert stems == {"waterfall", "error_by_band", "missing_torque"}


def test_the_plots_show_the_error_over_time_and_that_the_cause_closes_it_where_it_acts(gravity):
    levels = Page((gravity.out / "report.html").read_text()).data()["levels"]
    for plots in levels:
        times = [t for t in plots["run-time"]["data"] if t.get("yaxis") == "y2"]
        rms = {t["name"]: np.std(t["y"]) for t in times}
        assert rms["refit"] > 1.5 * rms["best explanation"]
        bands = {t["name"]: t["y"] for t in plots["run-bands"]["data"]}
        assert bands["refit"][0] > 3.0 * bands["+ gravity"][0]
        assert 0.2 < bands["+ gravity"][0] < 10.0  # in units of noise


def test_python_and_the_command_find_the_same(gravity, bags):
    found = diagnose(bags, read_nominal("paper"), effects=["gravity", "torque_bias"])
    assert found.verdict == gravity.diagnosis.verdict and found.effects == ["gravity"]


def test_a_short_single_record_names_nothing(run, tmp_path):
    effects = {"gravity.torque_nm": GRAVITY_NM}
    folder = write_records(tmp_path / "rig", effects, levels=(1,), seconds=0.2)
    done = diagnosed(run, folder, tmp_path / "out", "--effects", "gravity,torque_bias")
    found = done.diagnosis
    assert found.effects == [] and found.causes == [] and found.verdict == "unexplained"
    assert [s.stage for s in found.steps] == ["nominal", "refit"]
    assert not any("." in name for name in found.parameters)
    assert "too short or too few" in done.text


def test_a_time_budget_ends_the_search_and_says_so(run, tmp_path):
    effects = {"gravity.torque_nm": GRAVITY_NM}
    folder = write_records(tmp_path / "rig", effects, levels=(1, 1), seconds=1.0)
    found = diagnose(folder, read_nominal("paper"), effects=["gravity"], budget_s=0.0)
    assert found.effects == [] and not found.ranking
    assert any("The time budget ended the search" in note for note in found.notes)


def test_what_noise_explains_is_not_explained_further(tmp_path):
    folder = write_records(tmp_path / "rig", {}, levels=(0, 0, 1, 1))
    found = diagnose(folder, read_nominal("paper"), effects=["backlash", "torque_bias"])
    assert found.verdict == "parameters_only" and found.causes == [] and not found.ranking
    assert found.steps[-1].chi2_per_dof < 2.0


def test_a_cause_that_acts_at_the_highest_level_alone_is_judged_by_that_level(tmp_path):
    plain = write_records(tmp_path / "plain", {}, levels=(0, 0, 1, 1))
    peaks = [np.abs(r.torque).max() for r in read_records(plain).records]
    limit = 0.6 * min(peaks[2:])
    assert max(peaks[:2]) < 0.8 * limit  # the lower level never reaches it
    folder = write_records(
        tmp_path / "rig", {"torque_saturation.limit_nm": limit}, levels=(0, 0, 1, 1)
    )
    found = diagnose(folder, read_nominal("paper"), effects=[*LIMITS, "load_friction"])
    assert found.effects == ["torque_saturation"] and found.causes[0].present > 0.8
    assert found.causes[0].others in ([], ["torque_speed_limit"])  # which holds a saturation
    size = found.causes[0].parameters["torque_saturation.limit_nm"]
    assert size.value == pytest.approx(limit, rel=0.02)


def refused(done, *words):
    assert done.exit_code == 2, done.output
    for word in words:
        assert word in done.stderr
    assert "Traceback" not in done.output


def test_an_effect_of_an_unknown_name_is_one_sentence(run, bags, tmp_path):
    out = tmp_path / "out"
    done = run("diagnose", bags, "--nominal", "paper", "--effects", "gravity,slop", "--out", out)
    refused(done, "There is no effect 'slop'; did you mean")
    assert not out.exists()


@pytest.mark.parametrize("option", ["--periods", "--transient-periods", "--samples-per-period"])
def test_records_have_no_periods(run, bags, tmp_path, option):
    done = run("diagnose", bags, "--nominal", "paper", option, 2, "--out", tmp_path / "out")
    refused(done, "records are not cut into periods")


def test_a_record_too_short_for_a_window_is_one_sentence(run, tmp_path):
    folder = write_records(tmp_path / "rig", {}, levels=(0,), seconds=0.1)
    refused(
        run("diagnose", folder, "--nominal", "paper", "--out", tmp_path / "out"),
        "50 samples, too few",
    )


def test_a_record_with_nan_is_one_sentence(run, tmp_path):
    signal = band_noise(1, 500, 0.02)
    broken = np.where(np.arange(500) == 100, np.nan, signal)
    description = RecordDescription.of("run", sample_rate_hz=RATE_HZ)
    with BagWriter(tmp_path / "rig" / "run_0", description) as bag:
        bag.write_arrays(r=signal, y=broken, u=signal)
    done = run("diagnose", tmp_path / "rig", "--nominal", "paper", "--out", tmp_path / "out")
    refused(done, "run_0", "is nan", "record it again")
