"""Pages of the documentation site that are made of the code: commands, topics, schemas, API."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import typer
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = (
    "fjr_interface",
    "fjr_records",
    "bla_analyzer",
    "gap_diagnosis",
    "fjr_export",
    "fjr_compare",
    "fjr_bringup",
    "fjr_sim_node",
    "excitation_node",
    "controller_node",
)
DESIGN = {
    "fjr_bringup.design.planner": ("read_pilots", "propose"),
    "fjr_bringup.design.planned": ("planned_record",),
}
"""Names that notebooks and docs/python.md take from modules of a package."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages to those of the folder."""
    pages = {
        "reference/commands.md": commands_page(),
        "reference/topics.md": topics_page(),
        "reference/schemas.md": schemas_page(),
        "reference/api.md": api_page(),
    }
    for path, text in pages.items():
        files.append(File.generated(config, path, content=text))
    return files


def commands_page() -> str:
    """Return the reference of all commands, from their options in the code."""
    from fjr_cli.app import app

    lines = ["# Commands", "", "Every command of `fjr`, from the code: `fjr COMMAND --help`.", ""]
    for name, command in sorted(_commands("fjr", typer.main.get_command(app))):
        lines += [f"## {name}", "", _plain(command.help or ""), ""]
        rows = [_row(each) for each in command.params if each.name != "help"]
        if rows:
            lines += ["| argument or option | meaning |", "|---|---|", *rows, ""]
    lines += ["## Nodes", "", "`NODE --help` names the parameters of a node.", ""]
    return "\n".join(lines)


def _commands(prefix: str, group: Any) -> Iterator[tuple[str, Any]]:
    for name, command in group.commands.items():
        full = f"{prefix} {name}"
        if hasattr(command, "commands"):
            yield from _commands(full, command)
        else:
            yield full, command


def _row(parameter: Any) -> str:
    names = ", ".join(f"`{each}`" for each in (*parameter.opts, *parameter.secondary_opts))
    if parameter.param_type_name == "argument":
        names = f"`{parameter.metavar or parameter.name.upper()}`"
    elif parameter.metavar:
        names += f" `{parameter.metavar}`"
    default = "" if parameter.default in (None, False, ()) else f" Default: `{parameter.default}`."
    return f"| {names} | {_plain(parameter.help or '')}{default} |"


def _plain(text: str) -> str:
    """Return a help text as Markdown: escaped brackets of rich, angle brackets, bars of tables."""
    text = " ".join(line for line in text.replace("\\[", "[").split("\n"))
    return text.replace("<", "&lt;").replace("|", "\\|").replace("[", "\\[")


def topics_page() -> str:
    """Return the topics of the rig, from `fjr_interface.topics`."""
    from fjr_interface import topics

    lines = [
        "# Topics",
        "",
        f"All below the namespace `{topics.NAMESPACE}`. Signals are `{topics.JOINT_STATE}` with "
        f"one joint (`{topics.JOINT}`) and one value, reliable, depth {topics.SIGNAL_DEPTH}; "
        "sample k = 1, 2, ... has the stamp k Ts, rounded to nanoseconds.",
        "",
        "| topic | published by | field | unit | symbol |",
        "|---|---|---|---|---|",
    ]
    writers = {signal.topic: node for node, signal in topics.WRITERS.items()}
    for signal in (*topics.SIGNALS, topics.LINK_POSITION):
        node = writers.get(signal.topic, "simulator")
        lines.append(
            f"| `{signal.topic}` | {node} | {signal.field} | {signal.unit} | {signal.symbol} |"
        )
    lines += [
        "",
        "| topic | type | what |",
        "|---|---|---|",
        *(f"| {topic} | {kind} | {what} |" for topic, kind, what in _others()),
    ]
    return "\n".join(lines) + "\n"


def _others() -> Iterator[tuple[str, str, str]]:
    """Yield topic, type and meaning of what is no signal."""
    from fjr_interface import topics

    text = f"`{topics.STRING}`, latched"
    schema = "[experiment.schema.json](../schemas/experiment.schema.json)"
    yield f"`{topics.EXPERIMENT_TOPIC}`", text, f"description of the realization: JSON of {schema}"
    yield f"`{topics.CONTROLLER_TOPIC}`", text, "the controller's description of itself"
    stamp = "`builtin_interfaces/msg/Time`, latched"
    yield f"`{topics.RECORDED_TOPIC}`", stamp, "stamp up to which a recorder has everything"
    clock = "`rosgraph_msgs/msg/Clock`, best effort"
    yield "`/clock`", clock, "simulated time, one tick a sample"
    health = "`diagnostic_msgs/msg/DiagnosticArray`"
    yield "`/diagnostics`", health, "how each node is, once a second"


def schemas_page() -> str:
    """Return the JSON Schemas with their descriptions."""
    lines = ["# JSON Schemas", "", "A test holds them equal to the types in the code.", ""]
    lines += ["| file | of | fields |", "|---|---|---|"]
    for file in sorted((ROOT / "docs/schemas").glob("*.schema.json")):
        schema: Mapping[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        about = (schema.get("description") or schema.get("title") or "").split("\n")[0]
        fields = ", ".join(f"`{name}`" for name in schema.get("properties", {}))
        lines.append(f"| [{file.name}](../schemas/{file.name}) | {_plain(about)} | {fields} |")
    return "\n".join(lines) + "\n"


def api_page() -> str:
    """Return the public names of the packages, for mkdocstrings to fill in."""
    from importlib import import_module

    lines = ["# Python API", "", "What the packages export; [examples](../python.md).", ""]
    exported = {package: import_module(package).__all__ for package in PACKAGES}
    for package, names in (exported | DESIGN).items():
        module = import_module(package)
        lines += [f"## {package}", ""]
        for name in names:
            value = getattr(module, name)
            home = getattr(value, "__module__", None)
            target = f"{home}.{name}" if isinstance(home, str) and callable(value) else ""
            lines += [f"::: {target}" if target else f"`{package}.{name}`", ""]
    return "\n".join(lines)
