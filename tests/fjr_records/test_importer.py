"""Import of records: the same samples in SI from every format, or nothing but a sentence."""

from __future__ import annotations

import math
import re
import sys

import numpy as np
import pytest
from scipy.io import savemat

from bla_analyzer.analysis import analyze
from fjr_interface.bags.files import find_bags
from fjr_interface.bags.reader import LINEAR_AXIS, BagReader, audit
from fjr_interface.bags.signals import SignalMap
from fjr_kit.errors import InputError
from fjr_records.importers.import_map import Column, parse_harmonics, parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from fjr_records.importers.text import open_text
from fjr_records.periodic import read_experiment
from fjr_records.records import read_records

RATE_HZ = 500.0
N = 200
LINES = [1, 3, 7, 9, 13, 15, 19]
SI_MAP = ("reference=r", "torque=u", "position=y")


def record(seed: int = 0, amplitude: float = 0.01, periods: int = 4) -> dict[str, np.ndarray]:
    """Return r, u, y, q in SI of a loop with an inertia under P control, from rest."""
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(LINES))
    angle = 2 * np.pi * np.outer(np.arange(N * periods) / N, LINES)
    r = amplitude * np.cos(angle + phases).sum(axis=1)
    y, u = np.zeros((2, r.size))
    velocity = 0.0
    for k in range(r.size - 1):
        u[k] = 40.0 * (r[k] - y[k])
        velocity += (u[k] - 3.0 * velocity) / RATE_HZ / 0.05
        y[k + 1] = y[k] + velocity / RATE_HZ
    u[-1] = 40.0 * (r[-1] - y[-1])
    return {"r": r, "u": u, "y": y, "q": 0.9 * y}


def options(*specs: str, **changes) -> ImportOptions:
    return ImportOptions(
        **{"columns": parse_map(specs or SI_MAP), "sample_rate_hz": RATE_HZ, **changes}
    )


def write_csv(path, columns: dict[str, np.ndarray], delimiter: str = ",") -> None:
    header = delimiter.join(columns)
    rows = (
        delimiter.join(map(repr, row)) for row in np.stack(list(columns.values()), axis=1).tolist()
    )
    path.write_text("\n".join([header, *rows]) + "\n")


def read_back(folder) -> dict[str, np.ndarray]:
    sources = SignalMap.parse([])
    (block,) = BagReader(folder, sources).blocks(10**6)
    return {"r": block.reference, "u": block.torque, "y": block.position, "q": block.link}


def test_every_format_gives_the_same_bag(tmp_path):
    values = record()
    savemat(tmp_path / "flat.mat", {name: column[:, None] for name, column in values.items()})
    savemat(tmp_path / "nested.mat", {"log": {"enc": values, "rate": 500.0}})
    np.savez(tmp_path / "flat.npz", **values)
    np.savez(tmp_path / "matrix.npz", log=np.stack(list(values.values()), axis=1))
    write_csv(tmp_path / "comma.csv", values)
    write_csv(tmp_path / "tab.tsv", values, "\t")
    write_csv(
        tmp_path / "semicolon.txt",
        {f"# {n}" if n == "r" else f" {n} ": c for n, c in values.items()},
        ";",
    )
    names = {"nested.mat": "log.enc.{}", "matrix.npz": "log[{}]"}
    for file in sorted(p for p in tmp_path.iterdir()):
        name = names.get(file.name, "{}").format
        r, u, y, q = map(name, "0123" if file.name == "matrix.npz" else "ruyq")
        specs = (f"reference={r}", f"torque={u}", f"position={y}", f"link={q}")
        out = tmp_path / f"out_{file.name}"
        ((experiment, bag),) = import_files([file], out, options(*specs))
        audit(bag)
        back = read_back(bag)
        for symbol, expected in values.items():
            np.testing.assert_array_equal(back[symbol], expected, err_msg=file.name)
        assert experiment.excited_harmonics == LINES
        assert experiment.detection_harmonics == [5, 11, 17]
        assert (experiment.samples_per_period, experiment.periods) == (N, 3)
        assert experiment.amplitude_rad == 0.01
        assert BagReader(bag).experiment == experiment


