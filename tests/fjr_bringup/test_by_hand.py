"""A rig run by hand: simulation control, emergency stop, real time, restarts, diagnostics."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from by_hand import (
    REAL_TIME,
    SIMULATOR_NODE,
    by_hand,
    described,
    fjr,
    in_real_time,
    stamp_ns,
)
from graph_runs import campaign, contents, in_batch, in_graph
from processes import wait_for

from fjr_bringup.campaign.progress import CampaignProgress
from fjr_bringup.graph import conductor
from fjr_bringup.graph.graph_run import run_campaign
from fjr_bringup.graph.recorder import Recorder
from fjr_kit.errors import InputError
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization


def stamps(messages: list[Any]) -> list[int]:
    return [stamp_ns(message) // 1_000_000 for message in messages]


def test_pause_step_speed_reset_stop_and_play_by_the_command(start, rig):
    from std_srvs.srv import Trigger

    def ask(service: str) -> Any:
        return rig.peer.call(Trigger, f"simulator/{service}", Trigger.Request())

    nodes = by_hand(start, periods=5)
    for letter in "sce":
        nodes[letter]()
    rig.peer.spin_until(lambda: len(rig.torque) > 300, "torques")
    paused = ask("pause").message
    assert paused.startswith("paused: level 0, realization 0: ")
    first = int(fjr(start, "step", "3").split()[5])
    assert first == int(paused.split()[5]) + 3
    for played in (first, first + 3):
        rig.peer.spin_until(lambda: stamps(rig.torque)[-1] == played, "the last step")  # noqa: B023
        status = f"paused: level 0, realization 0: {played} of 6000 samples; as fast as possible"
        assert ask("status").message == status
        assert ask("step").success  # three again: the parameter stays
    rig.peer.spin_until(lambda: stamps(rig.torque)[-1] == first + 6, "the last step")
    assert stamps(rig.torque)[-7:] == list(range(first, first + 7))
    assert fjr(start, "speed", "2").endswith("; 2 x real time")
    assert ask("reset").success
    rig.torque.clear()
    assert ask("play").message.startswith("playing: ")
    assert not ask("step").success
    rig.peer.spin_until(
        lambda: rig.torque and stamps(rig.torque)[0] == 1, "the run from its beginning"
    )
    assert ask("stop").success
    assert ask("status").message.startswith("stopped: no realization under way")
    assert "speed out of range" in fjr(start, "speed", "0", status=2)
    assert fjr(start, "speed", "max").endswith("; as fast as possible")
    rig.torque.clear()
    assert ask("play").success
    torque = rig.hear_all_of(described(periods=5))
    batch = run_realization(SIMULATOR.defaults(), described(periods=5))
    np.testing.assert_array_equal(torque, batch.torque)


def test_an_emergency_stop_holds_zero_torque_until_it_is_released(start, rig):
    from diagnostic_msgs.msg import DiagnosticArray
    from std_srvs.srv import Trigger

    heard = rig.peer.listen(DiagnosticArray, "/diagnostics", 100)
    nodes = by_hand(start, periods=500, pace="clock")
    start.node(SIMULATOR_NODE, speed=1.0), nodes["e"]()
    controller = nodes["c"]()
    rig.peer.spin_until(lambda: len(rig.torque) > 100, "torques")
    # Asked while listening: a subscription keeps the latest 2000 torques only, two seconds.
    stopped = rig.peer.call(Trigger, "controller/estop", Trigger.Request())
    assert "zero torque until released" in stopped.message
    rig.peer.spin_until(lambda: rig.torque[-1].effort[0] == 0.0, "zero torque")
    torque = np.array([message.effort[0] for message in rig.torque])
    (ramp,) = np.flatnonzero(np.diff(np.sign(np.abs(torque[100:])) == 0.0, prepend=False))[:1]
    last = np.abs(torque[100 + ramp - 50 : 100 + ramp + 1])
    np.testing.assert_allclose(np.diff(last, 2)[1:], 0.0, atol=1e-9)  # a straight line to zero
    zeros = len(rig.torque)
    rig.peer.spin_until(lambda: len(rig.torque) > zeros + 2000, "more torques")
    assert not any(message.effort[0] for message in rig.torque[zeros:])
    status = fjr(start, "status")
    assert "controller: ERROR, tripped: emergency stop" in status and "excitation: ok" in status
    assert "motor sticking (fraction): " in status and "speed (x real time): " in status
    assert rig.peer.call(Trigger, "controller/release", Trigger.Request()).message == "ready"
    rig.peer.spin_until(lambda: rig.torque[-1].effort[0] != 0.0, "torque again")
    levels = {s.name: s.level for message in heard for s in message.status}
    assert levels["rig/controller: loop"] == b"\0" and len(levels) == 3
    assert "Tripped: emergency stop" in controller.output and "Ready." in controller.output
    assert fjr(start, "estop", "--release", status=2) == "It refuses: nothing has tripped."


@pytest.mark.parametrize("command", ["status", "estop"])
def test_where_no_rig_is_one_sentence_says_so(start, domain, command):
    output = fjr(start, command, status=2)
    begin = f"No rig is found in ROS domain {domain}, namespace /rig ("
    assert output.startswith(begin) and "\n" not in output


def test_a_domain_that_is_none_is_refused(start, monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "mine")
    sentence = "ROS_DOMAIN_ID is 'mine'; it must be a number from 0 to 232."
    assert fjr(start, "status", status=2) == sentence


def test_in_real_time_every_sample_is_played_and_the_drive_says_how_late(start, rig):
    position = rig.peer.listen(rig.kind, "motor_position", rig.qos)
    nodes = in_real_time(start, periods=1)
    simulator = start.node("fjr_sim_node", **REAL_TIME, readers="controller,peer")
    nodes["c"]()
    rig.peer.spin_until(lambda: rig.peer.node.count_publishers("motor_torque"), "the controller")
    nodes["e"]()
    experiment = described(sample_rate_hz=200.0, periods=1)
    last = int(experiment.stamps_ns[-1])
    rig.peer.spin_until(lambda: position and stamp_ns(position[-1]) == last, "the last position")
    assert [stamp_ns(message) for message in position] == experiment.stamps_ns.tolist()
    simulator.wait_for_text("400 samples in real time, ")
    assert "torque after position: p50 " in simulator.output
    rig.peer.spin_until(lambda: stamp_ns(rig.torque[-1]) >= last, "the last torque")
    heard = [stamp_ns(message) for message in rig.torque]
    assert heard == sorted(set(heard))
    assert "pause" in fjr(start, "pause", status=2)


def test_without_positions_the_controller_takes_the_torque_down_and_so_does_its_end(start, rig):
    nodes = in_real_time(start, periods=500)
    simulator, controller = nodes["s"](), nodes["c"]()
    nodes["e"]()
    rig.peer.spin_until(lambda: len(rig.torque) > 200, "torques")
    os.kill(simulator.process.pid, signal.SIGSTOP)
    controller.wait_for_text("Tripped: no position for 0.1 s")
    rig.peer.spin_until(lambda: rig.torque[-1].effort[0] == 0.0, "zero torque")
    os.kill(simulator.process.pid, signal.SIGCONT)
    said = len(rig.torque)
    rig.peer.spin_until(lambda: len(rig.torque) > said + 100, "torques of the drive that is back")
    assert not any(message.effort[0] for message in rig.torque[said:])
    assert fjr(start, "estop", "--release") == "ready"
    rig.peer.spin_until(lambda: rig.torque[-1].effort[0] != 0.0, "torque again")
    assert controller.interrupt() == 0
    rig.peer.spin_until(lambda: rig.torque[-1].effort[0] == 0.0, "the last torque")
    assert simulator.interrupt() == 0


def test_the_drive_lets_go_of_a_killed_controller_and_its_successor_plays_the_next_start(
    start,
    rig,
):
    from diagnostic_msgs.msg import DiagnosticArray
    from std_srvs.srv import Trigger

    def figure(name: str) -> float:
        values = [v for m in heard for s in m.status for v in s.values if v.key == name]
        return float(values[-1].value) if values else 0.0

    heard = rig.peer.listen(DiagnosticArray, "/diagnostics", 100)
    nodes = in_real_time(start, periods=500)
    nodes["s"]()
    controller = nodes["c"]()
    nodes["e"]()
    rig.peer.spin_until(lambda: len(rig.torque) > 200, "torques")
    controller.process.kill()
    rig.peer.spin_until(lambda: figure("let go") >= 1, "the drive to let go")
    rig.torque.clear()
    controller = nodes["c"]()
    controller.wait_for_text("Waiting for a new realization: the one under way began without")
    assert rig.peer.call(Trigger, "excitation/start", Trigger.Request()).success
    rig.peer.spin_until(lambda: len(rig.torque) > 100, "torques of a new run")
    assert stamp_ns(rig.torque[0]) <= 50_000_000
    assert controller.interrupt() == 0


@pytest.mark.parametrize("order", ["sce", "ecs"])
def test_nodes_may_be_started_again_mid_run_and_ended_in_any_order(start, rig, order):
    from std_srvs.srv import Trigger

    nodes = by_hand(start, periods=3)
    running = {letter: nodes[letter]() for letter in "sce"}
    rig.peer.spin_until(lambda: len(rig.torque) > 300, "torques")
    for letter in order:
        assert running[letter].interrupt() == 0
        running[letter] = nodes[letter]()
    rig.torque.clear()
    assert rig.peer.call(Trigger, "excitation/start", Trigger.Request()).success
    torque = rig.hear_all_of(described(periods=3))
    batch = run_realization(SIMULATOR.defaults(), described(periods=3))
    np.testing.assert_array_equal(torque, batch.torque)
    for letter in reversed(order):
        assert running[letter].interrupt() == 0


class Helper(threading.Thread):
    """Does something to a campaign's graph in the middle of its first realization.

    The recorder waits meanwhile, and with it, a window of samples later, the graph.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, act: Callable[[], None]) -> None:
        super().__init__()
        self._act, self._begun, self._acted = act, threading.Event(), threading.Event()
        self.failure: BaseException | None = None
        poll = Recorder.poll

        def waiting_poll(recorder: Recorder) -> int:
            if recorder.samples:
                self._begun.set()
                self._acted.wait()
            return poll(recorder)

        monkeypatch.setattr(Recorder, "poll", waiting_poll)
        self.start()

    def run(self) -> None:
        try:
            wait_for(self._begun.is_set, "a run")
            self._act()
        except BaseException as failure:
            self.failure = failure
        finally:
            self._acted.set()

    def end(self) -> None:
        """Wait until all is done; raise what went wrong."""
        self.join()
        if self.failure is not None:
            raise self.failure


