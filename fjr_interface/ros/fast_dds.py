"""Fast DDS profiles of the rig's processes where the user has chosen none (no ROS import).

Over UDP, although they are on one machine: a process that is killed leaves its part of Fast DDS's
shared memory behind, and who writes to it may be held up for two seconds. With heartbeats that
repeat a lost message soon, and discovery that does not wait for three seconds: fast_dds.xml.
"""

from __future__ import annotations

from collections.abc import Mapping, MutableMapping
from pathlib import Path

PROFILES = Path(__file__).absolute().with_name("fast_dds.xml")
"""Profiles of participant, writers and readers for all processes of the product."""

VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
"""Environment variable by which the Fast DDS of Jazzy finds its profiles."""

TRANSPORT = "FJR_RIG_TRANSPORT"
"""Environment variable by which the profiles choose their transport: loopback or network."""

CHOICES = (VARIABLE, "FASTDDS_DEFAULT_PROFILES_FILE", "FASTDDS_BUILTIN_TRANSPORTS")
"""Environment variables by which a user configures Fast DDS; one of them, and nothing is set."""

_IN_THIS_FOLDER = Path("DEFAULT_FASTRTPS_PROFILES.xml")  # Fast DDS reads it where it is


def stays_on_this_machine(environment: Mapping[str, str]) -> bool:
    """Return whether discovery, by the environment, finds nobody on the network."""
    reach = environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE") or "LOCALHOST"
    return reach == "OFF" or (reach == "LOCALHOST" and not environment.get("ROS_STATIC_PEERS"))


def set_defaults(environment: MutableMapping[str, str]) -> None:
    """Choose the profiles in an environment, before rclpy starts.

    Where discovery stays on this machine, nothing is read from another interface than loopback.
    Nothing is done if the user configures Fast DDS in any way, or has chosen another middleware.
    """
    middleware = environment.get("RMW_IMPLEMENTATION") or "rmw_fastrtps_cpp"
    own = environment.get(VARIABLE) == str(PROFILES)  # set by the process that started this one
    chosen = any(environment.get(name) for name in CHOICES) or _IN_THIS_FOLDER.exists()
    if own or (middleware.startswith("rmw_fastrtps") and not chosen):
        environment[VARIABLE] = str(PROFILES)
        local = stays_on_this_machine(environment)
        environment[TRANSPORT] = "loopback" if local else "network"
