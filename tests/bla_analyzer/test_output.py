from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest
import scipy.io
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from paths import DOCS
from pydantic import BaseModel
from synthetic_result import RATE, make_result, two_mass

from bla_analyzer import load_result, to_frd
from bla_analyzer.output import write_result
from bla_analyzer.results.findings import findings
from bla_analyzer.results.result import BlaEstimate, Comparison, LevelResult, LineLevels, Result
from bla_analyzer.results.summary import (
    bla_phase_deg,
    decibel,
    level_name,
    mean_level_db,
    phase_deg,
    signal_at,
    summarize,
    total_distortion,
)
from bla_analyzer.results.tables import UNITS, frf_csv, frf_mat, frf_npz
from fjr_kit.check import Check
from fjr_kit.errors import InputError
from fjr_kit.result_types import Array
from fjr_records.realization import TimeSignals


@pytest.fixture(scope="module")
def result() -> Result:
    return make_result()


def assert_same(a, b, where="result"):
    """Equal values, types, shapes and bits (NaN equals NaN)."""
    assert type(a) is type(b), where
    if isinstance(a, BaseModel):
        for name, value in a:
            assert_same(value, getattr(b, name), f"{where}.{name}")
    elif isinstance(a, np.ndarray):
        assert a.dtype == b.dtype and a.shape == b.shape, where
        assert np.array_equal(a, b, equal_nan=a.dtype.kind != "b"), where
    elif isinstance(a, tuple):
        assert len(a) == len(b), where
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            assert_same(x, y, f"{where}[{i}]")
    elif isinstance(a, float) and np.isnan(a):
        assert np.isnan(b), where
    else:
        assert a == b, where


def strict(text: str):
    def refuse(token):
        raise AssertionError(f"{token} is no JSON")

    return json.loads(text, parse_constant=refuse)


def changed(part, **changes):
    """A copy with other values, checked as any other."""
    return type(part)(**(dict(part) | changes))


def without_bla(result: Result) -> Result:
    return with_first_level(result, bla=None, comparisons=())


def with_first_level(result: Result, **changes) -> Result:
    level = changed(result.levels[0], **changes)
    return changed(result, levels=(level, *result.levels[1:]))


def test_result_json_gives_back_the_same_result(result):
    assert_same(Result.from_json(result.to_json(), "x"), result)


def of_type(model, lines=None, **fields):
    """Return a strategy for a result type: any value in each field, arrays of one length."""
    if lines is None:
        return st.integers(0, 5).flatmap(lambda lines: of_type(model, lines, **fields))
    for name, field in model.model_fields.items():
        if name in fields:
            continue
        [array] = [each for each in field.metadata if isinstance(each, Array)] or [None]
        if array is not None:
            elements = {float: NUMBERS, complex: st.builds(complex, NUMBERS, NUMBERS)}
            made = arrays(array.kind, lines, elements=elements.get(array.kind, st.booleans()))
        else:
            made = BY_TYPE.get(field.annotation)
        if made is not None:
            fields[name] = made
    return st.builds(model, **fields)


NUMBERS = st.floats(allow_nan=False) | st.just(np.nan)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]))
BY_TYPE = {float: NUMBERS, int: st.integers(), str: TEXTS, bool: st.booleans()}
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False),
    lambda inner: st.lists(inner) | st.dictionaries(TEXTS, inner),
    max_leaves=5,
)


def a_level(lines):
    return of_type(
        LevelResult,
        lines,
        bla=st.none() | of_type(BlaEstimate, lines),
        comparisons=st.lists(of_type(Comparison, lines), max_size=2).map(tuple),
        signals=of_type(TimeSignals),
        **{kind: of_type(LineLevels) for kind in ("excited", "odd", "even")},
    )


RESULTS = of_type(
    Result,
    0,
    bags=st.lists(TEXTS).map(tuple),
    notes=st.lists(TEXTS).map(tuple),
    levels=st.lists(st.integers(0, 5).flatmap(a_level), max_size=2).map(tuple),
    checks=st.lists(of_type(Check, 0, level=st.none() | st.integers()), max_size=3).map(tuple),
    controller=st.none() | st.dictionaries(TEXTS, PLAIN | TEXTS),
)


