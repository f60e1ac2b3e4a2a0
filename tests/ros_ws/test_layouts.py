"""The layouts for PlotJuggler and Foxglove: every path in them is one that the rig publishes."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree

from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from workspace import CONFIG

from fjr_interface import topics

SIGNALS = {signal.absolute_topic: signal for signal in (*topics.SIGNALS, topics.LINK_POSITION)}
EXPERIMENT = f"{topics.NAMESPACE}/{topics.EXPERIMENT_TOPIC}"
DIAGNOSTICS = "/diagnostics"
MESSAGES = {**dict.fromkeys(SIGNALS, JointState), EXPERIMENT: String, DIAGNOSTICS: DiagnosticArray}


def test_plotjuggler_shows_all_signals() -> None:
    root = ElementTree.parse(CONFIG / "plotjuggler.xml").getroot()
    assert root.tag == "root"
    series = set()
    for curve in root.iterfind("tabbed_widget/Tab/Container//DockArea/plot/curve"):
        merged = {curve.get("curve_x"), curve.get("curve_y")} - {None}
        series |= merged or {curve.get("name")}
    # PlotJuggler's ROS parser names the series of a JointState topic/joint/field.
    assert series == {f"{topic}/{topics.JOINT}/{signal.field}" for topic, signal in SIGNALS.items()}
    for splitter in root.iter("DockSplitter"):
        count = len(splitter)
        assert int(splitter.get("count", "")) == len(splitter.get("sizes", "").split(";")) == count


def test_plotjuggler_selects_the_topics_by_their_stamps() -> None:
    root = ElementTree.parse(CONFIG / "plotjuggler.xml").getroot()
    plugins = {plugin.get("ID"): plugin for plugin in root.iterfind("Plugins/plugin")}
    assert set(plugins) == {"DataLoad ROS2 bags", "ROS2 Topic Subscriber"}
    for plugin in plugins.values():
        (selected,) = plugin.iterfind("selected_topics")
        assert set(selected.get("value", "").split(";")) == {*SIGNALS, DIAGNOSTICS}
        (by_stamp,) = plugin.iterfind("use_header_stamp")
        assert by_stamp.get("value") == "true"


def leaves(layout: Any) -> Iterator[str]:
    """Yield the panels of a Foxglove layout tree."""
    if isinstance(layout, str):
        yield layout
        return
    assert layout["direction"] in ("row", "column")
    for side in ("first", "second"):
        yield from leaves(layout[side])


def test_foxglove_lays_out_every_panel_once() -> None:
    data = json.loads((CONFIG / "foxglove.json").read_text())
    assert set(data) == {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}
    assert sorted(leaves(data["layout"])) == sorted(data["configById"])
    kinds = {panel.partition("!")[0] for panel in data["configById"]}
    assert kinds == {"Plot", "DiagnosticSummary", "RawMessages"}


def test_foxglove_paths_are_fields_of_the_messages() -> None:
    panels = json.loads((CONFIG / "foxglove.json").read_text())["configById"]
    paths = [path for panel in panels.values() for path in panel.get("paths", ())]
    assert all(path["enabled"] and path["timestampMethod"] == "headerStamp" for path in paths)
    plotted = set()
    for value in [path["value"] for path in paths] + [
        panels["RawMessages!experiment"]["topicPath"]
    ]:
        match = re.fullmatch(r"(/[\w/]+)\.(\w+)(\[0\])?", value)
        assert match, value
        topic, field, index = match.groups()
        kind = MESSAGES[topic].get_fields_and_field_types()[field]
        assert kind.startswith("sequence<") == bool(index)
        plotted.add((topic, field))
    expected = {(topic, signal.field) for topic, signal in SIGNALS.items()}
    assert plotted == expected | {(EXPERIMENT, "data")}
    assert panels["DiagnosticSummary!rig"]["topicToRender"] == DIAGNOSTICS
