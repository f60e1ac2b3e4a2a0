"""What any bag may cost: small hostile ones a sentence within bounds, big honest ones a stream."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import hostile_bags
import pytest
from bag_tools import MS, WHOLE, foreign_bag, rig_streams
from paths import ROOT
from processes import Starter, completed
from rosbags.rosbag2 import StoragePlugin

LIMIT_MB = 512

_READ = """
import sys
from fjr_interface.bags.reader import read_record
try:
    read_record(sys.argv[1])
finally:
    with open("/proc/self/status") as status:
        peak = next(line for line in status if line.startswith("VmHWM"))
    print("peak", int(peak.split()[1]) // 1024, file=sys.stderr)
"""


def cost(start: Starter, *arguments: str) -> tuple[int, str, int]:
    """Run `fjr`; return its exit status, what it printed, and its greatest memory in MB."""
    program = start("peak_memory", *arguments, cwd=ROOT / "tests")
    status = program.exit_status()
    said, _, peak = program.output.rpartition("peak ")
    return status, said, int(peak)


def mapped() -> list[str]:
    return [part for source in hostile_bags.MAP for part in ("--map", source)]


@pytest.mark.parametrize("make", hostile_bags.HOSTILE, ids=lambda make: make.__name__)
def test_a_small_hostile_bag_costs_a_sentence(
    start_program: Starter, tmp_path, make: Callable[[Path], Path]
):
    bag = make(tmp_path)
    assert sum(file.stat().st_size for file in tmp_path.rglob("*") if file.is_file()) < 1.4e6
    status, said, peak_mb = cost(start_program, "analyze", str(bag), "--nominal", "none", *mapped())
    assert status == 2 and "Traceback" not in said
    assert str(bag) in said.replace("\n", "")
    assert peak_mb < LIMIT_MB


def with_camera(folder: Path, image_bytes: int, plugin: StoragePlugin) -> Path:
    streams = rig_streams(dict.fromkeys("ryu", WHOLE))
    image = bytes(image_bytes)
    streams["/camera"] = [(k * MS, image) for k in WHOLE]
    return foreign_bag(folder, streams, types={"/camera": "sensor_msgs/msg/Image"}, plugin=plugin)


def test_topics_that_are_not_asked_for_cost_nothing_in_sqlite(tmp_path):
    peaks = []
    for image_bytes in (100, 4 * 2**20):
        bag = with_camera(tmp_path / str(image_bytes), image_bytes, StoragePlugin.SQLITE3)
        done = completed(sys.executable, "-c", _READ, str(bag))
        assert done.returncode == 0, done.stderr
        peaks.append(int(done.stderr.rpartition("peak ")[2]))
    assert peaks[1] < peaks[0] + 32  # the images are 240 MB
