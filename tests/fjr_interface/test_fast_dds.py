"""How the nodes talk: over UDP, by the profiles of the product, unless the user says otherwise."""

from __future__ import annotations

import os
import signal
import socket
import sys
import time
from pathlib import Path

import pytest
from processes import Started, Starter, completed, wait_for
from ros_domain import Peer

from fjr_interface.ros import fast_dds

NODE = "controller_node"
OWN = {fast_dds.VARIABLE: str(fast_dds.PROFILES), fast_dds.TRANSPORT: "loopback"}


def chosen(**environment: str) -> dict[str, str]:
    fast_dds.set_defaults(environment)
    return environment


def test_the_profiles_are_chosen_where_nobody_else_did() -> None:
    assert fast_dds.PROFILES.is_file()
    assert chosen() == OWN
    assert chosen(**OWN) == OWN  # of a process that the product has started
    assert chosen(FASTDDS_BUILTIN_TRANSPORTS="") == {"FASTDDS_BUILTIN_TRANSPORTS": "", **OWN}
    for middleware in ("rmw_fastrtps_cpp", "rmw_fastrtps_dynamic_cpp"):
        assert chosen(RMW_IMPLEMENTATION=middleware)[fast_dds.VARIABLE] == str(fast_dds.PROFILES)


@pytest.mark.parametrize(
    ("given", "transport"),
    [
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, "loopback"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, "loopback"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, "network"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT"}, "network"),
        ({"ROS_STATIC_PEERS": "192.0.2.7"}, "network"),
    ],
)
def test_the_network_is_reached_only_where_discovery_may(
    given: dict[str, str], transport: str
) -> None:
    assert chosen(**given)[fast_dds.TRANSPORT] == transport
    assert chosen(**OWN, **given)[fast_dds.TRANSPORT] == transport  # asked for later


@pytest.mark.parametrize("name", [*fast_dds.CHOICES, "RMW_IMPLEMENTATION"])
def test_what_the_user_has_set_wins(name: str) -> None:
    environment = {name: "rmw_cyclonedds_cpp"}
    assert chosen(**environment) == environment


def test_so_do_the_profiles_in_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml").touch()
    assert chosen() == {}


def ports_in_shared_memory(process: Started) -> set[str]:
    """Return the ports of Fast DDS's shared memory that a process has open."""
    words = Path(f"/proc/{process.process.pid}/maps").read_text().split()
    return {word for word in words if "/fastrtps_port" in word}


def udp_sockets(process: Started) -> dict[tuple[str, int], int]:
    """Return the UDP sockets of a process: bytes that wait to be read by (address, port)."""
    folder = Path(f"/proc/{process.process.pid}")
    inodes = {str(each.readlink())[8:-1] for each in (folder / "fd").iterdir()}
    sockets = {}
    for row in (folder / "net/udp").read_text().splitlines()[1:]:
        _, local, _, _, queues, *_, inode = row.split()[:10]
        if inode in inodes:
            address, port = local.split(":")
            bound = socket.inet_ntoa(bytes.fromhex(address)[::-1])
            sockets[bound, int(port, 16)] = int(queues.partition(":")[2], 16)
    return sockets


def read_beyond_loopback(process: Started) -> set[tuple[str, int]]:
    """Return the sockets beyond loopback that a process reads: what is sent there disappears."""
    beyond = {each for each in udp_sockets(process) if each[0] != "127.0.0.1"}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for address, port in beyond:
            out.sendto(b"no RTPS", ("127.0.0.1" if address == "0.0.0.0" else address, port))
    time.sleep(1.0)  # for its threads to read what they read
    unread = {each for each, waiting in udp_sockets(process).items() if waiting}
    return beyond - unread


def ask(peer: Peer) -> str:
    """Ask the node how it is, which it answers once both have found each other."""
    from std_srvs.srv import Trigger

    return str(peer.call(Trigger, "controller/status", Trigger.Request()).message)


def test_a_node_talks_over_udp_and_on_this_machine_only(
    start: Starter, peer: Peer, domain: int
) -> None:
    node = start.node(NODE)
    assert ask(peer)
    assert ports_in_shared_memory(node) == set()
    first = 7400 + 250 * domain  # where discovery by multicast would listen
    sockets = {each for each in udp_sockets(node) if first <= each[1] < first + 250}
    assert sockets and all(bound == "127.0.0.1" and port > first for bound, port in sockets)
    assert read_beyond_loopback(node) == set()
    assert node.interrupt() == 0, node.output


def test_where_discovery_may_reach_the_network_it_listens_there(
    start: Starter, peer: Peer, domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    node = start.node(NODE)
    assert ask(peer)
    first = 7400 + 250 * domain
    wait_for(lambda: ("0.0.0.0", first) in read_beyond_loopback(node), "discovery by multicast")
    assert node.interrupt() == 0, node.output


OTHER_PROGRAM = """
import rclpy
from std_srvs.srv import Trigger
rclpy.init()
node = rclpy.create_node("other")
client = node.create_client(Trigger, "/rig/controller/status")
client.wait_for_service()
future = client.call_async(Trigger.Request())
rclpy.spin_until_future_complete(node, future)
print(future.result().message)
"""


@pytest.mark.parametrize("reach", ["LOCALHOST", "SUBNET"])
def test_other_programs_of_this_machine_are_understood(
    start: Starter, domain: int, reach: str
) -> None:
    node = start.node(NODE)
    taken = (fast_dds.VARIABLE, fast_dds.TRANSPORT)
    environment = {name: value for name, value in os.environ.items() if name not in taken}
    environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] = reach
    other = [sys.executable, "-c", OTHER_PROGRAM]
    said = completed(*other, env=environment)
    assert said.stdout.strip() == "ready", said.stderr
    assert node.interrupt() == 0, node.output


def test_the_transport_of_the_user_is_taken_and_both_understand_each_other(
    start: Starter, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(fast_dds.VARIABLE, raising=False)
    monkeypatch.setenv("FASTDDS_BUILTIN_TRANSPORTS", "DEFAULT")
    node = start.node(NODE)
    assert ask(peer)
    assert ports_in_shared_memory(node)
    assert node.interrupt() == 0, node.output


def test_a_killed_node_leaves_no_port_and_the_next_one_is_found(
    start: Starter, peer: Peer, domain: int
) -> None:
    def ports_left() -> set[Path]:
        of_domain = range(7400 + 250 * domain, 7650 + 250 * domain)
        memory = Path("/dev/shm")
        return {path for port in of_domain for path in memory.glob(f"*fastrtps_port{port}*")}

    before = ports_left()  # other programs of this domain, with transports of their own, leave some
    for _ in range(3):
        node = start.node(NODE)
        assert ask(peer)
        node.process.send_signal(signal.SIGKILL)
        node.process.wait()
        assert ports_left() <= before
