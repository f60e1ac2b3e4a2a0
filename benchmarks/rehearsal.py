"""A 500 Hz loop in real time, beside a plain two-process ping-pong at the same rate.

    python benchmarks/rehearsal.py [minutes]

The loop is three node processes and the recorder; its latency runs from sending the position to
receiving the torque, seen by the recorder. The ping-pong is the least that two processes need: one
sends a serialized JointState at the same instants and the other sends it back at once; its latency
runs from sending to receiving, in the first. Both use the same middleware, executor and profile.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from machine import describe

from fjr_bringup.rehearsal.loop_progress import RehearsalProgress
from fjr_bringup.rehearsal.timing import Distribution

RATE_HZ = 500.0
TARGET_P99_S = 2e-3
_MOST_PING_PONG_S = 120.0


def loop(duration_s: float) -> bool:
    """Rehearse, print what was measured, and return whether the target is reached."""
    from fjr_bringup.rehearsal.rehearse import rehearse
    from fjr_bringup.rehearsal.request import Options

    with tempfile.TemporaryDirectory() as folder, RehearsalProgress() as progress:
        overrides = {} if duration_s >= 20.0 else {"excitation": {"base_frequency_hz": 1.0,
                                                                  "f_min_hz": 1.0}}  # fmt: skip
        options = Options(
            out=Path(folder) / "x", rate_hz=RATE_HZ, duration_s=duration_s, overrides=overrides
        )
        found, _, _ = rehearse(options, progress)
    timing = found.timing
    print_row("loop: latency", timing.latency)
    print_row("loop: lateness of positions", timing.lateness)
    print_row("loop: delay (both)", timing.delay)
    lost = [topic.lost for topic in (timing.reference, timing.position, timing.torque)]
    lost.append(timing.unanswered)
    print(
        f"\n{timing.position.messages} samples in {timing.duration_s:.0f} s: lost of reference, "
        f"position, torque, unanswered: {lost}; {timing.late} late "
        f"({100.0 * timing.late / max(timing.latency.count, 1):.3f} %); "
        f"bag {'whole' if found.bag else 'NOT whole: ' + str(found.bag_damage)}"
    )
    print(f"verdict with the default limits: {found.headline}")
    for reason in found.reasons:
        print(f"  {reason}")
    return found.bag is not None and not any(lost) and timing.latency.p99 < TARGET_P99_S


def print_row(name: str, spread: Distribution) -> None:
    times = (spread.p50, spread.p99, spread.p999, spread.worst)
    cells = " | ".join(f"{1e3 * each:.3f}" for each in times)
    print(f"| {name} | {cells} | {spread.count} |", flush=True)


def partner(role: str, duration_s: float) -> None:
    """Play ping or pong; ping prints its latencies in ns as bytes on stdout."""
    import rclpy
    from rclpy.experimental import EventsExecutor
    from sensor_msgs.msg import JointState

    from fjr_interface.bags.joint_state import JointStateReader, JointStateWriter
    from fjr_interface.real_time import keep_pauses_out
    from fjr_interface.ros import runtime

    rclpy.init()
    node = rclpy.create_node(role)
    encode, decode = (
        JointStateWriter("position", "joint").encode,
        JointStateReader("position").decode,
    )
    publisher = node.create_publisher(JointState, role, runtime.SIGNAL_QOS)
    latencies: list[int] = []
    stopped = False

    def answer(message: bytes) -> None:
        nonlocal stopped
        stamp, _ = decode(message)
        stopped = stamp == 0
        if role == "pong":
            publisher.publish(message)
        elif not stopped:
            latencies.append(time.monotonic_ns() - stamp)

    other = "pong" if role == "ping" else "ping"
    reader = node.create_subscription(JointState, other, answer, runtime.SIGNAL_QOS, raw=True)
    while not (publisher.get_subscription_count() and reader.get_publisher_count()):
        time.sleep(0.01)
    executor = EventsExecutor()
    executor.add_node(node)
    keep_pauses_out()
    if role == "pong":
        while not stopped:
            executor.spin_once(timeout_sec=0.2)
        time.sleep(0.2)  # the last answer must leave
        return
    time.sleep(0.5)
    period_ns = round(1e9 / RATE_HZ)
    due = time.monotonic_ns()
    for _ in range(round(duration_s * RATE_HZ)):
        due += period_ns
        while (wait_ns := due - time.monotonic_ns()) > 0:
            executor.spin_once(timeout_sec=wait_ns * 1e-9)
        publisher.publish(encode(time.monotonic_ns(), 1.0))
    publisher.publish(encode(0, 1.0))
    while not stopped:
        executor.spin_once(timeout_sec=0.2)
    sys.stdout.buffer.write(np.array(latencies, np.int64).tobytes())


def ping_pong(duration_s: float) -> Distribution:
    """Return the latencies of the bare ping-pong."""
    command = [sys.executable, __file__]
    pong = subprocess.Popen([*command, "pong", str(duration_s)])
    ping = subprocess.run([*command, "ping", str(duration_s)], stdout=subprocess.PIPE, check=True)
    pong.wait()
    return Distribution.of(np.frombuffer(ping.stdout, np.int64) * 1e-9)


def main(minutes: float = 10.0) -> bool:
    """Print the distributions; return whether the target is reached."""
    os.environ.setdefault("ROS_DOMAIN_ID", "76")

    print(describe() + "\n")
    print(f"{RATE_HZ:g} Hz, {minutes:g} minutes; times in ms\n")
    print("| what | median | 99 % | 99.9 % | worst | samples |\n|---|---|---|---|---|---|")
    print_row("ping-pong of two processes", ping_pong(min(60.0 * minutes, _MOST_PING_PONG_S)))
    reached = loop(60.0 * minutes)
    print(f"target (nothing lost, 99 % below {1e3 * TARGET_P99_S:g} ms): ", end="")
    print("reached" if reached else "NOT reached")
    print(f"load at the end: {os.getloadavg()[0]:.1f}")
    return reached


if __name__ == "__main__":
    if sys.argv[1:2] in (["ping"], ["pong"]):
        partner(sys.argv[1], float(sys.argv[2]))
    else:
        sys.exit(not main(*map(float, sys.argv[1:2])))
