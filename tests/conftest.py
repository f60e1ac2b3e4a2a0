"""Fixtures and rules that all tests share.

The tests of a package stand in the folder of its name, a module's in `test_<module>.py` or, where
modules work together, in the test named by what they do. What several packages' tests use stands
beside this file, what those of one use beside them.
"""

from __future__ import annotations

import os
import re
import signal
import uuid
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from by_hand import Rig
from hypothesis import HealthCheck, settings
from nursery import Nursery
from paths import ROOT
from processes import MARK, Starter, marked_processes, wait_for
from ros_domain import Peer, own_domain
from typer.testing import CliRunner
from xdist.scheduler import LoadFileScheduling

from fjr_cli.app import app

# A machine that others share, or a kernel that compiles at its first call, is no fault of a test.
settings.register_profile("explore", deadline=None, suppress_health_check=[HealthCheck.too_slow])
# The same examples in every run; `--hypothesis-profile=explore` draws others.
settings.register_profile("same", settings.get_profile("explore"), derandomize=True)
settings.load_profile("same")

os.environ[MARK] = uuid.uuid4().hex  # what waits look at, also where a test has no mark of its own


GRAPH = re.compile(r"mark\.ros\b|^def \w+\([^)]*\b(?:domain|peer)\b", re.MULTILINE)
"""What a module holds whose tests play on a ROS graph."""


FIRST = pytest.StashKey[str]()
"""The first module of a worker."""


class Dealer(LoadFileScheduling):
    """Deals whole modules to the workers, and all that play on a ROS graph to one of them.

    Two graphs at once starve each other; what a module's tests share is made once. (Groups of xdist
    are no help: they go by a node ID that pytest 9 no longer lets it change.)
    """

    def _split_scope(self, nodeid: str) -> str:
        module = super()._split_scope(nodeid)
        return "graphs" if plays_on_graph(module) else module


@cache
def plays_on_graph(module: str) -> bool:
    """Tell whether a test module, by its path, has tests that play on a ROS graph.

    What is marked as slow has other work to do than that.
    """
    text = (ROOT / module).read_text(encoding="utf-8")
    return GRAPH.search(text) is not None and "pytestmark = pytest.mark.slow" not in text


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Dealer:
    """Give xdist the dealer of this suite."""
    return Dealer(config, log)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what plays on a graph; let graphs and slow modules begin first."""
    for item in items:
        if "domain" in getattr(item, "fixturenames", ()):
            item.add_marker("ros")
    first = {name: rank for rank, name in enumerate(("ros", "slow"))}
    ranks = {item: [first.get(mark.name, 2) for mark in item.iter_markers()] for item in items}
    items.sort(key=lambda item: min(ranks[item], default=2))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> None:
    """Let the worker that plays graphs go first where there are more workers than cores.

    It waits half of its time. Another worker steps back for good as it begins its first module.
    """
    if "PYTEST_XDIST_WORKER" in os.environ and FIRST not in item.config.stash:
        item.config.stash[FIRST] = item.nodeid.partition("::")[0]
        if not plays_on_graph(item.config.stash[FIRST]):
            os.nice(2)


@pytest.fixture(scope="session", autouse=True)
def default_signals() -> None:
    """Let no program of a test inherit that the suite ignores a signal, as a background job does.

    What the suite was told to ignore it goes on ignoring, but by a handler: exec() resets those.
    """
    for number in (signal.SIGINT, signal.SIGHUP):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, lambda *_: None)


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Give the test the command line, called in this process on a wide terminal."""
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.delenv("FJR_DEBUG", raising=False)
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def mark(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Mark all processes that the test starts; none of them may be left at its end."""
    mark = uuid.uuid4().hex
    monkeypatch.setenv(MARK, mark)
    yield mark
    wait_for(lambda: not marked_processes(mark), f"the end of {marked_processes(mark)}")


@pytest.fixture
def domain(mark: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Give the test a ROS domain of its own, on this machine only."""
    monkeypatch.delenv("ROS_STATIC_PEERS", raising=False)
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    with own_domain() as domain:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        yield domain


@pytest.fixture(scope="session")
def nursery() -> Iterator[Nursery]:
    """Give the tests the process from which their programs are forked."""
    nursery = Nursery()
    yield nursery
    nursery.end()


@pytest.fixture
def start_program(nursery: Nursery, mark: str, tmp_path: Path) -> Iterator[Starter]:
    """Give the test programs that it starts and ends."""
    starter = Starter(nursery, tmp_path)
    yield starter
    starter.end()


@pytest.fixture
def start(domain: int, start_program: Starter) -> Starter:
    """Give the test programs started by hand, in its domain."""
    return start_program


@pytest.fixture
def rig(peer: Peer) -> Rig:
    """Give the test ears in the rig."""
    return Rig(peer)


@pytest.fixture
def peer(domain: int) -> Iterator[Peer]:
    """Give the test a node in its domain."""
    peer = Peer(domain)
    yield peer
    peer.leave()
