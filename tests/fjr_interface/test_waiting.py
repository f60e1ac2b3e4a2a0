"""Who waits for whom, since when, and what to do: in the log, on /diagnostics, by `fjr status`."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from by_hand import (
    EXCITATION,
    by_hand,
    described,
    fjr,
    in_real_time,
)
from processes import wait_for

from fjr_interface.health import ERROR, OK, WARN, Health
from fjr_interface.topics import NODES
from fjr_interface.waiting import Lack, Waiting
from fjr_interface.waiting import start as start_it
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization

SECOND = 1_000_000_000


def test_what_is_waited_for_is_a_warning_after_a_second_and_said_every_three():
    waiting, health = Waiting(), Health(summary="busy", values={"samples": 3})
    said = []
    for second in range(10):
        waiting.look(Lack("the torque", "do this"), second * SECOND)
        said.append(waiting.sentence(second * SECOND))
        marked = waiting.mark(health, second * SECOND)
        assert marked.level == (WARN if second else OK)
        if second:
            assert marked.summary == f"waiting {second} s for the torque; do this"
            assert marked.values == {"state": "busy", "waiting (s)": second, "samples": 3}
    assert [second for second, sentence in enumerate(said) if sentence] == [3, 6, 9]
    assert said[3] == "Waiting for the torque. Do this."


def test_another_wait_begins_anew_and_a_trip_stays_an_error():
    waiting, health = Waiting(), Health()
    waiting.look(Lack("one"), 0)
    waiting.look(Lack("two"), 5 * SECOND)
    assert waiting.mark(health, 5 * SECOND) is health and not waiting.sentence(5 * SECOND)
    tripped = Health(ERROR, "tripped")
    assert waiting.mark(tripped, 50 * SECOND) is tripped
    assert waiting.mark(health, 50 * SECOND).summary == "waiting 45 s for two"
    assert waiting.sentence(50 * SECOND) == "Waiting for two."
    waiting.look(None, 51 * SECOND)
    assert waiting.mark(health, 60 * SECOND) is health and not waiting.sentence(60 * SECOND)


def test_the_mend_of_a_missing_node_is_its_program():
    assert start_it("controller", "recorder") == "start controller_node and recorder"
    assert start_it("simulator") == "start fjr_sim_node or the drive"


ALONE = {
    "simulator": "Waiting for a publisher of /rig/experiment. Start excitation_node.",
    "controller": "Waiting for a publisher of /rig/motor_position. Start fjr_sim_node or the drive",
    "excitation": "Waiting for controller to subscribe to /rig/reference. Start controller_node.",
}


@pytest.mark.parametrize("node", NODES)
def test_a_node_alone_is_ready_and_says_what_it_waits_for(start, domain, node):
    started = start.node(NODES[node])
    started.wait_for_text(ALONE[node])
    assert started.output.count(f"Ready, in ROS domain {domain}.") == 1
    status = wait_for(lambda: "WARN" in (said := fjr(start, "status")) and said, "the warning")
    assert re.search(rf"^{node}: WARN, waiting \d+ s for ", status, re.MULTILINE)
    for other in set(NODES) - {node}:
        assert re.search(rf"^{other}: MISSING, nobody publishes /rig/.*; start ", status, re.M)
    assert f"{node}: MISSING" not in status


def test_a_finished_realization_is_said_once_and_shown_as_finished(start, rig):
    nodes = by_hand(start)
    simulator = nodes["s"]()
    nodes["c"](), nodes["e"]()
    rig.hear_all_of(described())
    simulator.wait_for_text("Finished level 0, realization 0 (1 of 3): 3000 samples.")
    status = fjr(start, "status")
    assert "excitation: ok, finished level 0, realization 0\n" in status
    assert "simulator: ok, playing: finished level 0, realization 0 (1 of 3); as fast" in status
    assert "controller: ok, ready\n" in status
    assert simulator.output.count("inished") == 1
    assert fjr(start, "stop") == "stopped: no realization under way; as fast as possible"


def test_in_real_time_the_drive_says_that_it_finished(start, rig):
    nodes = in_real_time(start, periods=1)
    simulator = nodes["s"]()
    nodes["c"](), nodes["e"]()
    simulator.wait_for_text("Finished level 0, realization 0 (1 of 3): 400 samples in real time, ")
    assert "simulator: " in (status := fjr(start, "status"))
    assert "finished level 0, realization 0 (1 of 3); in real time" in status


def test_a_controller_started_again_in_mid_run_is_told_with_the_mend(start, rig):
    from diagnostic_msgs.msg import DiagnosticArray

    heard = rig.peer.listen(DiagnosticArray, "/diagnostics", 100)

    def warned(text: str) -> bool:
        statuses = [status for message in heard for status in message.status]
        return any(s.level == b"\1" and text in s.message for s in statuses)

    nodes = by_hand(start, periods=2)
    nodes["s"](), nodes["e"]()
    controller = nodes["c"]()
    rig.peer.spin_until(lambda: len(rig.torque) > 300, "torques")
    assert controller.interrupt() == 0
    gone = "; start controller_node, then `fjr reset` plays the realization from its beginning"
    rig.peer.spin_until(lambda: warned(gone), "the warning that the controller is gone")
    status = fjr(start, "status")
    assert (
        "controller: MISSING, nobody publishes /rig/motor_torque; start controller_node" in status
    )
    waits = r"simulator: WARN, waiting \d+ s for the torque of \d+(\.\d+)? s; start "
    assert re.search(waits, status)
    nodes["c"]()
    again = "; the controller was started in the middle of the run: `fjr reset` plays"
    rig.peer.spin_until(lambda: warned(again), "the warning that it was started again")
    assert again in fjr(start, "status")
    rig.torque.clear()
    assert fjr(start, "reset").endswith("the realization starts anew")
    torque = rig.hear_all_of(described(periods=2))
    batch = run_realization(SIMULATOR.defaults(), described(periods=2))
    np.testing.assert_array_equal(torque, batch.torque)


def test_what_takes_the_place_of_a_node_and_who_says_nothing_is_told(start, rig):
    import rclpy

    start.node(NODES["excitation"], **EXCITATION)
    others = [
        rclpy.create_node(name, namespace="/rig", context=rig.peer.context)
        for name in ("driver", "controller")
    ]
    for node, topic in zip(others, ("motor_position", "motor_torque"), strict=True):
        node.create_publisher(rig.kind, topic, rig.qos)
    wait_for(lambda: "excitation: WARN" in fjr(start, "status"), "the excitation")
    status = fjr(start, "status")
    assert "simulator: none, /rig/driver publishes /rig/motor_position in its place\n" in status
    assert "controller: SILENT, it says nothing: it hangs, or it was killed" in status
    for node in others:
        node.destroy_node()


TAKEN = "error: Another node of this machine publishes /rig/{} in ROS domain {} already; end it, "


PUBLISHED = {"s": "motor_position", "c": "motor_torque", "e": "reference"}


def test_a_second_node_is_refused_and_the_run_goes_on(start, rig, domain):
    nodes = by_hand(start, periods=4)
    for each in PUBLISHED:
        nodes[each]()
    rig.peer.spin_until(lambda: len(rig.torque) > 300, "torques")
    rig.step_ns = 2_000_000  # it flows slowly until they are gone
    seconds = {topic: nodes[letter]() for letter, topic in PUBLISHED.items()}
    for topic, second in seconds.items():
        rig.peer.spin_until(lambda node=second: node.process.poll() is not None, f"no 2nd {topic}")
        assert second.exit_status() == 2
        assert second.output.startswith(TAKEN.format(topic, domain)), second.output
        assert second.output.count("\n") == 1
    rig.step_ns = None
    torque = rig.hear_all_of(described(periods=4))
    batch = run_realization(SIMULATOR.defaults(), described(periods=4))
    np.testing.assert_array_equal(torque, batch.torque)


@pytest.mark.parametrize(("letter", "topic"), PUBLISHED.items())
def test_a_node_refuses_to_publish_beside_somebody_elses(start, rig, letter, topic):
    publisher: Any = rig.peer.node.create_publisher(rig.kind, topic, rig.qos)
    nodes = by_hand(start)
    refused = nodes[letter]()
    seen = rig.peer.node.get_publishers_info_by_topic
    rig.peer.spin_until(lambda: len(seen(f"/rig/{topic}")) > 1, "both publishers")
    for each in "sce".replace(letter, ""):
        nodes[each]()
    if letter == "c":  # it looks when a first position comes
        rig.peer.spin_until(lambda: publisher.get_subscription_count() > 0, "the simulator")
    assert refused.exit_status() == 2
    assert f"error: The node /rig/peer publishes /rig/{topic} in ROS domain" in refused.output


def test_a_second_publisher_is_named_where_the_lockstep_waits(start, rig):
    nodes = by_hand(start, periods=20)
    nodes["s"](), nodes["e"]()
    controller = nodes["c"]()
    rig.peer.spin_until(lambda: len(rig.torque) > 300, "torques")
    rig.peer.node.create_publisher(rig.kind, "reference", rig.qos)
    assert controller.interrupt() == 0
    twice = "2 nodes publish /rig/reference (/rig/excitation, /rig/peer): end all but one of them"
    wait_for(lambda: twice in fjr(start, "status"), "the name of the second publisher")
