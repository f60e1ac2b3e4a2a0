"""The rig in use: campaigns, the ROS graph, rehearsal, replay, bridges, and design of experiments.

Parameters of a rig go in, bags come out. Begin with `campaign` (levels and realizations of one
experiment, and their batch simulation); `graph` runs them on real nodes and records; `rehearsal`
plays one on the wall clock, with faults; `replay` plays bags again; `bridge` speaks ros2_control;
`design` finds amplitude, spectrum and length of an experiment.

    >>> from fjr_bringup import Campaign, simulate_campaign
    >>> experiment = {"amplitudes_rad": [0.002, 0.007], "realizations": 1, "base_frequency_hz": 0.5}
    >>> campaign = Campaign.create(overrides={"excitation": experiment, "simulator": {"k1": 0.0}})
    >>> sorted(bag.name for bag in simulate_campaign(campaign, "linear_rig", workers=1))
    ['level_0_realization_000', 'level_1_realization_000']
"""

from typing import TYPE_CHECKING

from fjr_kit.public_names import deferred_names

if TYPE_CHECKING:
    from .campaign.batch_run import simulate_campaign
    from .campaign.plan import Campaign
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = ["Campaign", "simulate_campaign"]
