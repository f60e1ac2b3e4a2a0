"""Names that one process of this machine holds at a time."""

from __future__ import annotations

import socket


def claim(name: str) -> socket.socket | None:
    """Return what holds a name, None if another process holds it.

    An abstract socket's name is unique on the machine and free again when its process has ended,
    however that happened.

    Args:
        name: at most 90 bytes.
    """
    lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    try:
        lock.bind(f"\0fjr-rig/{name}")
    except OSError:
        lock.close()
        return None
    return lock
