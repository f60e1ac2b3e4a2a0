"""Does a second encoder, on the link, tell what a transmission has? Two masses, a bare datasheet.

Run `python benchmarks/two_masses.py --cases 12 --seed 0 --encoders both`, and again with `motor`:
random drives of two masses with a spring of 8 to 40 Hz, damped a little; half of them have play,
three in ten an unbalanced link; Coulomb and viscous friction on both sides, of which the datasheet
(both inertias and the stiffness, 6 to 8 % off) has none. The torque is given, or made by a loop of
speed or position that is not told; a sweep, steps or noise, once to three times. All are integrated
here. The torque log has 1 % of noise, friction scatters by 2 % from run to run, a torque of 3 % of
it wanders. The link's encoder reads 0.03 rad beside, 0.08 % too far and 0.4 ms late.

Counted are what is named but is not there, what is missed, and the ratio of each size to the truth.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
from machine import describe
from robot_joint import wandering

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from gap_diagnosis import read_nominal
from gap_diagnosis.any_record import diagnose
from gap_diagnosis.outcome.diagnosis import Diagnosis

BRISTLE_RAD, COUNT_RAD, INNER_HZ = 2e-3, 2.0 * np.pi / 2**17, 16000.0
ZERO_RAD, SCALE, LATE_S = 0.03, 1.0008, 4e-4
LOOPS = ("torque", "speed", "position")
OUTER = 8.0  # gain of a position loop around a speed loop, 1/s
SIZES: dict[str, Callable[[Diagnosis], float]] = {
    "jm": lambda d: size(d, "jm"),
    "j": lambda d: size(d, "j"),
    "k0": lambda d: size(d, "k0"),
    "coulomb": lambda d: size(d, "coulomb_friction.motor_nm", "coulomb_friction.link_nm"),
    "viscous": lambda d: size(
        d, "viscous_friction.motor_nm_s_rad", "viscous_friction.link_nm_s_rad"
    ),
    "gap": lambda d: size(d, "backlash.half_gap_rad"),
    "gravity": lambda d: size(d, "gravity.torque_nm"),
}
EFFECTS = {
    "coulomb": "coulomb_friction", "viscous": "viscous_friction", "gap": "backlash",
    "gravity": "gravity",
}  # fmt: skip
ALSO = {"presliding_friction", "transmission_damping"}  # in all of them


@dataclass(frozen=True)
class Drive:
    """A random drive and its records.

    Attributes:
        truth: sizes by the names of `SIZES`.
        loop: one of `LOOPS`.
        rate_hz: of the records.
        runs: time, motor angle, torque and link angle, (4, samples) of each.
    """

    truth: dict[str, float]
    loop: str
    rate_hz: float
    runs: list[np.ndarray]

    def recorded(self, folder: Path, both: bool) -> None:
        """Import the records, with the link's encoder or without, and write the datasheet."""
        folder.mkdir()
        files = [folder / f"run_{number}.csv" for number in range(len(self.runs))]
        names = ["time", "position", "torque", "link"][: 4 if both else 3]
        for file, run in zip(files, self.runs, strict=True):
            table, header = run[: len(names)].T, ",".join(names)
            np.savetxt(file, table, fmt="%.9g", delimiter=",", header=header, comments="")
        columns = parse_map([f"{n}={n}" if n == "time" else f"{n}={n}:1" for n in names])
        import_files(files, folder / "bags", ImportOptions(columns=columns))
        told = {"jm": 1.07, "j": 0.94, "k0": 1.08}
        values = ", ".join(f"{name}: {self.truth[name] * off!r}" for name, off in told.items())
        (folder / "nominal.yaml").write_text(f"{{{values}}}\n")


@numba.njit  # type: ignore[untyped-decorator]
def moved(
    wanted, loop, gain, integral, jm, j, k0, damping, gap, dry, wet, gravity, pushed, dt, inner
):  # fmt: skip
    """Return motor angle, torque and link angle; friction is that of motor and link."""
    found, h = np.zeros((3, wanted.size)), dt / inner
    q1, w1, q2, w2, b1, b2, sum_ = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(wanted.size):
        count = np.round(q1 / COUNT_RAD) * COUNT_RAD
        torque = wanted[k]
        if loop > 0:
            error = (wanted[k] if loop == 1 else OUTER * (wanted[k] - count)) - w1
            sum_ += error * dt
            torque = gain * error + integral * sum_
        found[0, k], found[1, k] = count, torque
        found[2, k] = np.round(q2 / COUNT_RAD) * COUNT_RAD
        for _ in range(inner):
            end = BRISTLE_RAD if w1 >= 0.0 else -BRISTLE_RAD
            b1 = end + (b1 - end) * np.exp(-abs(w1) * h / BRISTLE_RAD)
            end = BRISTLE_RAD if w2 >= 0.0 else -BRISTLE_RAD
            b2 = end + (b2 - end) * np.exp(-abs(w2) * h / BRISTLE_RAD)
            twist, between = q1 - q2, 0.0
            if abs(twist) > gap:
                between = k0 * (twist - np.sign(twist) * gap) + damping * (w1 - w2)
            w1 += h * (torque + pushed[k] - between - dry[0] * b1 / BRISTLE_RAD - wet[0] * w1) / jm
            own = dry[1] * b2 / BRISTLE_RAD + wet[1] * w2 + gravity * np.sin(q2)
            w2 += h * (between - own) / j
            q1 += h * w1
            q2 += h * w2
    return found


