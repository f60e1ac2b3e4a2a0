"""A mass that swings or is sprung, of which the datasheet of a rigid axis knows nothing."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from controller_node import pd_filtered
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT, coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis.any_record import investigate
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.starts.seen_resonance import Hidden, hidden, with_mass
from gap_diagnosis.starts.seen_torques import SeenTorques
from gap_diagnosis.verdict.judgement import _may_ring

EFFECTS = ["coulomb_friction", "viscous_friction", "transmission_stiffness", "delay"]
RATE, SECONDS, AMPLITUDE, ZETA = 200.0, 15.0, 0.3, 0.03
COMPLIANCE, SHARE = (f"transmission_stiffness.{n}" for n in
                     ("compliance_rad_nm", "link_inertia_share"))  # fmt: skip


def run(seed: int, total: float, share: float, hz: float, law: dict[str, float]) -> np.ndarray:
    """Return torque (N m) and angle (rad) of an axis that is shaken from 0.2 to 6 Hz."""
    rng, samples = np.random.default_rng(seed), int(RATE * SECONDS)
    link, usual = share * total, total * AMPLITUDE * 360.0
    stiffness = link * (2.0 * np.pi * hz) ** 2
    plant = PLANT.defaults() | {
        "jm": total - link, "j": link, "k0": stiffness, "k1": 0.0, "fs": 0.0, "fv": 0.0,
        "fsm": 0.03 * usual, "fvm": 0.03 * usual,
    }  # fmt: skip
    lines = np.fft.rfftfreq(samples, 1.0 / RATE)
    spectrum = np.where((lines > 0.2) & (lines < 6.0), 1.0 / (1.0 + lines), 0.0) * np.exp(
        2j * np.pi * rng.uniform(size=lines.size)
    )
    wanted = np.fft.irfft(spectrum, samples)
    wanted *= AMPLITUDE / wanted.std() * np.minimum(1.0, np.arange(samples) / RATE)
    damped = 2.0 * ZETA * np.sqrt(stiffness * link)
    signals = simulate(
        wanted, RATE, coefficients(plant), pd_filtered.coefficients(law),
        1e-4 * AMPLITUDE * rng.standard_normal(samples),
        fx.coefficients({"transmission_damping.nm_s_rad": damped}),
    )  # fmt: skip
    return np.array([signals.torque, signals.position])


@cache
def recorded(total: float, share: float, hz: float) -> RecordSet:
    law = pd_filtered.CONTROLLER.check(
        {"sample_rate_hz": RATE, "p": 60.0 * total, "d": 11.0 * total, "n": 90.0}
    )
    runs = []
    for number in range(4):
        torque, position = run(number, total, share, hz, law)
        described = RecordDescription.of(
            "test", sample_rate_hz=RATE, level=0, levels=1, realization=number, realizations=4
        )
        runs.append(Record(f"run_{number}", described, None, torque, position, None))
    return RecordSet("test", RATE, tuple(runs))


def test_a_slow_resonance_that_few_lines_show_is_found_with_its_sizes():
    """It lies at 0.8 Hz, and the loop hardly shakes it: as a pendulum that hangs on a cart."""
    total, share, hz = 1.1, 0.2, 0.8
    found = investigate(
        recorded(total, share, hz), datasheet({"jm": 1.05 * total}, "test"), effects=EFFECTS
    )
    assert sorted(found.diagnosis.effects) == sorted(EFFECTS[:3])
    sizes = {name: each.value for name, each in found.diagnosis.parameters.items()}
    assert sizes["jm"] == pytest.approx(total, rel=0.05)
    assert sizes[SHARE] == pytest.approx(share, rel=0.1)
    stiffness = share * total * (2.0 * np.pi * hz) ** 2
    assert 1.0 / sizes[COMPLIANCE] == pytest.approx(stiffness, rel=0.1)


@pytest.mark.parametrize(("total", "share", "hz"), [(0.01, 0.2, 0.8), (5.0, 0.4, 2.0)])
def test_frequency_and_mass_are_read_off_the_record(total, share, hz):
    nominal = datasheet({"jm": total}, "test")
    fitter = CellFitter(
        Evidence(recorded(total, share, hz), nominal), Model.nominal(nominal).plant, 0.1
    )
    fit = fitter.refit()
    for effect in EFFECTS[:2]:
        fit = fitter.add(fit, effect, fitter.screening(fit, effect).proposals())
    first = SeenTorques(fitter.evidence, fitter.fit_parts, fit.model).resonance()[0]
    inertia = first.plant["jm"] * first.effects[SHARE]
    seen_hz = 1.0 / np.sqrt(first.effects[COMPLIANCE] * inertia) / (2.0 * np.pi)
    assert seen_hz == pytest.approx(hz, rel=0.1)
    assert first.effects[SHARE] == pytest.approx(share, rel=0.35)


def test_what_inertia_explains_needs_no_mass_behind_a_spring():
    rng, rate = np.random.default_rng(3), 100.0
    angle = np.cumsum(rng.standard_normal(3000)) / rate
    acceleration = rng.standard_normal(3000)
    found = hidden([angle], rate, 5.0, [-acceleration], -2.0 * acceleration, lambda t: t)
    assert all(one.inertia < 1e-9 for one in found)
    assert hidden([angle[:100]], rate, 2.0, [-acceleration], -acceleration, lambda t: t) == []


def test_a_mass_that_leaves_nothing_of_the_motor_is_no_start():
    mass = Hidden(inertia=0.2, added=0.1, frequency=2.0, damping=0.05, left=0.0)
    seen = with_mass(Model({"jm": 0.9, "fvm": 0.08}, {}), mass)
    assert seen is not None
    assert seen.plant["jm"] == pytest.approx(1.0)
    assert seen.effects[SHARE] == pytest.approx(0.2)
    assert seen.effects["transmission_stiffness.link_viscous_share"] == pytest.approx(0.5)
    assert mass.stiffness == pytest.approx(0.8)
    assert mass.drag == pytest.approx(0.04)
    assert with_mass(Model({"jm": 0.05}, {}), mass) is None
    assert with_mass(Model({"jm": -0.2}, {}), mass) is None


def test_what_a_rigid_datasheet_leaves_may_ring_unless_a_mass_was_found():
    rigid = SimpleNamespace(model=Model({"jm": 1.0}, {}), effects=("coulomb_friction",))
    yields = SimpleNamespace(model=rigid.model, effects=("transmission_stiffness",))
    flexible = SimpleNamespace(model=Model({"jm": 1.0, "k0": 2.0}, {}), effects=())
    for verdict in ("unexplained", "partly_explained"):
        told = [_may_ring(verdict, fit) for fit in (rigid, yields, flexible)]
        assert told == [True, False, False]
    assert not _may_ring("effect", rigid)
