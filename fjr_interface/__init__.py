"""The contract of the rig: topics, clock, experiment description, parameters and bags.

Programs that keep it can take the place of any node, recorder or reader of this product. Begin with
`topics` (names, types, stamps) and `experiment` (the JSON description of what was played);
`parameters` and `parameter_file` say what can be set and how ROS parameter files are read,
`linear_axis` what a linear axis says for rad, N m and kg m2. In come ROS messages (`ros`, the only
part that imports rclpy) and bags (`bags`, read in audited blocks); out go the same, and arrays on
an even grid (`resampling` for uneven stamps). `bounded_yaml` and `rcl_values` read YAML as ROS
does, within bounds; `health`, `waiting` and `real_time` are the states of a node, without ROS.

    >>> from fjr_interface import SignalMap
    >>> SignalMap.parse(["position=/joint_states:position[elbow]"]).position.joint
    'elbow'
"""

from typing import TYPE_CHECKING

from fjr_kit.public_names import deferred_names

if TYPE_CHECKING:
    from .bags.signals import SignalMap
    from .experiment import Experiment
    from .resampling.accuracy import Resampling
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = ["Experiment", "Resampling", "SignalMap"]
