"""The programs that run nodes: their start and their command lines (no ROS here)."""

from __future__ import annotations

import importlib
import shlex
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from fjr_kit.errors import InputError, needing_ros
from fjr_kit.output_pipe import outlive_readers

from ..parameter_file import refuse_empty
from ..parameters import Parameter, ParameterGroup

_WIDTH = 100
_HELP = {"-h", "--help"}
_OF_ROS = ("-p", "--param", "-r", "--remap", "--params-file")


def run_module(module: str) -> int:
    """Run `main` of a module that needs ROS; return the exit status.

    Ctrl-C ends it quietly while it is still being loaded, too; where ROS is not there, one sentence
    says so. Nor does it end earlier, or with a traceback, if nobody reads its output to the end.
    """
    outlive_readers()
    try:
        with needing_ros():
            main = importlib.import_module(module).main
    except KeyboardInterrupt:
        return 130
    except InputError as error:
        return refuse(error)
    return int(main())


def refuse(error: InputError) -> int:
    """Print why a program ends; return its exit status."""
    print(f"error: {error}", file=sys.stderr, flush=True)
    return 2


@dataclass(frozen=True)
class Program:
    """What the program of a node is called, does and takes.

    Attributes:
        name: as it is typed, with what stands before its ROS arguments.
        purpose: what it does, the first paragraph is shown.
        parameters: of its node.
    """

    name: str
    purpose: str | None
    parameters: ParameterGroup = field(default_factory=ParameterGroup)

    @staticmethod
    def wants_help(arguments: Sequence[str]) -> bool:
        """Return whether one of the arguments asks for help."""
        return not _HELP.isdisjoint(arguments)

    def refuse(self, arguments: Sequence[str]) -> None:
        """Raise InputError if an argument is not one of ROS, or names a file that holds nothing."""
        others = _outside_ros(arguments)
        if not others:
            for word, file in pairwise(arguments):
                if word == "--params-file":
                    refuse_empty(file)
            return
        first = others[0]
        if first in _OF_ROS or ":=" in first:
            raise InputError(
                f"{first!r} stands where ROS does not read it; write {self.name} --ros-args "
                f"{shlex.join(others if first in _OF_ROS else ['-p', *others])}"
            )
        raise InputError(
            f"{self.name} does not know the argument {first!r}; it takes parameters, as "
            f"--ros-args -p NAME:=VALUE, and {self.name} --help names them."
        )

    def help(self) -> str:
        """Return what `--help` prints."""
        purpose = " ".join((self.purpose or "").partition("\n\n")[0].split())
        lines = [
            f"Usage: {self.name} [--ros-args [-p NAME:=VALUE]... [--params-file FILE]...]",
            "",
            *textwrap.wrap(purpose, _WIDTH),
        ]
        if self.parameters.names:
            lines += ["", "Parameters (name, default, meaning):", ""]
            lines += [line for parameter in self.parameters for line in _described(parameter)]
        return "\n".join(lines)


def _outside_ros(arguments: Sequence[str]) -> list[str]:
    """Return what stands before --ros-args and after the -- that ends it.

    ROS itself still takes name:=value there for a remap rule of ROS 1.
    """
    outside, of_ros = [], False
    for word in arguments:
        if of_ros:
            of_ros = word != "--"
        elif word == "--ros-args":
            of_ros = True
        else:
            outside.append(word)
    return outside


def _described(parameter: Parameter) -> list[str]:
    default = parameter.default
    if isinstance(default, (tuple, bool)):
        text = str(list(default) if isinstance(default, tuple) else default).lower()
    else:
        text = f"{default:g}" if isinstance(default, float) else str(default)
    meaning = textwrap.wrap(
        parameter.help, _WIDTH, initial_indent=" " * 6, subsequent_indent=" " * 6
    )
    return [f"  {parameter.name}  {text}".rstrip(), *meaning]
