"""Folders of records: what `analyze` says of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rig_records as rigs
from html_page import Page

from bla_analyzer import analyze, load_result, write_result
from bla_analyzer.record_analysis import _lines_left
from bla_analyzer.results.findings import findings
from bla_analyzer.results.summary import campaign, headline
from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import RecordDescription
from fjr_interface.topics import MOTOR_POSITION, MOTOR_TORQUE, REFERENCE
from fjr_kit.errors import InputError

SIGNALS = {"r": REFERENCE, "u": MOTOR_TORQUE, "y": MOTOR_POSITION}
SECONDS = 20.0


def write(folder: Path, data: np.ndarray, symbols: str = "ruy", **described) -> Path:
    description = RecordDescription.of("test", sample_rate_hz=rigs.RATE, **described)
    values = {s: row for s, row in zip("ruy", data, strict=True) if s in symbols}
    with BagWriter(folder, description, signals=tuple(SIGNALS[s] for s in values)) as bag:
        bag.write_arrays(**values)
    return folder


def data(seed: int = 1, kind: str = "noise", **options) -> np.ndarray:
    rig = rigs.random_rig(3, linear=options.pop("linear", True))
    options = {"noise": 0.01, "seed": seed} | options
    return rigs.record(rig, kind, SECONDS, **options)


def test_one_record_gives_an_estimate_with_uncertainty(tmp_path):
    write(tmp_path / "rig" / "one", data())
    result = analyze(tmp_path / "rig")
    bla = result.levels[0].bla
    assert (result.excitation, bla.method) == ("arbitrary", "local")
    held = np.abs(bla.g - rigs.truth(rigs.random_rig(3, linear=True), bla.frequency_hz))
    assert np.mean((held <= bla.radius_95)[bla.reliable]) > 0.85
    assert campaign(result).startswith("Excitation without period: 1 level, 1 record, of up to 20")
    said = " ".join(findings(result.levels[0]))
    assert "Distortion and noise cannot be told apart" in said
    assert "Odd and even distortion cannot be told apart" in said
    assert any("are left out" in note for note in result.notes)
    write_result(result, tmp_path / "out", figures=False, report=False)
    again = load_result(tmp_path / "out" / "result.json")
    np.testing.assert_array_equal(again.levels[0].bla.g, bla.g)
    np.testing.assert_array_equal(again.levels[0].left_out_hz, result.levels[0].left_out_hz)


def test_repeats_are_pooled_and_split_noise_from_distortion(tmp_path):
    for number in range(3):
        again = {"repeat_of": 0} if number else {}
        record = data(noise_seed=number, linear=False, noise=2e-3)
        write(tmp_path / f"run_{number}", record, realization=number, realizations=3, **again)
    result = analyze(tmp_path)
    bla = result.levels[0].bla
    assert (result.excitation, bla.realizations, bla.periods) == ("repeated", 1, 3)
    assert np.median(bla.var_noise / bla.var_total) < 0.2
    assert "Total distortion with its noise" in " ".join(findings(result.levels[0]))


def test_without_reference_the_bias_is_warned_of(tmp_path):
    write(tmp_path / "rig" / "one", data(), symbols="uy")
    result = analyze(tmp_path / "rig")
    assert any("biased" in note and "-1/C" in note for note in result.notes)
    bla = result.levels[0].bla
    exact = rigs.truth(rigs.random_rig(3, linear=True), bla.frequency_hz)
    inside = bla.frequency_hz < 5.0
    assert np.median(np.abs(bla.g / exact - 1.0)[inside]) < 0.1


@pytest.mark.parametrize("noise", [1e-2, 1e-3, 1e-4])
def test_without_reference_no_line_shows_the_inverse_of_the_controller(tmp_path, noise):
    """Above 30 Hz nothing is played: there the torque is the controller's answer to noise."""
    write(tmp_path / "rig" / "one", data(noise=noise), symbols="uy")
    result = analyze(tmp_path / "rig")
    f, left_out = result.levels[0].bla.frequency_hz, result.levels[0].left_out_hz
    exact = rigs.truth(rigs.random_rig(3, linear=True), f)
    assert np.abs(np.log(np.abs(result.levels[0].bla.g / exact))).max() < 0.1
    assert 25.0 < f[-1] < 30.5 and left_out[-1] > 200.0
    assert any("do not stand above noise" in note for note in result.notes)


