"""A link with an encoder: the twist of the transmission is compared beside the motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import chirp

from fjr_interface.experiment import RecordDescription
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import import_files
from fjr_records.importers.record_file import ImportOptions
from fjr_records.records import Record, RecordSet
from gap_diagnosis.any_record import investigate, read_any
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.outcome.verdict_words import TWISTS
from gap_diagnosis.starts.seen_twist import play

RATE, STEPS = 500.0, 40
TRUE = {"jm": 0.02, "j": 0.03, "k0": 180.0}
NOMINAL = datasheet({"jm": 0.021, "j": 0.028, "k0": 195.0, "fvm": 0.05, "fv": 0.05}, "test")
DAMPING = 0.04  # of the transmission, N m s/rad


def moved(torque: np.ndarray, gap: float, damping: float) -> tuple[np.ndarray, np.ndarray]:
    """Return motor and link angle of two masses with play between them, integrated here."""
    h, q1, w1, q2, w2, rows = 1.0 / (RATE * STEPS), 0.0, 0.0, 0.0, 0.0, []
    for drives in torque:
        rows.append((q1, q2))
        for _ in range(STEPS):
            twist = q1 - q2
            taut = math.copysign(max(abs(twist) - gap, 0.0), twist)
            between = TRUE["k0"] * taut + (damping * (w1 - w2) if taut else 0.0)
            w1 += h * (drives - between - 0.05 * w1) / TRUE["jm"]
            w2 += h * (between - 0.05 * w2) / TRUE["j"]
            q1 += h * w1
            q2 += h * w2
    motor, link = np.array(rows).T
    return motor, link


def recorded(
    gap: float, *, scale: float = 1.0, zero: float = 0.0, late_s: float = 0.0
) -> RecordSet:
    """Return two runs whose link's encoder has a zero, a scale and a lateness of its own."""
    records, rng = [], np.random.default_rng(3)
    time = np.arange(4000) / RATE
    for number in range(2):
        torque = chirp(time, 0.5 + 0.3 * number, time[-1], 25.0 - 5.0 * number)
        motor, link = moved(torque, gap, DAMPING)
        link = zero + scale * np.interp(time - late_s, time, link)
        noise = 1e-6 * rng.standard_normal((2, time.size))
        described = RecordDescription.of(
            "test", sample_rate_hz=RATE, level=0, levels=1, realization=number, realizations=2
        )
        records.append(
            Record(f"run_{number}", described, None, torque, motor + noise[0], link + noise[1])
        )
    return RecordSet("test", RATE, tuple(records))


@pytest.fixture(scope="module")
def plain() -> RecordSet:
    return recorded(0.0)


@given(zero=st.floats(-3.0, 3.0), scale=st.floats(-2e-2, 2e-2), late_s=st.floats(-1e-3, 1e-3))
def test_what_two_encoders_differ_by_is_no_error_of_a_model(plain, zero, scale, late_s):
    """Zero and scale of the link's encoder leave none of a true model, lateness one of its square.

    A millisecond is 12 % of a radian where the masses swing.
    """

    def other(r: Record) -> Record:
        speed = np.gradient(r.link) * RATE
        return replace(r, link=zero + (1.0 + scale) * (r.link - late_s * speed))

    shifted = replace(plain, records=tuple(map(other, plain.records)))
    twist = Evidence(shifted, NOMINAL).twist
    for index, r in enumerate(plain.records):
        measured = twist.measured[index]
        error = twist.lines_of(np.array([r.position, r.torque, r.link]), index) - measured
        assert np.std(error) < (1e-9 + 0.03 * (late_s / 1e-3) ** 2) * np.std(measured)


def test_cells_of_the_twist_stand_after_those_of_the_motion(plain):
    both, bare = (
        Evidence(each, NOMINAL)
        for each in (
            plain, replace(plain, records=tuple(replace(r, link=None) for r in plain.records))
        )
    )  # fmt: skip
    assert bare.twist is None and both.bands == 2 * bare.bands
    assert both.of_motion.sum() == bare.lines
    which = both.parts_for("fit")
    model = Model.nominal(NOMINAL)
    errors, alone = (e.errors([model], which)[0] for e in (both, bare))
    of_motion = np.concatenate([np.tile(both.of_motion, both.windows(p)) for p in which])
    assert np.array_equal(errors[of_motion], alone)
    own = bare.bands
    assert np.array_equal(both.floor(which)[:own], bare.floor(which))
    assert (both.noise_power[own:] > 0.0).all()


