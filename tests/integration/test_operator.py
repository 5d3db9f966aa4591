"""An operator's words to a running team."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from expedition.errors import NoServerError
from expedition.launch import Progress
from expedition.operator import Operator
from tests.integration.command_line import Outcome
from tests.integration.teams import Told, events, play

Cli = Callable[..., Outcome]


@pytest.mark.slow
def test_visit_pause_resume_and_drive(tmp_path: Path, cli: Cli) -> None:
    said: list[Outcome] = []

    def speak(progress: Progress) -> None:
        if said or progress.sim_time_s < 8.0:
            return
        for words in (
            ("pause", "robot1"),
            ("resume", "robot1", "--json"),
            ("visit", "robot2", "-1.0,0.5"),
            ("visit", "robot2", "99999,99999"),
            ("drive", "robot1", "--speed", "0.2", "--turn-rate", "-0.3", "--for", "3"),
            ("pause", "robot9"),
        ):
            said.append(cli(*words, "--server", told.endpoint))

    told = Told(speak)
    summary = play(tmp_path, told=told, max_time=60.0)
    assert summary["ended"] == "time_limit"
    assert [outcome.status for outcome in said] == [0, 0, 0, 0, 0, 1]
    assert "robot1 is paused" in said[0].stdout
    assert json.loads(said[1].stdout) == {
        "accepted": True,
        "text": "robot1 is back with the team",
    }
    assert "(-1.00, 0.50)" in said[2].stdout
    assert "drives at 0.20 m/s" in said[4].stdout
    assert "no robot 'robot9'" in said[5].stderr
    assert said[5].stdout == ""
    kinds = {(e.get("robot"), e.get("kind")) for e in events(tmp_path)}
    assert {("robot1", "pause"), ("robot1", "drive"), ("robot2", "visit")} <= kinds


def test_in_real_time_an_operator_sets_the_pace_by_the_clock(tmp_path: Path) -> None:
    driven: list[float] = []

    def speak(progress: Progress) -> None:
        if driven or progress.sim_time_s < 1.5:
            return
        with Operator(told.endpoint) as operator:
            began = operator.now()
            assert operator.drive("robot1", 0.1, 0.0, 1.0, lambda: True).accepted
            driven.append(operator.now() - began)
            halted = operator.drive("robot1", 0.1, 0.0, 60.0, lambda: False)
            assert halted.accepted
        told.going = False

    told = Told(speak)
    summary = play(tmp_path, told=told, realtime=True)
    assert summary["ended"] == "operator"
    assert 1.0 <= driven[0] < 5.0


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@pytest.mark.parametrize(
    "words",
    [("visit", "robot1", "1,2"), ("pause", "a"), ("resume", "a"), ("drive", "a", "--speed", "0.1")],
)
def test_without_a_server_there_is_one_clear_line(words: tuple[str, ...], cli: Cli) -> None:
    outcome = cli(*words, "--server", f"127.0.0.1:{free_port()}")
    assert outcome.wrong_use("nobody listens at tcp://127.0.0.1:")
    assert "--server" in outcome.stderr


def test_somebody_who_listens_but_does_not_answer_is_no_server() -> None:
    with socket.create_server(("127.0.0.1", 0)) as mute:
        endpoint = f"tcp://127.0.0.1:{mute.getsockname()[1]}"
        with pytest.raises(NoServerError, match=r"no answer within 0.3 s"), Operator(endpoint, 0.3):
            raise AssertionError("never gets here")


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("visit", "robot1", "1;2"), "write X,Y"),
        (("visit", "robot1", "1,nan"), "write X,Y"),
        (("visit", "robot1", "1,9e9"), "y_m"),
        (("visit", "a b", "1,2"), "name"),
        (("drive", "robot1", "--speed", "nan"), "finite"),
        (("pause", "robot1", "--server", "nonsense"), "address:port"),
    ],
)
def test_wrong_words_are_refused_before_anything_is_sent(
    words: tuple[str, ...], why: str, cli: Cli
) -> None:
    assert cli(*words).wrong_use(why)
