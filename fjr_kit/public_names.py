"""Public names of a package that cost nothing until they are asked for (PEP 562).

A package lists its public names once, as imports below `if TYPE_CHECKING:`, which type checkers and
editors follow. At run time the same lines are read when a name is first asked for, and only the
module that holds it is imported: so `fjr --help` stays quick, and a node loads no analyzer.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any


def deferred_names(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package whose `__all__` names what it exports.

    Args:
        package: `__name__` of the package.
    """

    @cache
    def origins() -> dict[str, str]:
        """Return the relative module of each name, from the imports in the package's source."""
        source = Path(sys.modules[package].__file__ or "").read_bytes()
        imports = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom)]
        return {n.name: f".{i.module}" for i in imports if i.level == 1 for n in i.names}

    def get(name: str) -> Any:
        module = sys.modules[package]
        if name not in module.__all__:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(origins()[name], package), name)
        setattr(module, name, value)
        return value

    return get, lambda: sorted({*vars(sys.modules[package]), *sys.modules[package].__all__})
