"""rehearsal.json and report.html of a rehearsal."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from html import escape
from pathlib import Path

import numpy as np
import pytest
from html_page import EVIL, Page
from loop_messages import RATE, loop
from paths import DOCS

from fjr_bringup.rehearsal import limits, tables
from fjr_bringup.rehearsal.advice import advice
from fjr_bringup.rehearsal.limits import LIMITS, judge
from fjr_bringup.rehearsal.machine import Machine, MachineWatch, Scheduling
from fjr_bringup.rehearsal.report import render
from fjr_bringup.rehearsal.result import Rehearsal
from fjr_bringup.rehearsal.timing import RECORD, loop_timing
from fjr_kit.check import Check
from fjr_kit.document_tables import in_step

TEXT = "<script>&'\""


def machine(scheduling, **fields):
    return Machine(cores=2, nodes={"controller": scheduling, "recorder": scheduling}, **fields)


PLAIN = Scheduling(policy="SCHED_OTHER", priority=0, nice=0, cores=2)
BUSY = machine(PLAIN, real_time_kernel=False, load_before=3.5, load_after=4.0, busy=0.9)
FIRST = Scheduling(policy="SCHED_FIFO", priority=50, nice=0, cores=2)
QUIET = machine(FIRST, real_time_kernel=True, load_before=0.1, load_after=0.2, busy=0.1)


def rehearsal(signals=None, machine=BUSY, **given):
    signals = signals or loop()
    timing = loop_timing(*signals, RATE)
    checked = LIMITS.check(given)
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
        machine=machine,
        signals=signals,
    )


def test_json_says_verdict_reasons_and_times():
    found = json.loads(rehearsal(latency_p99_s=1e-4).to_json())
    assert found["schema"] == "fjr_rig/rehearsal/1"
    assert found["verdict"] == "NO-GO"
    assert found["reasons"] == [
        "latency: 99 % of the torques answer within 0.60 ms (99.9 %: 0.60 ms)."
    ]
    assert found["timing"]["latency"]["p999"] == pytest.approx(0.6e-3)
    assert sum(found["timing"]["latency"]["histogram"]["values"]) == 1000
    assert len(found["timing"]["histogram_edges_s"]["values"]) == 121
    assert found["limits"]["latency_worst_s"] == "Infinity"
    assert {check["name"]: check["passed"] for check in found["checks"]}["lost"]


def test_nothing_heard_is_still_json_and_a_report():
    empty = np.zeros(0, RECORD)
    found = rehearsal((empty, empty, empty))
    assert json.loads(found.to_json())["timing"]["latency"]["p50"] is None
    assert "NO-GO" in render(found, {})


def test_report_shows_the_verdict_and_escapes_what_is_not_ours():
    page = render(rehearsal(), {"command": TEXT})
    assert "<h1>Rehearsal: GO</h1>" in page
    assert page.count("&lt;script&gt;&amp;") == 2
    assert TEXT not in page
    data = json.loads(re.search(r'id="report-data">(.*?)</script>', page)[1])
    assert set(data["overview"]) == {"histogram", "course", "signals"}
    places = set(re.findall(r'class="plot" id="(\w+)"', page))
    assert places == set(data["overview"])
    shares = [trace["y"] for trace in data["overview"]["histogram"]["data"]]
    for share in shares:
        assert sum(y for y in share if y is not None) == pytest.approx(1.0)


def test_the_report_says_the_fault_in_words():
    fault = {"kind": "node_killed", "node": "controller", "after_s": 1.0}
    text = render(rehearsal().model_copy(update={"fault": fault}), {})
    assert "Fault rehearsed: kind node_killed, node controller, after_s 1.0." in text


def test_no_text_of_a_rehearsal_can_become_code():
    hostile = {"reach": EVIL, "ended": EVIL, "bag_damage": EVIL, "drive": EVIL}
    machine = BUSY.model_copy(update={"nodes": {EVIL: PLAIN.model_copy(update={"policy": EVIL})}})
    free = {"fault": {EVIL: EVIL}, "experiment": {EVIL: EVIL}, "machine": machine}
    plain = Page(render(rehearsal(), {"command": "fjr"}))
    evil = rehearsal().model_copy(update={**hostile, **free})
    page = Page(render(evil, {"command": EVIL}))
    assert len(page.scripts) == len(plain.scripts) == 3
    assert {tag for tag, _ in page.tags} == {tag for tag, _ in plain.tags}
    assert page.texts.count(EVIL) == 4  # the bag, the process, its policy, the command
    assert sum(EVIL in text for text in page.texts) == 6  # and within the lead and the reach


def test_the_report_shows_the_motion_over_time():
    signals = loop()
    page = render(rehearsal(signals), {})
    data = json.loads(re.search(r'id="report-data">(.*?)</script>', page)[1])
    plot = data["overview"]["signals"]
    for trace, messages in zip(plot["data"], signals, strict=True):
        assert max(trace["y"]) == pytest.approx(messages["value"].max(), rel=1e-5)
        assert trace["x"][-1] == pytest.approx(1e-9 * messages["stamp"][-1], rel=1e-2)
    titles = [plot["layout"][f"yaxis{row}"]["title"]["text"] for row in ("", 2, 3)]
    assert titles == ["reference (rad)", "position (rad)", "torque (N m)"]


def test_a_no_go_says_what_to_do_and_a_go_does_not():
    found = rehearsal(latency_p99_s=1e-4)
    page = render(found, {})
    [sentence] = json.loads(found.to_json())["advice"]
    assert escape(sentence) in page and "What to do" in page
    assert "end what else runs" in sentence and "chrt --fifo" in sentence
    [sentence] = rehearsal(machine=QUIET, latency_p99_s=1e-4).advice
    assert "end what else" not in sentence and "real-time" not in sentence and "--rate" in sentence
    assert rehearsal().advice == [] and "What to do" not in render(rehearsal(), {})


def test_every_check_has_its_advice():
    """Every check of the code that makes checks, failed by itself, is followed by a sentence."""
    folder = Path(limits.__file__).parent
    source = "".join(
        (folder / name).read_text(encoding="utf-8")
        for name in ("limits.py", "rehearse.py", "safety.py")
    )
    names = set(re.findall(r'(?:_check|_yes_or_no|Check)\(\s*"(\w+)"', source))
    assert {"course", "trip", "lost", "response", "safe_state", "delay_margin"} - names <= {"lost"}
    for name in names | {"lost", "repeated", "unordered"}:
        failed = Check(name=name, passed=False, value=1.0, limit=0.0, sentence="")
        assert len(advice([failed], BUSY)) == 1, name


def test_the_report_says_load_and_scheduling():
    page = render(rehearsal(), {})
    assert "The 2 cores were 90 % busy during the run (load 3.5 before, 4.0 after)" in page
    assert "SCHED_OTHER" in page
    nodes = json.loads(rehearsal().to_json())["machine"]["nodes"]
    assert nodes["controller"] == {"policy": "SCHED_OTHER", "priority": 0, "nice": 0, "cores": 2}


def test_a_watched_machine_knows_niceness_load_and_what_has_ended():
    command = "import os, sys; os.nice(7); print(flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-c", command], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as child:
        child.stdout.readline()
        watch = MachineWatch({"child": child.pid})
        child.stdin.close()
        child.wait()
    gone = MachineWatch({"child": child.pid})
    deadline = time.monotonic() + 10.0
    while not watch.ended().busy > 0.0 and time.monotonic() < deadline:
        pass  # this loop keeps a core busy, which the clock counts in ticks
    machine = watch.ended()
    assert machine.nodes["child"].nice == min(os.getpriority(os.PRIO_PROCESS, 0) + 7, 19)
    assert machine.nodes["child"].cores == len(os.sched_getaffinity(0))
    assert 0.0 < machine.busy <= 1.0 and machine.load_after >= 0.0
    assert set(gone.ended().nodes) == {"recorder"}


def test_the_document_lists_the_present_limits_and_faults():
    text = (DOCS / "rehearsal.md").read_text(encoding="utf-8")
    assert in_step(text, tables.TABLES) == text, (
        "renew it: python -m fjr_bringup.rehearsal.tables docs/rehearsal.md"
    )
