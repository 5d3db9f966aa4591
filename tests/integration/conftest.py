"""Fixtures for tests with real processes and sockets."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator

import pytest

from tests.integration.command_line import Outcome
from tests.integration.teams import ROOT, children_of, end_all_started, title


@pytest.fixture(scope="session", autouse=True)
def compiled() -> None:
    """Everything is compiled and loaded before the first process is forked."""
    from expedition.warm_up import warm_up

    warm_up(print)


@pytest.fixture(autouse=True)
def nothing_left_behind(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """No test may leave a process of a team, or its own handling of Ctrl-C."""
    paths = [str(ROOT), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    end_all_started()
    for number, handler in before.items():
        signal.signal(number, handler)
    assert [t for p in children_of(os.getpid()) if "expedition" in (t := title(p))] == []


@pytest.fixture
def cli(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> Callable[..., Outcome]:
    """The command line, run within this process: `cli("run", "--seed", "3")`."""
    from expedition.cli import main

    def call(*words: str) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["expedition", *words])
        capfd.readouterr()
        with pytest.raises(SystemExit) as ended:
            main()
        status = ended.value.code
        stdout, stderr = capfd.readouterr()
        return Outcome(status if isinstance(status, int) else 0, stdout, stderr)

    return call