def drawn(rng: np.random.Generator) -> Drive:
    """Draw a drive and move it."""
    rate, seconds = float(rng.choice([500, 1000, 2000])), float(rng.choice([10, 20]))
    j = 10.0 ** rng.uniform(-3.5, 0)
    jm, swings_hz = j * 2.0 ** rng.uniform(-2, 2), rng.uniform(8, 40)
    reduced = jm * j / (jm + j)
    k0 = reduced * (2.0 * np.pi * swings_hz) ** 2
    loop, fastest = int(rng.integers(3)), rng.uniform(2, 20)
    most = (jm + j) * fastest / 0.3
    coulomb = most * rng.uniform(0.05, 0.3)
    truth = {"jm": jm, "j": j, "k0": k0, "coulomb": coulomb}
    truth["viscous"] = coulomb / fastest * rng.uniform(0.2, 1.0)
    if rng.random() < 0.5:
        truth["gap"] = most / k0 * rng.uniform(0.5, 3)
    if rng.random() < 0.3:
        truth["gravity"] = coulomb * rng.uniform(0.5, 3)
    shares = np.array([1.0, 0.0]) + rng.uniform(0.3, 0.9) * np.array([-1.0, 1.0])
    stamps, runs = np.arange(int(seconds * rate)) / rate, []
    bandwidth = 2.0 * np.pi * swings_hz / 4.0
    gain = (jm + j) * bandwidth
    for _ in range(rng.integers(1, 4)):
        shape = shaped(rng, stamps, swings_hz)
        wanted = shape * most if loop == 0 else shape * fastest
        if loop == 2:
            wanted = np.cumsum(0.3 * wanted) / rate
        scatter = 1.0 + 0.02 * rng.standard_normal()
        q, torque, link = moved(
            wanted, loop, gain, gain * bandwidth / 5.0, jm, j, k0,
            0.06 * np.sqrt(reduced * k0), truth.get("gap", 0.0), scatter * coulomb * shares,
            scatter * truth["viscous"] * shares, truth.get("gravity", 0.0),
            0.03 * coulomb * wandering(rng, stamps.size, rate), 1.0 / rate,
            max(int(INNER_HZ / rate), 20),
        )  # fmt: skip
        torque += 0.01 * np.std(torque) * rng.standard_normal(stamps.size)
        link = ZERO_RAD + SCALE * np.interp(stamps - LATE_S, stamps, link)
        runs.append(np.array([stamps, q, torque, link]))
    return Drive(truth, LOOPS[loop], rate, runs)


def shaped(rng: np.random.Generator, stamps: np.ndarray, swings_hz: float) -> np.ndarray:
    """Return a sweep, steps or noise past the resonance, (samples,), of rms about a half."""
    rate, kind = 1.0 / stamps[1], rng.integers(3)
    if kind == 0:
        frequency = np.geomspace(0.3, 1.6 * swings_hz, stamps.size)
        return np.sin(2.0 * np.pi * np.cumsum(frequency) / rate)
    if kind == 1:
        return rng.choice([-1.0, 0.0, 1.0], int(5.0 * stamps[-1]) + 2)[(5.0 * stamps).astype(int)]
    lines = np.fft.rfftfreq(stamps.size, 1.0 / rate)
    inside = (lines > 0.2) & (lines < 1.5 * swings_hz)
    noise = np.fft.irfft(np.where(inside, np.exp(2j * np.pi * rng.random(lines.size)), 0.0))
    return np.resize(noise / (2.0 * np.std(noise)), stamps.size)


def size(found: Diagnosis, *names: str) -> float:
    """Return the sum of parameters of a diagnosis; zero for those that it lacks."""
    return sum(found.parameters[name].value for name in names if name in found.parameters)


def row(number: int, drive: Drive, found: Diagnosis, spent_s: float) -> str:
    """Return a line of the table."""
    there = {EFFECTS[name] for name in EFFECTS if name in drive.truth}
    named = {e for cause in found.causes for e in (cause.effect, *cause.others)}
    wrong = [c.effect for c in found.causes if not {c.effect, *c.others} & (there | ALSO)]
    ratios = [
        f"{of(found) / drive.truth[name]:.2f}" if name in drive.truth else "-"
        for name, of in SIZES.items()
    ]
    seconds = drive.runs[0].shape[1] / drive.rate_hz
    return (
        f"| {number} | {drive.loop}, {len(drive.runs)} x {seconds:.0f} s, {drive.rate_hz:.0f} Hz | "
        f"{', '.join(sorted(there - named)) or '-'} | {', '.join(wrong) or '-'} | "
        f"{' | '.join(ratios)} | {spent_s:.0f} |"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Two masses beside a bare datasheet.")
    parser.add_argument("--cases", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--encoders", choices=["both", "motor"], default="both")
    given = parser.parse_args()
    print(describe() + "\n")
    print(f"| {given.encoders} | log | missed | wrong | {' | '.join(SIZES)} | CPU s |")
    print("|---" * (5 + len(SIZES)) + "|", flush=True)
    for number in range(given.cases):
        drive = drawn(np.random.default_rng([given.seed, number]))
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / "drive"
            drive.recorded(case, given.encoders == "both")
            begun = time.process_time()
            found = diagnose(case / "bags", read_nominal(case / "nominal.yaml"))
            spent = time.process_time() - begun
        print(row(number, drive, found, spent), flush=True)


if __name__ == "__main__":
    main()
