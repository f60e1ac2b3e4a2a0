"""The Simscape component: its equations, integrated here, and the form of the two files.

MATLAB is not here, so that it reads them is not tested.
"""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from effect_rig import Rig, axis, moderate, relative_rms

from fjr_export.joint import Joint
from fjr_export.simscape import COMPONENT, Laws, component, laws, matlab_script
from fjr_export.treatments import SIMSCAPE
from fjr_sim_node import SIMULATOR, effects, plant

SAMPLES, PARTS = 150, 25
TORQUE = 20.0 * np.sin(0.08 * np.arange(SAMPLES)) + 8.0 * np.sin(0.3 * np.arange(SAMPLES))
FUNCTIONS = {
    "sin": math.sin, "cos": math.cos, "tanh": math.tanh, "exp": math.exp, "abs": abs, "max": max,
    "min": min, "sign": lambda x: math.copysign(1.0, x) if x else 0.0,
}  # fmt: skip


def joint_of(values: dict) -> Joint:
    return Joint(SIMULATOR.check(values), 1000.0, "test.yaml")


def derivative(made: Laws):
    """Return the right-hand side of the equations as a Python function of state and torque."""
    lines = ["def f(x, u):", "    load = 0.0"]
    lines += [f"    {name} = {value!r}" for name, (value, _) in made.parameters.items()]
    lines += [f"    {name} = x[{i}]" for i, name in enumerate(made.states)]
    lines += [f"    {name} = {law}" for name, law in made.terms.items()]
    lines += [f"    return [{', '.join(made.states.values())}]"]
    scope = dict(FUNCTIONS)
    exec("\n".join(lines).replace("^", "**"), scope)
    return lambda x, u: np.array(scope["f"](x, u))


def integrated(made: Laws) -> np.ndarray:
    """Return the motor position at each sample, by the classical Runge-Kutta method."""
    f, h = derivative(made), 1e-3 / PARTS
    x, motor = np.zeros(len(made.states)), list(made.states).index("th")
    positions = []
    for u in TORQUE:
        positions.append(x[motor])
        for _ in range(PARTS):
            a = f(x, u)
            b = f(x + h / 2 * a, u)
            c = f(x + h / 2 * b, u)
            x = x + h / 6 * (a + 2 * b + 2 * c + f(x + h * c, u))
    return np.array(positions)


def test_every_effect_of_the_catalogue_is_treated():
    assert set(SIMSCAPE) == set(effects.EFFECTS)


INTEGRATED = [n for n, t in SIMSCAPE.items() if t.kind != "refused" and n != "delay"]


@pytest.mark.parametrize("effect", INTEGRATED)
def test_the_equations_move_as_our_simulation_does(effect: str):
    compare({**moderate(effect), **axis(effect)})


@pytest.mark.parametrize("effects_on", [
    ("load_friction",), ("directional_loss",), ("load_friction", "gravity"),
    ("directional_loss", "external_spring"),
])  # fmt: skip
def test_the_losses_of_a_rigid_axis_move_it_as_our_simulation_does(effects_on: tuple[str, ...]):
    compare({**moderate(*effects_on), "k0": math.inf})


def compare(values: dict) -> None:
    """Hold the equations of a joint against the simulated rig."""
    joint = joint_of(values)
    rig = Rig(
        {name: joint.values[name] for name in plant.PLANT.names},
        {name: joint.values[name] for name in effects.NAMES},
    )
    own = []
    for u in TORQUE:
        own.append(rig.x[2])
        rig.hold(u)
    assert relative_rms(integrated(laws(joint)), np.array(own)) < 0.03  # friction is smooth there


def test_the_component_is_whole():
    on = moderate("delay", "actuator_lag", "hysteresis", "backlash", "extra_mode")
    text = component(joint_of(on))
    blocks = re.findall(r"^(component|nodes|inputs|outputs|parameters|variables|branches|equations)"
                        r"|^  let$", text, re.MULTILINE)  # fmt: skip
    assert len(blocks) == len(re.findall(r"^ *end$", text, re.MULTILINE)) == 10
    assert text.startswith(f"component {COMPONENT}\n")
    assert "late = delay(commanded, {0.0005, 's'}, History = 0);" in text
    for state in laws(joint_of(on)).states:
        assert f"  {state} = {{value = {{0, '1'}}, priority = priority.high}};" in text
        assert f"    {state}.der*{{1, 's'}} == " in text
    assert all(line.count("(") == line.count(")") for line in text.splitlines())


def test_the_script_connects_every_block_that_it_places():
    script = matlab_script(joint_of({}))
    placed = set(re.findall(r"^place\('[^']+', '(\w+)'", script, re.MULTILINE))
    joined = set(re.findall(r"'(\w+)/1'", script)) | set(re.findall(r"(\w+)\.[LR]Conn", script))
    assert placed == joined and len(placed) == 9
    assert "sample_period = 0.001; % s" in script
    assert f"'SourceFile', '{COMPONENT}'" in script
