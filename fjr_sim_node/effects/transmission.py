"""The table of effects: transmission and link."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .entry import (
    CONSTANT_TORQUE,
    Effect,
    EffectParameter,
    Load,
    angle,
    ripple,
    ripple_starts,
    size,
)
from .telltale import Telltale

_MODES = tuple(np.geomspace(0.08, 2.0, 44).tolist())
"""Frequencies of a light third mass over the highest with signal: it shows in a band as narrow as
its damping."""


def _weight(sizes: Sequence[float]) -> dict[str, float]:
    along, across = sizes
    return {
        "torque_nm": float(np.hypot(along, across)),
        "angle_rad": float(np.arctan2(across, along)),
    }


def _spring(sizes: Sequence[float]) -> dict[str, float] | None:
    """Return the parameters of a spring; None if it pushes."""
    stiffness, torque = sizes
    if not stiffness > 0.0:
        return None
    return {"stiffness_nm_rad": stiffness, "rest_rad": torque / stiffness}


def _hardening(sizes: Sequence[float]) -> dict[str, float] | None:
    """Return the parameters of a spring that hardens; None if it softens.

    The sizes are those of -q^3, q^2 and -q; what is left over is a constant torque.
    """
    cubic, square, linear, _ = sizes
    if not cubic > 0.0:
        return None
    rest = square / (3.0 * cubic)
    stiffness = max(linear - 3.0 * cubic * rest**2, 0.0)
    return {"cubic_nm_rad3": cubic, "stiffness_nm_rad": stiffness, "rest_rad": rest}


TRANSMISSION: tuple[Effect, ...] = (
    Effect(
        "backlash",
        "The transmission has a dead zone.",
        "transmission",
        "plant.spring:spring_torque",
        Telltale("low amplitude, more gain below the resonance", "deflection"),
        "Nordin, Gutman 2002, Automatica 38(10), dead-zone model",
        (size("half_gap_rad", "rad", "Half the dead zone of the deflection", 0.0, 1.0),),
        ({"half_gap_rad": (2e-3, 0.01, 0.04, 0.2, 0.5, 1.0, 2.0, 4.0)},),
        looks_like="dead or soft zone",
        same_as="a soft zone of zero stiffness (piecewise_stiffness with soft_ratio 0)",
    ),
    Effect(
        "piecewise_stiffness",
        "The transmission is soft around zero deflection and stiffer beyond (strain-wave gear).",
        "transmission",
        "plant.spring:spring_torque",
        Telltale("near backlash, which it contains", "deflection"),
        "Spong 1987; manufacturers' three-slope stiffness of strain-wave gears",
        (
            size("zone_rad", "rad", "Half width of the soft zone", 0.0, 1.0),
            EffectParameter("soft_ratio", 0.5, "", "Stiffness in the soft zone over k0", 0.0, 1.0),
        ),
        ({"zone_rad": (0.01, 0.04, 0.2, 0.6), "soft_ratio": (0.4, 0.9)},),
        looks_like="dead or soft zone",
    ),
    Effect(
        "asymmetric_stiffness",
        "The transmission is stiffer in one direction than in the other.",
        "transmission",
        "plant.spring:spring_torque",
        Telltale("even lines and DC, growing as the amplitude", "deflection"),
        "bilinear spring, k0 (1 + relative sgn d)",
        (size("relative", "", "Half the difference of the stiffnesses over k0", -0.95, 0.95),),
        ({"relative": (0.02,)},),
    ),
    Effect(
        "cubic_stiffness",
        "The transmission stiffens with the cube of its torsion where the datasheet has it linear.",
        "transmission",
        "plant.flexible_joint:with_added",
        Telltale("resonance higher at high amplitude", "deflection"),
        "paper eq. 3, k1",
        (size("stiffness_nm_rad3", "N m/rad3", "Cubic stiffness beyond k1", 0.0, 1e15,
              adds_to="k1"),),
        ({"stiffness_nm_rad3": (0.03, 0.3)},),
        same_as="a larger k1",
        of_bare_plant=True,
    ),
    Effect(
        "hysteresis",
        "The transmission torque depends on the history of the deflection.",
        "transmission",
        "plant.spring:transmitted_torque",
        Telltale("antiresonance damped", "deflection", "deflection rate"),
        "Dahl 1968 on the deflection; the rate-independent Bouc-Wen model with n = 1",
        (
            size("torque_nm", "N m", "Half height of the hysteresis loop"),
            EffectParameter("displacement_rad", 1e-3, "rad", "Deflection over which it builds up",
                            1e-6, 1.0, fit=(5e-4, 3.0)),
        ),
        ({"torque_nm": (0.003, 0.03), "displacement_rad": (3e-3, 0.03, 0.2)},),
        looks_like="loss in the transmission",
        looks_like_held="friction of the motor",
    ),
    Effect(
        "transmission_damping",
        "The transmission has a viscous term.",
        "transmission",
        "plant.spring:transmitted_torque",
        Telltale("resonance damped at mid and high amplitude", "deflection rate"),
        "Spong 1987, ASME J. Dyn. Syst. 109(4), with joint damping",
        (size("nm_s_rad", "N m s/rad", "Torque per deflection velocity"),),
        ({"nm_s_rad": (0.005, 0.05)},),
        looks_like="loss in the transmission",
        looks_like_held="drag of the motor",
    ),
    Effect(
        "kinematic_error",
        "The gear transmits an angle that is off periodically with the motor angle.",
        "transmission",
        "plant.spring:deflection",
        Telltale("even lines, flat with amplitude", "turn"),
        "Tuttle, Seering 1996, IEEE Trans. Robotics and Automation 12(3)",
        ripple("amplitude_rad", "rad", 1.0, "the angle error"),
        ripple_starts("amplitude_rad", 3e-3),
        looks_like_held="ripple of the torque",
        ripple=True,
    ),
    Effect(
        "extra_mode",
        "A third mass hangs on the link behind a spring of its own.",
        "link",
        "plant.torques:link_drive",
        Telltale("narrow band", "frequency"),
        "three-mass model of a flexible joint with a flexible link",
        (
            size("inertia_kg_m2", "kg m2", "Inertia of the third mass", 0.0, 1e3),
            EffectParameter("frequency_hz", 30.0, "Hz", "Its natural frequency with the link held",
                            0.1, 2000.0, fit=(0.04, 2.4)),
            EffectParameter("damping_ratio", 0.02, "", "Its damping ratio with the link held",
                            0.0, 2.0, fit=(0.0, 0.2)),
        ),
        (
            {"inertia_kg_m2": (2e-3,), "frequency_hz": _MODES, "damping_ratio": (0.03,)},
            {
                "inertia_kg_m2": (0.04,),
                "frequency_hz": (0.16, 0.3, 0.44, 0.6, 0.8, 1.1),
                "damping_ratio": (0.03,),
            },
        ),
        settles_slowly=True,
    ),
    Effect(
        "gravity",
        "The link is out of balance.",
        "link",
        "plant.torques:link_drive",
        Telltale("DC and even lines at low amplitude", "position"),
        "pendulum torque m g l sin(q + angle)",
        (
            size("torque_nm", "N m", "Greatest gravity torque m g l"),
            angle("angle_rad", "Angle of the link from hanging down at q = 0"),
        ),
        ({"torque_nm": (0.003, 0.03), "angle_rad": (0.0, np.pi / 2, np.pi)},),
        looks_like=CONSTANT_TORQUE,
        same_as="cogging of one cycle per turn, on a rigid axis",
        of_a_turn=True,
        load=Load(lambda q: [-np.sin(q), -np.cos(q)], _weight),
        axis="both",
    ),
    Effect(
        "external_spring",
        "A balancer or a hose pulls the link back as a spring to the frame does.",
        "link",
        "plant.torques:link_drive",
        Telltale("slow motion stiffer at every amplitude", "position"),
        "linear torsion spring to the ground (Hooke)",
        (
            size("stiffness_nm_rad", "N m/rad", "Stiffness between link and frame", 0.0, 1e9),
            EffectParameter("rest_rad", 0.0, "rad", "Angle of the link at which it pulls nowhere",
                            -1e4, 1e4, fit=(-5.0, 5.0)),
        ),
        (
            {"stiffness_nm_rad": (0.01, 0.1), "rest_rad": (0.0,)},
            {"stiffness_nm_rad": (0.01,), "rest_rad": (-3.0, 3.0)},
        ),
        looks_like=CONSTANT_TORQUE,
        load=Load(lambda q: [-q, np.ones(q.size)], _spring),
        rarer_than="gravity",
        axis="both",
    ),
    Effect(
        "hardening_spring",
        "A spring to the frame hardens as the link goes away from where it rests.",
        "link",
        "plant.torques:hardening_pull",
        Telltale("odd distortion and a stiffness that grow with the amplitude", "position"),
        "Duffing 1918; linear and cubic torsion spring to the ground",
        (
            size("cubic_nm_rad3", "N m/rad3", "Cubic stiffness between link and frame", 0.0, 1e15),
            size("stiffness_nm_rad", "N m/rad", "Stiffness between link and frame where the spring "
                 "rests", 0.0, 1e9),
            EffectParameter("rest_rad", 0.0, "rad", "Angle of the link at which it pulls nowhere",
                            -1e4, 1e4, fit=(-5.0, 5.0)),
        ),
        (
            {"cubic_nm_rad3": (0.01, 0.1), "stiffness_nm_rad": (0.0, 0.03), "rest_rad": (0.0,)},
            {"cubic_nm_rad3": (0.01,), "stiffness_nm_rad": (0.0,), "rest_rad": (-1.5, 1.5)},
        ),
        looks_like=CONSTANT_TORQUE,
        contains=("external_spring",),
        on_request=True,
        load=Load(lambda q: [-(q**3), q**2, -q, np.ones(q.size)], _hardening),
        rarer_than="gravity",
        axis="both",
    ),
    Effect(
        "cable",
        "A cable to the frame pulls the link back, and gives way while it does.",
        "link",
        "plant.torques:cable_pull",
        Telltale(
            "quick motion stiffer at every amplitude, slow motion and DC as without", "frequency",
        ),
        "Maxwell element to the ground, a spring behind a damper",
        (
            size("stiffness_nm_rad", "N m/rad", "Stiffness against quick motion", 0.0, 1e9),
            EffectParameter("relaxation_s", 1.0, "s", "Time in which its pull falls to 1/e",
                            0.02, 1e4, fit=(0.2, 2000.0)),
        ),
        ({"stiffness_nm_rad": (0.01, 0.1), "relaxation_s": (0.6, 10.0)},),
        looks_like=CONSTANT_TORQUE,
        rarer_than="gravity",
        axis="both",
        settles_slowly=True,
    ),
    Effect(
        "transmission_stiffness",
        "The transmission yields where the datasheet has it rigid.",
        "transmission",
        "plant.flexible_joint:with_added",
        Telltale("resonance and antiresonance where an inertia alone has none", "frequency"),
        "paper eqs. 2 and 3 with k1 = 0; Spong 1987, ASME J. Dyn. Syst. 109(4)",
        (
            size("compliance_rad_nm", "rad/N m", "Deflection per transmitted torque, 1/k0",
                 negligible=1e-3),
            EffectParameter("link_inertia_share", 0.5, "", "Share of the inertia behind the "
                            "transmission", 0.01, 0.99),
            EffectParameter("link_coulomb_share", 0.0, "", "Share of Coulomb friction behind the "
                            "transmission", 0.0, 1.0),
            EffectParameter("link_viscous_share", 0.0, "", "Share of viscous friction behind the "
                            "transmission", 0.0, 1.0),
        ),
        (
            {"compliance_rad_nm": (0.02, 0.2, 1.0), "link_inertia_share": (0.3, 0.7),
             "link_coulomb_share": (0.3,), "link_viscous_share": (0.3,)},
        ),
        same_as="a finite k0",
        of_bare_plant=True,
        axis="rigid",
    ),
)  # fmt: skip