def test_units_signs_and_time_column(tmp_path):
    values = record()
    time_us = 17.0 + np.arange(values["r"].size) * 1e6 / RATE_HZ
    np.savez(
        tmp_path / "rig.npz",
        r=values["r"] * 180 / np.pi,
        i=-values["u"] / 0.25,
        y=values["y"] * 1e3,
        q=-values["q"] / (2 * np.pi),
        t=time_us,
    )
    specs = ("reference=r:deg", "torque=-i:0.25", "position=y:mrad", "link=-q:rev", "time=t:us")
    ((experiment, bag),) = import_files(
        [tmp_path / "rig.npz"], tmp_path / "out", options(*specs, sample_rate_hz=None)
    )
    assert experiment.sample_rate_hz == RATE_HZ
    for symbol, got in read_back(bag).items():
        np.testing.assert_allclose(got, values[symbol], rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    ("text", "factor"),
    [
        ("c", 1.0),
        ("c:N m", 1.0),
        ("c:mNm", 1e-3),
        ("-c:kN m", -1e3),
        ("c:kN", 1e3),
        ("c:0.098", 0.098),
        ("c:-2", -2),
    ],
)
def test_torque_units(text, factor):
    by_factor = text[-1].isdigit()
    unit = "" if by_factor else text.partition(":")[2]
    assert Column.parse("torque", text) == Column("c", factor, by_factor, unit)


def test_degrees_taken_for_rad_are_refused_unless_a_factor_says_that_they_are_meant(tmp_path, run):
    values = record()
    np.savez(tmp_path / "rig.npz", **{**values, "y": np.degrees(values["y"])})
    words = ("--sample-rate-hz", RATE_HZ, "--map", "reference=r,torque=u")
    wrong = run("import", tmp_path / "rig.npz", "--out", tmp_path / "a", *words, "--map=position=y")
    assert wrong.exit_code == 2 and not (tmp_path / "a").exists()
    assert re.search(
        r"rig\.npz: the position is 28\.\d times the reference, as if it were in degrees and taken "
        r"for rad; give its unit, as in position=COLUMN:deg\.$",
        wrong.stderr.strip(),
    )
    meant = ("--out", tmp_path / "a", *words, "--map=position=y:1")
    assert "Warning: " in run("import", tmp_path / "rig.npz", *meant).stderr
    analysed = run("analyze", tmp_path / "a", "--method", "fast", "--out", tmp_path / "results")
    assert "1 of 6 checks failed" in analysed.stdout
    assert "y seems to be in degrees and taken for rad" in " ".join(analysed.stdout.split())
    right = ("--out", tmp_path / "b", *words, "--map=position=y:deg")
    assert run("import", tmp_path / "rig.npz", *right).stderr == ""


@pytest.mark.parametrize(
    ("per_rad", "says"),
    [(1e5, r"in counts of an encoder, .* position=COLUMN:FACTOR"),
     (4096 / 6.283, "COLUMN:mrad, or position=COLUMN:FACTOR if it counts encoder steps")],
)  # fmt: skip
def test_counts_of_an_encoder_taken_for_rad_are_refused(tmp_path, run, per_rad, says):
    values = record()
    np.savez(tmp_path / "rig.npz", **{**values, "y": np.round(2.0 * per_rad * values["y"])})
    words = ("--sample-rate-hz", RATE_HZ, "--map", "reference=r,torque=u,position=y")
    done = run("import", tmp_path / "rig.npz", "--out", tmp_path / "a", *words)
    assert done.exit_code == 2 and re.search(says, " ".join(done.stderr.split())), done.stderr


