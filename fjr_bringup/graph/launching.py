"""What the launch files ask of the rig before they start anything (no ROS, no launch here)."""

from __future__ import annotations

import tempfile
from pathlib import Path

from fjr_interface.parameter_file import load_parameter_file, save_parameter_file
from fjr_interface.topics import NAMESPACE


def checked_rig(file: str, namespace: str = NAMESPACE) -> str:
    """Return a parameter file that gives nodes in a namespace the values of a checked file.

    Args:
        file: parameter file of rig and experiment, with nodes in `/rig`.
        namespace: that of the nodes.

    Returns:
        The file itself for `/rig`; else one in the folder for temporary files, whose nodes are in
        that namespace.

    Raises:
        InputError: no such file, or one that names other nodes. The nodes check the values.
    """
    values = load_parameter_file(file)
    if f"/{namespace.strip('/')}" == NAMESPACE:
        return file
    moved = Path(tempfile.mkdtemp(prefix="fjr-launch-")) / Path(file).name
    save_parameter_file(moved, values, namespace=f"/{namespace.strip('/')}")
    return str(moved)
