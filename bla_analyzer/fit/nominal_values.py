"""A fitted physical model as parameters of the bare plant: a nominal for `fjr diagnose`."""

from __future__ import annotations

import math

from fjr_sim_node.plant import PLANT

from .fit_types import LevelFit


def nominal_values(level: LevelFit) -> dict[str, float]:
    """Return all parameters of the bare plant, each within what the simulator takes.

    Coulomb friction and cubic stiffness are zero, as a linear model holds neither; the mass of an
    extra mode is the link's; a rigid axis has a stiffness that is infinite. The delay is none of
    the bare plant's parameters.
    """
    found = {name: one.value for name, one in level.parameters.items()}
    values = dict.fromkeys(PLANT.names, 0.0)
    values |= {"j": PLANT["j"].low, "k0": math.inf}
    values |= {name: value for name, value in found.items() if name in PLANT}
    values["j"] += found.get("extra_mode.inertia_kg_m2", 0.0)
    return {
        name: float(min(max(value, PLANT[name].low), PLANT[name].high))
        for name, value in values.items()
    }
