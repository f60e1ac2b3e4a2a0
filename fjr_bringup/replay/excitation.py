"""Stands in for the excitation: streams a bag's reference and publishes its description.

`python -m fjr_bringup.replay.excitation --ros-args -p bag:=FOLDER`
"""

from __future__ import annotations

import sys
from functools import cached_property

import numpy as np

from excitation_node.node import STREAM, ExcitationNode
from fjr_interface.experiment import Experiment
from fjr_interface.parameters import ParameterGroup
from fjr_interface.ros import spinning
from fjr_interface.ros.program import Program

from .bag import BAG_PARAMETER, Recorded, read_recorded

PARAMETERS = ParameterGroup(BAG_PARAMETER, *STREAM)


class ReplayExcitationNode(ExcitationNode):
    """An excitation whose experiment and reference are a bag's.

    The controller in the description is the one that plays now, if it describes itself.
    """

    def __init__(self) -> None:
        """Read the bag."""
        super().__init__(PARAMETERS)
        self._bag  # noqa: B018 refused now rather than at the start

    @cached_property
    def _bag(self) -> Recorded:
        return read_recorded(str(self.values["bag"]))

    def _describe(self) -> Experiment:
        experiment = self._bag.experiment
        if self._controller is None:
            return experiment
        return experiment.model_copy(update={"controller": self._controller})

    def _signal(self, _experiment: Experiment) -> np.ndarray:
        reference = self._bag.record.reference
        assert reference is not None  # no bag is read without one
        return reference


def main() -> int:
    """Run the node."""
    program = Program("fjr_bringup.replay.excitation", ReplayExcitationNode.__doc__, PARAMETERS)
    return spinning.run(ReplayExcitationNode, program=program)


if __name__ == "__main__":
    sys.exit(main())
