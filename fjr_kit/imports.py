"""What a module rests on: itself and the modules of the product that it imports, transitively."""

from __future__ import annotations

import ast
import hashlib
from functools import cache
from importlib.util import find_spec, resolve_name
from pathlib import Path

PRODUCT = (
    "bla_analyzer",
    "controller_node",
    "excitation_node",
    "fjr_bringup",
    "fjr_cli",
    "fjr_compare",
    "fjr_export",
    "fjr_interface",
    "fjr_kit",
    "fjr_records",
    "fjr_sim_node",
    "fjr_validation",
    "gap_diagnosis",
)


@cache
def digest_of(module: str) -> str:
    """Return a digest of the sources that a module rests on, as they were at the first call."""
    digest = hashlib.sha256()
    for name, source in sorted(rests_on(module).items()):
        digest.update(name.encode() + source.read_bytes())
    return digest.hexdigest()


def rests_on(module: str) -> dict[str, Path]:
    """Return the sources of a module and of all that it imports, transitively, by module name.

    Imports within functions count as well. Followed are modules of the product and of the
    module's own package; the packages that they lie in count, as Python runs these first.
    """
    packages = {*PRODUCT, module.partition(".")[0]}
    found: dict[str, Path] = {}
    pending = [module]
    while pending:
        name = pending.pop()
        source = _source(name) if name.partition(".")[0] in packages else None
        if source is None or name in found:
            continue
        found[name] = source
        pending += [name.rpartition(".")[0], *_imported(name, source)]
    return found


def _source(module: str) -> Path | None:
    """Return the file of a module; None if there is no such module."""
    top, *rest = module.split(".")
    spec = find_spec(top) if top else None
    if spec is None:
        return None
    if spec.submodule_search_locations is None:
        return Path(spec.origin) if spec.origin and not rest else None
    for folder in spec.submodule_search_locations:
        base = Path(folder, *rest)
        for file in (base / "__init__.py", base.with_name(f"{base.name}.py")):
            if file.is_file():
                return file
    return None


def _imported(module: str, source: Path) -> tuple[str, ...]:
    """Return the names that a module imports; some are not modules but what these hold."""
    package = module if source.name == "__init__.py" else module.rpartition(".")[0]
    return _imported_by(source.read_bytes(), package)


@cache
def _imported_by(text: bytes, package: str) -> tuple[str, ...]:
    names: list[str] = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            origin = resolve_name("." * node.level + (node.module or ""), package)
            names += [origin, *(f"{origin}.{alias.name}" for alias in node.names)]
    return tuple(names)
