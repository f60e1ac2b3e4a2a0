"""The linear models of the nominal rig that a BLA is compared with."""

from __future__ import annotations

from functools import partial

from fjr_interface.experiment import Experiment, RecordDescription
from fjr_interface.parameter_file import load_parameter_file
from fjr_interface.parameters import Value
from fjr_kit.errors import InputError
from fjr_sim_node.plant import PLANT
from fjr_sim_node.theory.linear import DESCRIPTIONS, g0

from .metrics import ReferenceModel


def reference_models(
    nominal: str | None, experiment: Experiment | RecordDescription | None
) -> list[ReferenceModel]:
    """Return G0 of the nominal rig, with viscous damping and as in the paper's eqs. 6-7.

    Args:
        nominal: `paper`, `none`, a ROS parameter file, or None: `paper` if the bags describe a
            campaign of this rig, else `none`.
        experiment: what the bags describe; None for bags without a description.

    Raises:
        InputError: a parameter file that cannot be read, or with bad values.
    """
    if nominal is None:
        is_rig = isinstance(experiment, Experiment) and "imported" not in (
            experiment.model_extra or {}
        )
        nominal = "paper" if is_rig else "none"
    if nominal == "none":
        return []
    parameters, source = _nominal_parameters(nominal)
    return [
        ReferenceModel(
            f"G0_{damping}",
            f"{description}; {source}; zero-order-hold equivalent",
            partial(g0, parameters, damping=damping),
        )
        for damping, description in DESCRIPTIONS.items()
    ]


def _nominal_parameters(nominal: str) -> tuple[dict[str, Value], str]:
    if nominal == "paper":
        return PLANT.defaults(), "the paper's values"
    given = load_parameter_file(nominal).get("simulator")
    if given is None:
        raise InputError(
            f"{nominal}: /rig/simulator is missing; write the model's values below it."
        )
    plant = {name: value for name, value in given.items() if name in PLANT}
    return PLANT.check(plant, nominal), f"values of {nominal}"
