"""Campaigns on the graph from the command line: Ctrl-C and resuming, the demo."""

from __future__ import annotations

import signal

import pytest
from graph_runs import contents
from processes import INTERRUPTED, Starter

from fjr_cli.demo import DEMO
from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.bags.reader import audit


@pytest.mark.parametrize("signal_number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_run_keeps_bags_and_resumes_to_the_same_bytes(
    run, tmp_path, start: Starter, signal_number
):
    options = ["--realizations", "3", "--periods", "3", "--transient-periods", "0",
               "--set", "excitation.base_frequency_hz=0.5",
               "--set", "excitation.f_min_hz=0.5"]  # fmt: skip
    out = tmp_path / "x"
    campaign = start("fjr_cli", "run", "--out", str(out), *options)
    first, second = bag_folder(out, 0, 0), out / f".{bag_folder(out, 0, 1).name}.partial"
    campaign.wait_for(second.exists, "the second bag")
    assert campaign.interrupt(signal_number) in INTERRUPTED, campaign.output
    assert f"Interrupted: 1 of 3 bags are finished and kept in {out}" in campaign.output
    assert f"to go on: fjr run --out {out}" in campaign.output
    assert [path.name for path in out.glob("level_*")] == [first.name]
    assert not list(out.glob(".*"))
    audit(first)
    whole = tmp_path / "whole"
    assert run("simulate", "--out", whole, *options, "--workers", "1").exit_code == 0
    if signal_number == signal.SIGINT:  # the folder that the other one leaves is the same
        resumed = start("fjr_cli", "run", "--out", str(out), "--composed")
        assert resumed.exit_status() == 0, resumed.output
        assert "1 of 3 bags are there already." in resumed.output
        assert resumed.output.splitlines()[-1] == str(out)
        assert contents(out) == contents(whole)
    else:
        assert contents(out).items() < contents(whole).items()


def test_demo_ends_with_its_report_and_a_second_one_keeps_the_bags(
    run, tmp_path, domain, monkeypatch
):
    excitation = {**DEMO["excitation"], "base_frequency_hz": 2.0, "f_min_hz": 2.0}
    monkeypatch.setitem(DEMO, "excitation", excitation)
    report = tmp_path / "demo" / "analysis" / "report.html"
    done = run("demo", "--out", tmp_path / "demo")
    assert done.exit_code == 0 and done.stdout.splitlines()[-1] == str(report)
    assert "BLA" in report.read_text(encoding="utf-8")
    bags = contents(tmp_path / "demo")
    assert len(bags) == 14
    again = run("demo", "--out", tmp_path / "demo")
    assert again.exit_code == 0 and again.stdout.splitlines()[-1] == str(report)
    assert "7 of 7 bags are there already." in again.stderr
    assert contents(tmp_path / "demo") == bags
