"""Bags to arrays: speed beside the message-by-message loop of rosbags, and memory.

Run `python benchmarks/bag_reading.py [--quick]`. All figures come from one run on one machine; the
ratio is the one to compare. The page cache is warm.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from fjr_interface.bags.files import find_bags
from fjr_interface.bags.reader import BagReader, read_record
from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import Experiment
from fjr_interface.topics import SIGNALS

BAGS = 7
PERIOD = 10_000
PERIODS = 3
TARGET_RATE = 2e6
TARGET_RATIO = 30.0


def write_bags(folder: Path, bags: int, periods: int) -> None:
    """Write bags of `periods` periods of 10,000 samples with noise on all three signals."""
    for realization in range(bags):
        experiment = Experiment(
            sample_rate_hz=1000.0,
            samples_per_period=PERIOD,
            periods=periods - 1,
            transient_periods=1,
            realization=realization,
            realizations=bags,
            amplitude_rad=0.007,
            excited_harmonics=[k for k in range(1, 500, 2) if k % 3],
        )
        rng = np.random.default_rng(realization)
        values = {signal.symbol: rng.normal(size=experiment.samples) for signal in SIGNALS}
        with BagWriter(folder / f"bag_{realization:03d}", experiment) as writer:
            writer.write_arrays(**values)


def read_blockwise(folder: Path) -> float:
    """Read all bags with the product's reader; return the sum of the torque as a witness."""
    return sum(float(read_record(bag).torque.sum()) for bag in find_bags(folder))


def read_message_by_message(folder: Path) -> float:
    """Read all bags by deserialising each message with rosbags, into the same arrays."""
    store = get_typestore(Stores.ROS2_JAZZY)
    fields = {signal.absolute_topic: signal.field for signal in SIGNALS}
    total = 0.0
    for bag in find_bags(folder):
        stamps: dict[str, list[int]] = {topic: [] for topic in fields}
        values: dict[str, list[float]] = {topic: [] for topic in fields}
        with Reader(bag) as reader:
            wanted = [each for each in reader.connections if each.topic in fields]
            for connection, _, data in reader.messages(connections=wanted):
                message = store.deserialize_cdr(data, connection.msgtype)
                stamp = message.header.stamp
                stamps[connection.topic].append(stamp.sec * 10**9 + stamp.nanosec)
                field = fields[connection.topic]
                values[connection.topic].append(getattr(message, field)[0])
        total += float(np.array(values["/rig/motor_torque"]).sum())
    return total


def best_time(read: Callable[[Path], float], folder: Path, repeats: int) -> tuple[float, float]:
    """Return (best wall time in s, witness)."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        witness = read(folder)
        times.append(time.perf_counter() - start)
    return min(times), witness


def read_for_memory(folder: Path) -> None:
    """Read the bags one after the other, a period at a time, and print the peak RSS in MiB."""
    for bag in find_bags(folder):
        for block in BagReader(bag).blocks(PERIOD):
            assert len(block.torque) == PERIOD
    # ru_maxrss would count the memory of the parent at the time of its fork.
    status = Path("/proc/self/status").read_text()
    print(int(status.split("VmHWM:")[1].split()[0]) / 1024)


def peak_memory_mib(folder: Path) -> float:
    """Return the peak RSS of a fresh process that reads the bags in blocks of one period."""
    command = [sys.executable, __file__, "--child", str(folder)]
    return float(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def report_speed(folder: Path, repeats: int) -> None:
    """Print the table of speeds."""
    messages = BAGS * PERIODS * PERIOD * len(SIGNALS)
    fast, one = best_time(read_blockwise, folder, repeats)
    slow, other = best_time(read_message_by_message, folder, 1)
    assert one == other, "the two readers disagree"
    print(
        f"{BAGS} bags x {len(SIGNALS)} signals x {PERIODS * PERIOD} samples = {messages} messages"
    )
    print(
        f"{'rosbags, message by message':32}{slow:9.3f} s {messages / slow / 1e6:8.3f} M messages/s"
    )
    print(f"{'bag_reader':32}{fast:9.3f} s {messages / fast / 1e6:8.3f} M messages/s")
    print(
        f"ratio {slow / fast:.1f} (target {TARGET_RATIO:g}); target rate {TARGET_RATE / 1e6:g} M/s"
    )


def report_memory(root: Path) -> None:
    """Print peak memory against the numbers of bags and periods."""
    print(f"\n{'bags':>6}{'periods':>9}{'peak RSS in MiB':>18}")
    for bags, periods in ((1, 2), (1, 30), (14, 2)):
        folder = root / f"{bags}_bags_{periods}_periods"
        write_bags(folder, bags, periods)
        print(f"{bags:6d}{periods:9d}{peak_memory_mib(folder):18.1f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer repeats, no memory table")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        read_for_memory(options.child)
        return
    print(
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, numpy {np.__version__}"
    )
    with tempfile.TemporaryDirectory() as root:
        write_bags(Path(root) / "speed", BAGS, PERIODS)
        report_speed(Path(root) / "speed", 3 if options.quick else 7)
        if not options.quick:
            report_memory(Path(root))


if __name__ == "__main__":
    main()