def test_a_link_of_the_other_sign_is_not_used_and_this_is_said(plain):
    turned = replace(plain, records=tuple(replace(r, link=-r.link) for r in plain.records))
    assert Evidence(turned, NOMINAL).twist is None
    found = investigate(turned, NOMINAL, effects=["delay"]).diagnosis
    assert any("-1.1 times as far" in note or "-1 times as far" in note for note in found.notes)


@pytest.mark.parametrize("effect", ["backlash", "piecewise_stiffness"])
def test_play_and_stiffness_are_read_off_the_twist(effect):
    """By least squares, beside a datasheet whose spring is 8 % too stiff."""
    evidence = Evidence(recorded(2e-3, scale=1.001, zero=0.02), NOMINAL)
    bare = Model.nominal(NOMINAL)
    seen, *tried = play(evidence, evidence.parts_for("fit"), bare, effect, bare)
    assert next(iter(seen.effects.values())) == pytest.approx(2e-3, rel=0.15)
    assert seen.plant["k0"] == pytest.approx(TRUE["k0"], rel=0.05)
    assert seen.plant["jm"] == pytest.approx(TRUE["jm"], rel=0.05)
    sizes = [next(iter(model.effects.values())) for model in tried]
    assert min(sizes) < 2e-2 < max(sizes)
    fitted = [evidence.records.records[evidence.parts[p].record] for p in evidence.parts_for("fit")]
    reach = max(np.ptp(r.link - r.position) for r in fitted)
    assert min(sizes) > 0.0 and max(sizes) < reach


def test_stiffness_play_and_damping_are_seen_in_the_twist():
    """With a link encoder that is late, off in zero and scale; both inertias within two percent."""
    effects = ["backlash", "piecewise_stiffness", "transmission_damping", "viscous_friction",
               "hysteresis", "delay"]  # fmt: skip
    runs = recorded(2e-3, scale=1.001, zero=0.02, late_s=1e-3)
    found = investigate(runs, NOMINAL, effects=effects).diagnosis
    assert TWISTS in found.notes
    assert {"backlash", "transmission_damping"} <= set(found.effects)
    assert set(found.effects) <= {"backlash", "transmission_damping", "viscous_friction"}
    sizes = found.parameters
    for name, true in TRUE.items():
        assert sizes[name].value == pytest.approx(true, rel=0.02), name
    assert sizes["backlash.half_gap_rad"].value == pytest.approx(2e-3, rel=0.1)


def test_the_twist_of_steady_periods_is_compared_as_well(tmp_path):
    """Five periods after one; noise of the twist is that of the mean of the five."""
    rng, files, samples = np.random.default_rng(5), [], 2000
    for number in range(3):
        lines = np.zeros(samples // 2 + 1, complex)
        lines[2:140] = np.exp(2j * np.pi * rng.random(138))
        period = np.fft.irfft(lines, samples)
        torque = np.tile(period / period.std(), 6)
        ends = np.array(moved(torque, 2e-3, DAMPING)) + 1e-6 * rng.standard_normal((2, torque.size))
        table = np.column_stack([np.arange(torque.size) / RATE, torque, torque, *ends])
        files.append(tmp_path / f"run_{number}.csv")
        header = "time,reference,torque,position,link"
        np.savetxt(files[-1], table, delimiter=",", header=header, comments="")
    columns = [f"{name}={name}:1" for name in ("reference", "torque", "position", "link")]
    import_files(files, tmp_path / "bags", ImportOptions(parse_map(["time=time", *columns])))
    effects = ["backlash", "transmission_damping", "viscous_friction", "delay"]
    found = investigate(read_any(tmp_path / "bags"), NOMINAL, effects=effects)
    diagnosis, evidence = found.diagnosis, found.fitted.evidence
    assert diagnosis.evidence.excitation == "periodic" and TWISTS in diagnosis.notes
    assert evidence.twist.noise.std_rad == pytest.approx(1e-6 * math.sqrt(2.0 / 5.0), rel=0.2)
    assert set(diagnosis.effects) == {"backlash", "transmission_damping"}
    for name, true in TRUE.items():
        assert diagnosis.parameters[name].value == pytest.approx(true, rel=0.01), name
    gap = diagnosis.parameters["backlash.half_gap_rad"]
    assert gap.value == pytest.approx(2e-3, rel=0.03) and gap.low < 2e-3 < gap.high
