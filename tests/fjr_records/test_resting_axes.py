"""Axes that rest by themselves, held by friction, are not told to be off; braked ones still are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from fjr_records.drive_off import off_times, spans_of, ways_of

RATE, FINE = 250.0, 4
REST = 250  # samples at the beginning, without a torque


@dataclass(frozen=True)
class Axis:
    """A rigid axis with friction, of inertia 1 kg m2.

    Attributes:
        friction: Coulomb friction (N m).
        breakaway: times that, which it holds at rest.
        stiffness: of its presliding (N m/rad).
        weight: constant torque (N m).
        preload: of a spring, away from where the axis begins (N m).
        spring: its stiffness (N m/rad).
        braked: whether a brake holds it while its drive is off.
    """

    friction: float
    breakaway: float = 1.2
    stiffness: float = 3e3
    weight: float = 0.0
    preload: float = 0.0
    spring: float = 0.0
    braked: bool = False

    def follows(
        self, reference: np.ndarray, bandwidth: float, offs: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return torque and position under a PD law that is off until the reference first moves.

        Or it is off where a bool array (samples,) says so.
        Its friction is a bristle that slides at the Coulomb or, when it slows down, the breakaway
        torque.
        """
        y, v, bristle, step = reference[0], 0.0, 0.0, 1.0 / RATE / FINE
        torque, position = np.zeros(reference.size), np.zeros(reference.size)
        held = self.weight if self.braked else 0.0
        offs = np.arange(reference.size) < REST if offs is None else offs
        for k in range(reference.size):
            off = bool(offs[k])
            v = 0.0 if off and self.braked else v
            wanted = bandwidth**2 * (reference[k] - y) - 1.4 * bandwidth * v + held
            torque[k], position[k] = 0.0 if off else wanted, y
            for _ in range(0 if off and self.braked else FINE):
                most = self.friction * (1.0 + (self.breakaway - 1.0) * np.exp(-((v / 0.02) ** 2)))
                bristle = float(
                    np.clip(bristle + v * step, *np.array([-1, 1]) * most / self.stiffness)
                )
                away = y - reference[0]
                spring = self.spring * away + self.preload * np.tanh(away / 1e-3)
                rubs = self.stiffness * bristle + 2.0 * np.sqrt(self.stiffness) * v * (
                    abs(self.stiffness * bristle) < most
                )
                v += step * (torque[k] - rubs - spring - self.weight)
                y += step * v
        return torque, position


def moves(
    rng: np.random.Generator, one_way: bool = False, lowest: float = -1.0, rest_s: float = 0.6
) -> np.ndarray:
    """Return a reference of random moves from zero, each of a speed of its own, with rests."""
    pieces, at = [np.zeros(REST)], 0.0
    for _ in range(8):
        to = at + rng.uniform(0.2, 1.0) if one_way else rng.uniform(lowest, 1.0)
        samples = max(int(abs(to - at) / rng.uniform(0.3, 2.0) * RATE), 10)
        smooth = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, samples))
        pieces += [at + (to - at) * smooth, np.full(int(rng.uniform(0.1, rest_s) * RATE), to)]
        at = to
    return np.concatenate(pieces)


def within_rests(reference: np.ndarray) -> np.ndarray:
    """Return the samples from 0.3 s after the begin of each rest to 0.1 s before its end, bool."""
    found = np.zeros(reference.size, dtype=bool)
    for rest in spans_of(np.diff(reference, append=reference[-1]) == 0.0):
        found[rest.start + int(0.3 * RATE) : rest.stop - int(0.1 * RATE)] = True
    return found


