"""A node's waiting: for which message or node, since when, and how to end it (no ROS here)."""

from __future__ import annotations

from dataclasses import dataclass, replace

from .health import ERROR, WARN, Health
from .topics import NODES

_NOTICED_NS = 1_000_000_000  # what lasts no longer is no news: every sample waits for a moment
_SAID_NS = 3_000_000_000  # before and between messages in the log


@dataclass(frozen=True)
class Lack:
    """What a node waits for.

    Attributes:
        what: in words that follow 'waiting for'.
        mend: what to do about it, a clause; empty where nothing is to be done.
    """

    what: str
    mend: str = ""


def start(*nodes: str) -> str:
    """Return the mend of nodes that are not there: to start their programs."""
    programs = [NODES.get(node, node) for node in nodes]
    return f"start {' and '.join(programs)}" + " or the drive" * ("simulator" in nodes)


class Waiting:
    """How long a node has waited for the same thing; told the time (ns of a steady clock)."""

    def __init__(self) -> None:
        """Wait for nothing."""
        self._lack: Lack | None = None
        self._since_ns = self._said_ns = 0

    def look(self, lack: Lack | None, now_ns: int) -> None:
        """Take what is lacking now, None if nothing is."""
        if lack is None or self._lack is None or lack.what != self._lack.what:
            self._since_ns = self._said_ns = now_ns
        self._lack = lack

    def sentence(self, now_ns: int) -> str | None:
        """Return what the log is to say now, None if nothing."""
        lack = self._lack
        if lack is None or now_ns - self._said_ns < _SAID_NS:
            return None
        self._said_ns = now_ns
        mend = f" {lack.mend[0].upper()}{lack.mend[1:]}." if lack.mend else ""
        return f"Waiting for {lack.what}.{mend}"

    def mark(self, health: Health, now_ns: int) -> Health:
        """Return the health of the node that waits: a warning that says for what, and how long."""
        lack, waited_ns = self._lack, now_ns - self._since_ns
        if lack is None or waited_ns < _NOTICED_NS or health.level == ERROR:
            return health
        summary = f"waiting {waited_ns * 1e-9:.0f} s for {lack.what}"
        return replace(
            health,
            level=WARN,
            summary=f"{summary}; {lack.mend}" if lack.mend else summary,
            values={"state": health.summary, "waiting (s)": waited_ns * 1e-9, **health.values},
        )
