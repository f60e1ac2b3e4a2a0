"""The plain install, without what only reports or a cluster need, and what it says about them.

Libraries are hidden from a process of its own, as if pip had not installed them.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

REPORT, DASK = ("matplotlib", "plotly"), ("dask", "distributed")
SMALL = ["excitation.base_frequency_hz=2.0", "excitation.f_min_hz=2.0", "simulator.k1=0.0"]


def python(folder: Path, hidden: tuple[str, ...], code: str, *arguments: str):
    """Run code in a folder, by a Python that lacks some libraries."""
    hide = f"import sys; sys.modules.update(dict.fromkeys({hidden}))\n"
    return subprocess.run(
        [sys.executable, "-c", hide + code, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


def fjr(folder: Path, hidden: tuple[str, ...], *arguments: str):
    return python(folder, hidden, "from fjr_cli.app import main; main()", *arguments)


@pytest.mark.parametrize(
    "command",
    [
        "analyze .",
        "diagnose . --nominal paper",
        "shape",
        "paper --quick",
        "blind run --cases 1",
        "blind score .",
        "rehearse",
        "demo",
    ],
)
def test_a_command_that_writes_a_report_says_at_its_start_what_is_absent(
    tmp_path: Path, command: str
):
    said = fjr(tmp_path, REPORT, *command.split())
    assert said.returncode == 2
    assert said.stderr == (
        "This command writes a report, for which matplotlib and plotly must be installed; install "
        "fjr-rig[report].\n"
    )
    assert not list(tmp_path.iterdir())


def test_a_campaign_is_simulated_and_analyzed_without_reports_and_dask(tmp_path: Path):
    settings = [word for value in SMALL for word in ("--set", value)]
    levels = ["--level", "3e-3", "--level", "6e-3", "--level", "12e-3"]
    small = ["--realizations", "2", "--periods", "2", "--workers", "1", "--out", "made"]
    made = fjr(tmp_path, REPORT + DASK, "simulate", *small, *levels, *settings)
    assert made.returncode == 0, made.stderr
    analyzed = fjr(tmp_path, REPORT + DASK, "analyze", "made", "--no-report")
    assert analyzed.returncode == 0, analyzed.stderr
    assert analyzed.stdout.splitlines()[-1] == "made/analysis/result.json"
    written = {path.name for path in (tmp_path / "made/analysis").iterdir()}
    assert written == {"result.json", "frf.csv", "frf.npz", "frf.mat"}
    found = fjr(tmp_path, REPORT + DASK, "amplitude", "made")
    assert found.returncode == 0 and "Best amplitude of a line: " in found.stdout


def test_nodes_recorder_import_and_the_python_interface_need_no_extra(tmp_path: Path):
    code = """
import bla_analyzer.analysis, bla_analyzer.output, fjr_records.importers.importer
import controller_node.node, excitation_node.node, fjr_sim_node.node
import fjr_bringup.graph.graph_run, fjr_bringup.replay.lockstep, gap_diagnosis.investigation
"""
    said = python(tmp_path, REPORT + DASK, code)
    assert said.returncode == 0, said.stderr


def test_a_cluster_without_dask_is_one_sentence(tmp_path: Path):
    said = fjr(tmp_path, DASK, "paper", "--quick", "--dask", "tcp://127.0.0.1:9", "--out", "out")
    assert said.returncode == 2
    assert "Dask is not there (" in said.stderr
    assert "install fjr-rig[dask], or leave --dask out.\n" in said.stderr
