"""What each target makes of each effect: says it natively, by an equivalent, or not at all.

`python -m fjr_export.treatments docs/export.md` renews the table of the document.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, get_args

from fjr_kit.document_tables import renew
from fjr_kit.errors import InputError
from fjr_sim_node import effects

from .joint import Joint

Kind = Literal["native", "equivalent", "refused"]
Target = Literal["mjcf", "urdf", "control", "simscape-m"]
TARGETS: tuple[Target, ...] = get_args(Target)

TITLES: Mapping[Target, str] = {
    "mjcf": "MuJoCo",
    "urdf": "URDF",
    "control": "python-control",
    "simscape-m": "Simscape",
}


@dataclass(frozen=True)
class Treatment:
    """What a target makes of an effect.

    Attributes:
        kind: native: the same law; equivalent: another law near it; refused: nothing.
        how: by what, or why not, a phrase.
    """

    kind: Kind
    how: str


def _native(how: str) -> Treatment:
    return Treatment("native", how)


def _equivalent(how: str) -> Treatment:
    return Treatment("equivalent", how)


def _refused(why: str) -> Treatment:
    return Treatment("refused", why)


_DEFLECTION = "the joint is rigid there, so it has no deflection"
_LINEAR = "a linear model has no equivalent of it"
_AT_RECORD = "the gain that fits best over the replayed motion"
_LOAD = "friction there does not depend on the load"
_MEASUREMENT = "it belongs to the measurement; apply it to the position that you read"
_ONE_LEVEL = "friction there is one level and one viscous coefficient"

MJCF: Mapping[str, Treatment] = {
    "coulomb_friction": _native("frictionloss; MuJoCo lets it yield by less than a time step"),
    "viscous_friction": _native("damping"),
    "stribeck_friction_motor": _equivalent("LuGre friction on stiff bristles"),
    "stribeck_friction_link": _equivalent("LuGre friction on stiff bristles"),
    "asymmetric_friction": _refused("friction there is the same in both directions"),
    "presliding_friction": _native("LuGre friction whose bristles have no damping"),
    "lugre_friction": _equivalent(
        "LuGre friction; its bristle damping neither fades with speed nor rests while they unbend"
    ),
    "load_friction": _refused(_LOAD),
    "directional_loss": _refused(_LOAD),
    "position_friction": _refused("friction there does not depend on the angle"),
    "quadratic_friction": _native("second coefficient of damping"),
    "nonstationary": _refused("parameters there do not change with time"),
    "backlash": _native("dead band of the tendon's spring"),
    "piecewise_stiffness": _native("two springs, one with a dead band, which has k1"),
    "asymmetric_stiffness": _native("a spring for each direction"),
    "cubic_stiffness": _native("third coefficient of the tendon's stiffness"),
    "hysteresis": _native("LuGre friction of the tendon, without damping"),
    "transmission_damping": _native("damping of the tendon"),
    "kinematic_error": _refused("a tendon is linear in the angles"),
    "extra_mode": _native("a third body behind a tendon"),
    "gravity": _native("a torque that is sinusoidal in the angle of the link"),
    "external_spring": _native("stiffness and springref of the link's joint"),
    "hardening_spring": _native("stiffness of the link's joint, its first and third coefficient"),
    "cable": _refused("springs there do not give way with time"),
    "transmission_stiffness": _native("a tendon between two bodies"),
    "torque_bias": _native("a constant torque"),
    "cogging": _native("cogging of a passive DC motor"),
    "delay": _native("delay of the actuator, interpolated between time steps"),
    "actuator_lag": _native("first-order filter of the actuator"),
    "torque_saturation": _native("range of the control; a knee is left out, so that it clips"),
    "torque_speed_limit": _equivalent("DC motor of limited voltage, which brakes beyond no-load"),
    "torque_slew_limit": _equivalent("slew limit of a DC motor, which comes half a time step late"),
    "dead_band": _refused("a control has no dead band; apply it to the control that you write"),
    "torque_constant_ripple": _refused("an actuator's gain does not depend on the angle"),
    "torque_gain": _native("gain of the actuator"),
    "encoder_quantization": _refused(_MEASUREMENT),
    "encoder_eccentricity": _refused(_MEASUREMENT),
}  # fmt: skip

URDF: Mapping[str, Treatment] = {
    "coulomb_friction": _equivalent("friction, of motor and link together"),
    "viscous_friction": _equivalent("damping, of motor and link together"),
    "transmission_stiffness": _equivalent("a rigid joint"),
    "torque_saturation": _native("effort of limit; a knee is left out, so that it clips"),
    **dict.fromkeys(
        (
            *("backlash", "piecewise_stiffness", "asymmetric_stiffness", "cubic_stiffness"),
            "hysteresis",
        ),
        _refused(_DEFLECTION),
    ),
    "transmission_damping": _refused(_DEFLECTION),
    "kinematic_error": _refused(_DEFLECTION),
    **dict.fromkeys(
        (
            *("stribeck_friction_motor", "stribeck_friction_link", "asymmetric_friction"),
            *("presliding_friction", "lugre_friction", "position_friction", "quadratic_friction"),
        ),
        _refused(_ONE_LEVEL),
    ),
    "load_friction": _refused(_LOAD),
    "directional_loss": _refused(_LOAD),
    "nonstationary": _refused("parameters there do not change with time"),
    "extra_mode": _refused("the joint moves one body"),
    "gravity": _refused("the mass and its place are not known, only their product"),
    **dict.fromkeys(
        ("external_spring", "hardening_spring", "cable"), _refused("a joint there has no spring")
    ),
    **dict.fromkeys(
        (
            *("torque_bias", "cogging", "delay", "actuator_lag", "torque_speed_limit"),
            *("torque_slew_limit", "dead_band", "torque_constant_ripple", "torque_gain"),
        ),
        _refused("it belongs to the drive, of which a URDF says the limits alone"),
    ),
    "encoder_quantization": _refused(_MEASUREMENT),
    "encoder_eccentricity": _refused(_MEASUREMENT),
}

CONTROL: Mapping[str, Treatment] = {
    "coulomb_friction": _equivalent(f"viscous friction: {_AT_RECORD}"),
    "viscous_friction": _native("viscous friction"),
    "stribeck_friction_motor": _equivalent(f"viscous friction: {_AT_RECORD}"),
    "stribeck_friction_link": _equivalent(f"viscous friction: {_AT_RECORD}"),
    "quadratic_friction": _equivalent(f"viscous friction: {_AT_RECORD}"),
    "backlash": _equivalent(f"stiffness: {_AT_RECORD}"),
    "piecewise_stiffness": _equivalent(f"stiffness: {_AT_RECORD}"),
    "asymmetric_stiffness": _equivalent(f"stiffness: {_AT_RECORD}"),
    "cubic_stiffness": _equivalent(f"stiffness: {_AT_RECORD}"),
    "transmission_damping": _native("damping between the bodies"),
    "extra_mode": _native("a third body"),
    "transmission_stiffness": _native("stiffness between two bodies"),
    "delay": _native("states of the discrete model, fractions of a sample included"),
    "actuator_lag": _native("a state"),
    "torque_gain": _native("gain of the input"),
    "gravity": _equivalent("its slope at angle zero"),
    "external_spring": _equivalent("its stiffness; what it pulls at angle zero is left out"),
    "hardening_spring": _equivalent("its slope at angle zero"),
    "cable": _native("a state"),
    "nonstationary": _refused("the model does not change with time"),
    **dict.fromkeys(
        (
            *("asymmetric_friction", "presliding_friction", "lugre_friction", "load_friction"),
            *("directional_loss", "position_friction", "hysteresis", "kinematic_error"),
            *("torque_bias", "cogging", "torque_saturation", "torque_speed_limit"),
            *("torque_slew_limit", "dead_band", "torque_constant_ripple"),
        ),
        _refused(_LINEAR),
    ),
    "encoder_quantization": _refused(_MEASUREMENT),
    "encoder_eccentricity": _refused(_MEASUREMENT),
}

SIMSCAPE: Mapping[str, Treatment] = {
    **dict.fromkeys(
        (
            *("coulomb_friction", "stribeck_friction_motor", "stribeck_friction_link"),
            *("asymmetric_friction", "load_friction", "directional_loss", "position_friction"),
        ),
        _equivalent("a term of the friction level, which is smooth about zero velocity"),
    ),
    **dict.fromkeys(
        (
            *("viscous_friction", "quadratic_friction", "presliding_friction", "backlash"),
            *("piecewise_stiffness", "asymmetric_stiffness", "cubic_stiffness", "hysteresis"),
            *("transmission_damping", "kinematic_error", "extra_mode", "gravity"),
            *("external_spring", "hardening_spring", "cable", "transmission_stiffness"),
            *("torque_bias", "cogging", "actuator_lag", "torque_speed_limit", "dead_band"),
            *("torque_constant_ripple", "torque_gain", "encoder_eccentricity"),
        ),
        _native("its equation"),
    ),
    "delay": _native("the operator delay"),
    "torque_saturation": _native("its equation; a knee is left out, so that it clips"),
    "torque_slew_limit": _refused("its law holds from sample to sample, not in between"),
    "lugre_friction": _refused("its damping acts while the bristles bend further, which jumps"),
    "nonstationary": _refused("it drifts over an experiment, not within a simulation"),
    "encoder_quantization": _refused(_MEASUREMENT),
}

TREATMENTS: Mapping[Target, Mapping[str, Treatment]] = {
    "mjcf": MJCF,
    "urdf": URDF,
    "control": CONTROL,
    "simscape-m": SIMSCAPE,
}


def treatment(target: Target, identifier: str) -> Treatment:
    """Return what a target makes of an effect; one that it does not know is refused."""
    unknown = _refused(f"it is not expressed in {TITLES[target]} so far")
    return TREATMENTS[target].get(identifier, unknown)


def treated(joint: Joint, target: Target) -> Iterator[tuple[str, Treatment]]:
    """Yield each effect that is on, with what the target makes of it."""
    for identifier in joint.effects_on:
        yield identifier, treatment(target, identifier)


def refuse_inexpressible(joint: Joint, target: Target) -> None:
    """Refuse effects that a target cannot express.

    Raises:
        InputError: the first of them with its reason, and how to export the rest.
    """
    refused = {name: t for name, t in treated(joint, target) if t.kind == "refused"}
    if not refused:
        return
    reasons = "; ".join(f"{name}: {t.how}" for name, t in refused.items())
    raise InputError(
        f"{joint.source}: {TITLES[target]} cannot express {reasons}. "
        f"Give --without {','.join(refused)} to export the rest."
    )


def table() -> str:
    """Return what each target makes of each effect, as a Markdown table."""
    lines = [f"| effect | {' | '.join(TITLES.values())} |", "|---" * (len(TARGETS) + 1) + "|"]
    for effect in effects.CATALOGUE:
        cells = [treatment(target, effect.identifier) for target in TARGETS]
        told = " | ".join(f"{cell.kind}: {cell.how}" for cell in cells)
        lines.append(f"| `{effect.identifier}` | {told} |")
    return "\n".join(lines)


if __name__ == "__main__":
    renew({"treatments": table()})
