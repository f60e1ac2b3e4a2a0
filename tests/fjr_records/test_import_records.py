"""Runs of any excitation: described as what they are, and never as what they are not."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fjr_interface.bags.files import find_bags
from fjr_interface.bags.reader import audit, read_record
from fjr_interface.bags.signals import SignalMap
from fjr_interface.experiment import Experiment, RecordDescription
from fjr_kit.errors import InputError
from fjr_records.importers import coherence
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files, read_files
from fjr_records.importers.record_file import ImportOptions

RATE_HZ = 500.0
N, LINES = 500, np.arange(1, 60, 2)
MAP = ("reference=r", "torque=u", "position=y")
TIMED = (*MAP, "time=t")


def options(*specs: str, **changes) -> ImportOptions:
    rate = None if "time=t" in specs else RATE_HZ
    return ImportOptions(**{"columns": parse_map(specs or MAP), "sample_rate_hz": rate, **changes})


def loop(r: np.ndarray, gain: float = 40.0, noise: float = 0.0) -> dict[str, np.ndarray]:
    """Return r, u, y of an inertia with viscous friction under P control, from rest."""
    y, u = np.zeros((2, r.size))
    v = np.random.default_rng(9).normal(size=r.size) * noise
    speed = position = 0.0
    for k in range(r.size):
        y[k] = position + v[k]
        u[k] = gain * (r[k] - y[k])
        speed += (u[k] - 3.0 * speed) / RATE_HZ / 0.05
        position += speed / RATE_HZ
    return {"r": r, "u": u, "y": y}


def noise_reference(seed: int = 0, samples: int = 3000) -> np.ndarray:
    return 0.1 * np.random.default_rng(seed).normal(size=samples)


def chirp(samples: int = 3000) -> np.ndarray:
    t = np.arange(samples) / RATE_HZ
    return 0.1 * np.sin(2 * np.pi * (0.5 * t + t**2))


def trapezoid(samples: int = 3000) -> np.ndarray:
    moves = np.interp(np.arange(samples), [200, 500, 900, 1000, 1800, 2500], [0, 1, 1, 0.4, 0.4, 2])
    return moves


def multisine(seed: int = 0, periods: int = 5, amplitude: float = 0.01) -> np.ndarray:
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, LINES.size)
    angle = 2 * np.pi * np.outer(np.arange(N * periods) / N, LINES)
    return amplitude * np.cos(angle + phases).sum(axis=1)


def save(folder: Path, name: str, values: dict[str, np.ndarray]) -> Path:
    np.savez(folder / f"{name}.npz", **values)
    return folder / f"{name}.npz"


@pytest.mark.parametrize("excitation", [noise_reference, chirp, trapezoid])
def test_what_does_not_repeat_is_a_record(tmp_path, excitation):
    values = loop(excitation())
    file = save(tmp_path, "rig", values)
    ((description, bag),) = import_files([file], tmp_path / "out", options())
    assert isinstance(description, RecordDescription)
    assert (description.sample_rate_hz, description.samples) == (RATE_HZ, 3000)
    assert description.controller is None and description.repeat_of is None
    audit(bag)
    back = read_record(bag)
    for symbol, found in zip("ruy", (back.reference, back.torque, back.position), strict=True):
        np.testing.assert_array_equal(found, values[symbol])


def test_a_run_without_reference(tmp_path):
    values = loop(chirp())
    file = save(tmp_path, "rig", values)
    ((description, bag),) = import_files([file], tmp_path / "out", options(*MAP[1:]))
    assert isinstance(description, RecordDescription)
    back = read_record(bag)
    assert back.reference is None
    np.testing.assert_array_equal(back.position, values["y"])


def test_white_noise_with_an_artificial_reference_is_not_taken_for_periodic(tmp_path, run):
    values = loop(noise_reference())
    values["r"] = np.tile(noise_reference(7, 500), 6)
    file = save(tmp_path, "rig", values)
    with pytest.raises(InputError, match="is that of another run"):
        read_files([file], options())
    values["r"] = multisine(periods=6)
    file = save(tmp_path, "rig", values)
    with pytest.raises(InputError, match="is that of another run"):
        read_files([file], options())
    with pytest.raises(InputError, match="repeats after 500 samples, but the position does not"):
        read_files([file], options(samples_per_period=N))
    shown = run("import", file, "--out", tmp_path / "out", "--sample-rate-hz", RATE_HZ,
                "--map", ",".join(MAP))  # fmt: skip
    assert shown.exit_code == 2 and not (tmp_path / "out").exists()


def test_trajectories_that_each_repeat_in_their_own_way_are_records_of_one_experiment(tmp_path):
    shapes = np.random.default_rng(5).uniform(0.2, 1.0, (2, 6))
    angle = 2 * np.pi * np.outer(np.arange(N * 5) / N, np.arange(1, 7))
    lengths = [multisine(), multisine(1, periods=6)]
    for number, references in enumerate((lengths, (0.1 * np.cos(angle) @ shapes.T).T)):
        names = [f"{number}_{letter}" for letter in "ab"]
        files = [save(tmp_path, n, loop(r)) for n, r in zip(names, references, strict=True)]
        understood = read_files(files, options())
        assert all(isinstance(each, RecordDescription) for each in understood.descriptions)
        (said,) = [note for note in understood.notes if "separate folders" in note]
        assert "differ in" in said and "taken as records that do not repeat" in said
        with pytest.raises(InputError, match=r"differ in .*; import them into separate folders"):
            read_files(files, options(samples_per_period=N))


def test_one_reference_at_two_amplitudes_is_refused_with_the_word_that_tells_levels(tmp_path):
    sizes = [("a", 0.01), ("b", 0.02)]
    files = [save(tmp_path, name, loop(multisine(amplitude=size))) for name, size in sizes]
    with pytest.raises(InputError, match="say how many levels the files hold"):
        read_files(files, options())
    assert all(isinstance(d, Experiment) for d in read_files(files, options(levels=2)).descriptions)


@pytest.mark.parametrize("excitation", [noise_reference, multisine])
def test_the_reference_of_another_run_is_refused(tmp_path, excitation):
    values = loop(excitation(0))
    file = save(tmp_path, "rig", {**values, "r": excitation(1)})
    with pytest.raises(InputError, match=r"rig\.npz: .* is that of another run; map the right one"):
        read_files([file], options())
    read_files([save(tmp_path, "rig", values)], options())


@pytest.mark.parametrize("size", [1e120, 1e-150])
def test_whether_a_reference_is_of_another_run_does_not_depend_on_its_size(size):
    signals = loop(noise_reference())
    other = {**signals, "r": noise_reference(seed=1)}
    assert coherence.unrelated(signals, None) is None
    said = coherence.unrelated(other, None)
    assert said is not None
    for each, expected in ((signals, None), (other, said)):
        sized = {symbol: values * size for symbol, values in each.items()}
        assert coherence.unrelated(sized, None) == expected


def test_repeats_are_told_from_new_realizations(tmp_path):
    runs = [noise_reference(0), noise_reference(1), noise_reference(0), noise_reference(0)]
    files = [save(tmp_path, f"run{n}", loop(r, noise=1e-4 * n)) for n, r in enumerate(runs[:3])]
    files.append(save(tmp_path, "other_gain", loop(runs[3], gain=25.0)))
    understood = read_files(files, options())
    assert [one.repeat_of for one in understood.descriptions] == [None, None, 0, None]
    assert [note for note in understood.notes if "other_gain.npz has the reference of" in note]
    periodic = [save(tmp_path, f"m{n}", loop(multisine(n % 2), noise=1e-5)) for n in range(3)]
    found = import_files(periodic, tmp_path / "out", options())
    assert [one.repeat_of for one, _ in found] == [None, None, 0]
    assert all(isinstance(one, Experiment) for one, _ in found)


def test_hum_on_one_line_is_named_and_no_reason_to_refuse(tmp_path):
    hum = 2e-4 * np.cos(2 * np.pi * 50.0 * np.arange(2500) / RATE_HZ)
    clean = loop(multisine(0))
    humming = loop(multisine(1))
    humming["r"] = humming["r"] + hum
    files = [save(tmp_path, "clean", clean), save(tmp_path, "humming", humming)]
    understood = read_files(files, options())
    assert understood.descriptions[0].excited_harmonics == LINES.tolist()
    assert understood.descriptions[1].excited_harmonics == LINES.tolist()
    notes = [*understood.records[1].notes, *understood.notes]
    assert [note for note in notes if "0.0002 rad on line 50 (50 Hz)" in note]


@pytest.mark.parametrize("hertz", [50.03, 149.96])
def test_hum_as_strong_as_a_line_is_not_taken_for_one(tmp_path, hertz):
    values = loop(multisine())
    t = np.arange(values["r"].size) / RATE_HZ
    values["r"] = values["r"] + 0.006 * np.sin(2 * np.pi * hertz * t)
    (record,) = read_files([save(tmp_path, "rig", values)], options()).records
    assert set(record.repetition.excited) == set(LINES)
    assert any("not counted as excited" in note for note in record.notes)


def test_one_line_of_another_size_is_named_and_another_level_refused(tmp_path):
    other = multisine(1) + 0.004 * np.cos(2 * np.pi * 7 * np.arange(2500) / N)
    files = [save(tmp_path, f"run{n}", loop(r)) for n, r in enumerate(
        [multisine(0), other, multisine(2)])]  # fmt: skip
    understood = read_files(files, options())
    assert [n for n in understood.notes if n.startswith("run1.npz: line 7 (7 Hz) has ")]
    louder = save(tmp_path, "louder", loop(multisine(3, amplitude=0.03)))
    with pytest.raises(InputError, match=r"louder\.npz: the amplitudes .* say how many levels"):
        read_files([files[0], louder], options())


def test_a_period_that_is_stored_once_is_repeated_on_request(tmp_path):
    values = loop(multisine())
    file = save(tmp_path, "rig", {**values, "r": values["r"][:N]})
    with pytest.raises(InputError, match="--repeat-reference plays a single period"):
        read_files([file], options())
    understood = read_files([file], options(repeat_reference=True))
    np.testing.assert_allclose(understood.records[0].signals["r"], values["r"], atol=1e-12)
    assert isinstance(understood.descriptions[0], Experiment)


def sampled(t: np.ndarray) -> dict[str, np.ndarray]:
    """Return signals that are known between samples, at instants t."""
    r = 0.5 * np.sin(2 * np.pi * 1.3 * t) + 0.2 * np.sin(2 * np.pi * 3.1 * t + t**2)
    return {"r": r, "u": 3.0 * r, "y": 0.9 * r, "t": t}


TIMES = {
    "jitter": (lambda g: np.arange(2000) / 500 + g.uniform(-1e-4, 1e-4, 2000), "resampled from"),
    "lost": (lambda g: np.delete(np.arange(2000) / 500, [400, 1300]), "2 of 2000 samples lost"),
    "wandering": (lambda g: np.cumsum(g.uniform(0.0015, 0.0026, 2000)), "joined by straight lines"),
    "coarse": (lambda g: np.round(np.arange(2000) / 430, 3), "are rounded to 0.001 s"),
    "repeated": (lambda g: np.floor(np.arange(2000) / 4) * 0.008, "rounded|repeat the stamp"),
}


@pytest.mark.parametrize("kind", TIMES)
def test_uneven_stamps_are_resampled_and_the_error_is_stated(tmp_path, kind):
    make, says = TIMES[kind]
    stamps = make(np.random.default_rng(4))
    even = {"coarse": np.arange(2000) / 430, "repeated": np.arange(2000) / 500}
    values = sampled(even.get(kind, stamps))
    understood = read_files([save(tmp_path, "rig", {**values, "t": stamps})], options(*TIMED))
    (record,) = understood.records
    assert any(re.search(says, note) for note in record.notes), record.notes
    grid = stamps[0] + np.arange(record.samples) / record.sample_rate_hz
    inner = slice(40, -40)
    expected = sampled(grid)["y"][inner]
    error = np.std(record.signals["y"][inner] - expected) / np.std(expected)
    assert error < (0.05 if kind == "repeated" else 2e-3)


@pytest.mark.parametrize("jitter", [0.0, 1e-4])
def test_a_long_gap_is_not_bridged_but_ends_the_part_that_is_kept(tmp_path, jitter):
    stamps = np.delete(np.arange(3000) / 500, slice(900, 1400))
    stamps = stamps + jitter * np.random.default_rng(4).uniform(-1, 1, stamps.size)
    (record,) = read_files([save(tmp_path, "rig", sampled(stamps))], options(*TIMED)).records
    assert record.sample_rate_hz == 500.0 and 1590 < record.samples <= 1600
    assert "samples 900 to 2499 of 2500" in record.notes[0]
    assert record.timing.gaps == 1 and 0.9 < record.timing.longest_gap_s < 1.1
    expected = sampled(stamps[900] + np.arange(record.samples) / 500)["y"]
    assert np.std((record.signals["y"] - expected)[40:-40]) < 2e-3 * np.std(expected)


def test_a_logger_that_writes_in_bursts_is_not_cut_at_each_of_them(tmp_path):
    stamps = (0.02 * np.arange(400)[:, None] + 1e-4 * np.arange(10)).ravel()
    (record,) = read_files([save(tmp_path, "rig", sampled(stamps))], options(*TIMED)).records
    assert record.samples / record.sample_rate_hz == pytest.approx(8.0, abs=0.1)


@pytest.mark.parametrize("times", [1e3, 1e6, 1e9])
def test_a_time_that_is_not_in_seconds_is_refused_unless_a_factor_says_that_it_is(tmp_path, times):
    even = np.arange(2000) / 500
    file = save(tmp_path, "rig", {**sampled(even), "t": even * times})
    with pytest.raises(InputError, match=r"as if it were in ms, us or ns .* time=COLUMN:ms"):
        read_files([file], options(*TIMED))
    with pytest.raises(InputError, match=r"give its unit|are no record"):
        read_files([file], ImportOptions(parse_map([*MAP, "time=t:1e9"])))
    right = {1e3: "ms", 1e6: "us", 1e9: "ns"}[times]
    for unit in (right, f"{1 / times:g}"):
        (record,) = read_files([file], ImportOptions(parse_map([*MAP, f"time=t:{unit}"]))).records
        assert record.sample_rate_hz == pytest.approx(500.0)


def test_slow_samples_are_taken_where_a_factor_says_that_they_are_meant(tmp_path):
    even = np.arange(2000) / 500
    file = save(tmp_path, "rig", {**sampled(even), "t": even * 1e3})
    (record,) = read_files([file], ImportOptions(parse_map([*MAP, "time=t:1"]))).records
    assert record.sample_rate_hz == pytest.approx(0.5)


def test_a_torque_that_never_changes_is_doubted(tmp_path):
    values = {**loop(chirp()), "u": np.full(3000, 2.0)}
    (record,) = read_files([save(tmp_path, "rig", values)], options()).records
    assert any("the torque is constant" in doubt for doubt in record.doubts)


def test_uneven_files_come_onto_one_grid(tmp_path):
    generator = np.random.default_rng(5)
    files = [
        save(tmp_path, f"run{n}", sampled(np.cumsum(generator.uniform(0.8, 1.2, 1500) / rate)))
        for n, rate in enumerate((200.0, 300.0))
    ]
    understood = read_files(files, options(*TIMED))
    rates = {record.sample_rate_hz for record in understood.records}
    assert len(rates) == 1 and 190 < rates.pop() < 210
    given = read_files(files, options(*TIMED, sample_rate_hz=250.0))
    assert {record.sample_rate_hz for record in given.records} == {250.0}


def test_a_word_that_lost_its_sign(tmp_path):
    values = loop(chirp())
    counts = np.round(values["u"] * 100)
    file = save(tmp_path, "rig", {**values, "u": np.where(counts < 0, counts + 65536, counts)})
    (record,) = read_files([file], options("torque=u:0.01", *MAP[::2])).records
    np.testing.assert_allclose(record.signals["u"], values["u"], atol=0.006)
    assert any("torque is a 16-bit word" in note for note in record.notes)


def test_a_controller_is_described_and_a_wrong_one_refused(tmp_path):
    file = save(tmp_path, "rig", loop(chirp()))
    right, wrong, partly = (tmp_path / f"{name}.yaml" for name in ("right", "wrong", "partly"))
    right.write_text("kind: pid\np: 40\n")
    wrong.write_text("kind: pid\np: 8\n")
    partly.write_text("kind: pid\np: unknown\n")
    (one,) = read_files([file], options(controllers=(right,))).descriptions
    assert one.controller["kind"] == "transfer_function"
    assert one.controller["numerator"] == [40.0]
    with pytest.raises(InputError, match=r"wrong\.yaml: this controller gives a torque that diff"):
        read_files([file], options(controllers=(wrong,)))
    (one,) = read_files([file], options(controllers=(partly,))).descriptions
    assert one.controller == {"kind": "pid", "p": None, "unknown": ["p"]}
    with pytest.raises(InputError, match="2 controllers are given for 1 files"):
        read_files([file], options(controllers=(right, wrong)))


def test_pushes_in_one_file_of_a_controller_are_told_and_not_refused(tmp_path):
    alone, law = loop(chirp()), tmp_path / "law.yaml"
    law.write_text("kind: pid\np: 40\n")
    pushes = np.where(np.arange(alone["u"].size) % 400 < 200, 2.0, 0.0) * np.std(alone["u"])
    pushed = save(tmp_path, "pushed", {**alone, "u": alone["u"] + pushes})
    with pytest.raises(InputError, match=r"law\.yaml: .* differs by \d+% from that in .*pushed"):
        read_files([pushed], options(controllers=(law,)))
    both = read_files([save(tmp_path, "alone", alone), pushed], options(controllers=(law,)))
    told = [note for note in both.notes if "differs by" in note]
    assert len(told) == 1 and "pushed" in told[0]
    still = save(tmp_path, "still", {**alone, "u": np.ones(alone["u"].size)})
    with pytest.raises(InputError, match=r"from that in .*pushed"):  # a constant says nothing of it
        read_files([still, pushed], options(controllers=(law,)))


def test_dry_run_shows_what_is_understood_and_writes_nothing(tmp_path, run):
    files = [save(tmp_path, f"run{n}", loop(multisine(n // 2), noise=1e-5)) for n in range(3)]
    words = ("--sample-rate-hz", RATE_HZ, "--map", ",".join(MAP))
    shown = run("import", *files, *words, "--dry-run")
    assert shown.exit_code == 0 and shown.stderr == ""
    for expected in (
        "run0.npz: level 0, realization 0: 5 s at 500 Hz, 2500 samples",
        "every 500 samples (1 s): 1 transient and 4 kept periods, 30 excited lines from 1 to 59 Hz",
        "3 runs at 1 level, 1 of them repeating another, described as a periodic multisine",
        "realization 1 repeats 0",
        "controller: unknown",
        "Nothing was written.",
    ):
        assert expected in shown.stdout
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run0.npz", "run1.npz", "run2.npz"]
    refused = run("import", *files, *words)
    assert refused.exit_code == 2 and "name the experiment folder with --out" in refused.stderr
    written = run("import", *files, *words, "--out", tmp_path / "out")
    assert f"Next: fjr analyze {tmp_path / 'out'}" in written.stdout
    assert len(find_bags(tmp_path / "out")) == 3


def test_a_megabyte_costs_at_most_half_a_gigabyte(tmp_path):
    text = "0,1\n" * 2**18
    (tmp_path / "rig.csv").write_text(text)
    (tmp_path / "rig.json").write_text("[" + "[1,2]," * 170_000 + "[1,2]]")
    for name in ("rig.csv", "rig.json"):
        child = (
            "import sys\n"
            "from fjr_records.importers.columns import read_columns\n"
            "read_columns(sys.argv[1], [sys.argv[2]])\n"
            "status = dict(line.split(':', 1) for line in open('/proc/self/status'))\n"
            "assert int(status['VmHWM'].split()[0]) < 2**19, status['VmHWM']\n"
        )
        column = "1" if name.endswith("csv") else "[1]"
        words = [sys.executable, "-c", child, str(tmp_path / name), column]
        subprocess.run(words, check=True)


VALUES = st.sampled_from([0.0, 1.0, -1.0, 1e-300, 1e99, -1e99, 0.1, 3.0, 1e9, 40000.0])


@settings(max_examples=200)
@given(data=st.data())
def test_whatever_the_columns_hold_they_are_described_or_refused(tmp_path_factory, data):
    size = data.draw(st.integers(1, 400))
    generator = np.random.default_rng(data.draw(st.integers(0, 5)))
    kinds = {
        "walk": lambda: np.cumsum(generator.normal(size=size)),
        "noise": lambda: generator.normal(size=size),
        "even": lambda: np.arange(size) / 100.0,
        "uneven": lambda: np.cumsum(generator.exponential(size=size)) / 100.0,
        "periodic": lambda: np.sin(2 * np.pi * np.arange(size) / 20),
        "constant": lambda: np.ones(size),
    }
    values = {}
    for name in "ruyt":
        values[name] = kinds[data.draw(st.sampled_from(sorted(kinds)))]()
        for at in data.draw(st.lists(st.integers(0, size - 1), max_size=3)):
            values[name][at] = data.draw(VALUES)
        values[name] *= data.draw(st.sampled_from([1.0, 1.0, 1e-200, 1e6, 1e90]))
    file = save(tmp_path_factory.getbasetemp(), "fuzzed", values)
    specs = [*MAP, *data.draw(st.sampled_from([[], ["time=t"]]))]
    specs = specs[data.draw(st.integers(0, 1)) :]
    rate = data.draw(st.sampled_from([None, 100.0, 1e-3, 1e6]))
    n = data.draw(st.sampled_from([None, 2, 20, 1000]))
    try:
        chosen = options(*specs, sample_rate_hz=rate, samples_per_period=n)
        (record,) = read_files([file], chosen).records
    except InputError as refused:
        assert "\n" not in str(refused) and str(file) in str(refused)
    else:
        assert all(np.isfinite(each).all() for each in record.signals.values())


@pytest.mark.parametrize("quantity", ["reference", "position"])
def test_an_angle_in_degrees_that_is_taken_for_rad_is_refused(tmp_path, quantity):
    values = loop(trapezoid())
    symbol = {"reference": "r", "position": "y"}[quantity]
    file = save(tmp_path, "rig", {**values, symbol: np.degrees(values[symbol])})
    with pytest.raises(InputError, match=f"the {quantity} is .* as in {quantity}=COLUMN:deg"):
        read_files([file], options())
    in_degrees = [f"{spec}:deg" if spec.startswith(quantity) else spec for spec in MAP]
    assert read_files([file], options(*in_degrees)).records[0].doubts == ()


def test_without_a_map_a_file_says_what_it_holds_and_nothing_is_written(tmp_path, run):
    file = tmp_path / "run.csv"
    file.write_text("t,cmd,enc\n0.0,1.5,2.0\n0.1,-1.5,3.0\n")
    done = run("import", file)
    assert done.exit_code == 0 and [path.name for path in tmp_path.iterdir()] == ["run.csv"]
    assert re.search(r"cmd +2  from -1.5 to 1.5", done.output) and "--map" in done.output
    done = run("import", file, "--out", tmp_path / "rig")
    assert done.exit_code == 2 and "--map is missing" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]


def test_an_angle_that_wraps_and_a_torque_of_the_wrong_sign_are_told(tmp_path, run):
    time = np.arange(4000) / 500.0
    angle = 9.0 * np.sin(0.8 * time) + 2.5 * time
    speed = np.gradient(angle, time)
    torque = -(np.gradient(speed, time) + speed)
    rows = np.array([time, np.degrees(np.mod(angle, 2.0 * np.pi)), torque]).T
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header="t,q,u", comments="")
    mapped = ("--map", "position=q:deg,torque=u,time=t", "--out", tmp_path / "rig")
    done = run("import", tmp_path / "run.csv", *mapped)
    assert done.exit_code == 0 and "turns were added" in done.output
    assert "the torque brakes the motion" in done.stderr
    (bag,) = find_bags(tmp_path / "rig")
    position = read_record(bag, SignalMap.parse(["reference=none"])).position
    assert np.abs(position - angle - (position - angle)[0]).max() < 1e-9
