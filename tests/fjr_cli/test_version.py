"""`fjr --version`."""

from __future__ import annotations

from importlib.metadata import version

from typer.testing import CliRunner

from fjr_cli.app import app


def test_the_version_is_printed_and_nothing_else():
    done = CliRunner().invoke(app, ["--version"])
    assert (done.exit_code, done.stdout) == (0, f"fjr {version('fjr-rig')}\n")
