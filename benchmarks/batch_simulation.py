"""Batch closed loop on one core: speed and error beside MuJoCo and scipy's solve_ivp.

Run `python benchmarks/batch_simulation.py [--quick]`. The paper's plant and controller at 1 kHz,
A_k = 7 mrad, one phase realization after the other on one core. Speed is simulated over wall time,
best of the repeats; the error is the rms of the position's (torque's) difference to the
event-driven reference solution of the tests, over the rms of the signal, in 2 s from rest.

MuJoCo gets the same plant: two hinges, a tendon with cubic stiffness between them, `frictionloss`
and damping; the controller is computed in Python once a sample, all else is MuJoCo's. Its friction
is a soft constraint, so its step alone does not set its error. Shown are its default softness and
the hardest that still helps (`refsafe` off); the peer of the ratio is the fastest of its
rows with less error than the 0.1 % that the product promises.

Then the plant with effects of the catalogue, one at a time and several at once; their error is the
position's difference to the same loop with steps at least 10 times smaller.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "tests")]

import event_driven  # noqa: E402
import machine  # noqa: E402

from controller_node import pd_filtered  # noqa: E402
from controller_node.transfer_function import TransferFunction  # noqa: E402
from excitation_node import multisine  # noqa: E402
from fjr_sim_node import effects, plant  # noqa: E402
from fjr_sim_node.simulation import closed_loop  # noqa: E402

RATE = 1000.0
AMPLITUDE = 7e-3
REALIZATIONS = 8
PEER_SAMPLES = 2000
PROMISED_ERROR = 1e-3
TARGET_SPEED = 3000.0
TARGET_RATIO = 30.0

PLANT = plant.PLANT.defaults()
CONTROLLER = pd_filtered.CONTROLLER.check({"sample_rate_hz": RATE})

Signals = tuple[np.ndarray, np.ndarray]
Loop = Callable[[np.ndarray], Signals]

MODEL = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" gravity="0 0 0" integrator="{integrator}">
    <flag contact="disable" refsafe="{refsafe}"/>
  </option>
  <default><joint axis="0 0 1" {softness}/></default>
  <worldbody>
    <body>
      <joint name="motor" damping="{fvm}" frictionloss="{fsm}"/>
      <inertial pos="0 0 0" mass="1" diaginertia="{jm} {jm} {jm}"/>
    </body>
    <body>
      <joint name="link" damping="{fv}" frictionloss="{fs}"/>
      <inertial pos="0 0 0" mass="1" diaginertia="{j} {j} {j}"/>
    </body>
  </worldbody>
  <tendon>
    <fixed springlength="0" stiffness="{k0} 0 {k1}">
      <joint joint="link" coef="1"/><joint joint="motor" coef="-1"/>
    </fixed>
  </tendon>
  <actuator><motor joint="motor"/></actuator>
</mujoco>
"""


@dataclass(frozen=True)
class Row:
    """One line of the table: speed in simulated over wall time, errors relative to rms."""

    name: str
    speed: float
    position_error: float
    torque_error: float


def references(periods: int) -> list[np.ndarray]:
    """Return r of each realization (rad)."""
    values = multisine.EXCITATION.check(
        {
            "sample_rate_hz": RATE,
            "amplitudes_rad": (AMPLITUDE,),
            "realizations": REALIZATIONS,
            "periods": periods,
            "transient_periods": 0,
        }
    )
    return [multisine.reference(multisine.describe(values, 0, m)) for m in range(REALIZATIONS)]


def product_loop(r: np.ndarray) -> Signals:
    """Run the batch simulation at its default accuracy."""
    result = closed_loop.simulate(
        r, RATE, plant.coefficients(PLANT), pd_filtered.coefficients(CONTROLLER)
    )
    return result.position, result.torque


EFFECTS = {
    "backlash": {"backlash.half_gap_rad": 1e-3},
    "presliding friction": {
        "presliding_friction.motor_rad": 1e-3,
        "presliding_friction.link_rad": 1e-3,
    },
    "hysteresis": {"hysteresis.torque_nm": 3.0},
    "extra mode": {"extra_mode.inertia_kg_m2": 0.03},
    "actuator lag": {"actuator_lag.time_constant_s": 1e-3},
    "delay of half a sample": {"delay.time_s": 5e-4},
}
EFFECTS["all of these"] = {name: v for on in EFFECTS.values() for name, v in on.items()}


def loop_with_effects(on: dict[str, float], parts: int = 1) -> Loop:
    """Return the batch simulation with effects, its plant in at least `parts` steps a sample."""
    p, e = plant.coefficients(PLANT), effects.coefficients(on)
    c = pd_filtered.coefficients(CONTROLLER)

    def loop(r: np.ndarray) -> Signals:
        if parts == 1:
            result = closed_loop.simulate(r, RATE, p, c, effects=e)
        else:
            law = TransferFunction.of_pd(c)
            result = closed_loop.simulate_law(r, RATE, p, law, effects=e, substeps=parts)
        return result.position, result.torque

    return loop


def effects_rows(timed: list[np.ndarray], repeats: int) -> list[Row]:
    """Measure the batch simulation with effects."""
    rows = []
    for name, on in EFFECTS.items():
        fine = loop_with_effects(on, parts=20)(references(1)[0][:PEER_SAMPLES])
        rows.append(measure(f"with {name}", loop_with_effects(on), timed, fine, repeats))
    return rows


