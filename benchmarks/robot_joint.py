"""Does a diagnosis find all that a robot joint has, where its datasheet is an inertia alone?

Run `python benchmarks/robot_joint.py --cases 12 --seed 0`: joints of 1e-2 to 30 kg m2 with Coulomb
and viscous friction, most with gravity, some with friction that grows with the load, integrated
here by a law of their own, not by the simulator that the diagnosis fits. A drive follows Fourier
series of five lines at 100 to 500 samples a second, once to three times; the loop is not described.
The torque log has 3 % of noise, other axes push with 5 % of the friction, which scatters by 2 %
from run to run. Counted are what is named, what is named but is not there, the ratio of each
size to the truth, and how many of the intervals hold it. Bristles are there in every joint.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
from machine import describe

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from gap_diagnosis import read_nominal
from gap_diagnosis.any_record import diagnose
from gap_diagnosis.outcome.diagnosis import Diagnosis

BASE_HZ, LINES, BRISTLE_RAD, ENCODER = 0.1, 5, 0.002, 2.0 * np.pi / 2**19
DRIVE_S, INNER_HZ = 0.004, 8000.0
TOLD = ("jm", "coulomb_friction.motor_nm", "viscous_friction.motor_nm_s_rad", "gravity.torque_nm",
        "load_friction.coefficient")  # fmt: skip


@dataclass(frozen=True)
class Joint:
    """A random joint and how it is moved."""

    rate_hz: float
    seconds: float
    inertia: float
    coulomb: float
    viscous: float
    gravity: float
    direction: float
    of_load: float
    bandwidth: float
    integral: float
    motions: tuple[np.ndarray, ...]

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Joint:
        """Draw one; each motion is angle, speed and acceleration, (3, samples)."""
        rate, seconds = float(rng.choice([100, 125, 250, 500])), float(rng.choice([20, 40, 60]))
        inertia = 10.0 ** rng.uniform(-2, 1.5)
        motions = tuple(motion(rng, rate, seconds) for _ in range(rng.integers(1, 4)))
        speed, hardest = (float(np.sqrt(np.mean(motions[0][k] ** 2))) for k in (1, 2))
        inertial = inertia * hardest
        friction, ratio = inertial * 10.0 ** rng.uniform(-0.2, 0.7), 2.0 ** rng.uniform(-1, 1)
        bandwidth = 2.0 * np.pi * rng.uniform(1.5, 4)
        gravity = inertial * rng.uniform(1, 6) * (rng.random() < 0.7)
        return cls(
            rate, seconds, inertia, friction * ratio / (1 + ratio), friction / (1 + ratio) / speed,
            gravity,
            rng.uniform(-1, 1) * (rng.random() < 0.5),
            rng.uniform(0.05, 0.15) * (gravity > 0.0) * (rng.random() < 0.5),
            bandwidth, inertia * bandwidth**3 / 6.0 * (rng.random() < 0.5), motions,
        )  # fmt: skip

    def recorded(self, rng: np.random.Generator, folder: Path) -> None:
        """Move it, import what is logged, and write a datasheet whose inertia is 10 % off."""
        folder.mkdir()
        files = []
        for number, wanted in enumerate(self.motions):
            share = 1.0 + 0.02 * rng.standard_normal()
            pushed = wandering(rng, wanted.shape[1], self.rate_hz) * 0.05 * self.coulomb
            position, torque = moved(
                *wanted, pushed, self.inertia, self.coulomb * share, self.viscous * share,
                self.gravity, self.direction, self.of_load, self.bandwidth, self.integral,
                self.rate_hz, int(INNER_HZ / self.rate_hz),
            )  # fmt: skip
            rms = np.sqrt(np.mean(torque**2))
            torque = torque + 0.03 * rms * rng.standard_normal(torque.size)
            files.append(folder / f"run_{number}.csv")
            stamps = np.arange(torque.size) / self.rate_hz
            table = np.column_stack([stamps, wanted[0], position, torque])
            head = {"delimiter": ",", "header": "t,wanted,q,tau", "comments": ""}
            np.savetxt(files[-1], table, fmt="%.9g", **head)
        columns = parse_map(["time=t", "reference=wanted:1", "torque=tau:1", "position=q:1"])
        import_files(files, folder / "bags", ImportOptions(columns=columns))
        told = self.inertia * float(rng.choice([0.9, 1.1]))
        (folder / "nominal.yaml").write_text(f"{{jm: {told!r}, k0: .inf}}\n")

    def truth(self) -> tuple[float, ...]:
        """Return the sizes of `TOLD`."""
        return self.inertia, self.coulomb, self.viscous, self.gravity, self.of_load


def motion(rng: np.random.Generator, rate_hz: float, seconds: float) -> np.ndarray:
    """Return angle, speed and acceleration of a random Fourier series, (3, samples)."""
    stamps, found = np.arange(int(rate_hz * seconds)) / rate_hz, 0.0
    for line in range(1, LINES + 1):
        w = 2.0 * np.pi * BASE_HZ * line
        turn = rng.normal() * 0.6 / line * np.exp(1j * (w * stamps + rng.uniform(0, 2 * np.pi)))
        found = found + np.array([turn.imag, (1j * w * turn).imag, (-w * w * turn).imag])
    return np.asarray(found)


def wandering(rng: np.random.Generator, samples: int, rate_hz: float) -> np.ndarray:
    """Return noise of rms one that is slow against the motion, (samples,)."""
    decay = np.exp(-1.2 / rate_hz)
    steps, found = rng.standard_normal(samples) * np.sqrt(1.0 - decay**2), np.zeros(samples)
    for k in range(1, samples):
        found[k] = decay * found[k - 1] + steps[k]
    return found


@numba.njit  # type: ignore[untyped-decorator]
def moved(
    wanted, speed, hardest, pushed, inertia, coulomb, viscous, gravity, direction, of_load,
    bandwidth, integral, rate_hz, inner,
):  # fmt: skip
    """Return position and torque under a PID loop with feed-forward of most of the inertia."""
    dt = 1.0 / (rate_hz * inner)
    angle, v, z, torque, sum_ = wanted[0], 0.0, 0.0, 0.0, 0.0
    found = np.zeros((2, wanted.size))
    for k in range(wanted.size):
        seen = np.round(angle / ENCODER) * ENCODER
        error = wanted[k] - seen
        sum_ += integral * error / rate_hz
        asked = inertia * (bandwidth**2 * error + 1.4 * bandwidth * (speed[k] - v)) + sum_
        asked += 0.9 * inertia * hardest[k]
        found[0, k] = seen
        for _ in range(inner):
            torque += dt * (asked - torque) / DRIVE_S
            load = gravity * np.sin(angle + direction)
            friction = (coulomb + of_load * abs(load)) * z / BRISTLE_RAD + viscous * v
            z += dt * (v - abs(v) * z / BRISTLE_RAD)
            v += dt * (torque - friction - load + pushed[k]) / inertia
            angle += dt * v
            found[1, k] += torque / inner
    return found


def row(number: int, joint: Joint, found: Diagnosis, spent_s: float) -> str:
    """Return a line of the table."""
    there = {"presliding_friction"} | {
        name.split(".")[0] for name, size in zip(TOLD[1:], joint.truth()[1:], strict=True) if size
    }
    ratios, inside = [], []
    for name, true in zip(TOLD, joint.truth(), strict=True):
        size = found.parameters.get(name)
        ratios.append("-" if size is None or not true else f"{size.value / true:.2f}")
        if size is not None and true:
            inside.append(size.low <= true <= size.high)
    missed = there - set(found.effects)
    named = {e for cause in found.causes for e in (cause.effect, *cause.others)}
    wrong = [c.effect for c in found.causes if not {c.effect, *c.others} & there]
    missed -= named
    return (
        f"| {number} | {len(joint.motions)} x {joint.seconds:.0f} s, {joint.rate_hz:.0f} Hz | "
        f"{', '.join(sorted(missed)) or '-'} | {', '.join(wrong) or '-'} | {' | '.join(ratios)} | "
        f"{sum(inside)} of {len(inside)} | {spent_s:.0f} |"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="A robot joint beside a datasheet of inertia.")
    parser.add_argument("--cases", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    print(describe() + "\n")
    print("| joint | log | missed | wrong | inertia | Coulomb | viscous | gravity | of load | "
          "in 95 % | CPU s |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|---|", flush=True)
    for number in range(given.cases):
        rng = np.random.default_rng([given.seed, number])
        joint = Joint.drawn(rng)
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / "joint"
            joint.recorded(rng, case)
            begun = time.process_time()
            found = diagnose(case / "bags", read_nominal(case / "nominal.yaml"))
            spent = time.process_time() - begun
        print(row(number, joint, found, spent), flush=True)


if __name__ == "__main__":
    main()