@given(RESULTS)
def test_any_result_is_read_back_bit_for_bit(made):
    text = made.to_json()
    back = Result.from_json(json.dumps(strict(text)), "x")
    assert_same(back, made)
    assert back.to_json() == text


@pytest.mark.parametrize("periods", [1, 2])
def test_unknown_and_infinite_numbers_survive(periods):
    first = Check(name="periodicity", passed=False, value=np.inf, limit=-np.inf, sentence="x")
    checks = (first, changed(first, level=0, realization=1, value=np.nan, limit=-0.0))
    made = make_result((7e-3,), periods=periods, checks=checks)
    back = Result.from_json(json.dumps(strict(made.to_json())), "x")
    assert_same(back, made)
    assert np.signbit(back.checks[1].limit)


def test_level_without_bla_and_empty_lines_survive(result):
    empty = changed(
        result.levels[0].odd,
        **{name: np.empty(0) for name in LineLevels.model_fields},
    )
    made = with_first_level(without_bla(result), odd=empty)
    made = changed(made, controller=None, notes=(), described=False)
    assert_same(Result.from_json(made.to_json(), "x"), made)


def test_every_array_of_result_json_carries_its_unit(result):
    arrays = []

    def walk(node, name):
        if isinstance(node, dict) and "unit" in node:
            arrays.append(name)
            assert node["unit"] == UNITS[name]
            assert set(node) in ({"unit", "values"}, {"unit", "re", "im"})
        elif isinstance(node, dict):
            for key, item in node.items():
                walk(item, key)
        elif isinstance(node, list):
            assert not any(isinstance(item, float | int) for item in node), name
            for item in node:
                walk(item, name)

    walk(strict(result.to_json()), "")
    assert "g0" in arrays and "amplitude_rad" in arrays and "torque_nm" in arrays


def test_every_number_and_array_of_a_level_has_a_unit(result):
    level = result.levels[0]
    for part in (level, level.bla, level.odd, level.signals, level.comparisons[0]):
        for name, value in part:
            if isinstance(value, float | int | np.ndarray):
                assert name in UNITS, name


@pytest.mark.parametrize(
    ("edit", "field"),
    [
        (lambda d: d.update(schema="fjr_rig/result/3"), "schema"),
        (lambda d: d.pop("periods"), "periods"),
        (lambda d: d["levels"][1]["bla"]["g"].update(unit="m"), "levels.1.bla.g.unit"),
        (lambda d: d["levels"][1]["bla"]["g"].pop("im"), "levels.1.bla.g.im"),
        (lambda d: d["levels"][0]["odd"]["noise"]["values"].append("1.5"), "levels.0.odd.noise"),
        (lambda d: d["levels"][0]["bla"].update(method="best"), "levels.0.bla.method"),
        (lambda d: d["checks"][0].update(passed="yes"), "checks.0.passed"),
    ],
)
def test_the_schema_refuses_what_is_not_a_result(result, edit, field):
    document = strict(result.to_json())
    edit(document)
    with pytest.raises(InputError) as refused:
        Result.from_json(json.dumps(document), "some/result.json")
    assert "some/result.json" in str(refused.value) and field in str(refused.value)
    assert "\n" not in str(refused.value)


def test_the_document_names_every_field_and_column(result):
    document = (DOCS / "result_schema.md").read_text("utf-8")
    [header, *_] = frf_csv(result).splitlines()
    columns = [c for c in header.split(",") if not c.startswith("G0_") and "var_" not in c]
    for name in (*UNITS, *Result.model_fields, *columns):
        assert f"`{name.replace('schema_name', 'schema')}`" in document, name


@pytest.mark.parametrize(
    ("where", "name"), [("bla", "radius_95"), ("odd", "noise"), ("signals", "torque_nm")]
)
def test_arrays_of_different_length_are_refused(result, where, name):
    document = strict(result.to_json())
    document["levels"][0][where][name]["values"].pop()
    with pytest.raises(InputError, match=rf"levels\.0\.{where}: {name} must hold"):
        Result.from_json(json.dumps(document), "x")
    document = strict(result.to_json())
    document["levels"][0]["comparisons"][0]["g0"]["im"].pop()
    with pytest.raises(InputError, match=r"levels\.0\.comparisons\.0\.g0: re and im must hold"):
        Result.from_json(json.dumps(document), "x")


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"schema": NaN}', b"\xff\xfe"])
def test_loading_what_is_no_result_gives_one_sentence(tmp_path, content):
    path = tmp_path / "result.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"result\.json"):
        load_result(path)


