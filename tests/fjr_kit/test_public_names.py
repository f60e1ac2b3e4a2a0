"""The public names of the packages: every example in docstrings and in docs/python.md is run."""

from __future__ import annotations

import doctest
import importlib
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fjr_bringup import Campaign, simulate_campaign

PAGE = Path(__file__).resolve().parents[2] / "docs" / "python.md"
WITH_CONTROL = "## python-control"
"""Heading of the page's last section, which needs a package that is no dependency."""

PACKAGES = (
    "bla_analyzer",
    "controller_node",
    "excitation_node",
    "fjr_bringup",
    "fjr_compare",
    "fjr_export",
    "fjr_interface",
    "fjr_records",
    "fjr_sim_node",
    pytest.param("gap_diagnosis", marks=pytest.mark.slow),
)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Simulate a small campaign on a rig with backlash; return its folder."""
    excitation = {
        "amplitudes_rad": [0.005, 0.02],
        "realizations": 2,
        "base_frequency_hz": 1.0,
        "f_min_hz": 1.0,
        "transient_periods": 2,
    }
    simulator = {"backlash.half_gap_rad": 1e-3, "noise_std_rad": 2e-5}
    folder = tmp_path_factory.mktemp("public") / "rig"
    values = {"excitation": excitation, "simulator": simulator}
    assert len(simulate_campaign(Campaign.create(overrides=values), folder, workers=1)) == 4
    return folder


@pytest.fixture
def beside_rig(campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in an empty folder that holds a copy of the campaign as `rig`, as the examples do."""
    shutil.copytree(campaign, tmp_path / "rig")
    monkeypatch.chdir(tmp_path)


def run_examples(text: str, name: str) -> None:
    """Run the examples of a text; fail with what differs, or if there is none."""
    said: list[str] = []
    examples = doctest.DocTestParser().get_doctest(text, {}, name, None, None)
    outcome = doctest.DocTestRunner().run(examples, out=said.append)
    assert outcome.attempted > 0, f"{name} has no example"
    assert outcome.failed == 0, "".join(said)


@pytest.mark.parametrize("package", PACKAGES)
def test_the_example_of_a_package_runs_as_written(package: str, beside_rig: None):
    run_examples(importlib.import_module(package).__doc__ or "", package)


def test_the_page_on_records_runs_as_written():
    run_examples(PAGE.with_name("records.md").read_text(encoding="utf-8"), "records.md")


@pytest.mark.slow
def test_the_page_on_python_runs_as_written(beside_rig: None):
    run_examples(PAGE.read_text(encoding="utf-8").partition(WITH_CONTROL)[0], PAGE.name)


def test_the_bla_for_python_control_is_as_written(beside_rig: None):
    pytest.importorskip("control", reason="python-control is optional and not installed here")
    run_examples(PAGE.read_text(encoding="utf-8").partition(WITH_CONTROL)[2], PAGE.name)
    run_examples(importlib.import_module("bla_analyzer").to_frd.__doc__, "bla_analyzer.to_frd")


def test_the_page_on_python_names_all_that_the_packages_export():
    page = PAGE.read_text(encoding="utf-8")
    for package in (getattr(each, "values", [each])[0] for each in PACKAGES):
        module = importlib.import_module(package)
        assert set(module.__all__) <= set(dir(module))
        for name in module.__all__:
            assert callable(getattr(module, name)) or name.isupper()
            assert f"`{name}`" in page, f"{package}.{name}"
        with pytest.raises(AttributeError, match=f"{package}.*no attribute 'no_such_name'"):
            module.no_such_name  # noqa: B018


def test_a_package_imports_nothing_that_was_not_asked_for():
    code = (
        "import sys\n"
        "import bla_analyzer, controller_node, excitation_node, fjr_bringup, fjr_interface\n"
        "import fjr_records, fjr_sim_node, gap_diagnosis\n"
        "print(sorted({'numpy', 'scipy', 'numba', 'rclpy'} & set(sys.modules)))\n"
        "gap_diagnosis.Diagnosis\n"
        "print('gap_diagnosis.investigation' in sys.modules)\n"
        "import fjr_validation.blind.making\n"
        "import controller_node.node, excitation_node.node, fjr_sim_node.node\n"
        "print(sorted(m for m in sys.modules if m.startswith(('bla_analyzer.', 'fjr_records.'))))\n"
        "print(sorted(m for m in sys.modules if m.startswith('gap_diagnosis.')))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names = ("", ".cause", ".contender", ".diagnosis", ".gap_size")
    outcome = [f"gap_diagnosis.outcome{name}" for name in names]
    assert done.stdout.splitlines() == ["[]", "False", "[]", str(outcome)]
