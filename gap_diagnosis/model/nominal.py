"""The nominal parameters: a datasheet as a ROS parameter file, checked before anything is fitted.

A value in another unit cannot be mended by a refit of some percent, and what it leaves would look
like an unmodelled effect. So the nominal loop is compared with the record first; where it is far
off, and a usual unit of one value explains the record much better, the unit is named.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fjr_interface.parameter_file import load_parameter_file
from fjr_kit.errors import InputError
from fjr_records.periodic import RecordedExperiment
from fjr_records.spectra import line_spectrum
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT
from fjr_sim_node.simulation.simulator import SIMULATOR

from .rig_model import Model, steps_a_sample
from .simulated_rig import Simulator

PAPER = "paper"
"""Names the paper's values."""

FAR_OFF = 0.7
"""Distance of torque-to-position responses beyond which a wrong unit is looked for, in ln|G|."""
MUCH_NEARER = 0.4
"""A unit explains the record if the distance in it is below this share of the distance without."""

TOO_STIFF = 20.0
"""Steps that the integration of a sample may take at the most: motion of 4 rad in a sample, which
is beyond what samples can show of an oscillation."""

_DEGREE = math.pi / 180.0
_VISCOUS_UNITS = {"mN m s/rad": 1e-3}
_INERTIA_UNITS = {"g m2": 1e-3, "kg cm2": 1e-4, "g cm2": 1e-7, "kg mm2": 1e-6}
_TORQUE_UNITS = {"mN m": 1e-3, "N cm": 1e-2}
UNITS: dict[str, dict[str, float]] = {
    "jm": _INERTIA_UNITS,
    "j": _INERTIA_UNITS,
    "fs": _TORQUE_UNITS,
    "fsm": _TORQUE_UNITS,
    "fv": _VISCOUS_UNITS,
    "fvm": _VISCOUS_UNITS,
    "k0": {"N m/deg": 1.0 / _DEGREE, "N m/arcmin": 60.0 / _DEGREE, "kN m/rad": 1e3},
}
"""Usual other units of datasheets, and what turns them into SI.

Viscous friction and k1 that are too small hardly show beside the rest, and drag would be taken for
friction in N m/rpm; so those units are not looked for.
"""


def read_nominal(source: str | Path) -> dict[str, float]:
    """Return the nominal parameters of the bare plant (PLANT names, SI units).

    Args:
        source: `paper`, or a YAML file that holds them, by themselves (`jm: 0.02`) or under
            /rig/simulator as a ROS parameter file. Friction and k1 that it leaves out are zero: the
            datasheet lacks them. Without j and k0, or with an infinite k0, the axis is rigid, and
            jm is all its inertia but for j, which may be zero. With an infinite j the link is held.

    Raises:
        InputError: no such file, no simulator in it, an unknown name, an inertia or a stiffness
            that is missing, a value out of range, or an effect that is switched on.
    """
    if str(source) == PAPER:
        return {name: float(value) for name, value in PLANT.defaults().items()}
    given = load_parameter_file(source, bare="simulator").get("simulator")
    if given is None:
        raise InputError(
            f"{source}: /rig/simulator is missing; write the datasheet's values below it."
        )
    return datasheet(given, str(source))


def datasheet(given: Mapping[str, object], where: str) -> dict[str, float]:
    """Return the nominal parameters of the bare plant from those that a datasheet gives.

    Args:
        given: by name, SI units; what may be left out is said at `read_nominal`.
        where: what names their place in a sentence.

    Raises:
        InputError: an unknown name, an inertia or a stiffness that is missing, a value out of
            range, or an effect that is switched on.
    """
    if given.get("j") == 0.0 and given.get("k0", math.inf) == math.inf:
        given = {name: value for name, value in given.items() if name != "j"}
    checked = SIMULATOR.check(given, where)
    rigid = math.isinf(checked["k0"]) if "k0" in given else "j" not in given
    needed = ("jm",) if rigid else ("jm", "j", "k0")
    if missing := [name for name in needed if name not in given]:
        raise InputError(
            f"{where}: {', '.join(missing)} missing; a flexible joint has jm, j and k0, a rigid "
            f"axis jm alone, and --nominal {PAPER} takes the paper's values."
        )
    if rigid and math.isinf(checked["j"]):
        raise InputError(
            f"{where}: j and k0 are both infinite, so that nothing could move; a rigid axis has j "
            "in kg m2, a held link k0 in N m/rad."
        )
    refuse_effects(checked, where)
    lacking = dict.fromkeys(PLANT.names, 0.0) | ({"k0": math.inf} if rigid else {})
    return lacking | {name: float(checked[name]) for name in PLANT.names if name in given}


