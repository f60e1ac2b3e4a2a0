"""The `fjr` command: what a user sees of its commands and of its failures."""

from __future__ import annotations

import errno
import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from fjr_cli.cli_errors import reports_errors
from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import Experiment
from fjr_interface.parameter_file import save_parameter_file
from fjr_kit.errors import InputError
from fjr_sim_node.plant import PLANT
from fjr_sim_node.theory.linear import g0

RATE_HZ, N, LINES = 1000.0, 500, [1, 3, 5, 9, 11, 15, 17]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two realizations whose position follows the torque exactly by the paper's viscous G0."""
    folder = tmp_path_factory.mktemp("experiment")
    frequency = np.arange(N // 2 + 1) * RATE_HZ / N
    g = np.zeros(frequency.size, complex)
    g[LINES] = g0(PLANT.defaults(), frequency[LINES], RATE_HZ)
    rng = np.random.default_rng(5)
    for realization in range(2):
        spectrum = np.zeros(frequency.size, complex)
        spectrum[LINES] = 0.01 * np.exp(2j * np.pi * rng.random(len(LINES)))
        r, u, y = (
            np.tile(np.fft.irfft(s, N) * N / 2, 3)
            for s in (spectrum, 50 * spectrum, 50 * g * spectrum)
        )
        experiment = Experiment(
            sample_rate_hz=RATE_HZ,
            samples_per_period=N,
            periods=2,
            transient_periods=1,
            realization=realization,
            realizations=2,
            amplitude_rad=0.01,
            excited_harmonics=LINES,
            detection_harmonics=[7, 13],
        )
        noise = 1e-9 * rng.standard_normal((2, r.size))
        with BagWriter(folder / f"r{realization}", experiment) as bag:
            bag.write_arrays(r=r, u=u + noise[0], y=y + noise[1])
    return folder


def test_help_names_every_command_without_importing_numpy():
    code = (
        "import sys\n"
        "from fjr_cli.app import main\n"
        "sys.argv = ['fjr', '--help']\n"
        "try:\n    main()\n"
        "finally:\n    print(sorted({'numpy', 'scipy', 'numba', 'rclpy'} & set(sys.modules)))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {"analyze", "import"} <= set(re.findall(r"[a-z]+", done.stdout))
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize(("asked", "given"), [({}, "1"), ({"OMP_NUM_THREADS": "3"}, "3")])
def test_blas_has_one_thread_unless_the_environment_asks_for_more(asked, given):
    code = (
        "import atexit, os, sys; sys.argv = ['fjr', '--version']; "
        "atexit.register(lambda: print(os.environ['OMP_NUM_THREADS'])); "
        "from fjr_cli.app import main; main()"
    )
    own = {n: v for n, v in os.environ.items() if n != "OMP_NUM_THREADS"} | asked
    done = subprocess.run([sys.executable, "-c", code], env=own, capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.splitlines()[-1] == given


def test_help_breaks_its_paragraphs_at_the_width_of_the_terminal(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    said = run("simulate", "--help").stdout.split("Options")[0].splitlines()
    paragraph = [line.strip() for line in said if line.strip()][3:-1]
    assert paragraph[0].startswith("With --record") and len(paragraph) > 2
    following = [line.split()[0] for line in paragraph[1:]]
    for line, word in zip(paragraph, following, strict=False):
        assert len(line) + 1 + len(word) > 78, line


def test_analyze_prints_numbers_and_the_report_last(run, folder, tmp_path):
    out = tmp_path / "results"
    done = run("analyze", folder, "--out", out)
    assert done.exit_code == 0, done.output
    assert done.stdout.splitlines()[-1] == str(out / "report.html")
    assert (out / "report.html").stat().st_size > 0
    row = re.search(r"0, 10 mrad +7 .* (\S+) +(\S+)\s", done.stdout)
    viscous, paper = float(row[1]), float(row[2])
    assert viscous < 1e-6 and paper > 1.0
    result = json.loads((out / "result.json").read_text())
    names = [comparison["name"] for comparison in result["levels"][0]["comparisons"]]
    assert names == ["G0_viscous", "G0_paper"]
    assert "All" in done.stdout and "checks passed" in done.stdout


def test_results_stand_beside_the_bags_by_default(run, folder):
    beside = run("analyze", folder)
    assert beside.exit_code == 0, beside.output
    assert beside.stdout.splitlines()[-1] == str(folder / "analysis/report.html")
    bag = run("analyze", folder / "r0", "--method", "fast")
    assert bag.stdout.splitlines()[-1] == str(folder / "r0-analysis/report.html")
    assert run("analyze", folder, "--no-report").exit_code == 0  # what lies there now is no bag


def test_nominal_none_and_file(run, folder, tmp_path):
    command = ("analyze", folder, "--no-report", "--out")
    none = run(*command, tmp_path / "a", "--nominal", "none")
    assert none.exit_code == 0 and " viscous " not in none.stdout
    rig = tmp_path / "rig.yaml"
    save_parameter_file(rig, {"simulator": {"k0": 3000.0, "substeps": 4}})
    other = run(*command, tmp_path / "b", "--nominal", rig)
    assert other.exit_code == 0, other.output
    result = json.loads((tmp_path / "b/result.json").read_text())
    viscous = result["levels"][0]["comparisons"][0]
    assert viscous["v_mean"] > 1.0 and str(rig) in viscous["description"]
    rig.write_text("/rig/simulator: {ros__parameters: {k0: -1.0}}")
    bad = run(*command, tmp_path / "c", "--nominal", rig)
    assert bad.exit_code == 2 and bad.stderr.startswith(f"{rig}: k0 must lie in")
    assert not (tmp_path / "c").exists()


def test_imported_records_are_compared_with_nothing_unless_asked(run, folder, tmp_path):
    rng = np.random.default_rng(0)
    period = np.cos(2 * np.pi * np.outer(np.arange(N) / N, LINES) + rng.random(7)).sum(axis=1)
    np.savez(tmp_path / "rig.npz", r=np.tile(period, 3), u=np.tile(period, 3), y=np.tile(period, 3))
    done = run(
        *("import", tmp_path / "rig.npz", "--out", tmp_path / "out", "--sample-rate-hz", 1000),
        *("--map", "reference=r, torque=u", "--map", "position=y:mrad"),
    )
    assert done.exit_code == 0, done.output
    assert "the reference is 1e+03 times the position" in done.stderr
    assert (
        "every 500 samples (0.5 s): 1 transient and 2 kept periods, 7 excited lines" in done.stdout
    )
    assert done.stdout.splitlines()[-1] == str(tmp_path / "out")
    analyze = ("analyze", tmp_path / "out", "--method", "fast", "--no-report")
    foreign = run(*analyze)
    assert foreign.exit_code == 0 and " viscous " not in foreign.stdout
    asked = run(*analyze, "--nominal", "paper")
    assert asked.exit_code == 0 and " viscous " in asked.stdout


def test_override_and_map_reach_the_analysis(run, folder, tmp_path):
    command = ("analyze", folder, "--method", "fast", "--out", tmp_path / "out")
    done = run(*command, "--transient-periods", 0, "--periods", 3, "--map", "reference=none")
    assert done.exit_code == 0, done.output
    result = json.loads((tmp_path / "out/result.json").read_text())
    assert (result["transient_periods"], result["periods"]) == (0, 3)
    assert "Note: No reference is read" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("analyze", "/nonexistent"), "/nonexistent: is not a readable folder"),
        (("analyze", "{folder}", "--map", "speed=/x"), "signal map 'speed=/x' is not understood"),
        (("analyze", "{folder}", "--nominal", "/no.yaml"), "/no.yaml: cannot be read"),
        (("analyze", "{folder}", "--samples-per-period", "100"), "contradicts the description"),
        (
            ("import", "/no.csv", "--out", "{folder}/new", "--map", "reference=r"),
            "the map lacks torque",
        ),
    ],
)
def test_bad_input_is_one_sentence_and_status_2(run, folder, arguments, says):
    done = run(*(argument.format(folder=folder) for argument in arguments))
    assert done.exit_code == 2
    assert says in done.stderr and done.stderr.count("\n") == 1 and done.stdout == ""


def test_bad_options_are_status_2(run):
    assert run("analyze").exit_code == 2
    assert run("analyze", "x", "--method", "slow").exit_code == 2
    assert run("nothing").exit_code == 2


def failing(error: BaseException) -> typer.Typer:
    application = typer.Typer()

    @application.command()
    @reports_errors(kept="finished bags are kept")
    def command() -> None:
        raise error

    return application


def test_ctrl_c_says_what_is_kept():
    done = CliRunner().invoke(failing(KeyboardInterrupt()))
    assert (done.exit_code, done.stderr) == (130, "Interrupted: finished bags are kept.\n")


def test_bad_input_and_exit_are_no_error_of_ours():
    done = CliRunner().invoke(failing(InputError("rig.yaml: k0 must be a number.")))
    assert (done.exit_code, done.stderr) == (2, "rig.yaml: k0 must be a number.\n")
    assert CliRunner().invoke(failing(typer.Exit(7))).exit_code == 7


def wrapped(cause: BaseException) -> RuntimeError:
    """Return an error of a compiler, say, that says what low memory did to it."""
    error = RuntimeError("Failed in nopython mode pipeline (step: native lowering)\nTraceback ...")
    error.__cause__ = cause
    return error


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        wrapped(MemoryError("out of pages")),
        OSError(errno.ENOMEM, "Cannot allocate memory"),
        wrapped(RuntimeError("can't start new thread")),
        ImportError("libgfortran.so.5: failed to map segment from shared object"),
    ],
)
def test_low_memory_is_one_sentence_whoever_met_it(error, monkeypatch):
    monkeypatch.delenv("FJR_DEBUG", raising=False)
    done = CliRunner().invoke(failing(error))
    assert done.exit_code == 1 and done.stderr.count("\n") == 1
    assert done.stderr.startswith("The memory is not enough, or a process of fjr was killed for it")


