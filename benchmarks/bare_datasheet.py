"""Does a diagnosis find the frictions of an axis whose datasheet is an inertia alone?

Run `python benchmarks/bare_datasheet.py --cases 12 --seed 0`: axes of 1e-3 to 100 kg m2
with Coulomb and viscous friction, bristles, a constant torque and perhaps cogging, integrated here
by a law of their own, not by the simulator that the diagnosis fits. A P velocity loop within
a position loop moves each from place to place in two records, which are imported with the loop
described (gains unknown) or not at all. With `--remainder` friction also follows no law of the
catalogue: it bends with speed, differs between directions, drifts within a run and scatters from
run to run. Counted is what is named, and the error of both frictions,
which are equally great at the rms speed within a factor of four.
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

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from gap_diagnosis import read_nominal
from gap_diagnosis.any_record import diagnose

RATE_HZ, SUBSTEPS, SECONDS = 500.0, 40, 16.0
FRICTIONS = ("coulomb_friction.motor_nm", "viscous_friction.motor_nm_s_rad")


@dataclass(frozen=True)
class Axis:
    """A random rigid axis with its loop and its moves."""

    inertia: float
    coulomb: float
    viscous: float
    bristle_rad: float
    offset: float
    cogging: float
    cycles: float
    k_position: float
    k_velocity: float
    step_rad: float
    runs: tuple[np.ndarray, ...]
    loop_described: bool
    friction_of_runs: tuple[float, ...] = (1.0, 1.0)
    bend: float = 0.0
    asymmetry: float = 0.0
    drift_per_s: float = 0.0

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Axis:
        """Draw one."""
        inertia, crossover = 10.0 ** rng.uniform(-3, 2), rng.uniform(4.0, 12.0)
        k_velocity, k_position = inertia * 2.0 * np.pi * crossover, 2.0 * np.pi * crossover / 4.0
        size, speed = 10.0 ** rng.uniform(-0.7, 0.7), rng.uniform(0.5, 2.0)
        runs = tuple(moves(rng, size, speed * size, 8.0 * speed * size) for _ in range(2))
        velocity = np.diff(np.concatenate(runs)) * RATE_HZ
        velocity = velocity[np.abs(velocity) < 10.0 * speed * size]
        rms = float(np.sqrt(np.mean(velocity**2)))
        inertial = inertia * 8.0 * speed * size
        friction = inertial * 10.0 ** rng.uniform(-0.7, 0.3)
        ratio = 2.0 ** rng.uniform(-1, 1)
        coulomb, viscous = friction * ratio / (1 + ratio), friction / (1 + ratio) / rms
        stiffness = k_velocity * k_position
        return cls(
            inertia, coulomb, viscous,
            coulomb / (stiffness * 10.0 ** rng.uniform(0, 1.5)),
            coulomb * rng.uniform(-0.2, 0.2),
            coulomb * rng.choice([0.0, 0.15]),
            rng.uniform(10, 40) / size,
            k_position, k_velocity, size * 1e-5, runs, bool(rng.random() < 0.5),
        )  # fmt: skip

    def with_remainder(self, rng: np.random.Generator) -> Axis:
        """Return the axis with what no law of the catalogue accounts for."""
        return replace(
            self,
            friction_of_runs=tuple(1.0 + 0.03 * rng.standard_normal(2)),
            bend=rng.uniform(0.1, 0.3)
            / max(np.abs(np.diff(run)).max() for run in self.runs)
            / RATE_HZ,
            asymmetry=rng.uniform(-0.06, 0.06),
            drift_per_s=rng.uniform(-0.06, 0.06) / SECONDS,
        )

    def frictions(self) -> tuple[float, float]:
        """Return Coulomb and viscous friction as the nearest straight line over the speeds."""
        speed = np.abs(np.concatenate([np.diff(run) for run in self.runs])) * RATE_HZ
        share = float(np.mean(self.friction_of_runs)) * (1.0 + self.drift_per_s * SECONDS / 2.0)
        slope = 1.0 - self.bend * float(np.sum(speed**3) / np.sum(speed**2))
        return self.coulomb * share, self.viscous * share * slope

    def simulated(self, run: int) -> tuple[np.ndarray, np.ndarray]:
        """Return position and torque of one run."""
        share = self.friction_of_runs[run]
        position, torque = simulated(
            self.runs[run], self.inertia, self.coulomb * share, self.viscous * share,
            self.bristle_rad, self.offset, self.cogging, self.cycles, self.k_position,
            self.k_velocity, self.step_rad, self.bend, self.asymmetry, self.drift_per_s,
        )  # fmt: skip
        return position, torque


def moves(rng: np.random.Generator, size: float, fastest: float, hardest: float) -> np.ndarray:
    """Return trapezoids of the speed from place to place with rests between, (samples,)."""
    parts, place = [np.zeros(int(0.3 * RATE_HZ))], 0.0
    while sum(map(len, parts)) < SECONDS * RATE_HZ:
        way = rng.uniform(-0.5, 0.5) * 2.0 * size - place
        speed = min(fastest * rng.uniform(0.4, 1.0), np.sqrt(abs(way) * hardest))
        rising = speed / hardest
        whole = abs(way) / speed + rising
        t = np.arange(0.0, whole, 1.0 / RATE_HZ)
        gone = np.where(t < rising, hardest * t**2 / 2, speed * (t - rising / 2))
        gone = np.where(t > whole - rising, abs(way) - hardest * (whole - t) ** 2 / 2, gone)
        parts += [
            place + np.sign(way) * gone,
            np.full(int(rng.uniform(0.1, 0.4) * RATE_HZ), place + way),
        ]
        place += way
    return np.concatenate(parts)[: int(SECONDS * RATE_HZ)]


@numba.njit  # type: ignore[untyped-decorator]
def simulated(
    reference, inertia, coulomb, viscous, bristle, offset, cogging, cycles, kp, kv, step,
    bend, asymmetry, drift
):  # fmt: skip
    """Return position and torque of an axis under its loop, (2, samples)."""
    dt = 1.0 / (RATE_HZ * SUBSTEPS)
    angle = speed = deflection = before = 0.0
    found = np.zeros((2, reference.size))
    stiffness = coulomb / bristle
    for k in range(reference.size):
        seen = np.round(angle / step) * step
        torque = kv * (kp * (reference[k] - seen) - (seen - before) * RATE_HZ)
        before = seen
        found[0, k], found[1, k] = seen, torque
        warmth = 1.0 + drift * k / RATE_HZ
        for _ in range(SUBSTEPS):
            deflection += dt * (speed - abs(speed) * deflection / bristle)
            friction = stiffness * deflection + viscous * speed * (1.0 - bend * abs(speed))
            friction *= warmth * (1.0 + asymmetry * np.sign(speed))
            load = friction + offset + cogging * np.sin(cycles * angle)
            speed += dt * (torque - load) / inertia
            angle += dt * speed
    return found


def recorded(axis: Axis, folder: Path) -> None:
    """Import the records of an axis, and write its datasheet, whose inertia is 7 % off."""
    folder.mkdir()
    files: list[Path] = []
    for number, reference in enumerate(axis.runs):
        position, torque = axis.simulated(number)
        files.append(folder / f"run_{number}.npz")
        np.savez(files[-1], r=reference, y=position, u=torque)
    loop = folder / "loop.yaml"
    loop.write_text("{kind: p_pi, k_position: unknown, k_velocity: unknown}\n")
    options = ImportOptions(
        columns=parse_map(["reference=r:1", "torque=u:1", "position=y:1"]),
        sample_rate_hz=RATE_HZ,
        controllers=(loop,) if axis.loop_described else (),
    )
    import_files(files, folder / "bags", options)
    (folder / "nominal.yaml").write_text(f"{{jm: {1.07 * axis.inertia!r}, k0: .inf}}\n")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Frictions beside a datasheet of inertia alone.")
    parser.add_argument("--cases", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--remainder", action="store_true")
    given = parser.parse_args()
    print(describe() + "\n")
    print("| axis | loop | bristle | cogging | named | Coulomb | viscous | in 95 % | CPU s |")
    print("|---|---|---|---|---|---|---|---|---|", flush=True)
    for number in range(given.cases):
        rng = np.random.default_rng([given.seed, number])
        axis = Axis.drawn(rng)
        axis = axis.with_remainder(rng) if given.remainder else axis
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / "axis"
            recorded(axis, case)
            begun = time.process_time()
            found = diagnose(case / "bags", read_nominal(case / "nominal.yaml"))
            spent = time.process_time() - begun
        shown, inside = [], []
        for name, true in zip(FRICTIONS, axis.frictions(), strict=True):
            parameter = found.parameters.get(name)
            shown.append("-" if parameter is None else f"{parameter.value / true:.2f}")
            if parameter is not None:
                inside.append(parameter.low <= true <= parameter.high)
        print(
            f"| {number} | {'gains unknown' if axis.loop_described else 'unknown'} | "
            f"{axis.coulomb / axis.bristle_rad / (axis.k_position * axis.k_velocity):.1f} | "
            f"{axis.cogging / axis.coulomb:.2f} | {' + '.join(found.effects) or found.verdict} | "
            f"{' | '.join(shown)} | {sum(inside)} of {len(inside)} | {spent:.0f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