def test_loading_a_missing_file_gives_one_sentence(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        load_result(tmp_path / "absent.json")


def test_frf_csv_holds_the_bla_exactly(result):
    rows = list(csv.DictReader(io.StringIO(frf_csv(without_bla(result)))))
    level = result.levels[1]
    mine = [row for row in rows if row["level"] == "1"]
    assert {row["level"] for row in rows} == {"1", "2"}
    re, im = (np.array([float(row[f"g_{p}_rad_per_nm"]) for row in mine]) for p in ("re", "im"))
    assert np.array_equal(re + 1j * im, level.bla.g)
    for name, column in (("frequency_hz", "frequency_hz"), ("radius_95", "radius_95_rad_per_nm")):
        assert np.array_equal([float(row[column]) for row in mine], getattr(level.bla, name))
    g0 = np.array([float(row["G0_paper_im_rad_per_nm"]) for row in mine])
    assert np.array_equal(g0, level.comparisons[1].g0.imag)
    assert np.array_equal([row["reliable"] == "1" for row in mine], level.bla.reliable)


def test_frf_csv_says_nan_for_unknown_and_quotes_names():
    made = make_result((7e-3,), periods=1)
    odd = changed(made.levels[0].comparisons[0], name='a,"b"\nc')
    made = with_first_level(made, comparisons=(odd,))
    rows = list(csv.DictReader(io.StringIO(frf_csv(made))))
    assert all(row["var_noise_rad2_per_nm2"] == "NaN" for row in rows)
    assert float(rows[3]['a,"b"\nc_re_rad_per_nm']) == odd.g0[3].real


def test_frf_npz_holds_every_array_with_its_unit(result):
    loaded = np.load(io.BytesIO(frf_npz(result)), allow_pickle=False)
    units = json.loads(str(loaded["units"]))
    assert set(units) == set(loaded.files) - {"units"}
    assert np.array_equal(loaded["level1_bla_g"], result.levels[1].bla.g)
    assert units["level1_bla_g"] == "rad/(N m)" and units["level0_odd_noise"] == "rad"
    assert units["level2_comparisons_G0_paper_v_median"] == "dB^2"
    v = result.levels[2].comparisons[1].v_median
    assert loaded["level2_comparisons_G0_paper_v_median"] == v


def test_frf_mat_is_a_struct_array_over_levels(result):
    loaded = scipy.io.loadmat(io.BytesIO(frf_mat(without_bla(result))), simplify_cells=True)
    levels = loaded["result"]["level"]
    assert len(levels) == 3 and levels[0]["bla"].size == 0
    assert np.array_equal(levels[1]["bla"]["g"], result.levels[1].bla.g)
    assert levels[1]["comparisons"][1]["name"] == "G0_paper"
    assert loaded["result"]["controller"]["kind"] == "pd_filtered"
    assert loaded["units"]["g"] == "rad/(N m)"
    raw = scipy.io.loadmat(io.BytesIO(frf_mat(result)))["result"]["level"][0, 0]
    assert raw.shape == (1, 3) and raw["bla"][0, 1]["g"][0, 0].shape[1] == 1


def test_frd_of_python_control(result):
    control = pytest.importorskip("control", reason="python-control is not installed")
    frd = to_frd(result, 1)
    assert isinstance(frd, control.FrequencyResponseData)
    omega = 2 * np.pi * result.levels[1].bla.frequency_hz
    assert np.allclose(frd.omega, omega) and np.allclose(frd(1j * omega), result.levels[1].bla.g)


def test_frd_of_an_absent_level_is_refused(result):
    with pytest.raises(InputError, match="level 7 has no BLA; choose one of: 0, 1, 2"):
        to_frd(result, 7)
    with pytest.raises(InputError, match="level 0 has no BLA; choose one of: 1, 2"):
        to_frd(without_bla(result), 0)


def contents(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_write_result_makes_all_files_and_the_same_bytes_again(tmp_path):
    made = make_result((7e-3, 3e-2))
    said = []
    report = write_result(made, tmp_path / "a", progress=said.append)
    write_result(made, tmp_path / "deep" / "b")
    first = contents(tmp_path / "a")
    kinds = ("bla", "loop", "nyquist", "spectra", "distortion")
    figures = {f"figures/level_{i}_{n}" for i in (0, 1) for n in kinds}
    figures |= {"figures/levels", "figures/checks"}
    names = {f"{name}.{kind}" for name in figures for kind in ("png", "pdf")}
    names |= {"result.json", "frf.csv", "frf.npz", "frf.mat", "report.html"}
    assert set(first) == names
    assert report == tmp_path / "a" / "report.html" and "report.html" in said
    assert first == contents(tmp_path / "deep" / "b")
    assert all(data.startswith(b"\x89PNG") for n, data in first.items() if n.endswith("png"))
    assert all(data.startswith(b"%PDF") for n, data in first.items() if n.endswith("pdf"))
    assert_same(load_result(tmp_path / "a" / "result.json"), made)
    assert {path.name for path in tmp_path.iterdir()} == {"a", "deep"}


def test_an_earlier_analysis_is_replaced_and_other_files_stay(tmp_path):
    out = tmp_path / "out"
    write_result(make_result((1e-3, 7e-3)), out)
    (out / "mine.txt").write_text("keep")
    (out / "figures" / "sketch.svg").write_text("keep")
    write_result(make_result((7e-3,)), out, figures=False, report=False)
    assert set(contents(out)) == {
        "result.json",
        "frf.csv",
        "frf.npz",
        "frf.mat",
        "mine.txt",
        "figures/sketch.svg",
    }
    assert len(load_result(out / "result.json").levels) == 1


def test_a_failure_on_the_way_leaves_everything_as_it_was(tmp_path, monkeypatch):
    out = tmp_path / "out"
    write_result(make_result((1e-3,)), out, figures=False, report=False)
    before = contents(out)

    def fail(name):
        if name == "frf.mat":
            raise OSError(28, "No space left on device")

    with pytest.raises(InputError, match="No space left on device"):
        write_result(make_result((7e-3,)), out, progress=fail)
    assert contents(out) == before
    with pytest.raises(InputError):
        write_result(make_result((7e-3,)), tmp_path / "new", progress=fail)
    assert {path.name for path in tmp_path.iterdir()} == {"out"}


def test_a_file_in_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(InputError, match="is a file"):
        write_result(make_result((7e-3,)), tmp_path / "out")
    assert (tmp_path / "out").read_text() == "mine"


def test_figures_survive_hostile_names_and_missing_values(tmp_path):
    made = make_result((7e-3,), periods=1)
    odd = changed(made.levels[0].comparisons[0], name="$\\frac{$ <b>", v_mean=np.nan)
    made = with_first_level(made, comparisons=(odd,))
    unknown = Check(name="x$_{", level=0, passed=False, value=np.nan, limit=0.0, sentence="y")
    zero = changed(made.levels[0].even, corrected=np.zeros(len(made.levels[0].even.noise)))
    made = with_first_level(changed(made, checks=(unknown,)), even=zero)
    write_result(made, tmp_path / "a", report=False)
    write_result(without_bla(made), tmp_path / "b", report=False)
    assert (tmp_path / "a" / "figures" / "level_0_bla.pdf").exists()
    assert not (tmp_path / "b" / "figures" / "level_0_bla.pdf").exists()


def test_summary_numbers(result):
    level = result.levels[1]
    numbers = summarize(level)
    assert numbers.name == level_name(level) == "Level 1, 7 mrad"
    wide = changed(level, amplitude_rad=np.array([0.02, 1.824]))
    assert level_name(wide) == "Level 1, 0.02-1.82 rad"
    assert numbers.linear_db == pytest.approx(10 * np.log10(np.mean(level.excited.position**2)))
    assert numbers.odd_db > numbers.even_db + 10
    assert numbers.noise_db == pytest.approx(20 * np.log10(2e-5 / np.sqrt(2)))
    assert numbers.negative + numbers.significant <= numbers.lines
    assert any("Even distortion" in s and "at the level of noise" in s for s in findings(level))


def test_one_realization_is_not_compared_with_others(result):
    level = result.levels[1]
    doubtful = np.arange(len(level.bla.g)) < 3
    for realizations, says in ((7, "varies too much between realizations"), (1, "is too weak")):
        bla = changed(level.bla, realizations=realizations, reliable=~doubtful)
        [sentence] = [s for s in findings(changed(level, bla=bla)) if "unreliab" in s]
        assert sentence.startswith(f"3 lines unreliable: the torque {says}")


def test_distortion_of_all_lines_is_that_of_the_reliable_ones(result):
    level = result.levels[1]
    doubtful = np.arange(len(level.bla.g)) < 3
    coherence = np.where(doubtful, 1e-12, level.bla.coherence)
    known = mean_level_db(total_distortion(level)[~doubtful])
    weak = changed(level, bla=changed(level.bla, reliable=~doubtful, coherence=coherence))
    assert summarize(weak).total_db == pytest.approx(known)
    sure = changed(level, bla=changed(level.bla, coherence=coherence))
    assert summarize(sure).total_db > known + 100.0


def test_distortion_beyond_the_excited_lines_is_said_to_be_above_them(result):
    level = result.levels[1]
    weak = changed(level, bla=changed(level.bla, coherence=np.full_like(level.bla.coherence, 0.1)))
    [sentence] = [s for s in findings(weak) if s.startswith("Total distortion")]
    assert "dB above the excited lines" in sentence and "-" not in sentence
    [sentence] = [s for s in findings(level) if s.startswith("Total distortion")]
    assert "dB below the excited lines" in sentence


def test_decibel_of_nothing_is_unknown():
    assert np.isnan(decibel(np.array([0.0, np.nan]))).all() and decibel(10.0) == 20.0
    assert np.isnan(mean_level_db(np.empty(0)))


def test_phase_of_the_bla_stays_beside_the_model(result):
    level = result.levels[1]
    wild = level.bla.g.copy()
    wild[:4] *= np.exp(1j * np.array([2.0, -2.5, 3.0, 2.9]))
    bla = changed(level.bla, g=wild)
    phase = bla_phase_deg(level, bla)
    assert np.abs(phase[10:] - phase_deg(level.comparisons[0].g0)[10:]).max() < 45.0
    assert np.allclose(np.exp(1j * np.radians(phase)), wild / abs(wild))
    alone = changed(level, comparisons=())
    assert -270.0 < bla_phase_deg(alone, bla)[0] <= 90.0
    for ahead in (-0.1, 0.1):  # two masses and a spring about -180 degrees: motor, link
        turned = -np.exp(1j * (ahead + np.array([[0.0] * 9, [0.0] * 3 + [-np.pi] * 6])))
        turned[1, 3] *= np.exp(0.2j)
        motor, link = map(phase_deg, turned)
        np.testing.assert_allclose(motor[0], np.degrees(ahead) - 180.0)
        np.testing.assert_allclose(link[0], motor[0])
    assert np.isnan(phase_deg(np.full(3, np.nan + 0j))).all()


def test_round_off_of_the_reference_is_not_drawn(result):
    level = result.levels[1]
    lines = changed(level.odd, reference=np.geomspace(1e-19, 1e-5, len(level.odd.noise)))
    drawn = signal_at(level, lines, "reference")
    keep = lines.reference > 7e-13
    assert np.array_equal(np.isfinite(drawn), keep) and 0 < keep.sum() < keep.size
    assert signal_at(level, lines, "torque") is lines.torque


def test_the_synthetic_rig_is_the_two_mass_model(result):
    """The generator of these tests is right: its BLA lies near G0 within its own 95 % discs."""
    bla = result.levels[2].bla
    above = bla.frequency_hz > 20.0
    hit = abs(bla.g - two_mass(bla.frequency_hz)) < bla.radius_95
    assert hit[above].mean() > 0.85 and result.sample_rate_hz == RATE
