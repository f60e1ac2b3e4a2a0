"""Random plain machines and their logs, integrated by laws of their own.

- `swing`: a pendulum that is let go without a motor, twice to four times from other angles; it has
  gravity, Coulomb and viscous friction. Only ratios to its inertia show.
- `stairs`: a drive whose speed loop holds one speed after the other, both ways, up to a greatest
  one, as friction is measured; Coulomb and viscous friction, half of them with breakaway above.
- `fan`: a drive that steps its torque and logs speed in rpm; the load grows with its square, beside
  Coulomb and viscous friction.
- `leg`: a joint under a proportional and derivative law of 1 kHz or more, of which targets and
  angles alone are logged, at 50 to 400 Hz: a swept sine or steps; friction, half of them gravity, a
  third a delay of 4 ms. The law's file says at which rate it ran.
- `servo`: a hobby servo that logs position in 4096 steps and current in coarse counts, at 50 to
  200 Hz: a swept sine, sines, or moves of one speed; friction that falls from breakaway, half of
  them gravity, half of them friction under that load. Its law is not told.
- `stage`: a table on a screw, in metres and newtons, that goes from place to place at several
  speeds, logged at 1 kHz; friction of which half are unequal both ways, which a constant force
  tells as well. Half of the second runs are the first ones with pushes added to the force. Half
  of the laws, a position loop around a speed loop, are told.
- `screw`: a screw's drive at 250 to 1000 Hz that goes on at one speed after the other, both ways,
  with short rests; friction far above what its inertia takes, of most it falls from breakaway, and
  most have a ripple of 2 to 6 % of it. Its law is not told.
- `motor`: a small motor with a brush, driven by a voltage that steps, sweeps or ramps up and down,
  at 50 to 500 Hz; its back-EMF is viscous friction, beside Coulomb friction of 3 to 15 % of the
  voltage, of half of them falling from breakaway. Half of the drivers have a dead band, a third
  act one or two samples late. Angles have 500 to 4096 counts.
- `rotor`: a motor with strong cogging that turns at one speed, or at a few, one way or both, at 500
  to 1000 Hz; Coulomb and viscous friction, which one speed does not tell apart. Its law is not
  told, and two thirds of the records begin with the start from rest.
- `bristles`: a table whose friction four elastic elements make that slip one after the other
  (Maxwell slip), under a position loop whose targets are noise of 0.1 to 3 Hz: of a third of the
  way over which it yields, of one and a half, and of twenty. The force is logged with 0 to 3 % of
  noise that the table does not feel, at 1 kHz. Its law is not told.
- `flexure`: a joint that flexures hold, whose stiffness grows with the square of its angle from
  where it rests, under a position loop whose targets are slow sines, sweeps or sums of sines; its
  flexures take a third to all of the loop's torque, beside Coulomb and viscous friction. Its law is
  not told.

Friction scatters by 2 % from run to run, beside a torque that wanders (not of `bristles`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np
from robot_joint import wandering

from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions

BRISTLE, ACCELERATES_S, INNER_HZ, SMOOTHED = 0.003, 0.5, 8000.0, 0.3
_YIELDS = np.array([0.1, 0.25, 0.5, 1.0])  # of the way over which all elements yield
SIZES = {
    "gravity.torque_nm": "gravity",
    "coulomb_friction.motor_nm": "coulomb",
    "viscous_friction.motor_nm_s_rad": "viscous",
    "quadratic_friction.motor_nm_s2_rad2": "quadratic",
    "stribeck_friction_motor.torque_nm": "breakaway",
    "load_friction.coefficient": "of load",
    "delay.time_s": "delay",
    "torque_bias.torque_nm": "bias",
    "cogging.amplitude_nm": "ripple",
    "dead_band.width_nm": "dead band",
    "hardening_spring.cubic_nm_rad3": "cubic",
}


@dataclass(frozen=True)
class Machine:
    """A random machine and its records.

    Attributes:
        truth: inertia, and sizes by the names of `SIZES`.
        rate_hz: of the records.
        runs: (columns, samples) of each; a position may be a speed.
        columns: of each run.
        position: unit of positions and references.
        swings: whether sizes show over the inertia only.
        law: file of the controller that made the torque, where targets were logged; or empty.
    """

    truth: dict[str, float]
    rate_hz: float
    runs: list[np.ndarray]
    columns: tuple[str, ...] = ("time", "position", "torque")
    position: str = "1"
    swings: bool = False
    law: str = ""

    def recorded(self, folder: Path, told: float) -> None:
        """Import the records and write a datasheet with an inertia."""
        folder.mkdir()
        files = [folder / f"run_{number}.csv" for number in range(len(self.runs))]
        for file, run in zip(files, self.runs, strict=True):
            header = ",".join(self.columns)
            np.savetxt(file, run.T, fmt="%.9g", delimiter=",", header=header, comments="")
        law = folder / "law.yaml"
        law.write_text(self.law)
        laws = (law,) if self.law else ()
        given = [f"{name}={name}:{self.position if name in ('position', 'reference') else 1}"
                 for name in self.columns[1:]]  # fmt: skip
        columns = parse_map(["time=time", *given], described=bool(laws))
        import_files(files, folder / "bags", ImportOptions(columns=columns, controllers=laws))
        (folder / "nominal.yaml").write_text(f"{{jm: {told!r}, k0: .inf}}\n")


@numba.njit  # type: ignore[untyped-decorator]
def moved(
    wanted, gain, integral, damping, late, angle, inertia, gravity, coulomb, viscous, quadratic,
    breakaway, fallen, of_load, ripple, cycles, stiffness, cubic, rest, pushed, step, touch,
    rate_hz, often, inner,
):  # fmt: skip
    """Return position, mean torque and speed.

    With damping it is wanted positions, with a gain alone speeds, else torques. The law runs so
    often in a sample; its torque comes late by so many of its runs, its speed through a filter.
    """
    dt, speed, bristle, sum_, torque = 1.0 / (rate_hz * inner), 0.0, 0.0, 0.0, 0.0
    every, found = inner // often, np.zeros((3, wanted.size))
    smooth, runs, waiting = 0.0, 0, np.zeros(late + 1)
    for k in range(wanted.size):
        found[0, k], found[2, k] = np.round(angle / step) * step, speed
        for i in range(inner):
            if gain == 0.0:
                torque = wanted[k]
            elif i % every == 0:
                smooth += SMOOTHED * (speed - smooth)
                if damping > 0.0:
                    counted = np.round(angle / step) * step
                    sum_ += integral * (wanted[k] - counted) * dt * every
                    asked = gain * (wanted[k] - counted) - damping * smooth + sum_
                else:
                    error = wanted[k] - speed
                    sum_ += integral * error * dt * every
                    asked = gain * error + sum_
                waiting[runs % waiting.size] = asked
                runs += 1
                torque = waiting[runs % waiting.size]
            load = gravity * np.sin(angle)
            bent = angle - rest
            held = load + ripple * np.sin(cycles * angle + 1.0)
            held += (stiffness + cubic * bent * bent) * bent
            level = coulomb + breakaway * np.exp(-((speed / fallen) ** 2)) + of_load * abs(load)
            ends = touch if speed >= 0.0 else -touch
            bristle = ends + (bristle - ends) * np.exp(-abs(speed) * dt / touch)
            lost = level * bristle / touch + viscous * speed + quadratic * abs(speed) * speed
            speed += dt * (torque + pushed[k] - lost - held) / inertia
            angle += dt * speed
            found[1, k] += torque / inner
    return found


def run_of(
    truth: dict[str, float], wanted: np.ndarray, rate_hz: float, rng: np.random.Generator,
    wanders: float, *, gain: float = 0.0, integral: float = 0.0, damping: float = 0.0,
    angle: float = 0.0, fallen: float = 1.0, cycles: float = 1.0, step: float = 1e-6,
    touch: float = BRISTLE, pushed: np.ndarray | float = 0.0, often: int = 20,
) -> np.ndarray:  # fmt: skip
    """Return position, torque and speed of one run, (3, samples)."""
    share, size = 1.0 + 0.02 * rng.standard_normal(), truth.get
    inner = max(int(INNER_HZ / rate_hz), 20)
    late = round(size("delay", 0.0) * rate_hz * inner / (inner // often))
    return moved(
        wanted, gain, integral, damping, late, angle, truth["inertia"], size("gravity", 0.0),
        share * truth["coulomb"], share * truth["viscous"], size("quadratic", 0.0),
        share * size("breakaway", 0.0), fallen, size("of load", 0.0), size("ripple", 0.0), cycles,
        size("stiffness", 0.0), size("cubic", 0.0), size("rest", 0.0),
        wanders * truth["coulomb"] * wandering(rng, wanted.size, rate_hz) + size("bias", 0.0)
        + pushed, step, touch, rate_hz, often, inner,
    )  # fmt: skip


def swing(rng: np.random.Generator) -> Machine:
    """Draw a pendulum that is let go."""
    rate, seconds = float(rng.choice([100, 200, 500])), float(rng.choice([5, 10, 20]))
    inertia, natural = 10.0 ** rng.uniform(-3, 0.5), rng.uniform(3, 9)
    gravity = inertia * natural**2
    truth = {
        "inertia": inertia,
        "gravity": gravity,
        "coulomb": gravity * rng.uniform(0.005, 0.06),
        "viscous": 2.0 * inertia * natural * rng.uniform(0.005, 0.06),
    }
    step = 2.0 * np.pi / float(rng.choice([2**12, 2**14, 2**17]))
    nothing, runs = np.zeros(int(rate * seconds)), []
    for _ in range(rng.integers(2, 5)):
        angle = rng.uniform(0.6, 2.5) * rng.choice([-1, 1])
        found = run_of(truth, nothing, rate, rng, 0.01, angle=angle, step=step)
        runs.append(np.array([np.arange(nothing.size) / rate, found[0], nothing]))
    return Machine(truth, rate, runs, swings=True)


def stairs(rng: np.random.Generator) -> Machine:
    """Draw a drive that holds one speed after the other."""
    rate, inertia = float(rng.choice([50, 100, 250])), 10.0 ** rng.uniform(-4, 0.5)
    fastest, hold = rng.uniform(2, 60), float(rng.choice([2, 4]))
    most = inertia * fastest / ACCELERATES_S * rng.uniform(0.5, 4)
    truth = {"inertia": inertia, "coulomb": most * rng.uniform(0.2, 0.7)}
    truth["viscous"] = (most - truth["coulomb"]) / fastest
    fallen = fastest * rng.uniform(0.02, 0.1)
    if rng.random() < 0.5:
        truth["breakaway"] = 0.5 * truth["coulomb"]
    speeds = fastest * np.geomspace(0.02, 1.0, int(rng.integers(5, 9)))
    asked = np.concatenate([np.full(int(hold * rate), s) for one in speeds for s in (one, -one)])
    asked = np.concatenate([np.zeros(int(rate)), asked])
    wanted, most_change = np.zeros_like(asked), fastest / ACCELERATES_S / rate
    for k in range(1, asked.size):
        wanted[k] = wanted[k - 1] + np.clip(asked[k] - wanted[k - 1], -most_change, most_change)
    step, bandwidth = 2.0 * np.pi / float(rng.choice([2**12, 2**16])), 20.0 * rng.uniform(1, 3)
    gain, integral, runs = inertia * bandwidth, inertia * bandwidth**2 / 4.0, []
    for _ in range(rng.integers(1, 4)):
        found = run_of(
            truth, wanted, rate, rng, 0.03, gain=gain, integral=integral, fallen=fallen, step=step
        )
        torque = found[1] + 0.02 * most * rng.standard_normal(wanted.size)
        runs.append(np.array([np.arange(wanted.size) / rate, found[0], torque]))
    return Machine(truth, rate, runs)


def fan(rng: np.random.Generator) -> Machine:
    """Draw a drive whose load grows with the square of its speed."""
    rate, seconds = float(rng.choice([20, 50, 100])), float(rng.choice([60, 120]))
    inertia, fastest = 10.0 ** rng.uniform(-5, -1), rng.uniform(50, 400)
    slow = rng.uniform(0.5, 4)
    most = inertia * fastest / slow
    truth = {
        "inertia": inertia,
        "coulomb": most * rng.uniform(0.03, 0.2),
        "viscous": most * rng.uniform(0.03, 0.2) / fastest,
        "quadratic": most * rng.uniform(0.4, 0.8) / fastest**2,
    }
    samples, hold, runs = int(rate * seconds), int(3 * slow * rate), []
    for _ in range(rng.integers(1, 4)):
        asked = np.repeat(most * rng.uniform(0.1, 1.0, samples // hold + 1), hold)[:samples]
        found = run_of(truth, asked, rate, rng, 0.02)
        speed = found[2] + 0.002 * fastest * rng.standard_normal(samples)
        torque = found[1] + 0.01 * most * rng.standard_normal(samples)
        runs.append(np.array([np.arange(samples) / rate, speed * 30.0 / np.pi, torque]))
    return Machine(truth, rate, runs, position="rpm")


def leg(rng: np.random.Generator) -> Machine:
    """Draw a joint whose targets and angles are logged more slowly than its law runs."""
    rate, seconds = float(rng.choice([50, 100, 200, 400])), float(rng.choice([10, 20, 40]))
    inertia, natural = 10.0 ** rng.uniform(-3, -0.5), 2.0 * np.pi * rng.uniform(2, 6)
    gain, damping = inertia * natural**2, 2.0 * rng.uniform(0.2, 0.8) * inertia * natural
    widest, highest_hz = rng.uniform(0.2, 0.8), min(rate / 12.0, rng.uniform(3, 8))
    truth = {
        "inertia": inertia,
        "coulomb": gain * widest * rng.uniform(0.02, 0.25),
        "viscous": damping * rng.uniform(0.1, 0.8),
    }
    if rng.random() < 0.5:
        truth["gravity"] = gain * widest * rng.uniform(0.2, 0.8)
    if rng.random() < 1.0 / 3.0:
        truth["delay"] = 0.004
    stamps, runs = np.arange(int(rate * seconds)) / rate, []
    swept = np.sin(2.0 * np.pi * (0.1 * stamps + (highest_hz - 0.1) * stamps**2 / (2.0 * seconds)))
    steps = np.sign(np.sin(np.pi * stamps)) * np.minimum(1.0, stamps)
    for number in range(rng.integers(1, 4)):
        target = widest * rng.uniform(0.6, 1.0) * (steps if number % 2 else swept)
        found = run_of(
            truth, target, rate, rng, 0.03, gain=gain, damping=damping, step=2.0 * np.pi / 2**16
        )
        runs.append(np.array([stamps, found[0], target]))
    ran_hz = 20.0 * rate
    filtered = -ran_hz * np.log(1.0 - SMOOTHED)
    law = f"kind: pd\np: {gain}\nd: {damping}\nn: {filtered}\nderivative_on: measurement\n"
    columns = ("time", "position", "reference")
    return Machine(truth, rate, runs, columns, law=f"{law}rate_hz: {ran_hz}\n")


def servo(rng: np.random.Generator) -> Machine:
    """Draw a hobby servo that logs its current."""
    rate, seconds = float(rng.choice([50, 100, 200])), float(rng.choice([10, 20, 40]))
    inertia, natural = 10.0 ** rng.uniform(-3.5, -1.5), 2.0 * np.pi * rng.uniform(2, 6)
    gain, damping = inertia * natural**2 * rng.uniform(1, 3), 1.4 * inertia * natural
    widest = rng.uniform(0.3, 1.0)
    usual = inertia * (3.0 * np.pi) ** 2 * widest
    truth = {"inertia": inertia, "coulomb": usual * rng.uniform(0.2, 1.5)}
    truth["viscous"] = usual * rng.uniform(0.05, 0.3) / (2.0 * np.pi * widest)
    truth["breakaway"] = 0.3 * truth["coulomb"]
    if rng.random() < 0.5:
        truth["gravity"] = usual * rng.uniform(0.5, 2.0)
        if rng.random() < 0.5:
            truth["of load"] = 0.1
    stamps, runs, count = np.arange(int(rate * seconds)) / rate, [], usual / 200.0
    for _ in range(rng.integers(1, 5)):
        kind = rng.integers(3)
        if kind == 0:
            target = np.sin(2.0 * np.pi * (0.1 * stamps + 0.75 * stamps**2 / seconds))
        elif kind == 1:
            waves = [np.sin(2.0 * np.pi * f * stamps + rng.uniform(0.0, 6.0))
                     for f in rng.uniform(0.1, 1.5, 5)]  # fmt: skip
            target = np.minimum(1.0, stamps) * sum(waves) / 3.0
        else:
            period = rng.uniform(2.0, 4.0)
            phase = stamps % period / period
            moves = np.where(phase < 0.5, 8.0 * phase - 1.0, 7.0 - 8.0 * phase)
            target = np.clip(moves, -1.0, 1.0)
        found = run_of(
            truth, widest * target, rate, rng, 0.03, gain=gain, damping=damping, fallen=0.1,
            angle=widest * target[0], step=2.0 * np.pi / 4096,
        )  # fmt: skip
        current = np.round(found[1] / count + 2.0 * rng.standard_normal(stamps.size))
        runs.append(np.array([stamps, found[0], count * current]))
    return Machine(truth, rate, runs)


def stage(rng: np.random.Generator) -> Machine:
    """Draw a positioning table."""
    rate, seconds, mass = 1000.0, float(rng.choice([12, 25])), 10.0 ** rng.uniform(0, 2.5)
    natural = 2.0 * np.pi * rng.uniform(3, 10)
    gain, damping = mass * natural**2, 2.0 * mass * natural
    fastest, accelerates = rng.uniform(0.05, 0.3), rng.uniform(0.5, 3)
    truth = {"inertia": mass, "coulomb": mass * accelerates * rng.uniform(0.1, 0.5)}
    truth["viscous"] = truth["coulomb"] / fastest * rng.uniform(0.3, 2)
    if rng.random() < 0.5:
        truth["bias"] = truth["coulomb"] * rng.uniform(0.1, 0.3) * rng.choice([-1, 1])
    stamps, runs = np.arange(int(rate * seconds)) / rate, []
    target, place = np.zeros(stamps.size), 0
    while place < stamps.size:
        speed, length = fastest * rng.uniform(0.1, 1.0), fastest * rng.uniform(0.3, 1.0)
        times = np.arange(int((length / speed + speed / accelerates + 0.2) * rate)) / rate
        asked = np.minimum(accelerates * times, speed)
        asked = np.minimum(asked, np.maximum(accelerates * (times[-1] - 0.2 - times), 0.0))
        way = np.cumsum(asked) / rate * (1 if target[place - 1] <= 0.0 else -1)
        end = min(place + way.size, stamps.size)
        target[place:end] = target[place - 1] + way[: end - place]
        place = end
    pushes = np.zeros(stamps.size)
    if rng.random() < 0.5:
        for start in rng.integers(0, stamps.size - 300, 8):
            pushes[start : start + 200] = (
                mass * accelerates * rng.uniform(0.3, 1) * rng.choice([-1, 1])
            )
    for number in range(2):
        found = run_of(
            truth, target, rate, rng, 0.03, gain=gain, damping=damping, step=1e-6, touch=2e-5,
            pushed=pushes * number, often=1,
        )  # fmt: skip
        force = found[1] + pushes * number
        runs.append(np.array([stamps, found[0], force, target]))
    law = f"kind: pd\np: {gain}\nd: {damping}\nn: {-rate * np.log(1.0 - SMOOTHED)}\n"
    law += "derivative_on: measurement\n"
    columns = ("time", "position", "torque", "reference")
    return Machine(truth, rate, runs, columns, "m", law=law if rng.random() < 0.5 else "")


def screw(rng: np.random.Generator) -> Machine:
    """Draw the drive of a screw, whose friction is far above what its inertia takes."""
    rate, seconds = float(rng.choice([250, 500, 1000])), float(rng.choice([20, 30]))
    inertia, natural = 10.0 ** rng.uniform(-3, -1), 2.0 * np.pi * rng.uniform(4, 10)
    fastest = 10.0 ** rng.uniform(0.3, 1.3)
    friction = inertia * fastest * 10.0 ** rng.uniform(0.4, 1.5)
    truth = {"inertia": inertia, "coulomb": friction}
    truth["viscous"] = friction / fastest * rng.uniform(0.1, 1.0)
    if rng.random() < 0.7:
        truth["breakaway"] = friction * rng.uniform(0.15, 0.45)
    if rng.random() < 0.7:
        truth["ripple"] = friction * rng.uniform(0.02, 0.06)
    fallen, cycles = fastest * rng.uniform(0.015, 0.15), float(rng.integers(1, 9))
    touch, runs = 10.0 ** rng.uniform(-3.3, -2.3), []
    for _ in range(rng.integers(2, 5)):
        pieces = []
        while sum(map(len, pieces)) < seconds * rate:
            speed = fastest * rng.uniform(0.1, 1.0) * rng.choice([-1, 1])
            ramp, hold, rest = (int(rate * rng.uniform(*s))
                                for s in ((0.1, 0.4), (0.2, 1.5), (0.0, 0.3)))  # fmt: skip
            ramped = np.linspace(0.0, speed, ramp)
            pieces += [ramped, np.full(hold, speed), ramped[::-1], np.zeros(rest)]
        target = np.cumsum(np.concatenate(pieces)[: int(seconds * rate)]) / rate
        found = run_of(
            truth, target, rate, rng, 0.03, gain=inertia * natural**2,
            integral=inertia * natural**3 / 6.0, damping=1.4 * inertia * natural, fallen=fallen,
            cycles=cycles, step=2.0 * np.pi / 2**17, touch=touch,
        )  # fmt: skip
        noise = 0.02 * np.sqrt(np.mean(found[1] ** 2)) * rng.standard_normal(target.size)
        runs.append(np.array([np.arange(target.size) / rate, found[0], found[1] + noise]))
    if cycles == 1.0 and "ripple" in truth:  # once in a turn: what an unbalanced weight does
        truth["gravity"] = truth.pop("ripple")
    return Machine(truth, rate, runs)


def motor(rng: np.random.Generator) -> Machine:
    """Draw a small motor that a voltage drives."""
    rate, seconds = float(rng.choice([50, 100, 200, 500])), float(rng.choice([20, 40]))
    most, fastest, slow = rng.uniform(5, 24), 10.0 ** rng.uniform(0.8, 2.5), rng.uniform(0.05, 0.4)
    truth = {"viscous": most / fastest, "coulomb": most * rng.uniform(0.03, 0.15)}
    truth["inertia"] = truth["viscous"] * slow
    if rng.random() < 0.5:
        truth["breakaway"] = truth["coulomb"] * rng.uniform(0.2, 0.6)
    if rng.random() < 0.5:
        truth["dead band"] = most * rng.uniform(0.02, 0.08)
    late = int(rng.integers(1, 3)) if rng.random() < 1.0 / 3.0 else 0
    if late:
        truth["delay"] = late / rate
    stamps, runs = np.arange(int(rate * seconds)) / rate, []
    step = 2.0 * np.pi / float(rng.choice([500, 2048, 4096]))
    for _ in range(rng.integers(1, 4)):
        kind = rng.integers(3)
        if kind == 0:
            hold = int(rate * rng.uniform(2, 8) * slow) + 1
            levels = rng.uniform(-1.0, 1.0, stamps.size // hold + 1)
            command = np.repeat(levels, hold)[: stamps.size]
        elif kind == 1:
            highest_hz = min(1.0 / slow, rate / 10.0)
            sweep = 0.05 * stamps + (highest_hz - 0.05) * stamps**2 / (2.0 * seconds)
            command = rng.uniform(0.5, 1.0) * np.sin(2.0 * np.pi * sweep)
        else:
            command = 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * stamps / rng.uniform(3, 10)))
        command *= most
        band = truth.get("dead band", 0.0)
        acts = np.sign(command) * np.maximum(np.abs(command) - band, 0.0)
        acts = np.concatenate([np.zeros(late), acts])[: stamps.size]
        told = {name: size for name, size in truth.items() if name != "delay"}
        found = run_of(told, acts, rate, rng, 0.03, fallen=0.03 * fastest, step=step)
        runs.append(np.array([stamps, found[0], command]))
    return Machine(truth, rate, runs)


def rotor(rng: np.random.Generator) -> Machine:
    """Draw a motor with cogging that turns on and on."""
    rate, seconds = float(rng.choice([500, 1000])), float(rng.choice([10, 20, 30]))
    inertia, swings_hz = 10.0 ** rng.uniform(-5, -3), rng.uniform(8, 40)
    cycles = float(rng.choice([12, 24, 36, 42, 72, 84]))
    least = 2.0 * np.pi * swings_hz / cycles  # below about this speed cogging stops it
    fastest = least * rng.uniform(2, 6)
    truth = {"inertia": inertia, "ripple": inertia * (2.0 * np.pi * swings_hz) ** 2 / cycles}
    truth["coulomb"] = truth["ripple"] * rng.uniform(0.1, 0.8)
    truth["viscous"] = truth["coulomb"] / fastest * rng.uniform(0.2, 1.5)
    step, bandwidth = 2.0 * np.pi / 2.0 ** rng.integers(12, 18), 2.0 * np.pi * rng.uniform(2, 8)
    runs, ways, skipped = [], rng.integers(1, 3), int(rate) * int(rng.random() < 1.0 / 3.0)
    for _ in range(rng.integers(1, 4)):
        speeds = fastest * rng.uniform(0.6, 1.0, rng.integers(1, 4))
        each = int(seconds * rate / (ways * speeds.size))
        wanted = np.concatenate([np.full(each, s) for one in speeds for s in (one, -one)[:ways]])
        found = run_of(
            truth, wanted, rate, rng, 0.03, gain=inertia * bandwidth,
            integral=inertia * bandwidth**2 / 4.0, cycles=cycles, step=step,
        )[:, skipped:]  # fmt: skip
        torque = found[1] + 0.02 * np.std(found[1]) * rng.standard_normal(found.shape[1])
        runs.append(np.array([np.arange(torque.size) / rate, found[0], torque]))
    return Machine(truth, rate, runs)


@numba.njit  # type: ignore[untyped-decorator]
def slipped(wanted, stiff, slips, gain, damping, mass, viscous, step, dt, inner):
    """Return position and force of a mass on elements that yield (N/m), then slip (N)."""
    found, stretched, h = np.zeros((2, wanted.size)), np.zeros(stiff.size), dt / inner
    place, speed, smooth = 0.0, 0.0, 0.0
    for k in range(wanted.size):
        counted = np.round(place / step) * step
        smooth += SMOOTHED * (speed - smooth)
        force = gain * (wanted[k] - counted) - damping * smooth
        found[0, k], found[1, k] = counted, force
        for _ in range(inner):
            held = 0.0
            for e in range(stiff.size):
                most = slips[e] / stiff[e]
                stretched[e] = min(max(stretched[e] + speed * h, -most), most)
                held += stiff[e] * stretched[e]
            speed += h * (force - viscous * speed - held) / mass
            place += h * speed
    return found


def bristles(rng: np.random.Generator) -> Machine:
    """Draw a table that moves within and beyond what its friction yields over."""
    rate, mass, samples = 1000.0, 10.0 ** rng.uniform(0, 1.5), 15000
    coulomb, over = mass * rng.uniform(2, 6), 10.0 ** rng.uniform(-4.3, -3.5)
    truth = {"inertia": mass, "coulomb": coulomb, "viscous": coulomb * rng.uniform(0.5, 4)}
    natural, noise = 2.0 * np.pi * 20.0, rng.uniform(0.0, 0.03)
    lines, runs = np.fft.rfftfreq(samples, 1.0 / rate), []
    for times in (0.3, 1.5, 20.0):
        share = 1.0 + 0.02 * rng.standard_normal()
        slips = np.full(4, share * coulomb / 4.0)
        inside = (lines >= 0.1) & (lines <= 3.0)
        phases = np.where(inside, np.exp(2j * np.pi * rng.random(lines.size)), 0.0)
        wanted = np.fft.irfft(phases, samples)
        found = slipped(
            times * over * wanted / np.std(wanted), slips / (over * _YIELDS), slips,
            mass * natural**2, 1.6 * mass * natural, mass, share * truth["viscous"], 1e-8,
            1.0 / rate, 20,
        )  # fmt: skip
        force = found[1] + noise * np.std(found[1]) * rng.standard_normal(samples)
        runs.append(np.array([np.arange(samples) / rate, found[0], force]))
    return Machine(truth, rate, runs, position="m")


def flexure(rng: np.random.Generator) -> Machine:
    """Draw a joint whose flexures harden."""
    rate, seconds = float(rng.choice([200, 500, 1000])), float(rng.choice([10, 20]))
    inertia, natural = 10.0 ** rng.uniform(-3, 0.5), 2.0 * np.pi * rng.uniform(1.5, 4)
    widest, gain, damping = rng.uniform(0.3, 1.2), inertia * natural**2, 1.4 * inertia * natural
    most, stamps, runs = gain * widest, np.arange(int(rate * seconds)) / rate, []
    held = most * rng.uniform(0.3, 1.0)
    truth = {
        "inertia": inertia,
        "coulomb": most * rng.uniform(0.01, 0.1),
        "viscous": damping * rng.uniform(0.05, 0.4),
        "stiffness": held / widest * float(rng.choice([0.0, 0.2, 0.6])),
        "cubic": held / widest**3,
        "rest": float(rng.choice([0.0, 1.0])) * rng.uniform(-0.3, 0.3) * widest,
    }
    kind = rng.integers(3)
    for _ in range(rng.integers(2, 4)):
        if kind == 0:
            shape = np.sin(2.0 * np.pi * rng.uniform(0.2, 0.6) * stamps)
        elif kind == 1:
            shape = np.sin(2.0 * np.pi * (0.1 * stamps + 2.9 * stamps**2 / (2.0 * seconds)))
        else:
            hertz, phases = rng.uniform(0.1, 3.0, 8)[:, None], rng.uniform(0.0, 7.0, 8)[:, None]
            shape = np.sin(2.0 * np.pi * hertz * stamps + phases).sum(axis=0)
            shape /= np.abs(shape).max()
        found = run_of(
            truth, widest * rng.uniform(0.5, 1.0) * shape, rate, rng, 0.03, gain=gain,
            damping=damping, step=2.0 * np.pi / 2**16, touch=1e-3,
        )  # fmt: skip
        runs.append(np.array([stamps, found[0], found[1]]))
    return Machine(truth, rate, runs)


KINDS: dict[str, Callable[[np.random.Generator], Machine]] = {
    "swing": swing, "stairs": stairs, "fan": fan, "leg": leg, "servo": servo,
    "stage": stage, "screw": screw, "motor": motor, "rotor": rotor, "bristles": bristles,
    "flexure": flexure,
}  # fmt: skip