def refuse_effects(values: Mapping[str, object], where: str) -> None:
    """Raise InputError if values of SIMULATOR switch an effect on; `where` names their place."""
    for effect in fx.CATALOGUE:
        for name in effect.size_names:
            if values[name] != SIMULATOR[name].default:
                raise InputError(
                    f"{where}: {name} switches an effect on; take it out, the nominal is the bare "
                    "plant and the diagnosis itself looks for effects."
                )


def refuse_too_stiff(nominal: Mapping[str, float], sample_rate_hz: float, where: str) -> None:
    """Raise InputError if the bare plant moves too fast to be played at a sample rate.

    Args:
        nominal: values of PLANT.
        sample_rate_hz: rate of the samples.
        where: place of the values, for the sentence.
    """
    model = Model.nominal(nominal)
    if steps_a_sample(model, sample_rate_hz) <= TOO_STIFF:
        return
    given = model.plant
    pairs = [("fvm", "jm", 1.0), ("fv", "j", 1.0), ("k0", "jm", 0.5), ("k0", "j", 0.5)]
    rate, above, below, power = max(
        ((given[above] / given[below]) ** power, above, below, power)
        for above, below, power in pairs
        if above in given and below in given
    )
    quotient = f"{above} / {below}" if power == 1.0 else f"the root of {above} / {below}"
    rigid = ", or give .inf as k0 for a rigid axis" if above == "k0" else ""
    raise InputError(
        f"{where}: {quotient} is {rate:.3g} 1/s, a motion too fast to be simulated at "
        f"{sample_rate_hz:g} samples a second; check values and units of {above} and {below}"
        f"{rigid}."
    )


def refuse_wrong_units(
    recorded: RecordedExperiment, nominal: Mapping[str, float], source: str
) -> str | None:
    """Refuse a nominal in which one value is evidently in another unit.

    Returns:
        a warning if the nominal is far off for no unit that is known; else None.

    Raises:
        InputError: the nominal response is far off, and one value in another usual unit brings it
            much nearer; the sentence names value, unit and the value in SI. Also for an unknown
            controller.
    """
    simulator = Simulator(recorded)
    if not simulator.repeats:
        return None  # an observer holds any model near the record
    before = response_distance(recorded, simulator, Model.nominal(nominal))
    if before < FAR_OFF:
        return None
    found = [
        (distance, name, unit, factor)
        for name, units in UNITS.items()
        for unit, factor in units.items()
        if (distance := _in_unit(recorded, simulator, nominal, name, factor)) is not None
    ]
    distance, name, unit, factor = min(found)
    if distance < MUCH_NEARER * before:
        value, si = nominal[name], PLANT[name].unit
        raise InputError(
            f"{source}: {name} = {value:g} {si} does not fit the recorded response, but "
            f"{value:g} {unit} would; give it in {si}: {name}: {value * factor:.6g}."
        )
    return (
        "The nominal simulation diverges; check its values and units."
        if math.isinf(before)
        else f"{source}: the nominal response is a factor {math.exp(before):.2g} off the rig's; "
        "a strong effect can do that, but check values and units first."
    )


def _in_unit(
    recorded: RecordedExperiment,
    simulator: Simulator,
    nominal: Mapping[str, float],
    name: str,
    factor: float,
) -> float | None:
    """Return the distance with one value converted; None if it leaves the allowed range."""
    value, parameter = nominal[name] * factor, PLANT[name]
    if not nominal[name] or not parameter.low <= value <= parameter.high:
        return None
    return response_distance(recorded, simulator, Model.nominal({**nominal, name: value}))


def response_distance(recorded: RecordedExperiment, simulator: Simulator, model: Model) -> float:
    """Return the rms over excited lines of |ln(G_model/G_rig)|, G = Y/U of the highest level.

    A factor e in magnitude, or 1 rad of phase, is 1; inf if the motion diverges.
    """
    lines = np.array(recorded.experiment.excited_harmonics)
    index = len(recorded.realizations) - 1
    rig = recorded.realizations[index]
    y, u = (rig.spectrum(s, recorded.lines).mean(0)[lines] for s in (rig.position, rig.torque))
    simulated_y, simulated_u = (
        line_spectrum(signal[0], recorded.lines)[lines]
        for signal in simulator.signals(model, [index])
    )
    if not np.isfinite(simulated_y).all() or not np.isfinite(simulated_u).all():
        return math.inf
    ratio = (simulated_y / simulated_u) / (y / u)
    if not ratio.all():
        return math.inf  # the motor sticks
    return float(np.sqrt(np.mean(np.abs(np.log(ratio)) ** 2)))
