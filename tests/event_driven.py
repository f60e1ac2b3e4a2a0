"""Independent event-driven solution of the sampled closed loop, slow and very accurate.

It shares no code with the product: the equations and the controller are written again from
the paper (eqs. 2-5, 12) and from interface.md. Between events each side slips in one direction or
sticks; scipy's DOP853 integrates that smooth motion and its event detection ends it where a
velocity reaches zero or a stuck side breaks away.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import ode, solve_ivp

RTOL, ATOL = 1e-10, 1e-13


@dataclass
class EventDrivenPlant:
    """The plant of the paper, advanced from event to event.

    Attributes:
        values: jm, j, fs, fsm, fv, fvm, k0, k1 in SI units.
        rtol: relative tolerance of the solvers.
        method: of solve_ivp.
        parts: least number of steps of solve_ivp in a stretch, so that it misses no event.
        quick: take holds far from any event by scipy's compiled DOP853.
        state: q, q', th, th'.
        events: number of events so far.
    """

    values: dict[str, float]
    rtol: float = RTOL
    method: str = "DOP853"
    parts: int = 4
    quick: bool = True
    state: list[float] = field(default_factory=lambda: [0.0] * 4)
    events: int = 0

    def loads(self, state, torque):
        """Return the torque that drives each side, friction apart (link, motor)."""
        twist = state[0] - state[2]
        spring = self.values["k0"] * twist + self.values["k1"] * twist**3
        return -spring, torque + spring

    def modes(self, torque):
        """Return the slip direction of each side, 0 where it sticks."""
        link, motor = self.loads(self.state, torque)
        return (
            self._mode(self.state[1], link, self.values["fs"]),
            self._mode(self.state[3], motor, self.values["fsm"]),
        )

    @staticmethod
    def _mode(velocity, load, level):
        if velocity != 0.0:
            return math.copysign(1.0, velocity)
        return math.copysign(1.0, load) if abs(load) > level else 0.0

    def derivative(self, state, torque, modes):
        """Return d(state)/dt in fixed modes; numbers of a list are faster here than an array's."""
        v = self.values
        link, motor = self.loads(state, torque)
        link_acceleration = (link - v["fv"] * state[1] - v["fs"] * modes[0]) / v["j"]
        motor_acceleration = (motor - v["fvm"] * state[3] - v["fsm"] * modes[1]) / v["jm"]
        return [
            state[1] if modes[0] else 0.0,
            link_acceleration if modes[0] else 0.0,
            state[3] if modes[1] else 0.0,
            motor_acceleration if modes[1] else 0.0,
        ]

    def margins(self, state, torque, modes):
        """Return what stays positive between events: speed, or friction torque in reserve."""
        loads = self.loads(state, torque)
        levels = self.values["fs"], self.values["fsm"]
        return [
            state[2 * side + 1] * modes[side] if modes[side] else levels[side] - abs(loads[side])
            for side in (0, 1)
        ]

    def hold(self, torque, duration):
        """Advance by `duration` seconds under constant torque."""
        while duration > 0.0:
            modes = self.modes(torque)
            if modes == (0.0, 0.0):
                return
            end = self._quiet(torque, modes, duration) if self.quick else None
            if end is not None:
                self.state = end
                return
            duration -= self._to_event(torque, modes, duration)

    def _quiet(self, torque, modes, duration):
        """Return the end state if no margin comes near zero on the way, else None (cheap)."""
        before = self.margins(self.state, torque, modes)
        solver = ode(lambda _t, x: self.derivative(x.tolist(), torque, modes))
        solver.set_integrator("dop853", rtol=self.rtol, atol=ATOL, first_step=duration)
        solver.set_initial_value(self.state, 0.0)
        for part in (0.5, 1.0):
            state = solver.integrate(part * duration).tolist()
            after = self.margins(state, torque, modes)
            if not solver.successful() or any(
                min(a, b) <= 0.5 * abs(a - b) for a, b in zip(before, after, strict=True)
            ):
                return None
            before = after
        return state

    def _to_event(self, torque, modes, duration):
        """Advance to the next event or the end, whatever comes first; return the time taken."""

        def watch(side):
            def margin(_t, x):
                return self.margins(x.tolist(), torque, modes)[side]

            margin.terminal, margin.direction = True, -1
            return margin

        solution = solve_ivp(
            lambda _t, x: self.derivative(x.tolist(), torque, modes),
            (0.0, duration),
            np.array(self.state),
            method=self.method,
            rtol=self.rtol,
            atol=ATOL,
            max_step=duration / self.parts,
            events=[watch(0), watch(1)],
        )
        self.state = solution.y[:, -1].tolist()
        for side in (0, 1):
            if solution.t_events[side].size:
                self._apply_event(side, modes[side], torque)
        return float(solution.t[-1])

    def _apply_event(self, side, mode, torque):
        """Stop the side, or let a stuck one break away with the least visible speed."""
        self.events += 1
        if mode:
            self.state[2 * side + 1] = 0.0
            return
        load = self.loads(self.state, torque)[side]
        self.state[2 * side + 1] = math.copysign(1e-15, load)


def closed_loop(reference, sample_rate_hz, values, controller, **solver):
    """Return (position, torque, events) of the loop from rest under a zero-order hold.

    Args:
        reference: r (samples,) in rad.
        sample_rate_hz: rate of the samples.
        values: plant parameters by name.
        controller: p, d, n by name (interface.md, "Controller law").
        **solver: rtol, method, parts, quick of `EventDrivenPlant`.
    """
    period = 1.0 / sample_rate_hz
    decay = math.exp(-controller["n"] * period)
    plant = EventDrivenPlant(values, **solver)
    memory = 0.0
    position, torque = np.empty(len(reference)), np.empty(len(reference))
    for k, r in enumerate(reference):
        error = r - plant.state[2]
        u = controller["p"] * error + controller["d"] * controller["n"] * (error - memory)
        memory = decay * memory + (1.0 - decay) * error
        position[k], torque[k] = plant.state[2], u
        plant.hold(u, period)
    return position, torque, plant.events