@pytest.mark.parametrize("noise", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("kind", ["chirp", "trapezoid"])
def test_without_reference_what_tells_no_torque_from_its_transient_is_left_out(
    tmp_path, kind, noise
):
    """A sweep has the spectrum of a transient at both ends of its band, a move zeros within."""
    write(tmp_path / "rig" / "one", data(kind=kind, noise=noise), symbols="uy")
    result = analyze(tmp_path / "rig")
    bla = result.levels[0].bla
    exact = rigs.truth(rigs.random_rig(3, linear=True), bla.frequency_hz)
    assert np.abs(np.log(np.abs(bla.g / exact))).max() < {"chirp": 0.1, "trapezoid": 0.4}[kind]
    assert bla.g.size > 20
    assert any("where a sweep begins and ends" in note for note in result.notes)


def test_without_reference_nothing_is_shown_as_one(tmp_path):
    for level in (0, 1):
        record = data(seed=level) * (1.0 + level)
        write(tmp_path / "rig" / f"{level}", record, symbols="uy", level=level)
    result = analyze(tmp_path / "rig")
    out = write_result(result, tmp_path / "out")
    shown = Page(out.read_text("utf-8")).data()
    for level, plots in zip(result.levels, shown["levels"], strict=True):
        assert np.isnan(level.excited.reference).all() and np.isnan(level.amplitude_rad).all()
        axes = [a for name, a in plots["spectra"]["layout"].items() if name.startswith("yaxis")]
        titles = [axis["title"]["text"] for axis in axes]
        assert titles == ["torque (dB re 1 N m)", "position (dB re 1 rad)"]
        assert {trace.get("yaxis", "y") for trace in plots["spectra"]["data"]} == {"y", "y2"}
    assert not {"all-v", "all-power"} & set(shown["overview"])


def test_a_sweep_is_said_not_to_stand_for_noise(tmp_path):
    write(tmp_path / "rig" / "one", data(kind="chirp"))
    assert any("not Gaussian (kurtosis 1.5" in note for note in analyze(tmp_path / "rig").notes)


def test_a_reference_of_another_run_does_not_pass(tmp_path):
    """White noise with an artificial reference: no BLA, or a check that fails and says so."""
    r, u, y = data()
    other = np.random.default_rng(5).standard_normal(r.size)
    write(tmp_path / "rig" / "one", np.stack([other, u, y]))
    try:
        result = analyze(tmp_path / "rig")
    except InputError as error:
        assert "follow the reference beyond noise" in str(error)
    else:
        assert "checks failed" in headline(result)


def test_records_and_the_methods_of_multisines_do_not_meet(tmp_path):
    write(tmp_path / "rig" / "one", data())
    with pytest.raises(InputError, match="the robust method is for multisines"):
        analyze(tmp_path / "rig", method="robust")


def test_the_report_of_records_has_the_sensitivity_or_says_why_not(tmp_path):
    page = write_result(analyze(write(tmp_path / "r", data())), tmp_path / "out", figures=False)
    plots = Page(page.read_text("utf-8")).data()["levels"][0]
    assert {"bla", "coherence", "nyquist", "loop", "sensitivity"} < set(plots)
    silent = write(tmp_path / "uy", data(), "uy")
    page = write_result(analyze(silent), tmp_path / "without", figures=False)
    shown = Page(page.read_text("utf-8"))
    assert not {"sensitivity", "loop"} & set(shown.data()["levels"][0])
    assert "No sensitivity: no reference was recorded" in " ".join(shown.texts)


def test_how_many_frequencies_carry_an_estimate_is_told_and_a_few_are_no_response(tmp_path):
    write(tmp_path / "rig" / "one", data())
    result = analyze(tmp_path / "rig")
    (left,) = [check for check in result.checks if check.name == "lines_left"]
    assert left.passed and " frequencies carry an estimate, from 0." in left.sentence
    (level,) = result.levels
    few = level.bla.model_copy(update={"frequency_hz": level.bla.frequency_hz[:3]})
    left = _lines_left(level, few)
    assert not left.passed and left.sentence.startswith("level 0: 3 of ")
    assert "too few to be a response: excite more" in left.sentence


@pytest.mark.parametrize(
    ("turned", "said"),
    [
        ("", "the signs of torque, position and reference go together"),
        ("u", "the torque brakes the motion more than it drives it"),
        ("r", "the position goes against the reference"),
    ],
)
def test_a_wrong_sign_of_torque_or_reference_fails_a_check(tmp_path, turned, said):
    signs = [-1.0 if signal in turned else 1.0 for signal in "ruy"]
    record = data(kind="trapezoid") * np.array(signs)[:, None]
    write(tmp_path / "rig" / "one", record)
    (check,) = [c for c in analyze(tmp_path / "rig").checks if c.name == "signs"]
    assert check.passed is not bool(turned) and said in check.sentence
