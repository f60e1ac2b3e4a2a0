"""Laws of the second plant: its parameters and torques, written apart from the catalogue's.

Nothing here is shared with the simulated rig of `fjr_sim_node`. Where the field knows two models of
an effect, this is the other one:

    presliding              Generalized Maxwell Slip (Al-Bender et al. 2005), six elements
    Stribeck                Lorentzian of the velocity (Armstrong-Helouvry 1991)
    backlash                shaft with inner damping in the gap (Nordin, Galic, Gutman 1997)
    piecewise stiffness     rounded kinks
    hysteresis              Bouc-Wen ODE with n = 1.5 and unequal beta, gamma (Wen 1976)
    transmission damping    damper in series with a stiff spring (standard linear solid)
    kinematic error,
    cogging, friction angle two harmonics
    torque saturation       rounded
    actuator lag            two stages
    delay                   of the measurement
    LuGre                   Maxwell slip under a Stribeck level
    directional loss        friction by the transmitted torque, by the sign of the power
    torque-speed limit      hard clamp on a line that falls with the speed
    drift                   exponential warm-up

The remainder of the open worlds has laws of its own, in no catalogue: Eyring (shear-thinning)
drag, eddy-current drag, an inertia that varies with the angle as that of a crank, a one-sided
cushion, a torque constant that falls as the winding heats, loss in bending that grows with its
square, interpolation error of the encoder, a torque that wanders, jitter of the encoder's stamp.
"""

from __future__ import annotations

import itertools
import math

from .second_compiled import part

SETTINGS: tuple[str, ...] = (
    "stribeck_motor_nm", "stribeck_motor_rad_s", "stribeck_link_nm", "stribeck_link_rad_s",
    "asymmetric_coulomb_nm", "asymmetric_viscous_nm_s_rad", "bias_nm",
    "presliding_motor_rad", "presliding_link_rad", "load_coefficient",
    "friction_angle_nm", "friction_angle_cycles", "friction_angle_phase_rad",
    "drag_motor_nm_s2_rad2", "drag_link_nm_s2_rad2",
    "half_gap_rad", "soft_zone_rad", "soft_ratio",
    "hysteresis_nm", "hysteresis_rad", "flex_damping_nm_s_rad",
    "kinematic_rad", "kinematic_cycles", "kinematic_phase_rad",
    "mode_kg_m2", "mode_hz", "mode_damping_ratio",
    "gravity_nm", "gravity_angle_rad",
    "cogging_nm", "cogging_cycles", "cogging_phase_rad",
    "delay_s", "lag_s", "limit_nm", "resolution_rad",
    "eccentricity_rad", "eccentricity_phase_rad", "drift_relative", "drift_time_s",
    "slew_nm_s", "deadband_nm", "stiffness_asymmetry",
    "ripple_relative", "ripple_cycles", "ripple_phase_rad",
    "loss_forward", "loss_backward", "stall_nm", "no_load_rad_s",
    "spring_nm_rad", "spring_rest_rad", "spring_nm_rad3", "cable_nm_rad", "cable_time_s",
    "eyring_nm", "eyring_rad_s", "eddy_nm", "eddy_rad_s",
    "crank_relative", "crank_cycles", "crank_phase_rad", "cushion_nm_rad2", "cushion_rad",
    "heating_relative", "heating_nm", "heating_time_s", "bending_nm_s_rad", "bending_rad",
    "interpolation_rad", "interpolation_cycles", "wander_nm", "jitter_s",
)  # fmt: skip
"""Settings, zero if off; from eyring_nm on they are outside any catalogue."""

