"""A kept result is named by everything that it rests on: a change of any import renames it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from paths import ROOT

from fjr_kit.imports import PRODUCT, rests_on

DIGESTS = """
import json, sys
from pathlib import Path
from fjr_kit.imports import digest_of
from fjr_validation.paper import planner_check, search_check
from fjr_validation.paper.settings import QUICK

for source in (None, *sys.argv[1:]):
    if source:
        with open(source, "a") as file:
            file.write("# changed")
    digest_of.cache_clear()
    parts = (search_check, planner_check)
    assert all(Path(part.__file__).is_relative_to(Path.cwd()) for part in parts)
    names = {part.__name__: part.tasks(QUICK, 7e-3)[0].file(Path()).name for part in parts}
    print(json.dumps(names))
"""
SEARCH, PLANNER = "fjr_validation.paper.search_check", "fjr_validation.paper.planner_check"


def kept_files(product: Path, *sources: str) -> list[dict[str, str]]:
    """Return the names of the first kept results of two parts, before and after each change."""
    said = subprocess.run(
        [sys.executable, "-c", DIGESTS, *sources],
        env={**os.environ, "PYTHONPATH": str(product)},
        cwd=product,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return [json.loads(line) for line in said.splitlines()]


def test_a_changed_import_renames_the_kept_results_that_rest_on_it_and_no_others(tmp_path: Path):
    for package in PRODUCT:
        shutil.copytree(ROOT / package, tmp_path / package)
    renames = {
        "fjr_bringup/design/amplitude.py": {SEARCH},
        "fjr_bringup/design/planner.py": {PLANNER},
        "fjr_bringup/design/measured.py": {SEARCH, PLANNER},
        "fjr_interface/experiment.py": {SEARCH, PLANNER},
        "fjr_sim_node/plant/torques.py": {SEARCH, PLANNER},
        "fjr_kit/errors.py": {SEARCH, PLANNER},
        "fjr_records/lines.py": {SEARCH, PLANNER},
        "fjr_validation/paper/fig6.py": set(),
        "gap_diagnosis/gates/gate_checks.py": set(),
    }
    names = kept_files(tmp_path, *renames)
    for (source, parts), (before, after) in zip(renames.items(), pairwise(names), strict=True):
        assert {part for part in before if after[part] != before[part]} == parts, source


def test_every_form_of_import_is_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    package = tmp_path / "imported_by_a_test"
    texts = {
        "__init__.py": "",
        "first.py": "import numpy\nfrom . import second\nfrom .third import name\n",
        "second.py": "def late():\n    import imported_by_a_test.fourth\n",
        "third.py": "from . import first\nname = 1\n",
        "fourth.py": "from imported_by_a_test.inner import fifth\n",
        "inner/__init__.py": "from ..sixth import *\n",
        "inner/fifth.py": "",
        "sixth.py": "",
        "not_imported.py": "",
    }
    for name, text in texts.items():
        (package / name).parent.mkdir(exist_ok=True)
        (package / name).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    found = {file.relative_to(package).as_posix() for file in _files("first")}
    assert found == set(texts) - {"not_imported.py"}


def _files(module: str) -> list[Path]:
    return list(rests_on(f"imported_by_a_test.{module}").values())
