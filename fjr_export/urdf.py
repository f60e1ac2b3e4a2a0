"""The joint as a URDF: one rigid joint with damping and friction, and its ros2_control tag."""

from __future__ import annotations

import math
from xml.etree import ElementTree as ET

from .joint import Joint

_PLUGIN = "joint_state_topic_hardware_interface/JointStateTopicSystem"
_TRAVEL_M = 1e3
_NO_LIMIT = 1e9  # N
_STAND_IN = {
    False: "The mass is a stand-in; the inertia about the axis is what counts.",
    True: "Inertias and travel are stand-ins; the mass along the axis is what counts.",
}
"""What a body says that it need not, by whether it slides."""


def urdf(joint: Joint) -> str:
    """Return the joint as a URDF: base, joint and link, with the sums of motor and link.

    A URDF has no spring between motor and link, so it holds below the resonance alone. The hardware
    of the ros2_control tag is the component that `fjr bridge` answers. A joint that slides does so
    along x, within a travel that stands in for the true one, which a URDF must state.
    """
    bare = joint.bare
    inertia = bare["jm"] + (0.0 if joint.one_body and math.isinf(bare["j"]) else bare["j"])
    root = ET.Element("robot", name="joint")
    root.append(
        ET.Comment(
            f" One joint from {joint.title.replace('--', '- -')}, SI units: motor and link as one "
            f"body. {_STAND_IN[joint.linear]} "
        )
    )
    ET.SubElement(root, "link", name="base")
    link = ET.SubElement(root, "link", name="link")
    inertial = ET.SubElement(link, "inertial")
    mass, turning = (inertia, 1.0) if joint.linear else (1.0, inertia)
    ET.SubElement(inertial, "mass", value=_text(mass))
    about = {name: _text(turning) for name in ("ixx", "iyy", "izz")}
    ET.SubElement(inertial, "inertia", {**about, **dict.fromkeys(("ixy", "ixz", "iyz"), "0")})
    kind, axis = ("prismatic", "1 0 0") if joint.linear else ("continuous", "0 0 1")
    moving = ET.SubElement(root, "joint", name="joint", type=kind)
    ET.SubElement(moving, "parent", link="base")
    ET.SubElement(moving, "child", link="link")
    ET.SubElement(moving, "axis", xyz=axis)
    limit = joint.of("torque_saturation")["limit_nm"]
    if joint.linear or math.isfinite(limit):
        effort = _text(limit if math.isfinite(limit) else _NO_LIMIT)
        travel = {"lower": _text(-_TRAVEL_M), "upper": _text(_TRAVEL_M)} if joint.linear else {}
        ET.SubElement(moving, "limit", travel, effort=effort, velocity="1e3")
    ET.SubElement(
        moving, "dynamics", damping=_text(bare["fv"] + bare["fvm"]),
        friction=_text(bare["fs"] + bare["fsm"]),
    )  # fmt: skip
    control = ET.SubElement(root, "ros2_control", name="rig", type="system")
    hardware = ET.SubElement(control, "hardware")
    ET.SubElement(hardware, "plugin").text = _PLUGIN
    for name, value in (
        ("joint_states_topic", "/robot_joint_states"),
        ("joint_commands_topic", "/robot_joint_commands"),
        ("trigger_joint_command_threshold", "-1"),
    ):
        ET.SubElement(hardware, "param", name=name).text = value
    commanded = ET.SubElement(control, "joint", name="joint")
    command = ET.SubElement(commanded, "command_interface", name="effort")
    if math.isfinite(limit):
        ET.SubElement(command, "param", name="min").text = _text(-limit)
        ET.SubElement(command, "param", name="max").text = _text(limit)
    for name in ("position", "velocity", "effort"):
        ET.SubElement(commanded, "state_interface", name=name)
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _text(value: float) -> str:
    return f"{value:.10g}"
