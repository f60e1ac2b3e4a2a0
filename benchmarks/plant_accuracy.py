"""Accuracy of the plant: the order of its method, and the error in every case of the paper.

Run `python benchmarks/plant_accuracy.py`. Every error is the rms of the difference to the
event-driven reference solution (`tests/event_driven.py`), over the rms of the signal.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "tests")]

import event_driven  # noqa: E402
import machine  # noqa: E402

from controller_node import pd_filtered  # noqa: E402
from excitation_node import multisine  # noqa: E402
from fjr_sim_node import plant  # noqa: E402
from fjr_sim_node.simulation import closed_loop  # noqa: E402

RATE = 1000.0
CASES = {
    "friction only": {"k1": 0.0},
    "transmission only": {"fs": 0.0, "fsm": 0.0},
    "both": {},
}
AMPLITUDES = (1e-3, 7e-3, 3e-2)
PARTS = (1, 2, 4, 8, 16)
CONTROLLER = pd_filtered.CONTROLLER.check({"sample_rate_hz": RATE})


def relative_rms(signal: np.ndarray, exact: np.ndarray) -> float:
    return float(np.sqrt(np.mean((signal - exact) ** 2) / np.mean(exact**2)))


def reference(amplitude: float) -> np.ndarray:
    """Return one period of the paper's multisine at 1 kHz (rad)."""
    values = multisine.EXCITATION.check(
        {"amplitudes_rad": (amplitude,), "periods": 1, "transient_periods": 0}
    )
    return multisine.reference(multisine.describe(values, 0, 0))


def simulate(r: np.ndarray, values: dict) -> closed_loop.Trajectory:
    coefficients = plant.coefficients(values), pd_filtered.coefficients(CONTROLLER)
    return closed_loop.simulate(r, RATE, *coefficients)


def print_order() -> None:
    """Print the error against the step, with the torque of the loop played back and held."""
    print("Order: torque of the loop at 7 mrad, held for 1 ms each, 1 s; position error by step\n")
    steps = "".join(f"{1000.0 / parts:>11.5g} us" for parts in PARTS)
    print(f"{'':20}{steps}   order")
    for name, changes in CASES.items():
        values = plant.PLANT.check(changes)
        torque = simulate(reference(7e-3), values).torque[:1000]
        exact = event_driven.EventDrivenPlant(values)
        angles = []
        for u in torque:
            exact.hold(u, 1.0 / RATE)
            angles.append(exact.state[2])
        errors = [relative_rms(open_loop(torque, values, n), np.array(angles)) for n in PARTS]
        order = np.polyfit(np.log(PARTS), -np.log(errors), 1)[0]
        print(f"{name:20}" + "".join(f"{error:14.2e}" for error in errors) + f"{order:8.2f}")


def open_loop(torque: np.ndarray, values: dict, parts: int) -> np.ndarray:
    """Return the motor position after each held torque, in steps of a sample over `parts`."""
    p, state, angles = plant.coefficients(values), (0.0,) * 4, []
    for u in torque:
        for _ in range(parts):
            state = plant.advance(*state, u, 1.0 / RATE / parts, p)
        angles.append(state[2])
    return np.array(angles)


def print_accuracy() -> None:
    """Print the error of the closed loop over the whole period."""
    print("\nClosed loop at 1 kHz, default step, whole period of 10 s from rest\n")
    print(f"{'':20}{'A_k in rad':>12}{'events':>9}{'position':>12}{'torque':>12}")
    for name, changes in CASES.items():
        for amplitude in AMPLITUDES:
            r, values = reference(amplitude), plant.PLANT.check(changes)
            position, torque, events = event_driven.closed_loop(r, RATE, values, CONTROLLER)
            result = simulate(r, values)
            y_error = 100.0 * relative_rms(result.position, position)
            u_error = 100.0 * relative_rms(result.torque, torque)
            print(f"{name:20}{amplitude:12g}{events:9d}{y_error:11.5f}%{u_error:11.5f}%")


if __name__ == "__main__":
    print(machine.describe() + "\n")
    print_order()
    print_accuracy()