(
    STRIBECK_M, STRIBECK_MV, STRIBECK_L, STRIBECK_LV, ASYM_C, ASYM_V, BIAS, GMS_M, GMS_L, LOAD,
    FRICTION_ANGLE, FRICTION_CYCLES, FRICTION_PHASE, DRAG_M, DRAG_L, GAP, ZONE, SOFT,
    HYST, HYST_RAD, FLEX_DAMPING, KIN, KIN_CYCLES, KIN_PHASE, MODE, MODE_HZ, MODE_DAMPING,
    GRAVITY, GRAVITY_ANGLE, COG, COG_CYCLES, COG_PHASE, DELAY, LAG, LIMIT, RESOLUTION,
    ECC, ECC_PHASE, DRIFT, DRIFT_TIME, SLEW, DEADBAND, K_ASYM, RIPPLE, RIPPLE_CYCLES, RIPPLE_PHASE,
    LOSS_FORWARD, LOSS_BACKWARD, STALL, NO_LOAD, SPRING, SPRING_REST, SPRING_CUBE, CABLE,
    CABLE_TIME,
    EYRING, EYRING_V, EDDY, EDDY_V, CRANK, CRANK_CYCLES, CRANK_PHASE, CUSHION, CUSHION_RAD,
    HEATING, HEATING_NM, HEATING_TIME, BENDING, BENDING_RAD,
    INTERPOLATION, INTERPOLATION_CYCLES, WANDER, JITTER,
) = range(len(SETTINGS))  # fmt: skip

PLANT_NAMES = ("jm", "j", "fs", "fsm", "fv", "fvm", "k0", "k1")
JM, JL, FS, FSM, FV, FVM, K0, K1 = range(8)

GMS_YIELD = (0.2, 0.5, 0.9, 1.4, 2.1, 3.2)
"""Yield displacements of the slip elements over the displacement of the initial slope."""


def _gms_weights() -> tuple[float, ...]:
    """Return the share of each slip element in the Coulomb level; the sum is one."""
    edges = [0.0, 0.35, 0.7, 1.15, 1.75, 2.65, math.inf]
    slopes = [math.exp(-a) - math.exp(-b) for a, b in itertools.pairwise(edges)]
    heights = [slope * x for slope, x in zip(slopes, GMS_YIELD, strict=True)]
    return tuple(height / sum(heights) for height in heights)


GMS_WEIGHT = _gms_weights()


@part
def two_harmonics(angle):
    """Return sin of an angle with 30 % of second harmonic."""
    return math.sin(angle) + 0.3 * math.sin(2.0 * angle + 1.1)


@part
def two_harmonics_slope(angle):
    """Return the derivative of `two_harmonics`."""
    return math.cos(angle) + 0.6 * math.cos(2.0 * angle + 1.1)


@part
def rounded_beyond(d, zone):
    """Return how far |d| exceeds a zone, with its sign; kinks are rounded over a tenth of it."""
    width = 0.1 * zone
    a, b = d - zone, d + zone
    above = 0.5 * (a + math.sqrt(a * a + width * width))
    below = 0.5 * (b - math.sqrt(b * b + width * width))
    return above + below


@part
def elastic(d, p, s):
    """Return the elastic torque (N m) at a deflection d (rad) outside any gap."""
    k = p[K0]
    if s[K_ASYM] != 0.0:
        k *= 1.0 + s[K_ASYM] if d > 0.0 else 1.0 - s[K_ASYM]
    linear = d
    if s[ZONE] != 0.0:
        linear = s[SOFT] * d + (1.0 - s[SOFT]) * rounded_beyond(d, s[ZONE])
    return k * linear + p[K1] * linear * linear * linear


@part
def bouc_wen(z, moved, s):
    """Return Bouc-Wen's z in [-1, 1] after a small deflection, midpoint rule, n = 1.5."""
    step = moved / s[HYST_RAD]
    zm = z
    for _ in range(2):
        bent = abs(zm) * math.sqrt(abs(zm))
        sign = 1.0 if moved * zm >= 0.0 else -1.0
        after = z + step * (1.0 - bent * (0.4 + 0.6 * sign))
        zm = 0.5 * (z + after)
    return after


