"""Speed of the ROS graph beside a bare two-process ping-pong of the same message, in one run.

    python -m benchmarks.ros_graph [rounds]

The bare ping-pong is what rclpy and Fast DDS can do at best with two processes and nothing else:
one message there and one back per step, on the same executor and with the same profile as the
nodes. `typed` makes and reads JointState objects, as rclpy is commonly used; `raw` passes bytes
that are serialized already, as the nodes do. The graph does two such hops per sample as well, and
besides streams the reference, publishes /clock, simulates, and records three signals into a bag
that is audited.
"""

from __future__ import annotations

import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from fjr_bringup.campaign.plan import Campaign
from fjr_bringup.campaign.progress import CampaignProgress

SAMPLE_RATE_HZ = 1000.0
EXCHANGES = 20_000
TARGETS = {"graph": 2.5, "composed": 5.0}
TARGET_RATIO = 0.6


def _spin(node, done) -> None:
    from rclpy.experimental import EventsExecutor

    executor = EventsExecutor()
    executor.add_node(node)
    while not done():
        executor.spin_once(timeout_sec=1.0)


def partner(role: str, kind: str) -> None:
    """Play ping or pong; ping prints the exchanges per second."""
    import rclpy
    from sensor_msgs.msg import JointState

    from fjr_interface.bags.joint_state import JointStateReader, JointStateWriter
    from fjr_interface.ros import runtime

    rclpy.init()
    node = rclpy.create_node(role)
    encode, decode = (
        JointStateWriter("position", "joint").encode,
        JointStateReader("position").decode,
    )
    other = "pong" if role == "ping" else "ping"
    publisher = node.create_publisher(JointState, role, runtime.SIGNAL_QOS)
    count = 0

    def send(stamp: int) -> None:
        if kind == "raw":
            publisher.publish(encode(stamp, 1.0))
            return
        message = JointState(name=["joint"], position=[1.0])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        publisher.publish(message)

    def answer(message) -> None:
        nonlocal count
        count += 1
        if kind == "raw":
            stamp = decode(message)[0]
        else:
            stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        if role == "pong" or count < EXCHANGES:
            send(stamp if role == "pong" else stamp + 1_000_000)

    reader = node.create_subscription(
        JointState, other, answer, runtime.SIGNAL_QOS, raw=kind == "raw"
    )
    while not (publisher.get_subscription_count() and reader.get_publisher_count()):
        time.sleep(0.01)
    if role == "ping":
        time.sleep(0.5)
        began = time.perf_counter()
        send(1_000_000)
    _spin(node, lambda: count >= EXCHANGES)
    if role == "ping":
        print(EXCHANGES / (time.perf_counter() - began), flush=True)
    time.sleep(0.5)  # the last answer must leave


def ping_pong(kind: str) -> float:
    """Return the exchanges per second of two bare processes."""
    command = [sys.executable, "-m", "benchmarks.ros_graph"]
    pong = subprocess.Popen([*command, "pong", kind])
    ping = subprocess.run([*command, "ping", kind], stdout=subprocess.PIPE, check=True, text=True)
    pong.wait()
    return float(ping.stdout)


class _Stopwatch(CampaignProgress):
    """Takes the time between the first and the last recorded sample."""

    def __init__(self) -> None:
        super().__init__()
        self._looks: list[tuple[float, float]] = []

    def update(self, simulated_s: float) -> None:
        if simulated_s:
            self._looks.append((time.perf_counter(), simulated_s))

    @property
    def speed(self) -> float:
        """Simulated seconds per second."""
        (began, first), (ended, last) = self._looks[0], self._looks[-1]
        return (last - first) / (ended - began)


def graph(*, composed: bool) -> float:
    """Return how many times real time the graph with its recorder runs; the bag is audited."""
    from fjr_bringup.graph.graph_run import run_campaign

    excitation = {"realizations": 1, "periods": 4, "sample_rate_hz": SAMPLE_RATE_HZ}
    campaign = Campaign.create(None, {"excitation": excitation})
    with tempfile.TemporaryDirectory() as folder, _Stopwatch() as watch:
        (bag,) = run_campaign(campaign, Path(folder) / "x", composed=composed, progress=watch)
        assert bag.exists()  # it was audited when it was closed: nothing was lost
    return watch.speed


def main(rounds: int = 3) -> bool:
    """Print all figures; return whether the targets are reached."""
    os.environ.setdefault("ROS_DOMAIN_ID", "76")

    measured: dict[str, list[float]] = {}
    for _ in range(rounds):
        for kind in ("raw", "typed"):
            measured.setdefault(kind, []).append(ping_pong(kind) / SAMPLE_RATE_HZ)
        for kind in ("graph", "composed"):
            measured.setdefault(kind, []).append(graph(composed=kind == "composed"))
    print(f"{platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, ", end="")
    print(f"Python {platform.python_version()}; median of {rounds} rounds, x real time at 1 kHz")
    names = {
        "raw": "bare ping-pong, two processes, serialized bytes",
        "typed": "bare ping-pong, two processes, JointState objects",
        "graph": "graph: three node processes and recorder",
        "composed": "graph: nodes composed in one process, and recorder",
    }
    median = {kind: statistics.median(values) for kind, values in measured.items()}
    for kind, name in names.items():
        each = ", ".join(f"{value:.1f}" for value in measured[kind])
        print(f"  {name:52} {median[kind]:5.1f}  ({each})")
    reached = [median[kind] >= target for kind, target in TARGETS.items()]
    for kind in ("typed", "raw"):
        ratios = [g / p for g, p in zip(measured["graph"], measured[kind], strict=True)]
        ratio = statistics.median(ratios)
        print(f"  graph / {kind} ping-pong: {ratio:.2f} (target {TARGET_RATIO})")
        reached.append(ratio >= TARGET_RATIO)
    print(f"  targets: graph {TARGETS['graph']}, composed {TARGETS['composed']} x real time")
    return all(reached)


if __name__ == "__main__":
    if sys.argv[1:2] in (["ping"], ["pong"]):
        partner(*sys.argv[1:3])
    else:
        sys.exit(not main(*map(int, sys.argv[1:2])))
