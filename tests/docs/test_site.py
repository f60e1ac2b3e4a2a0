"""The documentation site builds strictly, loads nothing from the network, and misses no command."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from paths import ROOT

from fjr_cli.app import app

LOADED = re.compile(r"<(?:script|img|iframe|source)[^>]*\ssrc=[\"']?(https?:)?//|@import\s+url")
PYTHON = ROOT / "docs/python.md"
STYLE = re.compile(r"<link[^>]*rel=[\"']?stylesheet[^>]*href=[\"']?(https?:)?//")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("mkdocs", reason="the extra docs is not installed")
    pytest.importorskip("mkdocstrings", reason="the extra docs is not installed")
    folder = tmp_path_factory.mktemp("site")
    built(ROOT, folder)
    return folder


def built(root: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    done = subprocess.run(
        command,
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(ROOT), "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def test_no_page_loads_anything_from_elsewhere(site: Path):
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 25
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert not LOADED.search(text) and not STYLE.search(text), page
    for style in site.rglob("*.css"):
        assert "//fonts." not in style.read_text(encoding="utf-8"), style


def test_a_page_opened_from_the_folder_can_search(site: Path):
    """A browser gives it neither a file that it asks for nor a worker: both are scripts."""
    assert (site / "search/search_index.js").read_text(encoding="utf-8").startswith("var __index")
    for page, script in (("index", "scripts"), ("tutorials/gap", "../scripts")):
        text = (site / f"{page}.html").read_text(encoding="utf-8")
        assert f'<script src="{script}/iframe-worker.js"></script>' in text


def test_every_command_and_option_is_in_the_reference(site: Path):
    page = (site / "reference/commands.html").read_text(encoding="utf-8")
    assert "\\|" not in page
    commands = dict(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
    commands |= {f"blind {n}": c for n, c in commands.pop("blind").commands.items()}
    for name, command in commands.items():
        assert f"fjr {name}<" in page
        for option in (each for parameter in command.params for each in parameter.opts):
            assert not option.startswith("--") or f"<code>{option}</code>" in page, (name, option)


def test_the_api_has_every_public_name(site: Path):
    """Those of the table in docs/python.md, which is tested against the packages."""
    page = (site / "reference/api.html").read_text(encoding="utf-8")
    table = re.findall(
        r"^\| (`\w[\w.]*`)? ?\| (`.+?`) \| ", PYTHON.read_text("utf-8"), re.MULTILINE
    )
    assert len(table) > 12
    for name in (name for _, names in table for name in re.findall(r"`(\w+)`", names)):
        assert re.search(rf'id="[\w.]+\.{name}"', page) or f".{name}</code>" in page, name


def test_the_glossary_has_every_term(site: Path):
    page = (site / "glossary.html").read_text(encoding="utf-8")
    terms = ("BLA", "Level", "Realization", "V", "G0", "Disc", "M", "P", "Gap", "Remainder")
    assert [term for term in terms if f"<strong>{term}.</strong>" not in page] == []