@part
def slip_elements(elements, moved, level, displacement):
    """Advance the Maxwell slip elements in place; return their torque (N m)."""
    total = 0.0
    for i in range(6):
        most = GMS_WEIGHT[i] * level
        torque = elements[i] + moved * most / (GMS_YIELD[i] * displacement)
        elements[i] = min(max(torque, -most), most)
        total += elements[i]
    return total


@part
def impulse(inertia, v, force, viscous, level_plus, level_minus, h):
    """Return the velocity after a step under set-valued friction (Moreau's time stepping).

    inertia (v1 - v) = h (force - viscous (v + v1)/2 - friction), friction in level Sgn(v1): the
    inclusion has one solution, zero where friction can hold.
    """
    momentum = inertia * v + h * (force - 0.5 * viscous * v)
    if momentum > h * level_plus:
        return (momentum - h * level_plus) / (inertia + 0.5 * h * viscous)
    if momentum < -h * level_minus:
        return (momentum + h * level_minus) / (inertia + 0.5 * h * viscous)
    return 0.0


@part
def drive(u, s):
    """Return what the drive makes of a command (N m): dead band, rounded limit."""
    if s[DEADBAND] != 0.0:
        u -= min(max(u, -s[DEADBAND]), s[DEADBAND])
    if s[LIMIT] != 0.0:
        u /= (1.0 + abs(u / s[LIMIT]) ** 16) ** 0.0625
    return u


@part
def within_speed_limit(torque, speed, s):
    """Return a torque (N m) within what the supply voltage leaves at a speed (rad/s)."""
    if s[STALL] == 0.0:
        return torque
    ratio = speed / s[NO_LOAD]
    return min(max(torque, -s[STALL] * (1.0 + ratio)), s[STALL] * (1.0 - ratio))


@part
def drag(speed, s):
    """Return torque over speed (N m s/rad) of the drags that are in no catalogue, at |speed|."""
    total = 0.0
    if s[EYRING] != 0.0:
        ratio = speed / s[EYRING_V]
        total += s[EYRING] * (math.asinh(ratio) / speed if ratio > 1e-6 else 1.0 / s[EYRING_V])
    if s[EDDY] != 0.0:
        ratio = speed / s[EDDY_V]
        total += 2.0 * s[EDDY] / s[EDDY_V] / (1.0 + ratio * ratio)
    return total


@part
def outer_load(angle, cable, wander, s):
    """Return the torque (N m) on the output from outside: gravity, springs, cable, cushion."""
    torque = s[WANDER] * wander
    if s[GRAVITY] != 0.0:
        across = math.cos(s[GRAVITY_ANGLE]) * math.sin(angle)
        torque -= s[GRAVITY] * (across + math.sin(s[GRAVITY_ANGLE]) * math.cos(angle))
    torque -= s[SPRING] * angle - s[SPRING] * s[SPRING_REST]
    if s[SPRING_CUBE] != 0.0:
        torque -= s[SPRING_CUBE] * (angle - s[SPRING_REST]) ** 3
    if s[CABLE] != 0.0:
        torque -= s[CABLE] * (angle - cable)
    if s[CUSHION] != 0.0 and angle > s[CUSHION_RAD]:
        torque -= s[CUSHION] * (angle - s[CUSHION_RAD]) ** 2
    return torque


@part
def crank(inertia, angle, speed, s):
    """Return inertia (kg m2) and torque (N m) of a body whose inertia varies with the angle.

    Lagrange: J(q) q'' + J'(q) q'^2 / 2 is what drives it.
    """
    if s[CRANK] == 0.0:
        return inertia, 0.0
    at = s[CRANK_CYCLES] * angle + s[CRANK_PHASE]
    slope = inertia * s[CRANK] * s[CRANK_CYCLES] * math.cos(at)
    return inertia * (1.0 + s[CRANK] * math.sin(at)), -0.5 * slope * speed * speed