class Progress(CampaignProgress):
    """Remembers what it says."""

    def __init__(self) -> None:
        super().__init__()
        self.said = ""

    def say(self, sentence: str) -> None:
        self.said += sentence


def test_a_paused_campaign_is_not_called_hung(domain, tmp_path, start, monkeypatch):
    def play_once_the_pause_is_noticed() -> None:
        wait_for(lambda: "The simulation is paused: " in progress.said, "the campaign to notice")
        assert fjr(start, "play").startswith("playing: ")

    def pause() -> None:
        assert fjr(start, "pause").startswith("paused: ")
        player.start()

    monkeypatch.setattr(conductor, "_STALL_S", 5.0)
    player = threading.Thread(target=play_once_the_pause_is_noticed)
    what = campaign(base=0.5, excitation={"f_min_hz": 1.0, "f_max_hz": 40.0})
    with Progress() as progress:
        helper = Helper(monkeypatch, pause)
        run_campaign(what, tmp_path / "graph", progress=progress)
    helper.end(), player.join()
    assert contents(tmp_path / "graph") == contents(in_batch(what, tmp_path / "batch"))


def test_a_realization_with_a_trip_is_not_kept(domain, tmp_path, start, monkeypatch):
    what = campaign(base=0.5, excitation={"f_min_hz": 1.0, "f_max_hz": 40.0})
    helper = Helper(monkeypatch, lambda: fjr(start, "estop"))
    with pytest.raises(InputError, match="not kept: the controller tripped: emergency stop"):
        in_graph(what, tmp_path / "graph")
    helper.end()
    assert contents(tmp_path / "graph") == {}
