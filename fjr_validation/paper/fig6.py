"""Fig. 6: friction and elastic torque, and the range that the motion really uses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fjr_kit.plots import layout
from fjr_kit.tasks import Arrays, Task
from fjr_sim_node.plant import PLANT
from fjr_sim_node.simulation.simulator import run_realization

from . import drawing
from .levels import campaign_of
from .part import Part, PlotPlace, Statement
from .settings import SMALL_RAD, STRONG_RAD, Settings

STRONG, SMALL = "#d62728", "#1f4fd8"
JOINT, MOTOR = "#000000", "#2ca02c"


def motion(amplitude_rad: float) -> dict[str, Any]:
    """Return the greatest deflection (rad) and velocities (rad/s) of one realization at 2 kHz."""
    campaign = campaign_of(amplitude_rad, 1, 2, rate_hz=2000.0)
    experiment = campaign.experiment(0, 0)
    run = run_realization(campaign.values["simulator"], experiment)
    kept = slice(experiment.samples_per_period, None)
    link, motor = run.link[kept], run.motor[kept]
    rate = experiment.sample_rate_hz
    deflection = link - motor
    return {
        "deflection_rad": np.abs(deflection).max(),
        "deflection_std_rad": deflection.std(),
        "link_velocity_rad_s": np.abs(np.diff(link)).max() * rate,
        "motor_velocity_rad_s": np.abs(np.diff(motor)).max() * rate,
    }


def tasks(_settings: Settings, amplitude_rad: float) -> list[Task]:
    """Return the motions at three amplitudes."""
    amplitudes = {"small": SMALL_RAD, "strong": STRONG_RAD, "best": amplitude_rad}
    return [
        Task(f"motion_{name}", motion, {"amplitude_rad": value})
        for name, value in amplitudes.items()
    ]


def elastic(deflection_rad: np.ndarray | float) -> Any:
    """Return te(d) = k0 d + k1 d^3 in N m."""
    plant: Any = PLANT.defaults()
    return plant["k0"] * deflection_rad + plant["k1"] * np.asarray(deflection_rad) ** 3


def friction(velocity_rad_s: np.ndarray, side: str) -> np.ndarray:
    """Return the friction torque of a side in N m."""
    plant: Any = PLANT.defaults()
    coulomb, viscous = (
        (plant["fs"], plant["fv"]) if side == "joint" else (plant["fsm"], plant["fvm"])
    )
    return viscous * velocity_rad_s + coulomb * np.sign(velocity_rad_s)


def part(results: Mapping[str, Arrays], _settings: Settings, _amplitude_rad: float) -> Part:
    """Return Fig. 6 with what the motion reaches."""
    strong, small = results["motion_strong"], results["motion_small"]
    reach, torque = float(strong["deflection_rad"]), float(elastic(strong["deflection_rad"]))
    text = (
        f"At {1e3 * STRONG_RAD:.0f} mrad per line the deflection reaches {reach:.2f} rad and the "
        f"elastic torque {torque:.3g} N m; at {1e3 * SMALL_RAD:.0f} mrad "
        f"{float(small['deflection_rad']):.2g} rad, where the cubic term is "
        f"{100 * (elastic(small['deflection_rad']) / (1500 * small['deflection_rad']) - 1):.2g} % "
        "of the linear one. The paper prints axis ticks, not where its curves end.",
    )
    statement = Statement(
        "Fig. 6",
        "elastic torque at the strong amplitude, on axes to \N{PLUS-MINUS SIGN}4 rad and "
        "\N{PLUS-MINUS SIGN}1e5 N m",
        f"reaches {reach:.2f} rad and {torque:.3g} N m",
        "finding",
        "fjr paper",
    )
    numbers = {
        name: {key: float(value) for key, value in results[f"motion_{name}"].items()}
        for name in ("small", "best", "strong")
    }
    return Part(
        "Fig. 6: friction and elastic torque",
        text,
        (statement,),
        _plots(reach, float(small["deflection_rad"])),
        (),
        {"fig6": _figure(reach, float(small["deflection_rad"]))},
        numbers,
    )


def _plots(strong: float, small: float) -> tuple[PlotPlace, ...]:
    velocity = np.concatenate([np.linspace(-5, -1e-9, 50), [0.0], np.linspace(1e-9, 5, 50)])
    friction_data = [
        drawing.curve(velocity, friction(velocity, side), f"{side} side", color, unit="N m")
        for side, color in (("joint", JOINT), ("motor", MOTOR))
    ]
    wide = np.linspace(-4, 4, 201)
    elastic_data = [drawing.curve(wide, elastic(wide), "te(d)", "#7a7f87", dash="dot", unit="N m")]
    for reach, name, color in ((strong, "strong", STRONG), (small, "small", SMALL)):
        used = np.linspace(-reach, reach, 101)
        label = f"reached at {name} amplitude"
        elastic_data.append(drawing.curve(used, elastic(used), label, color, unit="N m"))
    titles = (("Friction torque", " against velocity."), ("Elastic torque", "; zoom in."))
    labels = (("velocity (rad/s)", "torque (N m)"), ("deflection (rad)", "torque (N m)"))
    return tuple(
        PlotPlace(name, *title, {"data": data, "layout": layout(*axes)}, 340)
        for name, title, data, axes in zip(
            ("fig6-friction", "fig6-elastic"),
            titles,
            (friction_data, elastic_data),
            labels,
            strict=True,
        )
    )


def _figure(strong: float, small: float) -> Figure:
    figure = Figure(figsize=(drawing.WIDTH_IN * 1.3, 2.6))
    left, right = figure.subplots(1, 2)
    velocity = np.concatenate([np.linspace(-5, -1e-9, 50), np.linspace(1e-9, 5, 50)])
    left.plot(velocity, friction(velocity, "joint"), color=JOINT, label="joint side")
    left.plot(velocity, friction(velocity, "motor"), color=MOTOR, label="motor side")
    left.set(xlim=(-5, 5), ylim=(-27, 27), xlabel="velocity (rad/s)", ylabel="friction (N m)")
    left.legend(loc="upper left")
    wide = np.linspace(-4, 4, 201)
    right.plot(wide, elastic(wide), ":", color="#7a7f87", label="te(d)")
    for reach, name, color in ((strong, "strong", STRONG), (small, "small", SMALL)):
        used = np.linspace(-reach, reach, 101)
        right.plot(used, elastic(used), color=color, lw=2, label=f"{name} amplitude reaches")
    right.set(xlim=(-4, 4), ylim=(-1e5, 1e5), xlabel="deflection (rad)")
    right.set_ylabel("elastic torque (N m)")
    right.ticklabel_format(axis="y", scilimits=(0, 0))
    right.legend(loc="upper left")
    figure.tight_layout()
    return figure
