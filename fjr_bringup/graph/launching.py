"""What launch files ask before they start anything, and files for nodes in another namespace."""

from __future__ import annotations

import tempfile
from pathlib import Path

from fjr_interface.parameter_file import load_parameter_file, save_parameter_file
from fjr_interface.topics import NAMESPACE, checked_namespace, moved_topic


def checked_rig(file: str, namespace: str = NAMESPACE) -> str:
    """Return a parameter file that gives nodes in a namespace the values of a checked file.

    Args:
        file: parameter file of rig and experiment, with nodes in `/rig`.
        namespace: that of the nodes.

    Returns:
        The file itself for `/rig`; else one in the folder for temporary files, whose nodes are in
        that namespace.

    Raises:
        InputError: no such file, one that names other nodes, or no namespace. The nodes check the
            values.
    """
    namespace = checked_namespace(namespace)
    if namespace == NAMESPACE:
        load_parameter_file(file)
        return file
    return str(moved_file(Path(file), namespace, Path(tempfile.mkdtemp(prefix="fjr-launch-"))))


def recorder_qos(file: str, namespace: str) -> str:
    """Return a file of rosbag2's QoS overrides, written for topics in `/rig`, for a namespace."""
    if (namespace := checked_namespace(namespace)) == NAMESPACE:
        return file
    moved = Path(tempfile.mkdtemp(prefix="fjr-launch-")) / Path(file).name
    lines = Path(file).read_text(encoding="utf-8").splitlines(keepends=True)
    moved.write_text("".join(moved_topic(line, namespace) for line in lines), encoding="utf-8")
    return str(moved)


def moved_file(file: Path, namespace: str, folder: Path) -> Path:
    """Return a copy, in a folder, of a parameter file, with its nodes in a namespace."""
    values = load_parameter_file(file)
    moved = folder / file.name
    save_parameter_file(moved, values, namespace=namespace)
    return moved
