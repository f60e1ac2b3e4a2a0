"""The joint as a component in the Simscape language, and a MATLAB script that puts it in a model.

The component holds the joint's laws as equations, numbers in SI units without units of their own,
so that what the tests integrate is what MATLAB reads. Friction is smooth about zero velocity: a
level times tanh(velocity / w0).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from fjr_interface.parameters import Parameter
from fjr_sim_node import plant

from .joint import Joint
from .spring import spring_expression

SLIP_RAD_S = 1e-3
"""Velocity w0 at which friction has reached 76 % of its level."""
COMPONENT = "flexible_joint"


@dataclass
class Laws:
    """The equations of a joint, as expressions in MATLAB.

    Attributes:
        parameters: value and description by name.
        states: derivatives by state, in its unit per second, all zero at first.
        terms: names that expressions stand for, in the order in which they rest on one another.
        outputs: expressions by output.
    """

    parameters: dict[str, tuple[float, str]] = field(default_factory=dict)
    states: dict[str, str] = field(default_factory=dict)
    terms: dict[str, str] = field(default_factory=dict)
    outputs: dict[str, str] = field(default_factory=dict)


def laws(joint: Joint) -> Laws:
    """Return the equations of a joint; the load's torque on the link is `load`, the command `u`."""
    made = Laws()
    for parameter, value in _bare(joint):
        made.parameters[parameter.name] = (value, f"{parameter.description} ({parameter.unit})")
    made.parameters["w0"] = (SLIP_RAD_S, "Velocity of slip (rad/s)")
    _drive(joint, made)
    if not joint.one_body:
        _transmission(joint, made)
    _motor(joint, made)
    _link(joint, made)
    eccentric = joint.of("encoder_eccentricity")
    amplitude, phase = eccentric["amplitude_rad"], eccentric["phase_rad"]
    made.outputs["y"] = f"th + {amplitude!r}*sin(th + {phase!r})" if amplitude else "th"
    made.outputs["position"] = "th" if joint.one_body else "q"
    return made


def _bare(joint: Joint) -> Iterator[tuple[Parameter, float]]:
    for parameter in plant.PLANT:
        if not joint.one_body or parameter.name in ("jm", "fsm", "fvm"):
            yield parameter, joint.body[parameter.name]


def _ripple(values: dict[str, float], angle: str) -> str:
    inner = f"({values['cycles_per_turn']!r}*{angle} + {values['phase_rad']!r})"
    first = f"sin{inner}"
    if not values["second_ratio"]:
        return first
    second = f"sin(2*{inner} + {values['second_phase_rad']!r})"
    return f"({first} + {values['second_ratio']!r}*{second})"


def _drive(joint: Joint, made: Laws) -> None:
    width, limit = joint.of("dead_band")["width_nm"], joint.of("torque_saturation")["limit_nm"]
    torque = "u"
    if width:
        torque = f"({torque} - min(max({torque}, {-width!r}), {width!r}))"
    if math.isfinite(limit):
        torque = f"min(max({torque}, {-limit!r}), {limit!r})"
    gain = 1.0 + joint.of("torque_gain")["relative_error"]
    made.terms["commanded"] = torque if gain == 1.0 else f"{gain!r}*{torque}"
    time = joint.of("delay")["time_s"]
    late = f"delay(commanded, {{{time!r}, 's'}}, History = 0)" if time else "commanded"
    made.terms["late"] = late
    lag = joint.of("actuator_lag")["time_constant_s"]
    if lag:
        made.states["lagged"] = f"(late - lagged)/{lag!r}"
    drive = "lagged" if lag else "late"
    line = joint.of("torque_speed_limit")
    if math.isfinite(line["stall_nm"]):
        share = f"max(1 - max(sign({drive})*w, 0)/{line['no_load_rad_s']!r}, 0)"
        made.terms["available"] = f"{line['stall_nm']!r}*{share}"
        drive = f"min(max({drive}, -available), available)"
    if joint.has("torque_constant_ripple"):
        ripple = joint.of("torque_constant_ripple")
        drive = f"{drive}*(1 + {ripple['amplitude']!r}*{_ripple(ripple, 'th')})"
    extra = ""
    if joint.has("torque_bias"):
        extra += f" + {joint.of('torque_bias')['torque_nm']!r}"
    if joint.has("cogging"):
        cogging = joint.of("cogging")
        extra += f" + {cogging['amplitude_nm']!r}*{_ripple(cogging, 'th')}"
    made.terms["drive"] = f"{drive}{extra}"


