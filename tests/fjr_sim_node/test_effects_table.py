"""The table of effects: what it says of laws and families, and that one entry is all it takes."""

from __future__ import annotations

import importlib
import inspect
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from paths import ROOT

from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT, with_added

PACKAGES = [path.parent.name for path in ROOT.glob("*/__init__.py")]


@pytest.mark.parametrize("effect", fx.CATALOGUE, ids=lambda effect: effect.identifier)
def test_the_law_of_an_effect_is_where_its_entry_says(effect: fx.Effect) -> None:
    module, _, function = effect.law.partition(":")
    assert callable(getattr(importlib.import_module(f"fjr_sim_node.{module}"), function))


def test_every_parameter_is_read_by_a_kernel() -> None:
    kernels = [
        "plant.torques",
        "plant.spring",
        "plant.presliding",
        "plant.motion",
        "plant.stick_slip",
        "plant.step_size",
        "simulation.rig",
    ]
    sources = "".join(
        inspect.getsource(importlib.import_module(f"fjr_sim_node.{name}")) for name in kernels
    )
    for effect in fx.CATALOGUE:
        for name in () if effect.of_bare_plant else effect.names:
            assert f"fx.{name.upper().replace('.', '_')}" in sources


def test_effects_of_the_bare_plant_change_its_parameters_and_need_no_kernel() -> None:
    found = [effect for effect in fx.CATALOGUE if effect.of_bare_plant]
    assert len(found) == 4
    for effect in found:
        values = PLANT.defaults() | {"k0": math.inf if effect.axis == "rigid" else 1500.0}
        sizes = dict.fromkeys(effect.names, 0.5)
        assert fx.coefficients(sizes) is None
        for name in effect.names:
            one = with_added(values | sizes | {name: 0.25})
            assert one != with_added(values | sizes), name


def test_starts_name_parameters_of_their_effect_within_their_bounds() -> None:
    for effect in fx.CATALOGUE:
        known = {p.name: p for p in effect.parameters}
        for start in effect.starts:
            for name, values in start.items():
                low, high = known[name].fit or (known[name].low, known[name].high)
                if known[name].fit is None and known[name].unit:
                    high = math.inf  # a physical limit, not relative as the starts are
                assert all(low <= value <= high for value in values), (effect.identifier, name)


def test_what_an_effect_contains_is_another_effect_of_the_table() -> None:
    for effect in fx.CATALOGUE:
        assert set(effect.contains) <= set(fx.EFFECTS) - {effect.identifier}
    assert fx.contains(("torque_speed_limit",), ("torque_saturation",))
    assert fx.contains(("delay", "torque_speed_limit"), ("torque_saturation", "delay"))
    assert not fx.contains(("torque_saturation",), ("torque_speed_limit",))
    assert not fx.contains(("delay", "torque_speed_limit"), ("torque_saturation",))


def test_what_is_rarer_is_a_near_equivalent_of_the_commoner_effect() -> None:
    rarer = [effect for effect in fx.CATALOGUE if effect.rarer_than]
    assert "external_spring" in {effect.identifier for effect in rarer}
    for effect in rarer:
        assert effect.rarer_than in fx.near_equivalents(effect.identifier)
        assert fx.rare((effect.identifier, "delay")) == 1 and not fx.rare((effect.rarer_than,))


def test_near_equivalents_are_mutual_and_never_the_effect_itself() -> None:
    for effect in fx.CATALOGUE:
        for other in fx.near_equivalents(effect.identifier):
            assert other != effect.identifier
            assert effect.identifier in fx.near_equivalents(other)
    assert fx.near_equivalents("backlash") == {"piecewise_stiffness"}
    assert not fx.near_equivalents("extra_mode")


def test_a_place_that_is_not_in_the_table_is_an_attribute_error() -> None:
    assert fx.PARAMETERS[fx.BACKLASH_HALF_GAP_RAD].name == "backlash.half_gap_rad"
    with pytest.raises(AttributeError, match="no parameter GROSS_NONSENSE"):
        _ = fx.GROSS_NONSENSE


ENTRY = """
    Effect(
        "cubic_drag",
        "Drag grows with the cube of velocity.",
        "motor",
        "plant.torques:motor_viscous",
        Telltale("highest amplitude", "velocity"),
        "a test of the table",
        (size("nm_s3_rad3", "N m s3/rad3", "Drag on the motor"),),
        ({"nm_s3_rad3": (0.05, 0.5)},),
    ),
)  # fmt: skip
"""
LAW = "    return p[FVM] * v + "
NEW_LAW = f"{LAW}e[fx.CUBIC_DRAG_NM_S3_RAD3] * v * v * v + "

