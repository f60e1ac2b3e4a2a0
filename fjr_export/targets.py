"""The targets that run here, each as a joint that is commanded sample by sample."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import numpy as np

from fjr_kit.errors import needing

from .joint import Joint
from .mjcf import MuJoCoModel, rigid_friction

_MEND = "install fjr-rig[export]"
_URDF_STEPS = 10


class MuJoCoJoint:
    """A MuJoCo model whose first joint is the motor."""

    def __init__(self, model: Any, steps: int) -> None:
        """Take a compiled model.

        Args:
            model: mujoco.MjModel; without actuators the torque acts on the joint itself.
            steps: time steps of one sample.
        """
        import mujoco

        mujoco.set_mju_user_warning(_unheard)
        self._mujoco, self._model, self._steps = mujoco, model, steps
        self._data = mujoco.MjData(model)
        of = mujoco.mjtWarning
        self._bad = (of.mjWARN_BADQPOS, of.mjWARN_BADQVEL, of.mjWARN_BADQACC, of.mjWARN_BADCTRL)
        self.version = f"mujoco {mujoco.__version__}"

    @classmethod
    def of_mjcf(cls, exported: MuJoCoModel) -> MuJoCoJoint:
        """Return the joint of an exported model."""
        with needing("MuJoCo", _MEND):
            import mujoco
        return cls(mujoco.MjModel.from_xml_string(exported.xml), exported.steps)

    @classmethod
    def of_urdf(cls, text: str, joint: Joint) -> MuJoCoJoint:
        """Return the joint of an exported URDF, read by MuJoCo."""
        with needing("MuJoCo", _MEND):
            import mujoco
        model = mujoco.MjModel.from_xml_string(text)
        model.opt.timestep = 1.0 / (joint.sample_rate_hz * _URDF_STEPS)
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        model.opt.gravity = 0.0
        reference, impedance = rigid_friction(model.opt.timestep)
        model.dof_solref[:], model.dof_solimp[:, :3] = reference, impedance
        return cls(model, _URDF_STEPS)

    def begin(self, position: float, speed: float) -> None:
        """Set position (rad) and velocity (rad/s) of all bodies."""
        self._mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:] = position
        self._data.qvel[:] = speed

    def position(self) -> float:
        """Return the motor position (rad)."""
        diverged = any(self._data.warning[kind].number for kind in self._bad)
        return float("nan") if diverged else float(self._data.qpos[0])

    def hold(self, torque: float) -> None:
        """Advance by one sample under a torque (N m)."""
        if self._model.nu:
            self._data.ctrl[0] = torque
        else:
            self._data.qfrc_applied[0] = torque
        self._mujoco.mj_step(self._model, self._data, self._steps)


def _unheard(warning: str) -> None:
    """Take a warning of MuJoCo, which would go into a log file in the working folder."""


class ControlJoint:
    """The discrete object of an exported script of python-control."""

    def __init__(self, script: str) -> None:
        """Run the script."""
        with needing("python-control", _MEND):
            import control  # noqa: F401
        made: dict[str, Any] = {}
        exec(compile(script, "joint.py", "exec"), made)
        self._system = made["discrete"]
        self._state = np.zeros(self._system.nstates)
        self.version = f"control {version('control')}"

    def begin(self, position: float, speed: float) -> None:
        """Set position (rad) and velocity (rad/s) of all bodies."""
        c = np.asarray(self._system.C)
        bodies = int(np.flatnonzero(c.any(axis=0)).max()) // 2 + 1
        self._state = np.zeros(self._system.nstates)
        self._state[0 : 2 * bodies : 2] = position
        self._state[1 : 2 * bodies : 2] = speed

    def position(self) -> float:
        """Return the motor position (rad)."""
        return float(self._system.output(0.0, self._state)[0])

    def hold(self, torque: float) -> None:
        """Advance by one sample under a torque (N m)."""
        self._state = self._system.dynamics(0.0, self._state, np.array([torque]))
