"""The real graph, node processes and bags: identity with the batch simulation, failures, load."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path

import pytest
from by_hand import stamp_ns
from graph_runs import campaign, contents, in_batch, in_graph
from processes import Starter, marked_processes, node_pid, wait_for
from ros_domain import Peer

from fjr_bringup.campaign.plan import Campaign
from fjr_bringup.graph.conductor import Conductor
from fjr_bringup.graph.recorder import Recorder
from fjr_interface.bags.reader import audit
from fjr_interface.topics import NODES, SIGNAL_DEPTH
from fjr_kit.errors import InputError

MODULES = {
    "simulator": "fjr_sim_node",
    "controller": "controller_node",
    "excitation": "excitation_node",
}


@pytest.mark.parametrize(
    ("rate", "base", "given"),
    [
        (100.0, 1.0, {"simulator": {"noise_std_rad": 1e-4, "link_encoder": True}}),
        (
            1000.0,
            1.0,
            {
                "simulator": {"noise_snr_db": 20.0, "k1": 0},
                "excitation": {"amplitudes_rad": [1e-3, 7e-3]},
                "m": 2,
            },
        ),
        (20_000.0, 10.0, {"controller": {"torque_limit_nm": 5.0}}),
    ],
    ids=[
        "100 Hz, noise by std, link encoder",
        "1 kHz, two levels, noise by SNR",
        "20 kHz, torque limit",
    ],
)
def test_graph_composed_graph_and_batch_give_the_same_bytes(domain, tmp_path, rate, base, given):
    what = campaign(rate, base, **given)
    batch = contents(in_batch(what, tmp_path / "batch"))
    assert len(batch) == 2 * len(what.runs)
    assert contents(in_graph(what, tmp_path / "graph")) == batch
    assert contents(in_graph(what, tmp_path / "composed", composed=True)) == batch


def test_two_runs_with_one_seed_are_identical_and_with_another_not(tmp_path):
    """In batch, whose bytes are those of each graph, with noise, too, by the test before."""
    noisy = {"simulator": {"noise_std_rad": 1e-4}}
    first = contents(in_batch(campaign(m=2, **noisy), tmp_path / "1"))
    assert contents(in_batch(campaign(m=2, **noisy), tmp_path / "2")) == first
    other = campaign(m=2, simulator={"noise_std_rad": 1e-4, "noise_seed": 2})
    different = contents(in_batch(other, tmp_path / "3"))
    mcap = "level_0_realization_001/level_0_realization_001.mcap"
    assert different.keys() == first.keys() and different[mcap] != first[mcap]


class Saboteur(threading.Thread):
    """Sends a signal to a node once the simulator has said that the first realization runs."""

    def __init__(self, mark: str, folder: Path, node: str, signal_number: int) -> None:
        super().__init__()
        self._mark, self._folder = mark, folder
        self._module, self._signal = MODULES[node], signal_number
        self.start()

    def run(self) -> None:
        log = self._folder / "log" / "simulator.log"
        wait_for(lambda: log.exists() and "realization 0" in log.read_text(), "the first sample")
        os.kill(node_pid(self._mark, self._module), self._signal)


@pytest.mark.parametrize(
    ("node", "signal_number", "sentence"),
    [
        ("controller", signal.SIGKILL, "The controller node ended with signal SIGKILL"),
        ("simulator", signal.SIGSTOP, "The simulator node hangs"),
        ("controller", signal.SIGSTOP, "The controller node hangs"),
        ("excitation", signal.SIGSTOP, "The excitation node hangs"),
    ],
)
def test_a_dead_or_hung_node_is_named_and_all_others_end(
    domain, mark, tmp_path, node, signal_number, sentence
):
    folder = tmp_path / "campaign"
    saboteur = Saboteur(mark, folder, node, signal_number)
    with pytest.raises(InputError) as caught:
        in_graph(campaign(base=0.05, excitation={"f_min_hz": 1.0, "f_max_hz": 40.0}), folder)
    saboteur.join()
    message = str(caught.value)
    assert message.startswith(sentence)
    assert f"log: {folder / 'log' / node}.log" in message
    if node == "simulator":
        assert "its last lines:" in message and "Level 0, realization 0" in message
    assert marked_processes(mark) == []
    assert contents(folder) == {} and not list(folder.glob(".level_*"))


def test_a_node_that_answers_is_not_blamed_for_one_that_hangs(domain, mark, tmp_path, monkeypatch):
    """A node that stops while it sends has reached the recorder and not those who answer it."""
    monkeypatch.setattr(Conductor, "_who_owes", lambda _: "controller")
    folder = tmp_path / "campaign"
    saboteur = Saboteur(mark, folder, "simulator", signal.SIGSTOP)
    with pytest.raises(InputError, match=r"^The simulator node hangs"):
        in_graph(campaign(base=0.05, excitation={"f_min_hz": 1.0, "f_max_hz": 40.0}), folder)
    saboteur.join()


def test_a_node_that_ends_at_its_start_is_named_with_what_it_said(domain, tmp_path, monkeypatch):
    monkeypatch.setitem(MODULES, "simulator", "fjr_sim_node")
    monkeypatch.setitem(NODES, "simulator", "fjr_sim_node.no_such_module")
    with pytest.raises(InputError, match=r"The simulator node ended with status 1; its last lines"):
        in_graph(campaign(), tmp_path / "campaign")


def test_a_slow_recorder_slows_the_lockstep_and_loses_nothing(domain, tmp_path, monkeypatch):
    what = campaign(base=0.125, excitation={"f_min_hz": 1.0, "f_max_hz": 40.0})
    assert what.experiment(0, 0).samples > 5 * SIGNAL_DEPTH
    poll = Recorder.poll
    polls = []

    def slow_poll(self: Recorder) -> int:
        time.sleep(0.5)
        polls.append(before := self.samples)
        after = poll(self)
        assert after - before <= SIGNAL_DEPTH // 2
        return after

    monkeypatch.setattr(Recorder, "poll", slow_poll)
    slow = contents(in_graph(what, tmp_path / "slow", composed=True))
    assert len(polls) >= what.experiment(0, 0).samples // (SIGNAL_DEPTH // 2)
    assert slow == contents(in_batch(what, tmp_path / "batch"))


def test_another_excitation_in_the_domain_refuses_the_campaign(domain, tmp_path, start: Starter):
    other = start.node("excitation_node")
    other.wait_for_text("Waiting for controller to subscribe to /rig/reference")
    sentence = (
        "The excitation node ended with status 2; its last lines:\n"
        f"  error: Another node of this machine publishes /rig/reference in ROS domain {domain} "
    )
    with pytest.raises(InputError, match=sentence):
        in_graph(campaign(), tmp_path / "campaign")
    assert contents(tmp_path / "campaign") == {}
    assert other.interrupt() == 0


def test_another_publisher_in_the_domain_is_refused_by_name(domain, tmp_path, peer: Peer):
    from sensor_msgs.msg import JointState

    from fjr_interface.ros import runtime

    peer.node.create_publisher(JointState, "reference", runtime.SIGNAL_QOS)
    who_saw_it = (
        r"(Several nodes publish on|has publishers of different nodes)"  # graph or controller
    )
    topic, nodes = "/rig/reference", r"\((/rig/peer|/rig/excitation(,| and) /rig/peer)"
    sentence = rf"({who_saw_it} {topic}|{topic} {who_saw_it}) {nodes}"
    with pytest.raises(InputError, match=sentence):
        in_graph(campaign(), tmp_path / "campaign")
    assert contents(tmp_path / "campaign") == {}


def test_a_watcher_in_the_domain_does_not_disturb(domain, tmp_path, peer: Peer):
    from sensor_msgs.msg import JointState

    from fjr_interface.ros import runtime

    for topic in ("reference", "motor_position", "motor_torque"):
        peer.listen(JointState, topic, runtime.SIGNAL_QOS)
    what = campaign()
    folder = in_graph(what, tmp_path / "campaign")
    audit(folder / "level_0_realization_000")


def test_a_second_campaign_in_the_domain_is_refused_and_the_first_goes_on(
    domain, tmp_path, start: Starter
):
    options = ["--out", str(tmp_path / "first"), "--periods", "1", "--realizations", "1",
               "--set", "excitation.base_frequency_hz=0.5",
               "--set", "excitation.f_min_hz=0.5"]  # fmt: skip
    first = start("fjr_cli", "run", *options)
    first.wait_for_text(f"ROS domain {domain}; discovery stays on this machine.")
    with pytest.raises(InputError, match=f"Another campaign runs in ROS domain {domain}; wait"):
        in_graph(campaign(), tmp_path / "second")
    assert first.exit_status() == 0, first.output


@pytest.mark.parametrize("composed", [False, True])
def test_no_node_survives_a_killed_campaign(domain, mark, tmp_path, start: Starter, composed):
    options = ["--out", str(tmp_path / "campaign"), *(["--composed"] if composed else [])]
    run = start("fjr_cli", "run", *options)
    run.wait_for(lambda: list((tmp_path / "campaign").glob(".level_*")), "a bag")
    assert len(marked_processes(mark)) == (2 if composed else 4)
    run.process.kill()
    run.process.wait()
    wait_for(lambda: not marked_processes(mark), f"the end of {marked_processes(mark)}")


def test_a_late_foreign_recorder_does_not_disturb_and_gets_the_description(
    domain, tmp_path, start: Starter, peer: Peer
):
    """It asks for other QoS than the graph offers: best effort, a queue of ten, even latched."""
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import JointState
    from std_msgs.msg import String

    from fjr_interface.experiment import Experiment
    from fjr_interface.ros import runtime

    latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    never = peer.listen(JointState, "motor_position", latched)  # nobody offers that
    band = {"base_frequency_hz": 0.2, "f_min_hz": 1.0, "f_max_hz": 40.0}
    settings = [word for name, f in band.items() for word in ("--set", f"excitation.{name}={f}")]
    folder = tmp_path / "campaign"
    options = ["--out", str(folder), "--realizations", "1", "--periods", "1", *settings]
    run = start("fjr_cli", "run", *options)
    hasty = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    early = peer.listen(JointState, "motor_position", hasty)
    peer.spin_until(lambda: early and stamp_ns(early[-1]) > 1_000_000, "samples after the first")
    heard = [
        peer.listen(JointState, topic, hasty)
        for topic in ("reference", "motor_position", "motor_torque")
    ]
    description = peer.listen(String, "experiment", runtime.EXPERIMENT_QOS)
    peer.spin_until(lambda: description and all(heard), "signals and description")
    peer.spin_until(lambda: run.process.poll() is not None, "the end of the campaign")
    assert run.exit_status() == 0, run.output
    what = Campaign.create(folder / "campaign.yaml")
    assert Experiment.from_json(description[0].data, "topic") == what.experiment(0, 0)
    assert contents(folder) == contents(in_batch(what, tmp_path / "batch"))
    assert stamp_ns(heard[1][0]) > 1_000_000
    assert not never