USE = """
import numpy as np
from fjr_interface.experiment import Experiment
from fjr_sim_node import effects as fx
from fjr_sim_node.effects import document
from fjr_sim_node.plant import PLANT
from fjr_sim_node.simulation.simulator import SIMULATOR, run_realization
from fjr_interface.parameter_file import load_parameter_file
from fjr_bringup.campaign.plan import Campaign
from fjr_export.exporting import export
from fjr_export.treatments import TARGETS, TITLES, table
from fjr_kit.errors import InputError
from fjr_records.periodic import RecordedExperiment, RecordedRealization
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.steady_runs import steady_runs
from gap_diagnosis.outcome.verdict_words import explanation, unit_of
from gap_diagnosis.report.telltales import drawn
from gap_diagnosis.starts.catalogue import catalogue
from gap_diagnosis.where.telltale import shown
from gap_diagnosis.fits.cell_fits import CellFitter

name = "cubic_drag.nm_s3_rad3"
assert SIMULATOR[name].unit == "N m s3/rad3"
assert load_parameter_file("rig.yaml")["simulator"][name] == 2.0
assert "**`cubic_drag`**" in document.table()
assert unit_of(name, linear=False) == "N m s3/rad3" and explanation(["cubic_drag"]) == "cubic drag"
assert "| `cubic_drag` | refused: it is not expressed in MuJoCo so far |" in table()
for target in TARGETS:
    try:
        export("bare.yaml", target, target)
    except InputError as error:
        assert f"cubic_drag: it is not expressed in {TITLES[target]} so far" in str(error)
    else:
        raise AssertionError(target)
    export("bare.yaml", target, target, without=["cubic_drag"])
campaign = Campaign.create("rig.yaml", {"excitation": {
    "amplitudes_rad": (5e-3,), "realizations": 2, "periods": 2, "transient_periods": 1,
    "base_frequency_hz": 0.5, "f_min_hz": 0.5, "f_max_hz": 30.0},
    "simulator": {"noise_std_rad": 1e-6}})
parts = []
for number in range(2):
    e = campaign.experiment(0, number)
    run = run_realization(campaign.values["simulator"], e)
    cut = lambda s: s.reshape(-1, e.samples_per_period)
    parts.append(RecordedRealization(str(number), e, cut(run.reference), cut(run.torque),
                                     cut(run.position), None))
recorded = RecordedExperiment("here", tuple(parts))
nominal = PLANT.defaults()
fitter = CellFitter(Evidence(steady_runs(recorded), nominal), nominal, 0.1)
assert "cubic_drag" in catalogue(nominal)
refit = fitter.refit()
found = fitter.add(refit, "cubic_drag", fitter.screening(refit, "cubic_drag").proposals())
assert abs(found.model.effects[name] / 2.0 - 1.0) < 0.02, found.model.effects
assert fitter.gains(found, refit).sum() > 10.0
plot = drawn(shown(fitter.evidence, "cubic_drag", found.model), "cubic_drag")
assert plot["layout"]["xaxis"]["title"]["text"] == "motor velocity (rad/s)"
"""


def test_a_new_effect_is_one_entry_and_its_law(tmp_path: Path) -> None:
    """Node parameter, file, fit, document and words have it; it is found and drawn; no export."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__py*"))
    table = tmp_path / "fjr_sim_node/effects/friction.py"
    before, mark, after = table.read_text().rpartition(")  # fmt: skip\n")
    assert mark and not after
    table.write_text(before.rstrip("\n") + ENTRY)
    law = tmp_path / "fjr_sim_node/plant/torques.py"
    assert law.read_text().count(LAW) == 1
    law.write_text(law.read_text().replace(LAW, NEW_LAW))
    rig = "/rig/simulator:\n  ros__parameters:\n    cubic_drag:\n      nm_s3_rad3: 2.0\n"
    (tmp_path / "rig.yaml").write_text(rig)
    linear = dict.fromkeys(("fs", "fsm", "k1"), 0.0)
    (tmp_path / "bare.yaml").write_text(rig + "".join(f"    {n}: {v}\n" for n, v in linear.items()))
    places = {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(tmp_path)}
    environment = {**os.environ, **places, "NUMBA_OPT": "1"}  # all kernels are compiled anew
    done = subprocess.run(
        [sys.executable, "-c", USE], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