def test_a_linear_axis_is_told_by_its_units_and_every_result_says_so(tmp_path, run):
    values = record()
    values["y"], values["r"] = 1e3 * values["y"], 1e3 * values["r"]
    np.savez(tmp_path / "run.npz", **values)
    units = "reference=r:mm,torque=u:N,position=y:mm"
    out = tmp_path / "rig"
    done = run(
        "import", tmp_path / "run.npz", "--map", units, "--sample-rate-hz", RATE_HZ, "--out", out
    )  # fmt: skip
    assert done.exit_code == 0, done.stderr
    assert " m (y, times 0.001)" in done.stdout and " N (u, times 1)" in done.stdout
    assert " rad" not in done.stdout and "N m" not in done.stdout
    folder = read_experiment(out)
    assert folder.experiment.linear and LINEAR_AXIS in folder.notes
    assert LINEAR_AXIS in read_records(out).notes
    done = run("analyze", out, "--method", "fast", "--out", tmp_path / "analysis")
    assert LINEAR_AXIS in " ".join((done.stdout + done.stderr).split())


def test_levels_and_realizations(tmp_path):
    files = []
    for level, amplitude in enumerate((0.01, 0.03)):
        for realization in range(2):
            files.append(tmp_path / f"l{level}r{realization}.npz")
            np.savez(files[-1], **record(seed=10 * level + realization, amplitude=amplitude))
    out = tmp_path / "out"
    import_files(files, out, options(levels=2))
    assert [bag.name for bag in find_bags(out)] == [
        f"level_{level}_realization_00{realization}" for level in (0, 1) for realization in (0, 1)
    ]
    result = analyze(out)
    assert [level.amplitude_rad[0] for level in result.levels] == [0.01, 0.03]
    assert all(level.bla.realizations == 2 for level in result.levels)
    assert result.notes == ()
    with pytest.raises(InputError, match=r"l1r0\.npz: the amplitudes .* say how many levels"):
        import_files(files, tmp_path / "other", options())
    with pytest.raises(InputError, match="4 files cannot be 3 levels"):
        import_files(files, tmp_path / "other", options(levels=3))
    assert not (tmp_path / "other").exists()


def test_imported_frf_is_that_of_the_loop(tmp_path):
    """The analysis of an imported record gives the plant's exact discrete transfer function."""
    np.savez(tmp_path / "rig.npz", **record(periods=6))
    import_files([tmp_path / "rig.npz"], tmp_path / "out", options(transient_periods=4))
    bla = analyze(tmp_path / "out", method="fast").levels[0].bla
    z = np.exp(2j * np.pi * bla.frequency_hz / RATE_HZ)
    # v+ = v + h (u - 3 v) / J, y+ = y + h v+
    h, gain = 1 / RATE_HZ, 1 / RATE_HZ / 0.05
    g = h * gain * z / ((z - 1 + 3 * gain) * (z - 1))
    np.testing.assert_allclose(bla.g, g, rtol=1e-9)


def test_cut_last_sample_does_not_hide_the_period(tmp_path):
    values = record(periods=20)
    values["r"][-1] = 0.0
    np.savez(tmp_path / "rig.npz", **values)
    ((experiment, _),) = import_files([tmp_path / "rig.npz"], tmp_path / "out", options())
    assert experiment.samples_per_period == N
    assert experiment.excited_harmonics == LINES


def test_chosen_part_and_given_lines(tmp_path):
    values = record(periods=5)
    lead_in = {name: np.concatenate([np.zeros(30), c, c[:7]]) for name, c in values.items()}
    np.savez(tmp_path / "rig.npz", **lead_in)
    chosen = options(
        skip_samples=30,
        samples_per_period=N,
        transient_periods=2,
        periods=2,
        excited_harmonics=(1, 3, 7),
    )
    ((experiment, bag),) = import_files([tmp_path / "rig.npz"], tmp_path / "out", chosen)
    assert experiment.excited_harmonics == [1, 3, 7]
    np.testing.assert_array_equal(read_back(bag)["y"], values["y"][: 4 * N])


