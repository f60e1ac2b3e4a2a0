"""Fixtures and rules that all tests share."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from ros_domain import Peer, Starter, marked_processes, own_domain, wait_for
from typer.testing import CliRunner

from fjr_bringup.cli import app

# A machine that others share, or a kernel that compiles at its first call, is no fault of a test.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep tests that start ROS nodes in one worker: two graphs at once starve each other."""
    for item in items:
        if item.get_closest_marker("ros"):
            item.add_marker(pytest.mark.xdist_group("ros"))


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
    monkeypatch.setenv("FJR_TEST", mark)
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


@pytest.fixture
def start(domain: int, tmp_path: Path) -> Iterator[Starter]:
    """Give the test processes started by hand, in its domain."""
    starter = Starter(tmp_path)
    yield starter
    starter.end()


@pytest.fixture
def peer(domain: int) -> Iterator[Peer]:
    """Give the test a node in its domain."""
    peer = Peer(domain)
    yield peer
    peer.leave()
