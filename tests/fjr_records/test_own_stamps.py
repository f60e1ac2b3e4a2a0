"""Signals that were not sampled together: own time columns, rows of one topic each, own rates."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from fjr_cli.import_summary import held_by
from fjr_kit.errors import InputError
from fjr_records.importers.import_map import parse_map
from fjr_records.importers.importer import read_files
from fjr_records.importers.record_file import ImportOptions

RATE_HZ = 500.0
SAMPLES = 3000
LATER_S = 0.7e-3


def motion(t: np.ndarray) -> np.ndarray:
    """A position in rad of many frequencies below 60 Hz."""
    lines = 2.0 * np.pi * np.array([1.3, 4.1, 11.7, 23.9, 41.3])
    return np.sin(np.multiply.outer(t, lines) + np.arange(5)).sum(axis=-1)


def effort(t: np.ndarray) -> np.ndarray:
    """A torque in N m that drives it (its speed, so that it does not brake)."""
    step = 1e-6
    return 0.02 * (motion(t + step) - motion(t - step)) / (2.0 * step)


T_U = np.arange(SAMPLES) / RATE_HZ
T_Y = T_U + LATER_S
U, Y = effort(T_U), motion(T_Y)


def understood(path, *specs: str, **options):
    """Return the only record of a file."""
    columns = parse_map(specs)
    return read_files([path], ImportOptions(columns=columns, **options)).records[0]


def rows_of_two_topics() -> list[tuple[float, float | None, float | None]]:
    """Rows as a recorder writes them: each holds one topic."""
    rows = [(t, u, None) for t, u in zip(T_U, U, strict=True)]
    rows += [(t, None, y) for t, y in zip(T_Y, Y, strict=True)]
    return sorted(rows, key=lambda row: row[0])


def two_topics_csv(path) -> tuple[str, ...]:
    lines = (
        ",".join("" if cell is None else repr(float(cell)) for cell in row)
        for row in rows_of_two_topics()
    )
    path.write_text("__time,/rig/effort,/rig/position\n" + "\n".join(lines) + "\n")
    return "torque=/rig/effort", "position=/rig/position", "time=__time"


def two_topics_jsonl(path) -> tuple[str, ...]:
    entries = (
        {"t": t, "msg": {"effort": u}} if y is None else {"t": t, "msg": {"angle": y}}
        for t, u, y in rows_of_two_topics()
    )
    path.write_text("\n".join(map(json.dumps, entries)))
    return "torque=msg.effort", "position=msg.angle", "time=t"


def two_topics_npy(path) -> tuple[str, ...]:
    rows = [[np.nan if cell is None else cell for cell in row] for row in rows_of_two_topics()]
    np.save(path, np.array(rows))
    return "torque=1", "position=2", "time=0"


def two_time_columns(path) -> tuple[str, ...]:
    np.savetxt(path, np.stack([1e3 * T_U, U, T_Y, Y], axis=1), delimiter=";", fmt="%.12g")
    return "torque=1", "position=3", "torque_time=0:ms", "position_time=2"


def two_arrays_of_two_lengths(path) -> tuple[str, ...]:
    np.savez(path, t_u=T_U[::2], u=effort(T_U[::2]), t=T_Y, y=Y)
    return "torque=u", "torque_time=t_u", "position=y", "time=t"


FILES = {
    "topics.csv": two_topics_csv,
    "topics.jsonl": two_topics_jsonl,
    "topics.npy": two_topics_npy,
    "columns.csv": two_time_columns,
    "lengths.npz": two_arrays_of_two_lengths,
}


@pytest.mark.parametrize("name", FILES)
def test_each_signal_is_where_its_own_stamps_say(tmp_path, name):
    specs = FILES[name](tmp_path / name)
    record = understood(tmp_path / name, *specs)
    rate = RATE_HZ / (2.0 if name == "lengths.npz" else 1.0)
    assert record.sample_rate_hz == rate
    begin = T_Y[0]  # the first instant that both cover
    grid = begin + np.arange(record.samples) / rate
    assert grid[-1] <= T_U[-1] < grid[-1] + 2.0 / rate
    inside = slice(50, -50)
    late = motion(grid - LATER_S)  # what taking rows for simultaneous would give
    error = np.std((record.signals["y"] - motion(grid))[inside])
    assert error < 1e-3 * np.std(Y) < 0.05 * np.std((late - motion(grid))[inside])
    # A torque is held from its stamp on: on the grid it counts half a sample earlier.
    held = effort(grid + 0.5 / rate - 0.5 / RATE_HZ * (2.0 if name == "lengths.npz" else 1.0))
    assert np.std((record.signals["u"] - held)[inside]) < 0.02 * np.std(U)
    assert any("have stamps of their own (torque, position)" in note for note in record.notes)


def test_equal_stamps_are_one_clock(tmp_path):
    np.savez(tmp_path / "rig.npz", a=T_U, u=U, b=T_U, y=motion(T_U))
    own = understood(
        tmp_path / "rig.npz", "torque=u", "position=y", "torque_time=a", "position_time=b"
    )
    one = understood(tmp_path / "rig.npz", "torque=u", "position=y", "time=a")
    assert own.notes == one.notes and own.sample_rate_hz == one.sample_rate_hz
    for symbol in "uy":
        np.testing.assert_array_equal(own.signals[symbol], one.signals[symbol])


def test_a_part_is_that_of_the_position(tmp_path):
    specs = two_topics_csv(tmp_path / "rig.csv")
    record = understood(tmp_path / "rig.csv", *specs, skip_samples=100, keep_samples=1000)
    assert record.samples in (998, 999)
    begin = T_U[np.searchsorted(T_U, T_Y[100])]
    grid = begin + np.arange(record.samples) / RATE_HZ
    error = (record.signals["y"] - motion(grid))[50:-50]
    assert np.std(error) < 1e-3 * np.std(Y)


def test_what_rows_lack_is_listed(tmp_path):
    two_topics_csv(tmp_path / "rig.csv")
    lines = "\n".join(held_by(tmp_path / "rig.csv"))
    assert f"/rig/effort      {SAMPLES} of {2 * SAMPLES}  from" in lines
    assert "torque=/rig/effort,position=/rig/position,time=__time" in lines


def test_columns_of_one_name_are_listed_by_number(tmp_path):
    rows = np.stack([T_U, U, T_Y, Y], axis=1)
    np.savetxt(tmp_path / "rig.csv", rows, delimiter=",", header="Name,u,Name,y", comments="")
    lines = list(held_by(tmp_path / "rig.csv"))
    assert [line.split()[0] for line in lines[1:5]] == ["0", "u", "2", "y"]
    with pytest.raises(InputError, match="the column Name is there 2 times"):
        understood(tmp_path / "rig.csv", "torque=u", "position=y", "time=Name")


def test_a_cell_that_lacks_in_a_whole_record_is_refused(tmp_path):
    rows = [[f"{cell:.9g}" for cell in row] for row in zip(T_U, U, Y, strict=True)]
    rows[70][1] = ""
    (tmp_path / "rig.csv").write_text("t,u,y\n" + "\n".join(map(",".join, rows)) + "\n")
    with pytest.raises(InputError, match="line 72: '' in column u is not a number"):
        understood(tmp_path / "rig.csv", "torque=u", "position=y", "time=t")


def arrays(**changed):
    return {"a": T_U, "u": U, "b": T_Y, "y": Y, **changed}


OWN = ("torque=u", "position=y", "torque_time=a", "position_time=b")
REFUSED = [
    (arrays(), OWN[:3], "position has no stamps; map position_time=COLUMN, or time=COLUMN"),
    (arrays(a=T_U[:-1]), OWN, "torque has 3000 samples, but torque_time has 2999"),
    (arrays(b=T_Y + 100.0), OWN, "have no time in common .torque 0 to 5.998 s; position 100.001"),
    (arrays(b=T_Y[::-1]), OWN, "position: the time column does not increase"),
    (arrays(b=1e6 * T_Y), OWN, "position: the time column goes on by 2000 s"),
    (arrays(y=Y[::2]), ("torque=u", "position=y", "time=a"), "torque_time=COLUMN maps stamps of"),
]


@pytest.mark.parametrize(("content", "specs", "says"), REFUSED)
def test_wrong_stamps_are_refused_in_a_sentence(tmp_path, content, specs, says):
    np.savez(tmp_path / "rig.npz", **content)
    with pytest.raises(InputError, match=says) as refused:
        understood(tmp_path / "rig.npz", *specs)
    assert str(refused.value).startswith(f"{tmp_path / 'rig.npz'}: ")


@pytest.mark.parametrize("rate_hz", [-5.0, 0.0, math.nan, math.inf, 1e9])
@pytest.mark.parametrize("specs", [OWN, ("torque=u", "position=y", "time=w"), OWN[:2]])
def test_a_rate_that_is_none_is_refused_whatever_the_stamps(tmp_path, rate_hz, specs):
    wild = np.cumsum(np.random.default_rng(2).uniform(1e-3, 3e-3, SAMPLES))
    np.savez(tmp_path / "rig.npz", **arrays(w=wild))
    with pytest.raises(InputError, match=r"give one above 0 and up to 1e\+06 Hz"):
        understood(tmp_path / "rig.npz", *specs, sample_rate_hz=rate_hz)


def test_a_period_has_no_stamps_of_its_own(tmp_path):
    np.savez(tmp_path / "rig.npz", **arrays())
    with pytest.raises(InputError, match="leave out --repeat-reference"):
        understood(tmp_path / "rig.npz", *OWN, repeat_reference=True)


def test_a_reference_of_a_few_changes_is_not_joined_by_lines(tmp_path):
    steps = np.sort(np.random.default_rng(3).uniform(0.0, T_U[-1], 40))
    levels = np.where(np.arange(40) % 2, 1.0, -1.0)
    np.savez(tmp_path / "rig.npz", **arrays(c=steps, r=levels))
    with pytest.raises(InputError, match="of the reference's rms"):
        understood(tmp_path / "rig.npz", *OWN, "reference=r", "reference_time=c")


def test_stamps_of_a_signal_that_is_not_mapped():
    with pytest.raises(InputError, match="has link_time but no link; add link=COLUMN"):
        parse_map((*OWN, "link_time=c"))


def test_two_columns_of_calendar_and_clock_count_from_one_instant(tmp_path):
    def stamp(t: float) -> str:
        return f"2026-01-31 23:59:{56 + t:012.9f}" if t < 4 else f"2026-02-01 00:00:{t - 4:012.9f}"

    lines = (
        f"{stamp(a)},{u:.12g},{stamp(b)},{y:.12g}"
        for a, u, b, y in zip(T_U, U, T_Y, Y, strict=True)
    )
    (tmp_path / "rig.csv").write_text("\n".join(lines) + "\n")
    specs = "torque=1", "position=3", "torque_time=0", "position_time=2"
    record = understood(tmp_path / "rig.csv", *specs)
    grid = T_Y[0] + np.arange(record.samples) / RATE_HZ
    assert np.std((record.signals["y"] - motion(grid))[50:-50]) < 1e-3 * np.std(Y)
