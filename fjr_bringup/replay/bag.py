"""The bag as read by replay nodes, which stand in for the rig's own, and the parts they share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fjr_interface.bags.files import find_bags
from fjr_interface.bags.reader import BagReader, Record, read_record
from fjr_interface.experiment import Experiment, periodic
from fjr_interface.parameters import Parameter
from fjr_kit.errors import InputError

BAG_PARAMETER = Parameter("bag", "", "", "Folder of the bag to replay")


@dataclass(frozen=True)
class Recorded:
    """A whole bag with its description."""

    experiment: Experiment
    record: Record


def the_bag(folder: Path) -> Path:
    """Return the bag that a folder is or holds; raise InputError if that is not one."""
    bags = find_bags(folder)
    if len(bags) > 1:
        raise InputError(
            f"{folder}: holds {len(bags)} bags; name the one to replay, such as {bags[0]}."
        )
    return bags[0]


def read_description(bag: str) -> Experiment:
    """Return the experiment that a bag describes; raise InputError if it describes none."""
    if not bag:
        raise InputError("The parameter bag is empty; give the folder of the bag to replay.")
    experiment = BagReader(bag).experiment
    if experiment is None:
        raise InputError(
            f"{bag}: describes no experiment, so the nodes cannot replay it in lockstep; leave "
            "--into out to publish it as it is."
        )
    return periodic(experiment, bag)


def read_recorded(bag: str) -> Recorded:
    """Read a bag; raise InputError if it is not whole or describes no experiment."""
    return Recorded(read_description(bag), read_record(bag))
