"""How near does an exported MuJoCo model come to this product's own simulation?

Run `python benchmarks/export_accuracy.py`: 6 s of the paper's loop at 1 kHz, at 2 and 7 mrad; rms
error of the motor position over its rms, by integrator, and of each effect at the size of
`tests/effect_rig.py`. Two minutes of processor time.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from machine import describe

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from effect_rig import CONTROLLER, axis, moderate, multisine_reference, relative_rms

from controller_node import pd_filtered
from fjr_export.joint import Joint
from fjr_export.mjcf import MuJoCoModel, mujoco_model
from fjr_export.targets import MuJoCoJoint
from fjr_export.treatments import MJCF
from fjr_sim_node import SIMULATOR, effects, plant
from fjr_sim_node.simulation.closed_loop import simulate

RATE, SAMPLES = 1000.0, 6000
AMPLITUDES = (2e-3, 7e-3)


def joint_of(values: dict) -> Joint:
    """Return the paper's joint with other values."""
    return Joint(SIMULATOR.check(values), RATE, "paper")


def error(joint: Joint, model: MuJoCoModel, amplitude: float) -> float:
    """Return the rms error of the motor position over its rms."""
    reference, target = multisine_reference(amplitude)[:SAMPLES], MuJoCoJoint.of_mjcf(model)
    target.begin(0.0, 0.0)
    x, position = 0.0, np.empty(SAMPLES)
    for k, r in enumerate(reference.tolist()):
        position[k] = target.position()
        x, u = pd_filtered.step(x, r - position[k], CONTROLLER)
        target.hold(u)
    p, e = plant.coefficients(joint.values), effects.coefficients(joint.values)
    return relative_rms(position, simulate(reference, RATE, p, CONTROLLER, None, e).position)


def row(name: str, joint: Joint, model: MuJoCoModel) -> None:
    """Print the errors of a model."""
    told = "".join(f"{error(joint, model, amplitude):10.5f}" for amplitude in AMPLITUDES)
    print(f"{name:34}{told}", flush=True)


def main() -> None:
    """Measure and print."""
    print(describe() + f"\n\n{'':34}" + "".join(f"{1e3 * a:5.0f} mrad" for a in AMPLITUDES))
    frictionless = joint_of({"fs": 0.0, "fsm": 0.0})
    row("no friction", frictionless, mujoco_model(frictionless))
    bare = joint_of({})
    model = mujoco_model(bare)
    for integrator in ("RK4", "Euler", "implicitfast", "discrete"):
        other = replace(model, xml=model.xml.replace('"RK4"', f'"{integrator}"'))
        row(f"bare joint, {integrator}", bare, other)
    for name, treatment in MJCF.items():
        if treatment.kind != "refused":
            joint = joint_of({**moderate(name), **axis(name)})
            row(f"{name} ({treatment.kind})", joint, mujoco_model(joint))


if __name__ == "__main__":
    main()
