"""Where the packages lie: together as pip installs them, apart as colcon does."""

from __future__ import annotations

from importlib.metadata import distribution
from pathlib import Path

import pytest

import fjr_sim_node
from fjr_kit.installed import product_version, sources


def test_sources_of_packages_that_lie_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = []
    for package in ("apart_one", "apart_two"):
        folder = tmp_path / package / "site-packages" / package
        (folder / "below").mkdir(parents=True)
        for name in ("__init__.py", "kernel.py", "notes.txt", "below/inner.py"):
            (folder / name).write_text("")
        monkeypatch.syspath_prepend(str(folder.parent))
        expected += [folder / n for n in ("__init__.py", "below/inner.py", "kernel.py")]
    assert sources(("apart_one", "apart_two")) == expected


def test_sources_of_this_product() -> None:
    folder = Path(fjr_sim_node.__file__).parent
    assert sources(("fjr_sim_node", "not_there")) == sorted(folder.rglob("*.py"))


def test_the_version_is_that_of_the_distribution() -> None:
    assert product_version() == distribution("fjr-rig").version
