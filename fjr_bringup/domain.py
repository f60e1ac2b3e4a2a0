"""The ROS domain of a campaign: one campaign in each, and none that leaves this machine unasked."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Iterator

from fjr_interface.errors import InputError

DOMAINS = range(77, 101)
"""Domains of campaigns where ROS_DOMAIN_ID is not set: not those that rigs are likely on."""

_GREATEST = 232


@contextlib.contextmanager
def claimed_domain() -> Iterator[int]:
    """Hold a ROS domain that no other campaign of this machine uses; ROS_DOMAIN_ID is set to it.

    Raises:
        InputError: ROS_DOMAIN_ID is no domain, or another campaign runs there.
    """
    before = os.environ.get("ROS_DOMAIN_ID")
    for domain in [_number(before)] if before else DOMAINS:
        lock = _claim(domain)
        if lock is not None:
            break
    else:
        where = f"ROS domain {before}" if before else "every free ROS domain"
        raise InputError(
            f"Another campaign runs in {where}; wait for it or set another ROS_DOMAIN_ID."
        )
    with lock:
        os.environ["ROS_DOMAIN_ID"] = str(domain)
        try:
            yield domain
        finally:
            if not before:
                del os.environ["ROS_DOMAIN_ID"]


def own_domain() -> int:
    """Return the ROS domain of the environment; raise InputError if it is none."""
    return _number(os.environ.get("ROS_DOMAIN_ID") or "0")


def reach() -> str:
    """Return in a few words how far discovery reaches, by the environment."""
    peers = os.environ.get("ROS_STATIC_PEERS")
    kind = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") or "LOCALHOST"
    if kind == "OFF" or (kind == "LOCALHOST" and not peers):
        return "discovery stays on this machine"
    asked = f"ROS_AUTOMATIC_DISCOVERY_RANGE={kind}" + (f", ROS_STATIC_PEERS={peers}" * bool(peers))
    return f"discovery REACHES THE NETWORK, as {asked} asks: machines there can join"


def _number(text: str) -> int:
    if not text.isdecimal() or int(text) > _GREATEST:
        raise InputError(f"ROS_DOMAIN_ID is {text!r}; it must be a number from 0 to {_GREATEST}.")
    return int(text)


def _claim(domain: int) -> socket.socket | None:
    """Return what holds the domain, None if another process holds it.

    An abstract socket's name is unique on the machine and free again when its process has ended,
    however that happened.
    """
    lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        lock.bind(f"\0fjr-rig/ros-domain-{domain}")
    except OSError:
        lock.close()
        return None
    return lock
