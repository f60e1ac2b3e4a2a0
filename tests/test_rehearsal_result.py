"""rehearsal.json and report.html of a rehearsal."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from loop_messages import RATE, loop

from fjr_bringup.rehearsal import tables
from fjr_bringup.rehearsal.limits import LIMITS, judge
from fjr_bringup.rehearsal.report import render
from fjr_bringup.rehearsal.result import Rehearsal, to_json
from fjr_bringup.rehearsal.timing import RECORD, loop_timing

TEXT = "<script>&'\""


def rehearsal(signals=None, **limits):
    timing = loop_timing(*(signals or loop()), RATE)
    checked = LIMITS.check(limits)
    return Rehearsal(
        drive="simulated",
        hardware=False,
        domain=77,
        reach="discovery stays on this machine",
        planned_s=2.0,
        ended="it ran its course " + TEXT,
        fault={},
        fault_seed=1,
        timing=timing,
        prediction=None,
        checks=judge(timing, None, checked),
        limits=checked,
        bag="level_0_realization_000",
        bag_damage=None,
        experiment={"sample_rate_hz": RATE},
    )


def test_json_says_verdict_reasons_and_times():
    found = json.loads(to_json(rehearsal(latency_p99_s=1e-4)))
    assert found["schema"] == "fjr_rig/rehearsal/1"
    assert found["verdict"] == "NO-GO"
    assert found["reasons"] == [
        "latency: 99 % of the torques answer within 0.60 ms (99.9 %: 0.60 ms)."
    ]
    assert found["timing"]["latency"]["p999"] == pytest.approx(0.6e-3)
    assert sum(found["timing"]["latency"]["histogram"]) == 1000
    assert len(found["timing"]["histogram_edges_s"]) == 121
    assert found["limits"]["latency_worst_s"] is None  # infinite
    assert {check["name"]: check["passed"] for check in found["checks"]}["lost"]


def test_nothing_heard_is_still_json_and_a_report():
    empty = np.zeros(0, RECORD)
    found = rehearsal((empty, empty, empty))
    assert json.loads(to_json(found))["timing"]["latency"]["p50"] is None
    assert "NO-GO" in render(found, {})


def test_report_shows_the_verdict_and_escapes_what_is_not_ours():
    page = render(rehearsal(), {"command": TEXT})
    assert "<h1>Rehearsal: GO</h1>" in page
    assert page.count("&lt;script&gt;&amp;") == 2
    assert TEXT not in page
    data = json.loads(re.search(r'id="report-data">(.*?)</script>', page)[1])
    assert set(data["overview"]) == {"histogram", "course"}
    places = set(re.findall(r'class="plot" id="(\w+)"', page))
    assert places == set(data["overview"])
    shares = [trace["y"] for trace in data["overview"]["histogram"]["data"]]
    for share in shares:
        assert sum(y for y in share if y is not None) == pytest.approx(1.0)


def test_the_document_lists_the_present_limits_and_faults():
    text = (Path(__file__).parents[1] / "docs/rehearsal.md").read_text(encoding="utf-8")
    assert tables.in_step(text) == text, (
        "renew it: python -m fjr_bringup.rehearsal.tables docs/rehearsal.md"
    )
