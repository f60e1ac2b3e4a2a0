"""Kernels: what several processes need at once is compiled by one of them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from paths import ROOT

KERNELS = """
from fjr_kit.compiled import inlined, jit

@inlined
def half(x):
    return 0.5 * x

@jit
def slow(x):
    total = 0.0
    for k in range(100):
        total += half(x) * k
    return total
"""
CALL = """
import sys, time
sys.path.insert(0, sys.argv[1])
import some_kernels
print("ready", flush=True)
sys.stdin.readline()
assert some_kernels.slow(1.0) == 2475.0
print(sum(some_kernels.slow.stats.cache_misses.values()), flush=True)
"""


def test_one_of_several_processes_compiles_and_the_others_read_it(tmp_path: Path):
    (tmp_path / "some_kernels.py").write_text(KERNELS)
    env = {"PATH": "/usr/bin:/bin", "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / "c")}
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", CALL, str(tmp_path)],
            env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )
        for _ in range(4)
    ]  # fmt: skip
    for process in processes:
        assert process.stdout is not None and process.stdout.readline() == "ready\n"
    for process in processes:
        assert process.stdin is not None
        process.stdin.write("go\n")
        process.stdin.flush()
    said = [process.communicate()[0].split() for process in processes]
    assert sorted(said) == [["0"], ["0"], ["0"], ["1"]]


def test_without_a_cache_that_can_be_written_kernels_are_compiled_all_the_same(tmp_path: Path):
    (tmp_path / "some_kernels.py").write_text(KERNELS)
    (tmp_path / "c").write_text("no folder")
    env = {"PATH": "/usr/bin:/bin", "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / "c")}
    done = subprocess.run(
        [sys.executable, "-c", CALL, str(tmp_path)], env=env, input="go\n", text=True,
        capture_output=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
