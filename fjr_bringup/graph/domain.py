"""The ROS domain of a campaign: one campaign in each, and none that leaves this machine unasked."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

from fjr_interface.ros.claims import claim
from fjr_interface.ros.fast_dds import stays_on_this_machine
from fjr_kit.errors import InputError

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
        lock = claim(f"ros-domain-{domain}")
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
    if stays_on_this_machine(os.environ):
        return "discovery stays on this machine"
    peers = os.environ.get("ROS_STATIC_PEERS")
    kind = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") or "LOCALHOST"
    asked = f"ROS_AUTOMATIC_DISCOVERY_RANGE={kind}" + (f", ROS_STATIC_PEERS={peers}" * bool(peers))
    return f"discovery REACHES THE NETWORK, as {asked} asks: machines there can join"


def _number(text: str) -> int:
    if not text.isdecimal() or int(text) > _GREATEST:
        raise InputError(f"ROS_DOMAIN_ID is {text!r}; it must be a number from 0 to {_GREATEST}.")
    return int(text)
