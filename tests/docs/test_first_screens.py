"""The first screen of every package, its `__init__` docstring, names every module that is there.

What it names is there, too.
"""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import pytest
from paths import ROOT

PACKAGES = sorted(
    file.parent.relative_to(ROOT).as_posix()
    for top in ROOT.glob("*/__init__.py")
    if top.parent.name != "tests"
    for file in top.parent.rglob("__init__.py")
)
NO_MODULES = {"fjr", "fx.EFFECT_PARAMETER", "effect.parameter", "_report", "_drawing"}
"""A command, and forms of names."""


def first_screen(package: str) -> str:
    text = (ROOT / package / "__init__.py").read_text(encoding="utf-8")
    return (ast.get_docstring(ast.parse(text)) or "").partition(">>>")[0]


def exists(name: str, package: str) -> bool:
    """Tell whether a name is a module of the package or of one around it, or in such a module."""
    around = [Path(package), *Path(package).parents]
    for folder in around:
        for length in range(len(name.split(".")), 0, -1):
            words = name.split(".")
            place = folder.joinpath(*words[:length])
            if not ((ROOT / place / "__init__.py").exists() or (ROOT / f"{place}.py").exists()):
                continue
            if length == len(words):
                return True
            module = importlib.import_module(".".join(place.parts))
            return length == len(words) - 1 and hasattr(module, words[-1])
    return False


@pytest.mark.parametrize("package", PACKAGES)
def test_what_a_first_screen_names_is_there(package: str):
    words = first_screen(package)
    assert words
    named = set(re.findall(r"`([a-z_][\w.]*)`", words)) - NO_MODULES
    assert [name for name in sorted(named) if not exists(name, package)] == []


def modules(package: str) -> list[str]:
    """Return the modules of a package, without what Python runs or what begins with `_`."""
    return sorted(
        file.stem for file in (ROOT / package).glob("*.py") if not file.stem.startswith("_")
    )


@pytest.mark.parametrize("package", PACKAGES)
def test_a_first_screen_names_every_module(package: str):
    named = re.findall(r"`([a-z_][\w.]*)`", first_screen(package))
    words = {word for name in named for word in name.split(".")}
    assert [name for name in modules(package) if name not in words] == []


def test_the_readme_says_where_each_equation_of_the_paper_is():
    section = (ROOT / "README.md").read_text(encoding="utf-8").partition("## The paper in the")[2]
    rows = re.findall(r"^\| ([^|]*\d) \|[^|]*\| `([\w/]+\.py)`", section, re.MULTILINE)
    assert len(rows) >= 10
    for label, file in rows:
        assert label.lower() in (ROOT / file).read_text(encoding="utf-8").lower(), (label, file)
