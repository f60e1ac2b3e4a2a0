"""MuJoCo's own system identification (`mujoco.sysid`), on a MuJoCo model of the joint.

Motor and link are two hinges with armature, damping and friction loss, a fixed tendon between them
is the transmission, with stiffness and damping, and the motor's actuator has a delay. The toolbox
fits these by its own least squares, residuals normalised as it does; the loop is closed in its
custom rollout, step by step, so that controllers of any kind can be played. The optimiser ends
within its part of the budget, at the best that it has seen. The model has no Stribeck friction,
backlash, ripple, quantisation or saturation as the catalogue has them, and its friction is a soft
constraint. The toolbox names nothing: what was found is named as for `pace`.
"""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from controller_node import transfer_function
from gap_diagnosis.model.drive import Drive
from gap_diagnosis.outcome.diagnosis import Diagnosis

from .baseline_fit import MATTERS, Positions, Problem, verdict_of

_STEP_S = 5e-4  # longest
_MOST_DELAY_S, _MOST_SAMPLES = 0.1, 20.0
_FACTOR = 3.0  # by which inertia, stiffness and friction may be off
_FRICTION = 0.5  # of the rms torque at the most, or the factor
_DAMPING = 0.1  # of the transmission at the most, over the greatest drag at rms speed
_TINY = 1e-6  # inertia of a body beside its joint's armature
_ITERATIONS = 30
_FOR_FIT = 0.8  # of the budget

NAMES = {"delay": "delay", "transmission_damping": "flex_damping"}
_LACKING = {"coulomb_friction": ("fsm", "fs"), "viscous_friction": ("fvm", "fv")}


class _OutOfTime(Exception):
    """The budget is spent."""


def mujoco_sysid(folder: Path, nominal: Mapping[str, float]) -> Diagnosis:
    """Diagnose by MuJoCo's system identification."""
    return _Identification(Problem(folder, nominal)).diagnosis()


