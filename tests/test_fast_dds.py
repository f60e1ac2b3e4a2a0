"""How the nodes talk: over UDP, by the profiles of the product, unless the user says otherwise."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from ros_domain import Peer, Started, Starter

from fjr_interface import fast_dds

NODE = "controller_node"
OWN = {fast_dds.VARIABLE: str(fast_dds.PROFILES)}


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


def udp_ports(process: Started) -> set[int]:
    """Return the UDP ports that a process has bound."""
    folder = Path(f"/proc/{process.process.pid}")
    inodes = {str(each.readlink())[8:-1] for each in (folder / "fd").iterdir()}
    rows = [row.split() for row in (folder / "net/udp").read_text().splitlines()[1:]]
    return {int(row[1].rpartition(":")[2], 16) for row in rows if row[9] in inodes}


def ask(peer: Peer) -> str:
    """Ask the node how it is, which it answers once both have found each other."""
    from std_srvs.srv import Trigger

    return str(peer.call(Trigger, "controller/status", Trigger.Request()).message)


@pytest.mark.ros
def test_a_node_talks_over_udp_and_on_this_machine_only(
    start: Starter, peer: Peer, domain: int
) -> None:
    node = start.node(NODE)
    assert ask(peer)
    assert ports_in_shared_memory(node) == set()
    first = 7400 + 250 * domain  # where discovery by multicast would listen
    ports = {port for port in udp_ports(node) if first <= port < first + 250}
    assert ports and first not in ports
    assert node.interrupt() == 0, node.output


@pytest.mark.ros
def test_the_transport_of_the_user_is_taken_and_both_understand_each_other(
    start: Starter, peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(fast_dds.VARIABLE, raising=False)
    monkeypatch.setenv("FASTDDS_BUILTIN_TRANSPORTS", "DEFAULT")
    node = start.node(NODE)
    assert ask(peer)
    assert ports_in_shared_memory(node)
    assert node.interrupt() == 0, node.output


@pytest.mark.ros
def test_a_killed_node_leaves_no_port_and_the_next_one_is_found(
    start: Starter, peer: Peer, domain: int
) -> None:
    for _ in range(3):
        node = start.node(NODE)
        assert ask(peer)
        node.process.send_signal(signal.SIGKILL)
        node.process.wait()
        for port in range(7400 + 250 * domain, 7650 + 250 * domain):
            assert not list(Path("/dev/shm").glob(f"*fastrtps_port{port}*"))
