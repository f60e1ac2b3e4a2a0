"""Is one axis of an arm diagnosed rightly while another axis moves, which no record of it tells?

Run `python benchmarks/coupled_arm.py --cases 12 --seed 0`: two links in a vertical plane, either
the shoulder or the elbow recorded alone. Both follow Fourier series, or moves from place to place,
under a law that is not told. The other axis changes the recorded one's inertia and gravity and
pushes it by Coriolis and reaction torques, which no model of one axis has: a remainder as large as
the friction. The datasheet is an inertia alone. All is integrated here, by laws of its own.

With `--known` the recorded angles of both axes give the torque that the other one and gravity need,
by a model of the arm whose masses are 5 % off: it is imported as a known torque. The gravity that
this model lacks is there, and so named rightly.

Counted are what is named but is not there, what is missed, the ratio of each size to the truth
(inertia and gravity to their means over the motion), how many intervals hold it, and how sure each
name is.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numba
import numpy as np
from machine import describe
from scipy.signal import savgol_filter

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from gap_diagnosis import read_nominal
from gap_diagnosis.any_record import diagnose
from gap_diagnosis.outcome.diagnosis import Diagnosis

BASE_HZ, LINES, MOVE_S, INNER = 0.1, 5, 2.0, 20
SMOOTH_S, TOLD_OFF = 0.04, 0.05
BRISTLE_RAD, COUNT_RAD = 1e-3, 2.0 * np.pi / 2**19
SIZES = {
    "coulomb_friction.motor_nm": "coulomb",
    "viscous_friction.motor_nm_s_rad": "viscous",
    "gravity.torque_nm": "gravity",
}
AXES = ("shoulder", "elbow")
ALSO = {"presliding_friction"}  # in all of them


@dataclass(frozen=True)
class Arm:
    """A random arm; index 0 is the shoulder.

    Attributes:
        rotors: inertia of the rotor behind the gear of each axis, kg m2.
        carried: moments of the arm: m1 c1^2 + m2 l1^2, m2 c2^2, m2 l1 c2, in kg m2.
        weights: torque of gravity, (m1 c1 + m2 l1) g and m2 c2 g, N m; zeros for a plane that
            lies flat.
        coulomb: N m of each axis.
        viscous: N m s/rad of each axis.
    """

    rotors: np.ndarray
    carried: np.ndarray
    weights: np.ndarray
    coulomb: np.ndarray
    viscous: np.ndarray

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Arm:
        """Draw one."""
        masses, lengths = (
            10.0 ** rng.uniform(0, 2) * rng.uniform(0.5, 1.5, 2),
            rng.uniform(0.2, 1, 2),
        )
        centres = lengths * rng.uniform(0.3, 0.6, 2)
        carried = np.array([
            masses[0] * centres[0] ** 2 + masses[1] * lengths[0] ** 2,
            masses[1] * centres[1] ** 2,
            masses[1] * lengths[0] * centres[1],
        ])  # fmt: skip
        whole = np.array([carried[0] + carried[1], carried[1]])
        flat = rng.random() < 0.3
        weights = 9.81 * np.array([
            masses[0] * centres[0] + masses[1] * lengths[0], masses[1] * centres[1]
        ])  # fmt: skip
        inertial = whole * (1.0 + rng.uniform(0.2, 1.0)) * 2.0
        coulomb = inertial * rng.uniform(0.3, 1.0, 2)
        return cls(
            whole * rng.uniform(0.2, 1.0, 2), carried, weights * (not flat), coulomb,
            coulomb * rng.uniform(0.3, 1.5, 2),
        )  # fmt: skip


def motion(rng: np.random.Generator, rate_hz: float, seconds: float) -> np.ndarray:
    """Return wanted angles of both axes, (samples, 2): Fourier series, or moves."""
    stamps, found = np.arange(int(rate_hz * seconds)) / rate_hz, []
    moves = rng.random() < 0.4
    for _ in AXES:
        angle = np.zeros(stamps.size)
        if moves:
            places = rng.uniform(-1.0, 1.0, int(seconds / MOVE_S) + 2)
            share = np.minimum((stamps % MOVE_S) / (0.75 * MOVE_S), 1.0)
            smooth = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
            at = (stamps / MOVE_S).astype(int)
            angle = places[at] + smooth * (places[at + 1] - places[at])
        else:
            for line in range(1, LINES + 1):
                w = 2.0 * np.pi * BASE_HZ * line
                angle += (
                    rng.normal() * 0.5 / line * np.sin(w * stamps + rng.uniform(0.0, 2 * np.pi))
                )
        found.append(angle)
    return np.array(found).T.copy()


@numba.njit  # type: ignore[untyped-decorator]
def moved(wanted, rotors, carried, weights, coulomb, viscous, bandwidth, rate_hz):
    """Return angles and mean torques of both axes, (samples, 4)."""
    dt = 1.0 / (rate_hz * INNER)
    q, v, z = wanted[0].copy(), np.zeros(2), np.zeros(2)
    torque, load, found = np.zeros(2), np.zeros(2), np.zeros((wanted.shape[0], 4))
    whole = np.array([carried[0] + carried[1], carried[1]]) + rotors
    for k in range(wanted.shape[0]):
        ahead = wanted[min(k + 1, wanted.shape[0] - 1)]
        seen = np.round(q / COUNT_RAD) * COUNT_RAD
        rate = (ahead - wanted[k]) * rate_hz
        asked = whole * (bandwidth**2 * (wanted[k] - seen) + 1.6 * bandwidth * (rate - v))
        found[k, :2] = seen
        for _ in range(INNER):
            torque += dt * (asked - torque) / 0.002
            friction = coulomb * z / BRISTLE_RAD + viscous * v
            z += dt * (v - np.abs(v) * z / BRISTLE_RAD)
            both, c, s = carried[1], np.cos(q[1]), np.sin(q[1])
            m11 = carried[0] + both + 2.0 * carried[2] * c + rotors[0]
            m12, m22 = both + carried[2] * c, both + rotors[1]
            load[0] = -carried[2] * s * (2.0 * v[0] * v[1] + v[1] ** 2)
            load[0] += weights[0] * np.sin(q[0]) + weights[1] * np.sin(q[0] + q[1])
            load[1] = carried[2] * s * v[0] ** 2 + weights[1] * np.sin(q[0] + q[1])
            left = torque - friction - load
            det = m11 * m22 - m12 * m12
            a0 = (m22 * left[0] - m12 * left[1]) / det
            a1 = (m11 * left[1] - m12 * left[0]) / det
            v[0] += dt * a0
            v[1] += dt * a1
            q += dt * v
            found[k, 2:] += torque / INNER
    return found


def needed(arm: Arm, angles: np.ndarray, axis: int, rate_hz: float) -> np.ndarray:
    """Return what an axis needs beside its mean inertia and friction, (samples,), N m.

    Args:
        arm: the model.
        angles: (samples, 2), rad.
        axis: its index.
        rate_hz: of the samples.
    """
    span = 2 * int(SMOOTH_S * rate_hz) + 5
    at = {"window_length": span, "polyorder": 3, "delta": 1.0 / rate_hz, "axis": 0}
    v, a = (savgol_filter(angles, deriv=order, **at) for order in (1, 2))
    c, s = arm.carried[2] * np.cos(angles[:, 1]), arm.carried[2] * np.sin(angles[:, 1])
    lower = arm.weights[1] * np.sin(angles[:, 0] + angles[:, 1])
    if axis == 1:
        return (arm.carried[1] + c) * a[:, 0] + s * v[:, 0] ** 2 + lower
    known = (arm.carried[1] + c) * a[:, 1] - s * (2.0 * v[:, 0] * v[:, 1] + v[:, 1] ** 2)
    known += 2.0 * (c - np.mean(c)) * a[:, 0]
    return known + arm.weights[0] * np.sin(angles[:, 0]) + lower


def recorded(
    rng: np.random.Generator, folder: Path, known: bool
) -> tuple[str, dict[str, float], str]:
    """Import records of one axis; return which, its truth, and what is logged."""
    folder.mkdir()
    arm, axis = Arm.drawn(rng), int(rng.integers(2))
    rate, seconds = float(rng.choice([100, 250, 500])), float(rng.choice([10, 20, 40]))
    told = 1.0 + TOLD_OFF * rng.spawn(1)[0].choice([-1.0, 1.0], 3)
    model = replace(arm, carried=arm.carried * told, weights=arm.weights * told[:2])
    bandwidth, files, inertias = 2.0 * np.pi * rng.uniform(2, 5), [], []
    for number in range(rng.integers(1, 4)):
        share = 1.0 + 0.02 * rng.standard_normal()
        run = moved(
            motion(rng, rate, seconds), arm.rotors, arm.carried, arm.weights, share * arm.coulomb,
            share * arm.viscous, bandwidth, rate,
        )  # fmt: skip
        torque = run[:, 2 + axis]
        torque = torque + 0.02 * np.std(torque) * rng.standard_normal(torque.size)
        files.append(folder / f"run_{number}.csv")
        other = needed(model, run[:, :2], axis, rate)
        table = np.column_stack([np.arange(torque.size) / rate, run[:, axis], torque, other])
        np.savetxt(files[-1], table, fmt="%.9g", delimiter=",", header="t,q,tau,other", comments="")
        turned = arm.carried[2] * np.cos(run[:, 1])
        whole = arm.carried[1] + (arm.carried[0] + 2.0 * turned if axis == 0 else 0.0)
        inertias.append(np.mean(whole + arm.rotors[axis]))
    taken_off = ["known_torque=other:1"] if known else []
    columns = parse_map(["time=t", "torque=tau:1", "position=q:1", *taken_off])
    import_files(files, folder / "bags", ImportOptions(columns=columns))
    truth = {
        "inertia": float(np.mean(inertias)),
        "coulomb": float(arm.coulomb[axis]),
        "viscous": float(arm.viscous[axis]),
    }
    if arm.weights.any() and not known:
        truth["gravity"] = float(arm.weights[axis])
    sheet = truth["inertia"] * float(rng.choice([0.9, 1.1]))
    (folder / "nominal.yaml").write_text(f"{{jm: {sheet!r}, k0: .inf}}\n")
    return AXES[axis], truth, f"{len(files)} x {seconds:.0f} s, {rate:.0f} Hz"


def row(number: int, axis: str, truth: dict[str, float], log: str, found: Diagnosis,
        spent_s: float, known: bool) -> str:  # fmt: skip
    """Return a line of the table."""
    left = {"gravity"} if known else set()
    there = {name.split(".")[0] for name, size in SIZES.items() if size in truth}
    named = {e for cause in found.causes for e in (cause.effect, *cause.others)}
    wrong = [f"{c.effect} {c.present:.2f}" for c in found.causes
             if not {c.effect, *c.others} & (there | ALSO | left)]  # fmt: skip
    ratios, inside = [], []
    for name, size in {"jm": "inertia", **SIZES}.items():
        given, true = found.parameters.get(name), truth.get(size)
        if true is None or given is None:
            ratios.append("-")
            continue
        ratios.append(f"{given.value / true:.2f}")
        inside.append(given.low <= true <= given.high)
    sure = ", ".join(f"{c.effect} {c.present:.2f}" for c in found.causes)
    return (
        f"| {number} | {axis} | {log} | {', '.join(sorted(there - named)) or '-'} | "
        f"{', '.join(wrong) or '-'} | {' | '.join(ratios)} | {sure or found.verdict} | "
        f"{sum(inside)} of {len(inside)} | {spent_s:.0f} |"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="One axis of an arm whose other axis moves.")
    parser.add_argument("--cases", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--known", action="store_true", help="take the known torque off")
    given = parser.parse_args()
    print(describe() + "\n")
    print("| arm | axis | log | missed | wrong | inertia | Coulomb | viscous | gravity | named | "
          "in 95 % | CPU s |")  # fmt: skip
    print("|---" * 12 + "|", flush=True)
    for number in range(given.cases):
        rng = np.random.default_rng([given.seed, number])
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / "arm"
            axis, truth, log = recorded(rng, case, given.known)
            begun = time.process_time()
            found = diagnose(case / "bags", read_nominal(case / "nominal.yaml"))
            spent = time.process_time() - begun
        print(row(number, axis, truth, log, found, spent, given.known), flush=True)


if __name__ == "__main__":
    main()