def recorded(
    torque: np.ndarray, position: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return them with noise, or as an encoder of random steps or the sum of a speed has them."""
    how = rng.integers(4)
    travel = float(np.ptp(position))
    if how == 1:
        position = position + rng.uniform(1e-5, 1e-4) * travel * rng.standard_normal(position.size)
    elif how == 2:
        step = rng.uniform(1e-4, 1e-3) * travel
        position = step * np.rint(position / step)
    elif how == 3:
        speed = np.gradient(position) * RATE + 0.002 * travel * rng.standard_normal(position.size)
        position = np.cumsum(speed) / RATE
    most = float(np.abs(torque).max())
    return torque + 2e-3 * most * rng.standard_normal(torque.size), position


@pytest.mark.parametrize("seed", range(12))
def test_an_axis_that_goes_one_way_rests_by_its_friction(seed):
    rng = np.random.default_rng(seed)
    axis = Axis(rng.uniform(1.0, 5.0), rng.uniform(1.0, 1.6), rng.uniform(1e3, 1e4))
    run = axis.follows(moves(rng, one_way=True), rng.uniform(10.0, 25.0))
    assert off_times(*recorded(*run, rng), RATE) is None


@pytest.mark.parametrize("seed", range(12))
def test_an_axis_that_goes_there_and_back_rests_by_its_friction(seed):
    rng = np.random.default_rng(100 + seed)
    friction = rng.uniform(1.0, 5.0)
    load = rng.uniform(0.0, 0.9) * friction
    axis = Axis(friction, rng.uniform(1.0, 1.6), rng.uniform(1e3, 1e4), load)
    run = axis.follows(moves(rng, lowest=rng.choice([-1.0, 0.0])), rng.uniform(10.0, 25.0))
    assert off_times(*recorded(*run, rng), RATE) is None


@pytest.mark.parametrize("seed", range(12))
def test_an_axis_rests_where_the_preload_of_its_spring_turns(seed):
    rng = np.random.default_rng(200 + seed)
    friction = rng.uniform(0.3, 1.0)
    preload, spring = rng.uniform(1.0, 4.0) * friction, rng.uniform(0.3, 3.0)
    axis = Axis(friction, 1.3, rng.uniform(1e3, 1e4), preload=preload, spring=spring)
    run = axis.follows(moves(rng, lowest=rng.uniform(-1.0, -0.2)), rng.uniform(10.0, 25.0))
    assert off_times(*recorded(*run, rng), RATE) is None


@pytest.mark.parametrize("seed", range(12))
def test_a_closed_brake_is_found_of_random_weights(seed):
    rng = np.random.default_rng(300 + seed)
    friction = rng.uniform(0.5, 3.0)
    weight = rng.choice([-1.0, 1.0]) * rng.uniform(4.0, 10.0) * friction
    axis = Axis(friction, weight=weight, braked=True)
    there = moves(rng, lowest=rng.choice([-1.0, 0.0]))
    home = there[-1] * (0.5 + 0.5 * np.cos(np.linspace(0.0, np.pi, 200)))
    run = axis.follows(np.concatenate([there, home]), rng.uniform(10.0, 25.0))
    off = off_times(*recorded(*run, rng), RATE)
    assert off is not None and REST <= off.begin < REST + 40
    assert off.takes == pytest.approx(weight, rel=0.35)


@pytest.mark.parametrize("seed", range(12))
def test_an_axis_whose_drive_is_off_in_its_rests_is_held_by_friction(seed):
    rng = np.random.default_rng(400 + seed)
    friction = rng.uniform(1.0, 5.0)
    load = rng.uniform(-0.9, 0.9) * friction
    axis = Axis(friction, rng.uniform(1.0, 1.6), rng.uniform(1e3, 1e4), load)
    there = moves(rng, lowest=rng.choice([-1.0, 0.0]), rest_s=1.5)
    run = axis.follows(there, rng.uniform(10.0, 25.0), within_rests(there))
    assert off_times(*recorded(*run, rng), RATE) is None


@pytest.mark.parametrize("seed", range(12))
def test_a_servo_that_rests_with_a_torque_on_is_not_off(seed):
    rng = np.random.default_rng(500 + seed)
    friction = rng.uniform(0.5, 3.0)
    weight = rng.choice([-1.0, 1.0]) * rng.uniform(4.0, 10.0) * friction
    axis = Axis(friction, rng.uniform(1.0, 1.6), rng.uniform(1e3, 1e4), weight)
    there = moves(rng, lowest=rng.choice([-1.0, 0.0]), rest_s=1.5)
    run = axis.follows(there, rng.uniform(10.0, 25.0), np.zeros(there.size, dtype=bool))
    assert off_times(*recorded(*run, rng), RATE) is None


@pytest.mark.parametrize("seed", range(12))
def test_brakes_that_close_in_mid_run_are_found(seed):
    rng = np.random.default_rng(600 + seed)
    friction = rng.uniform(0.5, 3.0)
    weight = rng.choice([-1.0, 1.0]) * rng.uniform(4.0, 10.0) * friction
    axis = Axis(friction, rng.uniform(1.0, 1.6), weight=weight, braked=True)
    there = moves(rng, lowest=rng.choice([-1.0, 0.0]), rest_s=1.5)
    closed = within_rests(there)
    run = axis.follows(there, rng.uniform(10.0, 25.0), closed)
    off = off_times(*recorded(*run, rng), RATE)
    assert off is not None
    brakes = [each for each in spans_of(closed) if each.stop - each.start >= 0.15 * RATE]
    assert np.mean([off.at[brake].all() for brake in brakes]) >= 0.5
    assert not off.at[np.abs(np.gradient(there)) > 0.3 * np.abs(np.gradient(there)).max()].any()


def test_moves_are_told_from_noise():
    rng = np.random.default_rng(0)
    there = np.concatenate([np.zeros(50), np.linspace(0.0, 1.0, 50), np.ones(50)])
    y = np.concatenate([there, there[::-1]]) + 1e-3 * rng.standard_normal(300)
    ways = ways_of(y, 0.05)
    assert np.all(ways[52:98] >= 0.0) and ways[52:98].mean() > 0.9
    assert np.all(ways[202:248] <= 0.0) and ways[202:248].mean() < -0.9
    assert np.abs(ways[:50]).mean() < 0.2 and np.abs(ways[250:]).mean() < 0.2
    assert not ways_of(1e-3 * rng.standard_normal(300), 0.05).any()