def test_one_amplitude_for_each_line_where_they_differ(tmp_path):
    values = record()
    values["r"] += 0.01 * np.cos(2 * np.pi * np.arange(values["r"].size) * 23 / N)
    values["r"] += 0.005 * np.cos(2 * np.pi * np.arange(values["r"].size) * 25 / N)
    np.savez(tmp_path / "rig.npz", **values)
    ((experiment, _),) = import_files([tmp_path / "rig.npz"], tmp_path / "out", options())
    assert experiment.amplitude_rad == pytest.approx([0.01] * 8 + [0.005], rel=1e-6)


def test_harmonics_text():
    assert parse_harmonics("13:21:4,30") == [13, 17, 21, 30]
    assert parse_harmonics("5:7") == [5, 6, 7]
    for bad in ("", "a", "3:1", "0", "1:9:0", "1:2:3:4", "1.5", "1:99999999999", "\u0661"):
        with pytest.raises(InputError, match=r"the harmonics .* are not understood"):
            parse_harmonics(bad)


@pytest.mark.parametrize(
    ("specs", "says"),
    [
        (("reference=r", "position=y"), "lacks torque; add torque=column"),
        ((), "lacks torque and position"),
        ((*SI_MAP, "torque=u"), "'torque=u' is not understood; give each of .* at most once"),
        ((*SI_MAP, "gain=v"), "'gain=v' is not understood"),
        (("torque=u", "velocity=v:rpm"), "a speed stands for an angle, as in position=v:rpm"),
        ((*SI_MAP, "q"), "'q' is not understood"),
        (
            (*SI_MAP[:2], "position=y", " left"),
            "with a comma in its name by its number, counted from",
        ),
        (
            (*SI_MAP[:2], "position=y: left"),
            "with a colon in its name by its number, counted from 0",
        ),
        (
            ("reference=r", "torque=u", "position=y:grad"),
            "one of the units rad, mrad, .*, or with a f",
        ),
        (("reference=r", "torque=u:rad", "position=y"), "one of the units N m, "),
        (("torque=u:N m", "position=y:mm"), "position in mm, as of a linear axis, and torque in N"),
        (("reference=r", "torque=u:0", "position=y"), "torque=u:0 is not understood"),
        (("reference=r", "torque=u:nan", "position=y"), "torque=u:nan is not understood"),
        (("reference=r", "torque=u:1e300", "position=y"), "torque=u:1e300 is not understood"),
        (("reference=r", "torque=u:\uff11", "position=y"), "is not understood"),
        (("reference=r", "torque=u", "position="), "position= is not understood"),
    ],
)
def test_bad_map(specs, says):
    with pytest.raises(InputError, match=says):
        parse_map(specs)


def spoiled(name: str, at: int, value: float) -> dict[str, np.ndarray]:
    values = record()
    values[name][at] = value
    return values


def stepped(*steps: int) -> dict[str, np.ndarray]:
    values = record()
    return values | {
        "t": np.cumsum([0, *steps, *[1] * (values["r"].size - 1 - len(steps))]) / RATE_HZ
    }


TIMED = (*SI_MAP, "time=t")