def _transmission(joint: Joint, made: Laws) -> None:
    error = joint.of("kinematic_error")
    made.terms["lever"] = "1"
    made.terms["d"] = "q - th"
    if error["amplitude_rad"]:
        cycles = error["cycles_per_turn"]
        angle = f"({cycles!r}*th + {error['phase_rad']!r})"
        slope = f"{cycles!r}*(cos{angle}"
        slope += f" + {2.0 * error['second_ratio']!r}*cos(2*{angle} + "
        slope += f"{error['second_phase_rad']!r}))"
        made.terms["d"] = f"q - th + {error['amplitude_rad']!r}*{_ripple(error, 'th')}"
        made.terms["lever"] = f"1 - {error['amplitude_rad']!r}*{slope}"
    made.terms["vd"] = "v - w*lever"
    te = spring_expression(joint, "d")
    for name in ("k0", "k1"):
        te = te.replace(f"{joint.bare[name]!r}*", f"{name}*")
    if joint.has("transmission_damping"):
        te += f" + {joint.of('transmission_damping')['nm_s_rad']!r}*vd"
    if joint.has("hysteresis"):
        loop = joint.of("hysteresis")
        made.states["z"] = f"(vd - abs(vd)*z)/{loop['displacement_rad']!r}"
        te += f" + {loop['torque_nm']!r}*z"
    made.terms["te"] = te


def _friction(joint: Joint, side: str, speed: str, level: str, made: Laws) -> str:
    way = joint.of("presliding_friction")[f"{side}_rad"]
    if not way:
        return f"{level}*tanh({speed}/w0)"
    state = f"bent_{side}"
    made.states[state] = f"({speed} - abs({speed})*{state})/{way!r}"
    return f"{level}*{state}"


def _slow(joint: Joint, side: str, speed: str) -> str:
    slow = joint.of(f"stribeck_friction_{side}")
    if not slow["torque_nm"]:
        return ""
    return f" + {slow['torque_nm']!r}*exp(-({speed}/{slow['velocity_rad_s']!r})^2)"


def _motor(joint: Joint, made: Laws) -> None:
    level = "fsm" + _slow(joint, "motor", "w")
    uneven = joint.of("asymmetric_friction")
    if uneven["coulomb_nm"]:
        level += f" + {uneven['coulomb_nm']!r}*sign(w)"
    if joint.has("position_friction"):
        place = joint.of("position_friction")
        level += f" + {place['amplitude_nm']!r}*{_ripple(place, 'th')}"
    viscous = "fvm*w"
    square = joint.of("quadratic_friction")["motor_nm_s2_rad2"]
    if square:
        viscous += f" + {square!r}*abs(w)*w"
    if uneven["viscous_nm_s_rad"]:
        viscous += f" + {uneven['viscous_nm_s_rad']!r}*abs(w)"
    level += _losses(joint, f"({level})*tanh(w/w0) + {viscous}", made)
    made.terms["friction"] = (
        f"{_friction(joint, 'motor', 'w', f'max({level}, 0)', made)} + {viscous}"
    )
    on_motor = "drive + te*lever - friction" if not joint.one_body else "drive - friction + load"
    if joint.one_body:
        on_motor += _outside(joint, "th", made)
    made.states = {"th": "w", "w": f"({on_motor})/jm", **made.states}


def _losses(joint: Joint, friction: str, made: Laws) -> str:
    """Return the part of the motor's friction level that grows with what the gear carries, signed.

    Args:
        joint: the joint.
        friction: of the motor without that part.
        made: takes the torque of a rigid axis' gear; see `plant.torques.gear_load`.
    """
    loss = joint.of("directional_loss")
    half = 0.5 * (loss["forward"] - loss["backward"])
    mean = 0.5 * (loss["forward"] + loss["backward"])
    mean += joint.of("load_friction")["coefficient"]
    if not mean:
        return ""
    if joint.one_body:
        outside = _outside(joint, "th", made)
        made.terms["carried"] = f"0.5*(drive - ({friction}) - (load{outside}))"
        made.terms["forward"] = "sign(carried*w)"
        made.terms["te"] = f"-carried/(1 + 0.5*({mean!r} + {half!r}*forward)*forward)"
    return f" + ({mean!r} - {half!r}*sign(te*w))*abs(te)"


def _outside(joint: Joint, angle: str, made: Laws) -> str:
    """Return the torque of gravity, of a spring and a cable to the frame at an angle, signed."""
    torque = ""
    if joint.has("gravity"):
        weight = joint.of("gravity")
        torque += f" - {weight['torque_nm']!r}*sin({angle} + {weight['angle_rad']!r})"
    if joint.has("external_spring"):
        spring = joint.of("external_spring")
        torque += f" - {spring['stiffness_nm_rad']!r}*({angle} - {spring['rest_rad']!r})"
    if joint.has("hardening_spring"):
        spring = joint.of("hardening_spring")
        stretched = f"({angle} - {spring['rest_rad']!r})"
        torque += f" - {spring['stiffness_nm_rad']!r}*{stretched}"
        torque += f" - {spring['cubic_nm_rad3']!r}*{stretched}^3"
    if joint.has("cable"):
        cable = joint.of("cable")
        torque += f" - {cable['stiffness_nm_rad']!r}*({angle} - slack)"
        made.states["slack"] = f"({angle} - slack)/{cable['relaxation_s']!r}"
    return torque


