"""What reports say about their making."""

from __future__ import annotations

from importlib.metadata import version

from fjr_kit.installed import product_version
from fjr_kit.invocation import provenance


def test_provenance_names_what_was_given_and_all_that_the_numbers_rest_on():
    assert list(provenance("fjr analyze rig", "today")) == ["command", "date", "versions"]
    (versions,) = provenance(None, None).values()
    assert f"fjr-rig {product_version()}" in versions
    for package in ("numpy", "scipy", "numba", "matplotlib", "plotly"):
        assert f"{package} {version(package)}" in versions
