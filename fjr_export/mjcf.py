"""The joint as a MuJoCo model: two bodies that a tendon couples, and actuators for what MuJoCo has.

The motor's inertia is the armature of its joint, the link's that of its body; where they slide,
along x, each is the mass of its body. Both joints stand in one parent, so their angles and
frictions are absolute, as th and q are; the tendon's length is q - th. What is periodic in an
angle, bristles and hysteresis are passive DC motors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from xml.etree import ElementTree as ET

from fjr_kit.errors import InputError

from .joint import Joint
from .spring import spring_parts

_FEWEST_STEPS, _MOST_STEPS = 10, 100  # time steps of one sample
_LEAST_DELAY = 1.5  # time steps: the control of a step is known from its end on
_LIGHT = 1e-6  # share of the motor's inertia that its body has; the rest is armature
_RIGID_FRICTION = (0.9999, 0.9999, 0.001)
_STIFF_BRISTLES, _BRISTLE_DAMPING = 0.1, 0.5  # rad of their oscillation in a step; damping ratio
_RUNGE_KUTTA = 2.78  # decay in a step up to which it is stable
_SIGNIFICANT = 10


@dataclass(frozen=True)
class MuJoCoModel:
    """A model and how it is to be stepped.

    Attributes:
        xml: the MJCF.
        steps: time steps of one sample.
        time_step_s: length of one.
        notes: sentences that a reader must see.
    """

    xml: str
    steps: int
    time_step_s: float
    notes: tuple[str, ...]


def mujoco_model(joint: Joint) -> MuJoCoModel:
    """Return the joint as MJCF for MuJoCo 3.12 or later.

    Raises:
        InputError: effects that cannot stand beside one another there.
    """
    return _Builder(joint).model()


def _steps(delay_samples: float) -> int:
    """Return time steps per sample so many that a delay is no shorter than it can be."""
    if not delay_samples:
        return _FEWEST_STEPS
    return min(max(math.ceil(_LEAST_DELAY / delay_samples), _FEWEST_STEPS), _MOST_STEPS)


def rigid_friction(step_s: float) -> tuple[tuple[float, float], tuple[float, float, float]]:
    """Return solref and solimp of the most rigid friction that a time step allows."""
    return (2.0 * step_s, 1.0), _RIGID_FRICTION


def _text(*values: float) -> str:
    return " ".join(f"{value:.{_SIGNIFICANT}g}" for value in values)


class _Builder:
    def __init__(self, joint: Joint) -> None:
        self.joint = joint
        self.steps = _steps(joint.of("delay")["time_s"] * joint.sample_rate_hz)
        self.step = 1.0 / (joint.sample_rate_hz * self.steps)
        self.root = ET.Element("mujoco", model="joint")
        self.notes: list[str] = []

    def model(self) -> MuJoCoModel:
        rate = self.joint.sample_rate_hz
        self.root.append(
            ET.Comment(
                f" One joint from {self.joint.title.replace('--', '- -')}, SI units. Command the "
                f"actuator 'torque' at {rate:g} Hz: set ctrl, then {self.steps} steps. "
            )
        )
        ET.SubElement(self.root, "compiler", angle="radian", autolimits="true")
        ET.SubElement(
            self.root, "option", timestep=_text(self.step), integrator="RK4", gravity="0 0 0"
        )
        world = ET.SubElement(self.root, "worldbody")
        body = self.joint.body
        side = {"damping": body["fvm"], "friction": body["fsm"]}
        self._body(world, "motor", body["jm"], side, armature=True)
        tendons = ET.Element("tendon")
        if not self.joint.one_body:
            side = {"damping": body["fv"], "friction": body["fs"]}
            self._body(world, "link", body["j"], side)
            self._transmission(tendons)
        if self.joint.has("extra_mode"):
            self._extra_mode(world, tendons)
        if len(tendons):
            self.root.append(tendons)
        actuators = ET.SubElement(self.root, "actuator")
        self._drive(actuators)
        self._passive(actuators)
        self._sensors()
        ET.indent(self.root)
        xml = ET.tostring(self.root, encoding="unicode") + "\n"
        return MuJoCoModel(xml, self.steps, self.step, tuple(self.notes))

    def _body(
        self, parent: ET.Element, name: str, inertia: float, side: dict, armature: bool = False
    ) -> None:
        body = ET.SubElement(parent, "body", name=name)
        slides = self.joint.linear
        own = inertia * (_LIGHT if armature and not slides else 1.0)
        mass = own if slides else 1e-3 if armature else 1.0
        ET.SubElement(
            body, "inertial", pos="0 0 0", mass=_text(mass), diaginertia=_text(own, own, own)
        )
        kind, axis = ("slide", "1 0 0") if slides else ("hinge", "0 0 1")
        moving = ET.SubElement(body, "joint", name=name, type=kind, axis=axis)
        if own < inertia:
            moving.set("armature", _text(inertia - own))
        drag = self.joint.of("quadratic_friction")
        square = drag.get(f"{name}_nm_s2_rad2", 0.0)
        moving.set("damping", _text(side["damping"], square) if square else _text(side["damping"]))
        if side["friction"] and not self._has_bristles(name):
            moving.set("frictionloss", _text(side["friction"]))
            reference, impedance = rigid_friction(self.step)
            moving.set("solreffriction", _text(*reference))
            moving.set("solimpfriction", _text(*impedance))
        held = "motor" if self.joint.one_body else "link"
        if name == held and self.joint.has("external_spring"):
            spring = self.joint.of("external_spring")
            moving.set("stiffness", _text(spring["stiffness_nm_rad"]))
            moving.set("springref", _text(spring["rest_rad"]))
        if name == held and self.joint.has("hardening_spring"):
            if self.joint.has("external_spring"):
                raise self._beside("hardening_spring", "external_spring")
            spring = self.joint.of("hardening_spring")
            stiffness = _text(spring["stiffness_nm_rad"], 0.0, spring["cubic_nm_rad3"])
            moving.set("stiffness", stiffness)
            moving.set("springref", _text(spring["rest_rad"]))
        size, colour = ("0.05 0.02", "0.3 0.4 0.6 1") if armature else ("0.02 0.1", "0.7 0.5 0.2 1")
        ET.SubElement(
            body, "geom", type="cylinder", size=size, rgba=colour, mass="0",
            contype="0", conaffinity="0",
        )  # fmt: skip

    def _has_bristles(self, name: str) -> bool:
        slow = f"stribeck_friction_{name}"
        if self.joint.has(slow) or (name == "motor" and self.joint.has("lugre_friction")):
            return True
        return self.joint.of("presliding_friction").get(f"{name}_rad", 0.0) > 0.0

    def _tendon(self, tendons: ET.Element, name: str, first: str, second: str) -> ET.Element:
        tendon = ET.SubElement(tendons, "fixed", name=name)
        ET.SubElement(tendon, "joint", joint=first, coef="1")
        ET.SubElement(tendon, "joint", joint=second, coef="-1")
        return tendon

    def _transmission(self, tendons: ET.Element) -> None:
        for index, part in enumerate(spring_parts(self.joint)):
            name = "transmission" if not index else f"transmission_{index + 1}"
            tendon = self._tendon(tendons, name, "link", "motor")
            tendon.set("springlength", _text(part.low_rad, part.high_rad))
            cubic = part.cubic_nm_rad3
            own = part.stiffness_nm_rad
            tendon.set("stiffness", _text(own, 0.0, cubic) if cubic else _text(own))
            if not index and self.joint.has("transmission_damping"):
                tendon.set("damping", _text(self.joint.of("transmission_damping")["nm_s_rad"]))

    def _extra_mode(self, world: ET.Element, tendons: ET.Element) -> None:
        mode = self.joint.of("extra_mode")
        inertia, rate = mode["inertia_kg_m2"], 2.0 * math.pi * mode["frequency_hz"]
        self._body(world, "extra", inertia, {"damping": 0.0, "friction": 0.0})
        tendon = self._tendon(tendons, "extra", "extra", "link")
        tendon.set("springlength", "0 0")
        tendon.set("stiffness", _text(inertia * rate**2))
        tendon.set("damping", _text(2.0 * mode["damping_ratio"] * inertia * rate))

    def _drive(self, actuators: ET.Element) -> None:
        joint = self.joint
        gain = 1.0 + joint.of("torque_gain")["relative_error"]
        limit = joint.of("torque_saturation")["limit_nm"]
        shared = {"name": "torque", "joint": "motor"}
        if math.isfinite(limit):
            shared["ctrlrange"] = _text(-limit, limit)
        delay = joint.of("delay")["time_s"]
        if delay:
            # between two samples a ramp of one step is read, whose middle is half a step late
            samples = math.ceil(delay / self.step + 0.5) + 1
            shared |= {"nsample": str(samples), "interp": "linear"}
            least = _LEAST_DELAY * self.step
            shared["delay"] = _text(max(delay, least) + 0.5 * self.step)
            if delay < 0.999 * least:
                self.notes.append(
                    f"The delay of {delay:.2g} s is {least:.2g} s here, the least that its time "
                    "steps allow."
                )
        if joint.has("torque_speed_limit") or joint.has("torque_slew_limit"):
            self._motor(actuators, shared, gain)
            return
        lag = joint.of("actuator_lag")["time_constant_s"]
        drive = ET.SubElement(actuators, "general", shared, gainprm=_text(gain))
        if lag:
            drive.set("dyntype", "filter")
            drive.set("dynprm", _text(lag))

    def _motor(self, actuators: ET.Element, shared: dict[str, str], gain: float) -> None:
        """Add a DC motor that follows the commanded torque within its voltage and slew rate."""
        line, slew = self.joint.of("torque_speed_limit"), self.joint.of("torque_slew_limit")
        stall, rate = line["stall_nm"], slew["limit_nm_s"]
        drive = ET.SubElement(actuators, "dcmotor", shared, input="ff", gear=_text(gain))
        limited = math.isfinite(stall)
        torque = stall / gain if limited else 1.0
        speed = line["no_load_rad_s"] * gain if limited else 1.0
        drive.set("nominal", _text(1.0, torque, speed))
        drive.set(
            "controller",
            _text(0, 0, 0, rate if math.isfinite(rate) else 0, 0, 1 if limited else 0),
        )
        if limited:
            drive.set("saturation", _text(torque, 0, 0))
        if self.joint.has("actuator_lag"):
            raise self._beside("actuator_lag", "a limit of speed or slew")

    def _beside(self, effect: str, other: str) -> InputError:
        return InputError(
            f"{self.joint.source}: MuJoCo cannot express {effect} beside {other}. Give --without "
            f"{effect} to export the rest."
        )

    def _device(self, actuators: ET.Element, name: str, **what: str) -> None:
        """Add a passive DC motor without windings."""
        where = {} if "tendon" in what else {"joint": what.pop("on")}
        ET.SubElement(
            actuators, "dcmotor", where, name=name, input="none", motorconst="0 0", resistance="1",
            **what,
        )  # fmt: skip

    def _ripple(self, actuators: ET.Element, name: str, on: str, torque: tuple) -> None:
        amplitude, cycles, phase = torque
        self._device(actuators, name, on=on, cogging=_text(amplitude, cycles, phase))

    def _passive(self, actuators: ET.Element) -> None:
        joint = self.joint
        bias = joint.of("torque_bias")["torque_nm"]
        if bias:
            ET.SubElement(
                actuators, "general", name="bias", joint="motor", gainprm="0", biastype="affine",
                biasprm=_text(bias, 0, 0),
            )  # fmt: skip
        if joint.has("cogging"):
            c = joint.of("cogging")
            first = (c["amplitude_nm"], c["cycles_per_turn"], c["phase_rad"])
            self._ripple(actuators, "cogging", "motor", first)
            if c["second_ratio"]:
                phase = 2.0 * c["phase_rad"] + c["second_phase_rad"]
                amplitude = c["second_ratio"] * c["amplitude_nm"]
                second = (amplitude, 2.0 * c["cycles_per_turn"], phase)
                self._ripple(actuators, "cogging_second", "motor", second)
        if joint.has("gravity"):
            g = joint.of("gravity")
            on = "motor" if joint.one_body else "link"
            torque = (g["torque_nm"], 1.0, g["angle_rad"] + math.pi)
            self._ripple(actuators, "gravity", on, torque)
        for side in ("motor",) if joint.one_body else ("motor", "link"):
            if self._has_bristles(side):
                law = _text(*self._bristles(side))
                self._device(actuators, f"friction_{side}", on=side, lugre=law)
        if joint.has("hysteresis"):
            h = joint.of("hysteresis")
            stiffness, level = h["torque_nm"] / h["displacement_rad"], h["torque_nm"]
            loop = _text(stiffness, 0.0, level, level, 1.0)
            self._device(actuators, "hysteresis", tendon="transmission", lugre=loop)

    def _bristles(self, side: str) -> tuple[float, float, float, float, float]:
        """Return stiffness, damping, sliding and static level and Stribeck velocity of a side."""
        body = self.joint.body
        level, inertia = (body["fsm"], body["jm"]) if side == "motor" else (body["fs"], body["j"])
        slow = self.joint.of(f"stribeck_friction_{side}")
        rise, velocity, damping, stiffness = slow["torque_nm"], slow["velocity_rad_s"], 0.0, 0.0
        if side == "motor" and self.joint.has("lugre_friction"):
            law = self.joint.of("lugre_friction")
            if rise:
                raise self._beside("stribeck_friction_motor", "lugre_friction")
            rise, velocity = law["stribeck_nm"], law["velocity_rad_s"]
            damping, stiffness = law["damping_nm_s_rad"], law["bristle_nm_rad"]
        else:
            way = self.joint.of("presliding_friction")[f"{side}_rad"]
            stiffness = (level + rise) / way if way else math.inf
        stiffest = inertia * (_STIFF_BRISTLES / self.step) ** 2
        if stiffness > stiffest:
            stiffness, damping = stiffest, 2.0 * _BRISTLE_DAMPING * math.sqrt(stiffest * inertia)
            fastest = _RUNGE_KUTTA * level / (stiffness * self.step)
            said = (
                f"Friction of the {side} stands on bristles of {stiffness:.3g} N m/rad, as stiff "
                f"as the time step allows; that is stable up to about {fastest:.2g} rad/s."
            )
            self.notes.append(self.joint.in_units(said))
        return stiffness, damping, level, level + rise, velocity

    def _sensors(self) -> None:
        sensors = ET.SubElement(self.root, "sensor")
        for side in ("motor",) if self.joint.one_body else ("motor", "link"):
            ET.SubElement(sensors, "jointpos", name=f"{side}_position", joint=side)
