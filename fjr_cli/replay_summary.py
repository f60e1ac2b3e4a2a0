"""What `fjr replay` prints: what was published, or how replayed and recorded signals differ."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console

from fjr_bringup.replay.comparison import Difference
from fjr_bringup.replay.publishing import Published
from fjr_kit.terminal import print_table


def print_published(published: Published, console: Console | None = None) -> None:
    """Print a line for each topic, and the speed."""
    console = console or Console()
    heads = [("topic", ""), ("messages", ""), ("readers", ""), ("QoS", "")]
    rows = [[t.topic, str(t.messages), str(t.readers), t.qos] for t in published.topics]
    print_table(console, heads, rows, left=("QoS",))
    played_s, took_s, late_s = published.played_s, published.took_s, published.late_s
    speed = f" ({played_s / took_s:.2f} x real time)" if took_s > 0.0 else ""
    late = "" if late_s is None else f", no message more than {late_s * 1e3:.1f} ms late"
    console.print(f"{played_s:.3f} s played in {took_s:.3f} s{speed}{late}.", highlight=False)


def print_differences(differences: dict[str, Difference], console: Console | None = None) -> None:
    """Print one line for each signal that was played anew, or that should not differ but does."""
    titles = ("signal", "identical", "rms", "rms diff.", "worst diff.", "unit", "at sample")
    rows = [
        [name, *_cells(each)]
        for name, each in differences.items()
        if each.played_anew or each.different
    ]
    print_table(
        console or Console(), [(title, "") for title in titles], rows, left=("identical", "unit")
    )


def _cells(each: Difference) -> Sequence[str]:
    numbers = [f"{value:.4g}" for value in (each.rms_recorded, each.rms, each.worst)]
    where = "" if each.worst_sample is None else str(each.worst_sample)
    return ("yes" if each.identical else "no", *numbers, each.unit, where)
