"""Who imports whom: packages in one order, folders and modules without a circle, names once.

Imports within functions count; those that only type checkers read (`if TYPE_CHECKING`) do not.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import TopologicalSorter
from importlib.util import resolve_name
from pathlib import Path

from paths import ROOT

NODES = ("controller_node", "excitation_node", "fjr_sim_node")
ORDER = (
    *("fjr_kit", "fjr_interface", NODES, "fjr_records", "bla_analyzer", "gap_diagnosis"),
    *("fjr_export", "fjr_compare", "fjr_bringup", "fjr_validation", "fjr_cli"),
)
"""A package imports those before it; the nodes, which stand at one place, some of one another."""
PLACES = {
    package: place
    for place, packages in enumerate(ORDER)
    for package in ([packages] if isinstance(packages, str) else packages)
}
FILES = {
    ".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file
    for package in PLACES
    for file in (ROOT / package).rglob("*.py")
}


def executed(node: ast.AST) -> Iterator[ast.AST]:
    """Yield a syntax tree without what stands below `if TYPE_CHECKING`."""
    yield node
    for child in ast.iter_child_nodes(node):
        if not (isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING"):
            yield from executed(child)


def imported(module: str) -> set[str]:
    """Return the modules of the product that a module imports, without the packages around them."""
    file = FILES[module]
    package = module if file.name == "__init__.py" else module.rpartition(".")[0]
    names = []
    for node in executed(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            origin = resolve_name("." * node.level + (node.module or ""), package)
            inner = {alias.name: f"{origin}.{alias.name}" for alias in node.names}
            names += [full if full in FILES else origin for full in inner.values()]
    return {name for name in names if name in FILES} - {module}


@cache
def arrows() -> dict[str, set[str]]:
    """Return what each module imports; not before a test asks, for it parses all sources."""
    return {module: imported(module) for module in FILES}


def folder(module: str) -> Path:
    return FILES[module].parent


def refuse_circle(graph: Mapping) -> None:
    TopologicalSorter(graph).prepare()  # raises CycleError, which names the circle


def test_packages_import_those_before_them():
    packages = {(a.partition(".")[0], b.partition(".")[0]) for a in FILES for b in arrows()[a]}
    upward = {(a, b) for a, b in packages if a != b and PLACES[a] <= PLACES[b]}
    assert {(a, b) for a, b in upward if a not in NODES or b not in NODES} == set()


def test_no_modules_import_each_other_in_a_circle():
    assert len(arrows()) > 300 and sum(map(len, arrows().values())) > 1000
    refuse_circle(arrows())


def test_no_folders_import_each_other_in_a_circle():
    places: dict[Path, set[Path]] = {}
    for module, others in arrows().items():
        places.setdefault(folder(module), set()).update(map(folder, others))
    refuse_circle({place: others - {place} for place, others in places.items()})


def test_no_file_name_stands_twice_in_a_package():
    names = Counter((name.partition(".")[0], file.name) for name, file in FILES.items())
    twice = {name for name, times in names.items() if times > 1}
    assert {name for name in twice if name[1] not in ("__init__.py", "__main__.py")} == set()