def test_ctrl_c_that_a_lock_turns_into_its_own_error_is_an_interruption(monkeypatch):
    monkeypatch.delenv("FJR_DEBUG", raising=False)
    error = RuntimeError("release unlocked lock")
    error.__context__ = KeyboardInterrupt()
    done = CliRunner().invoke(failing(error))
    assert done.exit_code == 130 and done.stderr == "Interrupted: finished bags are kept.\n"


def test_too_low_a_limit_of_memory_is_told_before_anything_begins(tmp_path):
    """OpenBLAS would wait for ever for memory as it is loaded."""
    out = tmp_path / "bags"
    command = f"ulimit -v 450000; exec {sys.executable} -m fjr_cli simulate --out {out}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and not out.exists()
    assert done.stderr.startswith("A process may take 439 MiB of memory here (ulimit -v), and fjr ")
    assert done.stderr.count("\n") == 1


def test_unexpected_error_names_a_log_with_the_traceback(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.delenv("FJR_DEBUG", raising=False)
    done = CliRunner().invoke(failing(ZeroDivisionError("division\nby zero")))
    (log,) = tmp_path.iterdir()
    assert done.exit_code == 1
    assert done.stderr == (
        "fjr failed unexpectedly (ZeroDivisionError: division by zero); "
        f"the traceback is in {log}.\n"
    )
    assert "Traceback" in log.read_text() and "raise error" in log.read_text()
    monkeypatch.setenv("FJR_DEBUG", "1")
    assert isinstance(CliRunner().invoke(failing(ZeroDivisionError())).exception, ZeroDivisionError)