def mujoco_model(substeps: int, integrator: str, hard: bool):
    """Build the two-inertia model with `substeps` steps in a sample."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(
        MODEL.format(
            step=1.0 / RATE / substeps,
            integrator=integrator,
            refsafe="disable" if hard else "enable",
            softness='solreffriction="2e-5 1" solimpfriction="0.9999 0.9999 0.001"' if hard else "",
            **PLANT,
        )
    )
    data = mujoco.MjData(model)
    data.qpos[:] = [0.0, 0.5]
    mujoco.mj_forward(model, data)
    expected = PLANT["k0"] * 0.5 + PLANT["k1"] * 0.125
    if not np.allclose(data.qfrc_passive, [expected, -expected]):
        raise ValueError("its tendon does not follow te = k0 d + k1 d^3")
    return model


def why_not_mujoco() -> str:
    """Return why MuJoCo can't be measured here, empty if it can."""
    try:
        mujoco_model(1, "Euler", hard=False)
    except ImportError as error:
        return f"{error}; install it with pip install mujoco"
    except ValueError as error:
        return f"it can't hold the plant (cubic tendon stiffness came with version 4): {error}"
    return ""


def mujoco_loop(substeps: int, integrator: str, hard: bool) -> Loop:
    """Return the closed loop around MuJoCo."""
    import mujoco

    model = mujoco_model(substeps, integrator, hard)
    p, gain = CONTROLLER["p"], CONTROLLER["d"] * CONTROLLER["n"]
    decay = math.exp(-CONTROLLER["n"] / RATE)

    def loop(r: np.ndarray) -> Signals:
        data, x = mujoco.MjData(model), 0.0
        position, torque = np.empty(r.size), np.empty(r.size)
        angle, control = data.qpos, data.ctrl
        for k, target in enumerate(r.tolist()):
            position[k] = angle[0]
            error = target - angle[0]
            torque[k] = control[0] = p * error + gain * (error - x)
            x = decay * x + (1.0 - decay) * error
            mujoco.mj_step(model, data, substeps)
        return position, torque

    return loop


def scipy_loop(r: np.ndarray) -> Signals:
    """Run the loop by solve_ivp (RK45 with events, rtol 1e-6), restarted at every sample."""
    return event_driven.closed_loop(
        r, RATE, PLANT, CONTROLLER, method="RK45", rtol=1e-6, parts=1, quick=False
    )[:2]


def speed(loop: Loop, signals: list[np.ndarray], repeats: int) -> float:
    """Return simulated time over the best wall time."""
    loop(signals[0][:100])
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        for r in signals:
            loop(r)
        times.append(time.perf_counter() - start)
    return sum(r.size for r in signals) / RATE / min(times)


def relative_rms(signal: np.ndarray, exact: np.ndarray) -> float:
    """Return the rms of the error over the rms of the exact signal."""
    return float(np.sqrt(np.mean((signal - exact) ** 2) / np.mean(exact**2)))


def measure(name: str, loop: Loop, timed: list[np.ndarray], exact: Signals, repeats: int) -> Row:
    """Time a loop and compare it with the reference solution."""
    result = loop(references(1)[0][:PEER_SAMPLES])
    errors = [relative_rms(a, b) for a, b in zip(result, exact, strict=True)]
    return Row(name, speed(loop, timed, repeats), *errors)


def mujoco_rows(short: list[np.ndarray], exact: Signals, repeats: int) -> list[Row]:
    """Measure MuJoCo by integrator and step."""
    cases = [("Euler", 5, False), ("Euler", 5, True)]
    cases += [("RK4", n, True) for n in (1, 2, 5)]
    return [
        measure(
            f"MuJoCo {integrator} {1.0 / n:g} ms, {'hard' if hard else 'default'} friction",
            mujoco_loop(n, integrator, hard),
            short,
            exact,
            repeats,
        )
        for integrator, n, hard in cases
    ]


def print_table(rows: list[Row], product: Row) -> None:
    print(f"{'':42}{'x real time':>12}{'product is':>12}{'error y':>11}{'error u':>11}")
    for row in rows:
        print(
            f"{row.name:42}{row.speed:12.1f}{product.speed / row.speed:11.0f}x"
            f"{100 * row.position_error:10.4f}%{100 * row.torque_error:10.4f}%"
        )


def verdict(label: str, value: float, target: float) -> str:
    return f"{label}: {value:.0f} (target {target:.0f}: {'met' if value >= target else 'MISSED'})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer repeats, fewer realizations")
    quick = parser.parse_args().quick
    print(machine.describe())
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    long = references(1 if quick else 3)
    short = [r[:PEER_SAMPLES] for r in long[: 2 if quick else None]]
    exact = event_driven.closed_loop(long[0][:PEER_SAMPLES], RATE, PLANT, CONTROLLER)[:2]
    product = measure("fjr batch simulation", product_loop, long, exact, 3 if quick else 10)
    rows = [product]
    problem = why_not_mujoco()
    if not problem:
        rows += mujoco_rows(short, exact, 1 if quick else 3)
    rows.append(measure("scipy solve_ivp RK45, events", scipy_loop, short[:1], exact, 1))
    print(
        f"one core, {len(long)} realizations of {long[0].size / RATE:g} s "
        f"(peers: {len(short)} of {PEER_SAMPLES / RATE:g} s, solve_ivp 1)\n"
    )
    print_table(rows, product)
    print("\nwith effects (error against steps at least 10 times smaller)")
    print_table(effects_rows(long, 3 if quick else 10), product)
    print("\n" + verdict("times real time", product.speed, TARGET_SPEED))
    if problem:
        print(f"MuJoCo is left out: {problem}")
        return
    accurate = [row for row in rows[1:-1] if row.position_error < PROMISED_ERROR]
    peer = max(accurate, key=lambda row: row.speed)
    print(verdict(f"times {peer.name}", product.speed / peer.speed, TARGET_RATIO))


if __name__ == "__main__":
    main()