def _link(joint: Joint, made: Laws) -> None:
    if joint.one_body:
        return
    level = f"({'fs' + _slow(joint, 'link', 'v')})"
    torque = f"load - te - {_friction(joint, 'link', 'v', level, made)} - fv*v"
    square = joint.of("quadratic_friction")["link_nm_s2_rad2"]
    if square:
        torque += f" - {square!r}*abs(v)*v"
    torque += _outside(joint, "q", made)
    if joint.has("extra_mode"):
        mode = joint.of("extra_mode")
        rate = 2.0 * math.pi * mode["frequency_hz"]
        pull = f"({rate**2!r}*(q3 - q) + {2.0 * mode['damping_ratio'] * rate!r}*(v3 - v))"
        torque += f" + {mode['inertia_kg_m2']!r}*{pull}"
        made.states |= {"q3": "v3", "v3": f"-{pull}"}
    made.states |= {"q": "v", "v": f"({torque})/j"}


def component(joint: Joint) -> str:
    """Return the joint as a component in the Simscape language."""
    made = laws(joint)
    lines = [f"component {COMPONENT}", f"% One joint from {joint.title}, SI units."]
    lines += ["nodes", "  R = foundation.mechanical.rotational.rotational; % R:right", "end"]
    lines += ["inputs", "  u = {0, '1'}; % u:left, commanded torque in N m", "end"]
    lines += ["outputs", "  y = {0, '1'}; % y:left, measured motor position in rad"]
    lines += ["  position = {0, '1'}; % q:right, link position in rad", "end", "parameters"]
    lines += [
        f"  {name} = {{{value!r}, '1'}}; % {told}" for name, (value, told) in
        made.parameters.items()
    ]  # fmt: skip
    lines += ["end", "variables", "  load = {0, '1'}; % torque of what hangs on R, in N m"]
    lines += [
        f"  {name} = {{value = {{0, '1'}}, priority = priority.high}};" for name in made.states
    ]
    lines += ["end", "variables (Access = private)", "  t = {0, 'N*m'};", "end"]
    lines += ["branches", "  t : R.t -> *;", "end", "equations", "  let"]
    lines += [f"    {name} = {law};" for name, law in made.terms.items()]
    lines += ["  in"]
    lines += [f"    {name}.der*{{1, 's'}} == {law};" for name, law in made.states.items()]
    lines += [f"    {name} == {law};" for name, law in made.outputs.items()]
    lines += [f"    value(R.w, 'rad/s') == {'w' if joint.one_body else 'v'};"]
    lines += ["    load == value(t, 'N*m');", "  end", "end", "end"]
    return "\n".join(lines) + "\n"


def matlab_script(joint: Joint) -> str:
    """Return the script that puts the component into a new model, held at the sample rate."""
    return f"""% One joint from {joint.title}: a Simscape model of {COMPONENT}.ssc beside it.
% Needs Simulink and Simscape. Input: torque in N m; outputs: motor and link position in rad.
sample_period = {1.0 / joint.sample_rate_hz!r}; % s
model = '{COMPONENT}_model';
new_system(model);
open_system(model);
place = @(library, name, varargin) add_block(library, [model '/' name], varargin{{:}});
place('simulink/Sources/In1', 'torque');
place('simulink/Discrete/Zero-Order Hold', 'hold', 'SampleTime', num2str(sample_period, 17));
place('nesl_utility/Simulink-PS Converter', 'to_physical');
place('nesl_utility/Simscape Component', 'joint');
set_param([model '/joint'], 'SourceFile', '{COMPONENT}');
place('nesl_utility/Solver Configuration', 'solver');
place('nesl_utility/PS-Simulink Converter', 'from_motor');
place('nesl_utility/PS-Simulink Converter', 'from_link');
place('simulink/Sinks/Out1', 'motor');
place('simulink/Sinks/Out1', 'link');
ports = @(name) get_param([model '/' name], 'PortHandles');
add_line(model, 'torque/1', 'hold/1');
add_line(model, 'hold/1', 'to_physical/1');
joint = ports('joint'); % left: u, y; right: R, position
to_physical = ports('to_physical');
from_motor = ports('from_motor');
from_link = ports('from_link');
solver = ports('solver');
add_line(model, to_physical.RConn(1), joint.LConn(1));
add_line(model, joint.LConn(2), from_motor.LConn(1));
add_line(model, joint.RConn(1), solver.RConn(1));
add_line(model, joint.RConn(2), from_link.LConn(1));
add_line(model, 'from_motor/1', 'motor/1');
add_line(model, 'from_link/1', 'link/1');
"""