@pytest.mark.parametrize(
    ("values", "chosen", "says"),
    [
        (record(), options("reference=r", "torque=tau", "position=y"), "no tau; .* r, u, y, q"),
        (record(), options("reference=r", "torque=u[1]", "position=y"), "u is 800, so there is no"),
        ({**record(), "y": np.eye(5)}, options(), r"y is a matrix \(5 x 5\); name one .* y\[0\]"),
        ({**record(), "y": np.zeros(799)}, options(), "r has 800 samples, but y has 799"),
        ({**record(), "y": np.array(["a", "b"])}, options(), "y does not hold real numbers"),
        ({**record(), "y": np.zeros(800, complex)}, options(), "y does not hold real numbers"),
        (spoiled("u", 70, math.nan), options(), "u holds nan at sample 70; repair"),
        (spoiled("y", 3, -math.inf), options(), "y holds -inf at sample 3"),
        (spoiled("y", 3, 1e308), options(), r"y holds 1e\+308 at sample 3"),
        (spoiled("r", 3, -1e200), options(), r"r holds -1e\+200 at sample 3"),
        (record(), options(sample_rate_hz=None), r"give a sample rate of up to 1e\+06 Hz, or map"),
        (record(), options(sample_rate_hz=math.inf), r"give one above 0 and up to 1e\+06 Hz"),
        (stepped(1, 1, -2), options(*TIMED, sample_rate_hz=None), "goes back from 0.004 to 0 s"),
        ({**record(), "t": np.ones(800)}, options(*TIMED), "does not increase"),
        (stepped(), options(*TIMED, sample_rate_hz=400.0), "says 500 Hz, not 400 Hz"),
        (record(), options(sample_rate_hz=1e308), r"give one above 0 and up to 1e\+06 Hz"),
        (stepped(), options(*SI_MAP, "time=t:1e-12", sample_rate_hz=None), "correct its unit"),
        (record(), options(samples_per_period=160), "does not repeat after 160 samples"),
        (record(), options(samples_per_period=300), "no excited lines stand out"),
        (record(), options(transient_periods=4), "4 periods of 200, too few for 4 transient"),
        (record(), options(periods=4), "too few for 1 transient periods and 4 to keep"),
        (record(), options(skip_samples=800), "no samples are left"),
        ({**record(), "y": np.ones(800)}, options(), "the position is constant"),
        (record(), options(keep_samples=9), "9 samples are too few for a record"),
        ({**record(), "r": np.ones(800)}, options(samples_per_period=N), "reference is constant"),
        (record(), options(excited_harmonics=(1, 5)), "the reference is zero on harmonic 5"),
        (record(), options(excited_harmonics=(1, 100)), "harmonic 100 is not below half of 200"),
    ],
)  # fmt: skip
def test_bad_record_is_refused_and_nothing_is_written(tmp_path, values, chosen, says):
    file = tmp_path / "rig.npz"
    np.savez(file, **values)
    with pytest.raises(InputError, match=says) as refused:
        import_files([file], tmp_path / "out", chosen)
    sentence = str(refused.value)
    assert sentence.startswith(f"{file}: ") and sentence.endswith(".") and "\n" not in sentence
    assert [path.name for path in tmp_path.iterdir()] == ["rig.npz"]


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("rig.xyz", b"PK", r"suffix '.xyz'; it must be one of .mat, .npz, .csv"),
        ("rig.xlsx", b"PK", "files .xlsx are not read here; save its sheet as CSV"),
        ("rig.npz", b"PK\x03\x04 nothing", "is not a NPZ archive"),
        ("rig.npz", b"", "is not a NPZ archive"),
        ("rig.mat", b"MATLAB 5.0 MAT-file" + bytes(200), "is not a readable MAT file"),
        ("rig.mat", b"", "is not a readable MAT file"),
        ("rig.mat", b"MATLAB 7.3 MAT-file, Platform: GLNXA64", "is not a readable MATLAB 7.3 file"),
        ("rig.csv", b"", "there is no r; the file holds nothing"),
        ("rig.csv", b"\xff\xfe\x00", "is not a text file in UTF-8"),
        ("rig.csv", b"t,u,y\n1,2,3\n", "there is no r; the file holds t, u, y"),
        ("rig.csv", b"r,u,y,r\n1,2,3,4\n", "the column r is there 2 times"),
        ("rig.csv", b"r,u,y\n1,2,3\n4,x,6\n", "line 3: 'x' in column u is not a number"),
        ("rig.csv", b"r,u,y\n1,2,3\n4,5\n", "line 3 has 2 columns, not 3"),
        ("rig.csv", b"r,u,y\n", "holds no numbers below"),
    ],
)
def test_bad_file_is_refused(tmp_path, name, content, says):
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(InputError, match=says) as refused:
        import_files([file], tmp_path / "out", options())
    sentence = str(refused.value)
    assert sentence.startswith(f"{file}: ") and sentence.endswith(".") and "\n" not in sentence
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_without_its_library_a_file_of_matlab_7_3_is_refused(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    file = tmp_path / "rig.mat"
    file.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64")
    with pytest.raises(InputError, match=r"is a MATLAB 7.3 file.*install fjr-rig\[hdf5\]"):
        import_files([file], tmp_path / "out", options())


def test_files_must_belong_together_and_the_folder_be_new(tmp_path):
    np.savez(tmp_path / "a.npz", **record())
    np.savez(tmp_path / "b.npz", **record(seed=1, periods=5))
    files = [tmp_path / "a.npz", tmp_path / "b.npz"]
    with pytest.raises(InputError, match=r"a\.npz and .*b\.npz differ in .* number of periods"):
        import_files(files, tmp_path / "out", options(samples_per_period=N))
    with pytest.raises(InputError, match=r"c\.npz: there is no such file"):
        import_files([files[0], tmp_path / "c.npz"], tmp_path / "out", options())
    (tmp_path / "out").mkdir()
    with pytest.raises(InputError, match="out: exists already"):
        import_files(files[:1], tmp_path / "out", options())
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["a.npz", "b.npz", "out"]


def test_archive_of_a_few_bytes_that_stands_for_gigabytes_is_refused(tmp_path):
    zeros = np.zeros(2**22 + 1)
    np.savez_compressed(tmp_path / "bomb.npz", r=zeros, u=zeros, y=zeros)
    savemat(tmp_path / "bomb.mat", {"r": zeros, "u": zeros}, do_compression=True)
    savemat(tmp_path / "cell.mat", {"r": {"x": [zeros, zeros]}}, do_compression=True)
    np.savez(tmp_path / "bytes.npz", r=zeros.astype(np.uint8), u=zeros[:9], y=zeros[:9])
    for name in ("bomb.npz", "bomb.mat", "cell.mat"):
        with pytest.raises(InputError, match=rf"{name}: its \d+ bytes stand for .* write it again"):
            import_files([tmp_path / name], tmp_path / "out", options())
    with pytest.raises(InputError, match="they must be of one length"):
        import_files([tmp_path / "bytes.npz"], tmp_path / "out", options())


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (";" * 1_000_000, r"more than 100000 columns; a row is one sample, so turn the table\.$"),
        ('"' * 200_000, r"there is no r; the file holds "),
    ],
)
def test_one_line_that_is_no_row_of_a_record_ends_in_a_sentence(tmp_path, text, sentence):
    (tmp_path / "line.csv").write_text(text)
    with pytest.raises(InputError, match=sentence):
        import_files([tmp_path / "line.csv"], tmp_path / "out", options())
    assert not (tmp_path / "out").exists()


def test_a_quote_without_an_end_and_wide_gaps_hide_no_cell(tmp_path):
    """An inch mark opens nothing, and white space of any width is one gap."""
    gap = " " * 60_000
    rows = "\n".join(f"{k}{gap}{0.1 * k}{gap}{0.2 * k}" for k in range(3))
    (tmp_path / "wide.txt").write_text(f"r{gap}u{gap}y\n{rows}\n")
    (tmp_path / "inch.csv").write_text('r,"u,y\n0,0,0\n1,0.1,0.2\n2,0.2,0.4\n')
    wide, inch = (open_text(tmp_path / name) for name in ("wide.txt", "inch.csv"))
    assert wide.known == ["r", "u", "y"]
    assert wide.find("y").tolist() == [0.0, 0.2, 0.4]
    assert len(inch.known) == 3
    assert inch.find("y").tolist() == [0.0, 0.2, 0.4]


def test_many_columns_are_not_all_named(tmp_path):
    (tmp_path / "wide.csv").write_text(",".join(f"c{i}" for i in range(50_000)) + "\n1\n")
    with pytest.raises(InputError, match=r"there is no r; the file holds c0, .* and 49980 more\.$"):
        import_files([tmp_path / "wide.csv"], tmp_path / "out", options())
