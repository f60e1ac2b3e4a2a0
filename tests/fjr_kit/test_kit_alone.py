"""The kit stands alone: it imports no other package of the product."""

from __future__ import annotations

import ast
from pathlib import Path

import fjr_kit
from fjr_kit.imports import PRODUCT


def test_no_module_of_the_kit_imports_another_package_of_the_product():
    others = set(PRODUCT) - {"fjr_kit"}
    modules = sorted(Path(fjr_kit.__file__).parent.rglob("*.py"))
    assert others and modules
    for module in modules:
        for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module and not node.level:
                names = [node.module]
            assert not {name.partition(".")[0] for name in names} & others, module