class _Identification:
    """One identification with `mujoco.sysid`."""

    def __init__(self, problem: Problem) -> None:
        import mujoco
        from mujoco import sysid

        self._mujoco: Any = mujoco
        self._sysid: Any = sysid
        self._problem = problem
        self._period = 1.0 / problem.sample_rate_hz
        self._substeps = math.ceil(self._period / _STEP_S)
        self._most_delay = min(_MOST_DELAY_S, _MOST_SAMPLES * self._period)
        self._fitting, self._ended = False, False
        self._best: tuple[float, np.ndarray | None] = (math.inf, None)

    def diagnosis(self) -> Diagnosis:
        """Return the verdict."""
        problem, datasheet = self._problem, self._parameters()
        found = self._fitted()
        names = self._named(datasheet, found)
        return verdict_of(
            problem,
            {
                "nominal": problem.gap(self._play(datasheet, problem.reported)),
                "refit": problem.gap(self._play(found, problem.reported)),
            },
            {name: float(one.value[0]) for name, one in found.items()},
            dict.fromkeys(names, 1.0),
            notes=["The fit was ended by its budget."] if self._ended else [],
        )

    def _parameters(self) -> Any:
        """Return what is fitted, at the datasheet's values, with what writes it into the model."""
        nominal, scales = self._problem.nominal, self._problem.scales
        torque = _FRICTION * scales.torque_nm
        drag = torque / scales.velocity_rad_s
        params = self._sysid.ParameterDict()

        def add(name: str, value: float, low: float, high: float, write: Any) -> None:
            params.add(self._sysid.Parameter(name, value, low, high, modifier=write))

        def on_joint(joint: str, attribute: str) -> Any:
            return lambda spec, p: setattr(spec.joint(joint), attribute, p.value[0])

        def first_of_joint(joint: str) -> Any:
            return lambda spec, p: spec.joint(joint).damping.__setitem__(0, p.value[0])

        def of_tendon(attribute: str) -> Any:
            return lambda spec, p: getattr(spec.tendon("flex"), attribute).__setitem__(
                0, p.value[0]
            )

        sides = {"motor": ("jm", "fsm", "fvm")}
        if "k0" in nominal:
            sides["link"] = ("j", "fs", "fv")
        for side, (inertia, coulomb, viscous) in sides.items():
            value = nominal[inertia]
            armature = on_joint(side, "armature")
            add(f"{side}_armature", value, value / _FACTOR, value * _FACTOR, armature)
            most = max(torque, _FACTOR * nominal[coulomb])
            add(f"{side}_friction", nominal[coulomb], 0.0, most, on_joint(side, "frictionloss"))
            most = max(drag, _FACTOR * nominal[viscous])
            add(f"{side}_damping", nominal[viscous], 0.0, most, first_of_joint(side))
        if "k0" in nominal:
            k0 = nominal["k0"]
            add("stiffness", k0, k0 / _FACTOR, k0 * _FACTOR, of_tendon("stiffness"))
            add("flex_damping", 0.0, 0.0, _DAMPING * drag, of_tendon("damping"))
        add(
            "delay", 0.0, 0.0, self._most_delay,
            lambda spec, p: setattr(spec.actuator("drive"), "delay", p.value[0]),
        )  # fmt: skip
        return params

    def _spec(self) -> Any:
        """Return the joint as MuJoCo has it."""
        mj, nominal = self._mujoco, self._problem.nominal
        spec = mj.MjSpec()
        spec.option.timestep = self._period / self._substeps
        spec.option.gravity = [0.0, 0.0, 0.0]
        spec.option.integrator = mj.mjtIntegrator.mjINT_IMPLICITFAST
        for side, inertia in (("motor", "jm"), ("link", "j"))[: 2 if "k0" in nominal else 1]:
            tiny = _TINY * nominal[inertia]
            body = spec.worldbody.add_body(
                name=side, mass=tiny, inertia=[tiny] * 3, explicitinertial=True
            )
            body.add_joint(name=side, type=mj.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0])
        if "k0" in nominal:
            tendon = spec.add_tendon(
                name="flex", stiffness=[nominal["k0"], 0.0, nominal["k1"]], springlength=[0.0, 0.0]
            )
            tendon.wrap_joint("motor", 1.0)
            tendon.wrap_joint("link", -1.0)
        spec.add_sensor(
            name="position", type=mj.mjtSensor.mjSENS_JOINTPOS, objtype=mj.mjtObj.mjOBJ_JOINT,
            objname="motor",
        )  # fmt: skip
        drive = spec.add_actuator(name="drive", trntype=mj.mjtTrn.mjTRN_JOINT, target="motor")
        drive.set_to_motor()
        drive.nsample = math.ceil(self._most_delay / spec.option.timestep) + 2
        drive.interp = 1  # linear, so that the error is a smooth function of the delay
        return spec

    def _fitted(self) -> Any:
        """Return the fitted parameters: the optimiser's, or the best it saw within the budget."""
        params = self._parameters().move_off_bounds(fraction=0.01)
        params["delay"].value[:] = 1.5 * self._period / self._substeps  # less acts as one step
        functions = [self._residual_function(index) for index in self._problem.runs("fit")]

        def residual(x: np.ndarray, own: Any) -> tuple[list[np.ndarray], None, None]:
            residuals = [part for function in functions for part in function(x, own)[0]]
            first = [part if part.ndim == 1 else part[:, 0] for part in residuals]
            cost = float(sum(np.sum(part**2) for part in first))
            if cost < self._best[0]:
                self._best = cost, np.array(x if x.ndim == 1 else x[:, 0])
            return residuals, None, None

        self._fitting = True
        try:
            with contextlib.redirect_stdout(io.StringIO()):  # it prints a table as it goes
                found, _ = self._sysid.optimize(
                    params, residual, verbose=False, max_iters=_ITERATIONS, x_scale="jac"
                )
        except _OutOfTime:
            found, self._ended = params, True
        self._fitting = False
        if self._best[1] is not None:
            found.update_from_vector(self._best[1])
        return found

    def _residual_function(self, index: int) -> Any:
        """Return the toolbox's residual of one run, on the samples that are fitted."""
        sysid, problem = self._sysid, self._problem
        spec = self._spec()
        model = spec.compile()
        record = problem.evidence.records.records[index]
        drive = problem.evidence.player.drive(index)
        times = self._period * np.arange(record.samples)
        mapping = {"position": (sysid.SignalType.MjSensor, np.array([0]))}
        measured = sysid.TimeSeries(times, record.position[:, None], mapping)
        control = sysid.TimeSeries(times, record.torque[:, None])
        data = self._mujoco.MjData(model)
        start = sysid.create_initial_state(model, data.qpos, data.qvel, data.act)
        sequence = sysid.ModelSequences("joint", spec, record.name, start, control, measured)

        def rollout(models: Sequence[Any], **_: Any) -> list[Any]:
            return [self._trajectory(one, drive, times, mapping, control, start) for one in models]

        return sysid.build_residual_fn(
            models_sequences=[sequence],
            custom_rollout=rollout,
            modify_residual=partial(self._residual, index),
            n_threads=1,
            resample_true=False,
        )

    def _residual(
        self, index: int, params: Any, simulated: Any, measured: Any, *_: Any, **__: Any
    ) -> tuple[np.ndarray, Any, Any]:
        """Return the residual of a run as the toolbox makes it, of the fitted samples alone."""
        keep = self._problem.samples(index, "fit")
        real = measured.data[keep]
        left = self._sysid.weighted_diff(simulated.data[keep], real)
        return self._sysid.normalize_residual(left, real).ravel(), simulated, measured

    def _trajectory(
        self, model: Any, drive: Drive, times: np.ndarray, mapping: Any, control: Any, start: Any
    ) -> Any:
        position = self._closed_loop(model, drive)[:, None]
        state = self._sysid.TimeSeries(times, np.hstack([times[:, None], position]))
        sensors = self._sysid.TimeSeries(times, position, mapping)
        return self._sysid.SystemTrajectory(model, control, sensors, start, state)

    def _closed_loop(self, model: Any, drive: Drive) -> np.ndarray:
        """Return the position of a run, (samples,) in rad."""
        data = self._mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = drive.start
        x = np.zeros(drive.law.states + 1)
        if drive.entry is not None:
            x[:-1] = drive.entry
        b, forward, a, limit = drive.law.coefficients
        step, law = self._mujoco.mj_step, transfer_function.step
        angle, torque, substeps = data.qpos, data.ctrl, self._substeps
        added = np.zeros(drive.reference.size) if drive.command is None else drive.command
        position = np.empty(drive.reference.size)
        for k, (r, u) in enumerate(zip(drive.reference.tolist(), added.tolist(), strict=True)):
            y = angle[0]
            position[k] = y
            torque[0] = u + law(x, r, y, b, forward, a, limit)
            step(model, data, substeps)
            if self._fitting and not k % 1024 and self._late:
                raise _OutOfTime
        return position

    @property
    def _late(self) -> bool:
        return self._problem.seconds_left < (1.0 - _FOR_FIT) * self._problem.budget_s

    def _play(self, params: Any, which: Sequence[int]) -> Positions:
        model = self._sysid.apply_param_modifiers(params, self._spec())
        drive = self._problem.evidence.player.drive
        return {index: self._closed_loop(model, drive(index)) for index in which}

    def _named(self, datasheet: Any, found: Any) -> list[str]:
        """Return the effects without which the validation parts are met worse."""
        nominal, runs = self._problem.nominal, self._problem.runs("select")
        candidates = {effect: [name] for effect, name in NAMES.items() if name in found}
        for effect, names in _LACKING.items():
            quantity = effect.removesuffix("_friction").replace("coulomb", "friction")
            quantity = quantity.replace("viscous", "damping")
            sides = zip(("motor", "link"), names, strict=True)
            lacking = [f"{s}_{quantity}" for s, n in sides if n in nominal and not nominal[n]]
            if lacking:
                candidates[effect] = lacking
        best = self._squared(found, runs)
        named = []
        for effect, parameters in candidates.items():
            without = found.copy()
            for name in parameters:
                without[name].value[:] = datasheet[name].value
            if self._squared(without, runs) > (1.0 + MATTERS) ** 2 * best:
                named.append(effect)
        return named

    def _squared(self, params: Any, runs: Sequence[int]) -> float:
        return float(np.mean(self._problem.error(self._play(params, runs), "select") ** 2))
