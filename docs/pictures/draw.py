"""Draws the pictures of README and first page: `python docs/pictures/draw.py` from the repository.

`graph.svg` is the graph of nodes and topics; `bla.png` is the BLA of the report of `fjr demo`'s
experiment, here simulated.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

HERE = Path(__file__).resolve().parent
INK, NODE, PAPER, CLOCK = "#1f2933", "#dbe8f7", "#ffffff", "#8a5a00"


def box(axes: Axes, x: float, y: float, title: str, what: str, fill: str = NODE) -> None:
    """Draw a node with its middle at (x, y)."""
    axes.add_patch(
        FancyBboxPatch(
            (x - 1.5, y - 0.5), 3.0, 1.0, boxstyle="round,pad=0.08", fc=fill, ec=INK, lw=1.3
        )
    )
    axes.text(x, y + 0.18, title, ha="center", va="center", fontsize=12, weight="bold", color=INK)
    axes.text(x, y - 0.22, what, ha="center", va="center", fontsize=8.5, color=INK)


def arrow(
    axes: Axes,
    start: tuple[float, float],
    end: tuple[float, float],
    text: str,
    at: tuple[float, float],
    **style: object,
) -> None:
    """Draw a topic."""
    given = {"color": INK, "lw": 1.4, "arrowstyle": "-|>", "mutation_scale": 14, **style}
    axes.add_patch(FancyArrowPatch(start, end, shrinkA=0, shrinkB=0, **given))
    axes.text(*at, text, ha="center", va="center", fontsize=9.5, color=given["color"],
              family="monospace")  # fmt: skip


def graph(file: Path) -> None:
    """Draw the three nodes, the recorder and what goes between them."""
    figure, axes = plt.subplots(figsize=(9.6, 3.7))
    axes.set(xlim=(-0.2, 14.0), ylim=(-0.75, 4.45), aspect="equal")
    axes.axis("off")
    box(axes, 1.5, 3.2, "excitation", "multisine reference r")
    box(axes, 6.5, 3.2, "controller", "torque u from r and y")
    box(axes, 12.3, 3.2, "simulator", "joint, or a real drive")
    box(axes, 6.5, 0.4, "recorder", "audited MCAP bags", PAPER)
    arrow(axes, (3.08, 3.2), (4.92, 3.2), "reference", (4.0, 3.42))
    arrow(axes, (8.08, 3.5), (10.72, 3.5), "motor_torque", (9.4, 3.72))
    arrow(axes, (10.72, 2.9), (8.08, 2.9), "motor_position", (9.4, 2.68))
    arrow(axes, (1.9, 2.62), (4.92, 0.62), "", (0, 0), ls=":")
    arrow(axes, (6.5, 2.62), (6.5, 0.98), "", (0, 0), ls=":")
    arrow(axes, (11.9, 2.62), (8.08, 0.62), "", (0, 0), ls=":")
    arrow(axes, (4.92, 0.2), (1.2, 2.62), "recorded", (1.25, 0.75), color="#6b7280", lw=1.0,
          connectionstyle="arc3,rad=-0.25")  # fmt: skip
    arrow(axes, (12.6, 3.78), (1.5, 3.78), "/clock (simulated time)", (6.9, 4.32), color=CLOCK,
          lw=1.0, connectionstyle="arc3,rad=0.045")  # fmt: skip
    axes.text(
        10.9, 0.35, "lockstep: each sample waits for\nthe answer to the one before",
        ha="center", va="center", fontsize=10, style="italic", color=INK,
    )  # fmt: skip
    plt.rcParams["svg.hashsalt"] = "graph"
    figure.savefig(file, bbox_inches="tight", facecolor=PAPER, metadata={"Date": None})
    plt.close(figure)


def report(file: Path) -> None:
    """Simulate the demo's experiment and draw the first figure of its report."""
    from bla_analyzer.analysis import analyze
    from bla_analyzer.compare.reference_models import reference_models
    from bla_analyzer.output import write_result
    from fjr_bringup.campaign.batch_run import simulate_campaign
    from fjr_bringup.campaign.plan import Campaign
    from fjr_cli.demo import DEMO
    from fjr_interface.bags.reader import BagReader

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "demo"
        bags = simulate_campaign(Campaign.create(None, DEMO), folder, workers=1)
        models = reference_models(None, BagReader(bags[0]).experiment)
        write_result(analyze(folder, models=models), folder / "analysis", figures=True)
        image = plt.imread(folder / "analysis/figures/level_0_bla.png")
    height, width = image.shape[:2]
    figure = plt.figure(figsize=(width / 200, height / 200), dpi=120)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.imshow(image, interpolation="lanczos")
    axes.axis("off")
    figure.savefig(file, dpi=120)
    plt.close(figure)


if __name__ == "__main__":
    graph(HERE / "graph.svg")
    if "--graph" not in sys.argv:
        report(HERE / "bla.png")
