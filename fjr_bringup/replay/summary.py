"""What is printed after a bag was published."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table


@dataclass(frozen=True)
class PlayedLine:
    """What became of one topic: messages published and subscriptions at the end."""

    topic: str
    messages: int
    qos: str
    readers: int


def print_summary(
    lines: Sequence[PlayedLine], played_s: float, took_s: float, late_s: float | None
) -> None:
    """Print a line for each topic, and the speed.

    Args:
        lines: the topics.
        played_s: rig time that was played (s).
        took_s: wall time that it took (s).
        late_s: how late a message was at worst (s); None if none had a time.
    """
    table = Table("topic", box=SIMPLE_HEAD)
    for title in ("messages", "readers"):
        table.add_column(title, justify="right")
    table.add_column("QoS")
    for line in lines:
        table.add_row(line.topic, str(line.messages), str(line.readers), line.qos)
    console = Console()
    console.print(table)
    speed = f" ({played_s / took_s:.2f} x real time)" if took_s > 0.0 else ""
    late = "" if late_s is None else f", no message more than {late_s * 1e3:.1f} ms late"
    console.print(f"{played_s:.3f} s played in {took_s:.3f} s{speed}{late}.", highlight=False)
